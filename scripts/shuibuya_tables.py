#!/usr/bin/env python3
"""Measures of drained shear tests as a table in Markdown, beside what the source and the laboratory report.

    scripts/shuibuya_tables.py results/p0800_300.h5 results/p1600_300.h5

Strains count from the end of the consolidation, compression and contraction positive. The peak is that of a moving mean over
0.2 % of strain, since single increments jump where force chains break; the initial modulus is the secant to 0.1 %; the dilation rate is
the largest -d(volume strain)/d(axial strain) over 1 % of strain behind the largest contraction.
"""

import argparse
import os
import sys

import numpy

from duncan_chang_curves import strength
from riprap_results import Results, ResultsError

# Peak deviatoric stress [Pa] and its axial strain at a confining pressure [Pa]: Ma, Zhou, Chang & Zhou (2011).
SOURCE = {0.8e6: (3.52e6, 0.1164), 1.6e6: (7.04e6, 0.154)}


def smoothed(strain, values, width):
    """Mean of `values` over `width` of strain about each point; ends take what there is."""
    low = numpy.searchsorted(strain, strain - width / 2, side="left")
    high = numpy.searchsorted(strain, strain + width / 2, side="right")
    total = numpy.concatenate([[0.0], numpy.cumsum(values)])
    return (total[high] - total[low]) / (high - low)


def measures(results):
    """One row of the table as a dict of numbers; NaN where a run does not reach."""
    history = results.history
    names = ("axial_strain", "volumetric_strain", "deviatoric_stress", "confining_pressure")
    strain, volume, q, pressure = (numpy.nan_to_num(column) for column in results.shear(*names))
    if len(strain) < 3:
        raise ResultsError(f"{results.path}: has no shear to measure")
    mean_q = smoothed(strain, q, 0.002)
    peak = int(mean_q.argmax())
    deepest = int(volume.argmax())
    behind = strain > strain[deepest]
    rates = [
        (volume[at] - numpy.interp(strain[at] + 0.01, strain, volume)) / 0.01
        for at in numpy.flatnonzero(behind)
        if strain[at] + 0.01 <= strain[-1]
    ]
    work = history["energy_external"][-1]
    share = lambda name: history[name][-1] / work if name in history else 0.0
    return {
        "pressure": float(numpy.median(pressure)),
        "reached": strain[-1],
        "peak": mean_q[peak],
        "peak_strain": strain[peak] if peak < len(strain) - 1 else numpy.nan,
        "modulus": numpy.interp(0.001, strain, q) / 0.001,
        "contraction": volume[deepest],
        "dilation": max(rates, default=numpy.nan),
        "error": history["energy_error"][-1] / work,
        "stabilisation": share("energy_stabilisation"),
        "friction": share("energy_friction"),
        "damage": share("energy_damage"),
        "missed": int((history["out_of_balance"][:] > 1e-3).sum()),
        "factorisations": history["factorisations"][:].mean(),
        "increments": len(history),
        "minutes": history["wall_time"][-1] / 60,
    }


def table(files):
    lines = [
        "| run | reached | peak q [MPa] at | source's | laboratory q_f (unverified) | secant to 0.1 % [MPa] | largest contraction | dilation rate"
        " | friction, damage, stabilisation / external work | ledger error / external work | increments, factorisations each | wall [min] | status |",
        "|---" * 13 + "|",
    ]
    for path in files:
        with Results(path) as results:
            row = measures(results)
            status, _ = results.status
        known = [SOURCE[p] for p in SOURCE if abs(p / row["pressure"] - 1) < 0.01]
        source = f"{known[0][0] / 1e6:.2f} at {100 * known[0][1]:.2f} % ({100 * (row['peak'] / known[0][0] - 1):+.0f} %)" if known else "none given"
        laboratory = strength(row["pressure"])
        at = f"{100 * row['peak_strain']:.2f} %" if numpy.isfinite(row["peak_strain"]) else "the end"
        name = os.path.splitext(os.path.basename(path))[0]
        lines.append(
            f"| {name} | {100 * row['reached']:.2f} % | {row['peak'] / 1e6:.2f} at {at} | {source} |"
            f" {laboratory / 1e6:.2f} ({100 * (row['peak'] / laboratory - 1):+.0f} %) | {row['modulus'] / 1e6:.0f} | {100 * row['contraction']:+.2f} % |"
            f" {row['dilation']:.2f} | {100 * row['friction']:.0f}, {100 * row['damage']:.1f}, {100 * row['stabilisation']:.1f} % | {row['error']:.1e} |"
            f" {row['increments']}, {row['factorisations']:.0f} | {row['minutes']:.0f} | {status} |"
        )
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="results files of drained shear tests")
    arguments = parser.parse_args()
    try:
        print(table(arguments.files))
    except ResultsError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
