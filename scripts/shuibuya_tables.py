#!/usr/bin/env python3
"""Measures of drained shear tests as a table in Markdown, beside what the source and the laboratory report.

    scripts/shuibuya_tables.py results/p0800_300.vtkhdf results/p1600_300.vtkhdf

Strains count from the end of the consolidation, compression and contraction positive. The peak is that of a moving mean over
0.2 % of strain, since single increments jump where force chains break; the contraction is the largest within the first 2 %; the dilation rate is
the largest -d(volume strain)/d(axial strain) over 1 % of strain behind it.
"""

import argparse
import os
import sys

import numpy

from duncan_chang_curves import strength
from riprap_results import Results, ResultsError

# Peak deviatoric stress [Pa] and its axial strain at a confining pressure [Pa]: Ma, Zhou, Chang & Zhou (2011).
SOURCE = {0.8e6: (3.52e6, 0.1164), 1.6e6: (7.04e6, 0.154)}

# Where the largest contraction is looked for, and the strain over which dilation is measured.
EARLY = 0.02
OVER = 0.01


def smoothed(strain, values, width):
    """Mean of `values` over `width` of strain about each point; ends take what there is."""
    low = numpy.searchsorted(strain, strain - width / 2, side="left")
    high = numpy.searchsorted(strain, strain + width / 2, side="right")
    total = numpy.concatenate([[0.0], numpy.cumsum(values)])
    return (total[high] - total[low]) / (high - low)


def measures(results):
    """The rows of one run's column, in order: what is measured and its text; None where it has no shear."""
    history = results.history
    names = ("axial_strain", "volumetric_strain", "deviatoric_stress", "confining_pressure")
    strain, volume, q, pressures = (numpy.nan_to_num(column) for column in results.shear(*names))
    if results.is_scene or len(strain) < 3:
        return None
    pressure = float(numpy.median(pressures))
    mean_q = smoothed(strain, q, 0.002)
    peak = int(mean_q.argmax())
    strength_found = mean_q[peak]
    at_peak = f"at {100 * strain[peak]:.1f} %" if peak < len(strain) - 1 else "at the end"
    deepest = int(numpy.where(strain < EARLY, volume, -numpy.inf).argmax())
    starts = numpy.arange(strain[deepest], strain[-1] - OVER, 2e-4)
    volume_at = lambda at: numpy.interp(at, strain, volume)
    dilation = max(((volume_at(at) - volume_at(at + OVER)) / OVER for at in starts), default=numpy.nan)
    of_source = [value for known, value in SOURCE.items() if abs(known / pressure - 1) < 0.01]
    laboratory = strength(pressure)
    off = lambda value: f"{100 * (strength_found / value - 1):+.0f} %"
    # Of older files a column may be missing.
    column = lambda name: history[name] if name in history else numpy.zeros(len(history))
    work = column("energy_external")
    share = lambda name: 100 * column(name)[-1] / work[-1]
    errors = numpy.abs(column("energy_error") / numpy.maximum(work, 1e-9))[history["axial_strain"] > 0.01]
    sampled = [at for at in (0.05, 0.10, 0.15) if at <= strain[-1] + 1e-6]
    mean = numpy.trapezoid(q, strain) / (strain[-1] - strain[0])
    status, _ = results.status
    crushed = column("crushed_share")[-1]
    return {
        "status, axial strain reached": f"{status}, {100 * strain[-1]:.1f} %",
        "peak q (mean over 0.2 %)": f"**{strength_found / 1e6:.2f} MPa** {at_peak}",
        "the source's peak": f"{of_source[0][0] / 1e6:.2f} MPa at {100 * of_source[0][1]:.2f} %: {off(of_source[0][0])}" if of_source else "none given",
        "Duncan-Chang strength, **unverified**": f"{laboratory / 1e6:.2f} MPa: {off(laboratory)}",
        "friction angle at the peak": f"{numpy.degrees(numpy.arcsin(strength_found / (strength_found + 2 * pressure))):.1f} deg",
        "secant to 0.1 %": f"{numpy.interp(0.001, strain, q) / 1e3:.0f} MPa",
        "contraction before dilation": f"{100 * volume[deepest]:.2f} % at {100 * strain[deepest]:.2f} %",
        "fastest dilation over 1 % of strain": f"{dilation:.2f}",
        "volume strain at " + ", ".join(f"{100 * at:.0f}" for at in sampled) + " %": ", ".join(f"{100 * volume_at(at):+.1f}" for at in sampled) + " %",
        "mean q": f"{mean / 1e6:.2f} MPa",
        "elastic, friction, damage, stabilisation / work": f"{share('energy_elastic'):.1f}, {share('energy_friction'):.0f}, {share('energy_damage'):.1f}, **{share('energy_stabilisation'):.1f} %**",
        "reshaped, by which stabilisation is told too low / work": f"{share('energy_reshaped'):.1f} %",
        "grains condensed, in the mean": f"{column('condensed_bodies')[history['axial_strain'] > 0].mean():.0f}",
        "of the damage, crushing / work": f"{share('energy_crushing'):.1f} %",
        "ledger error / work, at the end; worst beyond 1 %": f"{abs(share('energy_error')) / 100:.0e}; {errors.max(initial=0.0):.0e}",
        "cells failed; fragments": f"{column('deleted_cells')[-1]:.0f}; {column('fragments')[-1]:.0f}",
        "rock crushed": f"{100 * crushed:.1f} %" if numpy.isfinite(crushed) else "none can break",
        "increments, cut, out of balance by more than 1e-3": f"{len(work)}, {column('cuts').sum():.0f}, {(column('out_of_balance') > 1e-3).sum()}",
        "factorisations each": f"{column('factorisations').mean():.0f}",
        "deepest contact": f"{1e3 * numpy.nanmax(column('max_penetration')):.2f} mm",
        "wall time": f"{history['wall_time'][-1] / 60:.0f} min",
    }


def table(files):
    """A column a run; rows that not all runs have are left empty where they are missing. Runs without shear are left out."""
    columns = {}
    for path in files:
        with Results(path) as results:
            column = measures(results)
        if column is None:
            print(f"shuibuya_tables: left out: {path} has no shear to measure", file=sys.stderr)
        else:
            name = os.path.splitext(os.path.basename(path))[0]
            columns[name if name not in columns else path] = column
    if not columns:
        raise ResultsError("shuibuya_tables: no run is left")
    rows = dict.fromkeys(name for column in columns.values() for name in column)
    lines = ["| | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for row in rows:
        lines.append(f"| {row} | " + " | ".join(column.get(row, "") for column in columns.values()) + " |")
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
