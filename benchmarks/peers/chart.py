#!/usr/bin/env python3
"""Draws runs.csv of run.py: CPU seconds against error, one panel a problem.

    benchmarks/peers/chart.py RUNS.csv --out CHART.png
"""

import argparse
import csv
import os
import statistics
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plot

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts"))
from chart_style import COLOURS, STYLE  # noqa: E402

TITLES = {
    "hertz": "Hertz: force at an approach",
    "block": "Pushed block: T / N",
    "pile_closed": "Closed pile: force on the lid",
    "pile_gapped": "Gapped pile: force on the lid",
}
CODES = {"riprap": (COLOURS[0], "o"), "CalculiX": (COLOURS[1], "s")}
LEAST = 1e-8  # errors below it are drawn there


def medians(path):
    """{problem: [(code, setting, CPU seconds, error)]}, the median CPU time of the repetitions that finished with an error."""
    runs = {}
    for row in csv.DictReader(open(path)):
        if row["error"] and row["status"] == "finished":
            runs.setdefault((row["problem"], row["code"], row["setting"]), []).append((float(row["cpu_s"]), abs(float(row["error"]))))
    out = {}
    for (problem, code, setting), each in runs.items():
        out.setdefault(problem, []).append((code, setting, statistics.median(c for c, _ in each), each[0][1]))
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    plot.rcParams.update(STYLE)
    problems = medians(arguments.runs)
    shown = [p for p in TITLES if p in problems]
    figure, panels = plot.subplots(1, len(shown), figsize=(4.6 * len(shown), 4.4), squeeze=False)
    for axes, problem in zip(panels[0], shown):
        for code, (colour, marker) in CODES.items():
            # The reference itself has no error.
            rows = [row for row in problems[problem] if row[0] == code and not (problem.startswith("pile") and row[3] == 0)]
            axes.plot([r[2] for r in rows], [100 * max(r[3], LEAST) for r in rows], marker, color=colour, label=code, markersize=7)
            for _, setting, cpu, error in rows:
                axes.annotate(setting, (cpu, 100 * max(error, LEAST)), xytext=(5, 5), textcoords="offset points", fontsize=7, color=colour)
        axes.set(xscale="log", yscale="log", title=TITLES[problem], xlabel="CPU time of one thread [s]")
        axes.margins(x=0.25, y=0.15)
    panels[0][0].set_ylabel("error [%]")
    panels[0][0].legend()
    figure.tight_layout()
    figure.savefig(arguments.out, dpi=130)


if __name__ == "__main__":
    main()
