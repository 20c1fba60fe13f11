#!/usr/bin/env python3
"""Draws runs of one specimen in its three covers from their records, and prints what the README quotes.

    benchmarks/covers/chart.py benchmarks/runs/2026-11-21-covers-100-closed

The folder holds `history.csv` of each cover as `<cover>.csv` (`riprap export FILE --csv`), and `cost.csv`: cover, CPU seconds, how far it came.
"""

import csv
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy

COVERS = [
    ("pressure", "pressure on the grains", "#0072B2", "-"),
    ("rubber", "rubber, 5 mm of 2 MPa", "#D55E00", (0, (6, 2))),
    ("rigid_wall", "rigid wall", "#009E73", (0, (2, 1.5))),
]


def read(path):
    """Columns of a CSV by the name before any unit."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    names = [name.split(" ")[0].split("[")[0] for name in rows[0]]
    return {name: numpy.array([float(row[at]) for row in rows[1:]]) for at, name in enumerate(names)}


def main(folder):
    with open(os.path.join(folder, "cost.csv"), newline="", encoding="utf-8") as file:
        costs = {row["cover"]: row for row in csv.DictReader(file)}
    figure, axes = plt.subplots(3, 1, figsize=(6.4, 9.0), layout="constrained", height_ratios=[3, 3, 1.4])
    for name, label, colour, style in COVERS:
        h = read(os.path.join(folder, f"{name}.csv"))
        sheared = h["stage"] > 0
        strain = 100 * h["axial_strain"][sheared]
        axes[0].plot(strain, h["deviatoric_stress"][sheared] / 1e6, color=colour, linestyle=style, lw=1.4, label=label)
        axes[1].plot(strain, 100 * h["volumetric_strain"][sheared], color=colour, linestyle=style, lw=1.4)
        tell(name, h, float(costs[name]["cpu_seconds"]))
    axes[0].set_ylabel("deviatoric stress  q  [MPa]")
    axes[0].legend(frameon=False)
    axes[0].tick_params(labelbottom=False)
    axes[0].sharex(axes[1])
    axes[1].set_ylabel("volumetric strain  [%]\n(contraction positive)")
    axes[1].set_xlabel("axial strain  [%]")
    names = [label for _, label, _, _ in COVERS]
    seconds = [float(costs[name]["cpu_seconds"]) for name, _, _, _ in COVERS]
    bars = axes[2].barh(names, seconds, color=[colour for _, _, colour, _ in COVERS])
    axes[2].bar_label(bars, labels=[f"{float(costs[name]['cpu_seconds']):.0f} s, {costs[name]['comes_to']}" for name, _, _, _ in COVERS], padding=4)
    axes[2].set_xlim(0, 1.7 * max(seconds))
    axes[2].invert_yaxis()
    axes[2].set_xlabel("CPU time of the run  [s]")
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(os.path.join(folder, "covers.png"), dpi=130)


def snapped(h):
    """Increments known by balance only; records made before `/history/snapped` are judged by their augmentations."""
    return h["snapped"] > 0 if "snapped" in h else h["augmentations"] > 8


def tell(name, h, seconds):
    """What each stage held and how its energy closed."""
    error, work = h["energy_error"], h["energy_external"]
    print(f"{name}: {len(work)} rows, {seconds:.0f} CPU s; worst cumulative error over the work {numpy.abs(error / work)[5:].max():.1e}; "
          f"stabilisation {h['energy_stabilisation'][-1] / work[-1]:.1e} of the work, "
          f"of friction taken back {h['energy_overdrawn'][-1] / work[-1] if 'energy_overdrawn' in h else 0:.1e}")
    for stage in numpy.unique(h["stage"]):
        rows = h["stage"] == stage
        gaps = numpy.abs(h["energy_gap"][rows])
        print(f"  stage {stage:.0f}: {rows.sum()} rows, {h['factorisations'][rows].sum():.0f} factorisations, {h['cuts'][rows].sum():.0f} cuts; "
              f"control {h['control_error'][rows].max():.1e}, out of balance {h['out_of_balance'][rows].max():.1e}, "
              f"stresses disagree {h['stress_disagreement'][rows].max():.1e}; gap median {numpy.median(gaps):.1e}, worst {gaps.max():.1e}, "
              f"beyond 1e-3: {(gaps > 1e-3).sum()}; increments that snapped {snapped(h)[rows].sum()}; "
              f"ends at {100 * h['axial_strain'][rows][-1]:.3f} %, q {h['deviatoric_stress'][rows][-1] / 1e6:.4f} MPa")
    sheared = h["stage"] == 1
    for strain in [0.1, 0.5, 1, 2, 5]:
        if strain > 100 * h["axial_strain"][sheared][-1] + 1e-6:
            break
        q = numpy.interp(strain, 100 * h["axial_strain"][sheared], h["deviatoric_stress"][sheared] / 1e6)
        volume = numpy.interp(strain, 100 * h["axial_strain"][sheared], 100 * h["volumetric_strain"][sheared])
        print(f"  at {strain:g} %: q {q:.3f} MPa, volume {volume:+.3f} %")


if __name__ == "__main__":
    main(sys.argv[1])
