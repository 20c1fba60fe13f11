#!/usr/bin/env python3
"""Compares runs of one specimen that differ in one thing, its cover say: a chart, and a table in Markdown.

    scripts/compare_runs.py pressure.vtkhdf rubber.vtkhdf rigid_wall.vtkhdf --out covers.png --at 0.1 0.2 0.5 1

The first file is the reference of the differences. Strains count from the end of the consolidation, or from the start of a run
that starts from a consolidated specimen; its void ratio is that of its first row, its error that behind it.
"""

import argparse
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy

from chart_style import COLOURS, STYLE, STYLES
from riprap_results import Results, ResultsError


class Run:
    """The rows of a file behind its consolidation."""

    def __init__(self, path, results):
        self.name = os.path.splitext(os.path.basename(path))[0]
        history = results.history
        shear, consolidated = results.shear_rows()
        if not consolidated and not results.starts_consolidated:
            raise ResultsError(f"{path}: has no consolidation, or no rows behind it")
        # Of a run that starts from a consolidated specimen every row is of shearing; its energies go on from the consolidation's.
        rows = shear[1:] if consolidated else shear
        change = lambda name: history[name][rows[-1]] - history[name][shear[0]]
        strain, q, volume = results.shear("axial_strain", "deviatoric_stress", "volumetric_strain")
        self.strain, self.q, self.volume = 100 * strain, q / 1e6, 100 * volume
        self.factorisations = numpy.cumsum([0, *history["factorisations"][rows]])[-len(strain) :]
        self.consolidation = int(history["factorisations"][: rows[0]].sum())
        self.seconds = history["wall_time"][rows] - (history["wall_time"][shear[0]] if consolidated else 0)
        self.void_ratio = history["void_ratio"][shear[0]]
        work = change("energy_external")
        self.error = change("energy_error") / work if work else numpy.nan

    def at(self, values, strain):
        return numpy.interp(strain, self.strain, values) if strain <= self.strain[-1] + 1e-9 else numpy.nan


def table(runs, strains):
    lines = [
        "| run | " + " | ".join(f"q, volume strain at {strain:g} %" for strain in strains)
        + " | void ratio before | factorisations: consolidation, stage | s | error over external work |",
        "|---" * (len(strains) + 5) + "|",
    ]
    for run in runs:
        cells = []
        for strain in strains:
            q, base = run.at(run.q, strain), runs[0].at(runs[0].q, strain)
            off = "" if run is runs[0] else f" ({100 * (q / base - 1):+.0f} %)"
            cells.append(f"{q:.3f} MPa{off}, {run.at(run.volume, strain):+.3f} %")
        cells += [
            f"{run.void_ratio:.3f}",
            f"{run.consolidation}, {run.factorisations[-1]}",
            f"{run.seconds[-1]:.0f}",
            f"{run.error:.1e}",
        ]
        lines.append(f"| {run.name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(runs):
    panels = [
        ("q", "deviatoric stress  q  [MPa]"),
        ("volume", "volumetric strain  [%]\n(contraction positive)"),
        ("factorisations", "factorisations"),
    ]
    figure, axes = plt.subplots(3, 1, figsize=(6.4, 8.4), sharex=True, layout="constrained")
    for ax, (name, label) in zip(axes, panels):
        for at, run in enumerate(runs):
            style = {"color": COLOURS[at % len(COLOURS)], "linestyle": STYLES[at % len(STYLES)]}
            ax.plot(run.strain, getattr(run, name), label=run.name, **style)
        ax.set_ylabel(label)
    axes[0].legend(loc="best", fontsize=9)
    axes[0].set_xlim(left=0)
    axes[-1].set_xlabel("axial strain  [%]")
    figure.align_ylabels()
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+")
    parser.add_argument("--out", required=True, help="image to write")
    parser.add_argument("--at", nargs="+", type=float, default=[0.5, 1.0], help="axial strains of the table [%%]")
    arguments = parser.parse_args()
    try:
        runs = []
        for path in arguments.files:
            with Results(path) as results:
                runs.append(Run(path, results))
        with plt.rc_context(STYLE):
            draw(runs).savefig(arguments.out, dpi=150)
    except ResultsError as error:
        sys.exit(f"compare_runs.py: {error}")
    print(table(runs, arguments.at))


if __name__ == "__main__":
    main()
