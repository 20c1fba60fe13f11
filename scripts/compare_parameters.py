#!/usr/bin/env python3
"""What each changed parameter does to shear tests, and whether that is more than chance: over the packings of a batch.

    scripts/compare_parameters.py results/parameters/*.vtkhdf --out effects.png --csv runs.csv > table.md
    scripts/compare_parameters.py runs.csv --out effects.png > table.md

Files are named as `riprap batch` names members with seeds, NAME_seed=NUMBER.vtkhdf; one NAME is the default (--default), and each of the others
is compared with it packing by packing. The table has means and standard errors of the differences, the chart every packing. Peaks are those of
a moving mean over 0.2 % of strain; mean q is over the strain, volume strain at the end is over the axial strain there, contraction positive.
With three packings a difference within about three standard errors is no difference.
"""

import argparse
import csv
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy

from riprap_results import Results, ResultsError
from shuibuya_tables import smoothed

# name: (heading, unit factor, unit, number format)
MEASURES = {
    "mean_q_Pa": ("mean q", 1e-6, "MPa", "{:.2f}"),
    "peak_q_Pa": ("peak q", 1e-6, "MPa", "{:.2f}"),
    "volume_over_axial_strain": ("volume strain", 100, "% of axial", "{:+.0f}"),
    "stabilisation_share": ("stabilisation", 100, "% of work", "{:.1f}"),
    "crushed_share": ("rock crushed", 100, "%", "{:.1f}"),
}
# What the runs are compared by, and the label of the chart.
COMPARED = {
    "mean_q_Pa": "mean q, off the default  [%]",
    "volume_over_axial_strain": "volume strain over axial strain, off  [%]",
}


def measured(path):
    """The row of one run; None where it has no shear yet."""
    with Results(path) as results:
        strain, volume, q = results.shear("axial_strain", "volumetric_strain", "deviatoric_stress")
        if results.is_scene or len(strain) < 3:
            return None
        history, (status, _) = results.history, results.status
        last = lambda name: history[name][-1] if name in history else numpy.nan
        return {
            "status": status,
            "axial_strain": strain[-1],
            "mean_q_Pa": numpy.trapezoid(q, strain) / (strain[-1] - strain[0]),
            "peak_q_Pa": smoothed(strain, q, 0.002).max(),
            "volume_over_axial_strain": volume[-1] / strain[-1],
            "stabilisation_share": last("energy_stabilisation") / last("energy_external"),
            "crushed_share": last("crushed_share"),
            "deleted_cells": last("deleted_cells"),
            "wall_time_s": last("wall_time"),
        }


def runs_of(files):
    """{(name, seed): row} of results files, or of a table that an earlier call wrote."""
    runs = {}
    for path in files:
        if path.endswith(".csv"):
            with open(path, newline="") as stream:
                for row in csv.DictReader(stream):
                    values = {k: v if k == "status" else float(v) for k, v in row.items() if k not in ("name", "seed")}
                    runs[row["name"], row["seed"]] = values
            continue
        name, found, seed = os.path.splitext(os.path.basename(path))[0].rpartition("_seed=")
        if not found:
            raise ResultsError(f"{path}: is not named NAME_seed=NUMBER.vtkhdf")
        row = measured(path)
        if row is None:
            print(f"compare_parameters: left out: {path} has no shear to measure", file=sys.stderr)
        else:
            runs[name, seed] = row
    return runs


def differences(runs, name, default, measure):
    """Of `measure`, packing by packing; of q over the default's mean."""
    seeds = [seed for known, seed in runs if known == name and (default, seed) in runs]
    values = numpy.array([runs[name, seed][measure] - runs[default, seed][measure] for seed in seeds])
    if measure == "mean_q_Pa":
        values = values / numpy.mean([row[measure] for (known, _), row in runs.items() if known == default])
    return values


def with_error(values):
    """Mean and, of two or more, standard error of values, in per cent."""
    if not len(values):
        return ""
    error = f" ± {100 * values.std(ddof=1) / len(values) ** 0.5:.0f}" if len(values) > 1 else ""
    return f"{100 * values.mean():+.0f}{error} %"


def table(runs, default):
    names = list(dict.fromkeys(name for name, _ in runs))
    names.sort(key=lambda name: name != default)
    heads = [f"{heading} [{unit}]" for heading, _, unit, _ in MEASURES.values()]
    lines = ["| changed | " + " | ".join(heads) + " | mean q, off | volume strain, off | packings |", "|---" * (len(heads) + 4) + "|"]
    for name in names:
        rows = [row for (known, _), row in runs.items() if known == name]
        means = [text.format(factor * numpy.mean([row[key] for row in rows])) for key, (_, factor, _, text) in MEASURES.items()]
        means = ["" if value == "nan" else value for value in means]
        off = [with_error(differences(runs, name, default, measure)) if name != default else "" for measure in COMPARED]
        unfinished = sum(row["status"] != "finished" for row in rows)
        count = f"{len(rows)}" + (f", {unfinished} not finished" if unfinished else "")
        lines.append(f"| {name.replace('_', ' ')} | " + " | ".join(means + off + [count]) + " |")
    return "\n".join(lines)


def draw(runs, default, path):
    names = [name for name in dict.fromkeys(name for name, _ in runs) if name != default]
    figure, axes = plt.subplots(1, 2, figsize=(10, 1.2 + 0.36 * len(names)), sharey=True, layout="constrained")
    for axis, (measure, label) in zip(axes, COMPARED.items()):
        for at, name in enumerate(names):
            values = 100 * differences(runs, name, default, measure)
            if not len(values):
                continue
            axis.plot(values, numpy.full(len(values), at), "o", color="#4878a8", alpha=0.65, markeredgewidth=0)
            axis.plot([values.mean()] * 2, [at - 0.28, at + 0.28], color="#b03a2e", linewidth=2.5)
        axis.axvline(0, color="0.5", linewidth=0.8)
        axis.set_xlabel(label)
        axis.grid(axis="x", color="0.9")
        axis.spines[["top", "right", "left"]].set_visible(False)
        axis.tick_params(left=False)
    axes[0].set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
    axes[0].invert_yaxis()
    figure.savefig(path, dpi=140)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="results files, or the table that --csv wrote")
    parser.add_argument("--default", default="default", help="name of the runs that the others are compared with (default: default)")
    parser.add_argument("--out", help="chart to write (.png, .svg)")
    parser.add_argument("--csv", help="table of all runs to write")
    options = parser.parse_args()
    try:
        runs = runs_of(options.files)
    except (ResultsError, OSError, ValueError, KeyError) as error:
        sys.exit(f"compare_parameters: {error}")
    if not any(name == options.default for name, _ in runs):
        sys.exit(f"compare_parameters: none of the files is of {options.default!r}; --default names another")
    if options.csv:
        with open(options.csv, "w", newline="") as stream:
            rows = csv.writer(stream)
            rows.writerow(["name", "seed", *next(iter(runs.values()))])
            for (name, seed), row in runs.items():
                rows.writerow([name, seed, *(value if isinstance(value, str) else f"{value:.6g}" for value in row.values())])
    print(table(runs, options.default))
    if options.out:
        draw(runs, options.default, options.out)


if __name__ == "__main__":
    main()
