#!/usr/bin/env python3
"""Draws runs.csv of run.py: CPU seconds against error, one panel a problem; hollow where a run stopped short.

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
    """{problem: [(code, setting, CPU seconds, error, finished)]}, with the median CPU time of the repetitions."""
    runs = {}
    for row in csv.DictReader(open(path)):
        if row["error"]:
            done = row["status"] == "finished"
            runs.setdefault((row["problem"], row["code"], row["setting"], done), []).append((float(row["cpu_s"]), abs(float(row["error"]))))
    out = {}
    for (problem, code, setting, done), each in runs.items():
        out.setdefault(problem, []).append((code, setting, statistics.median(c for c, _ in each), each[0][1], done))
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    plot.rcParams.update(STYLE)
    problems = medians(arguments.runs)
    shown = [p for p in TITLES if p in problems]
    figure, panels = plot.subplots((len(shown) + 1) // 2, 2, figsize=(11, 4.2 * ((len(shown) + 1) // 2)), squeeze=False)
    for axes, problem in zip(panels.flat, shown):
        floor = 0  # labels of errors that are drawn at the least one, stacked
        for code, (colour, marker) in CODES.items():
            # The reference itself has no error.
            rows = [row for row in problems[problem] if row[0] == code and not (problem.startswith("pile") and row[3] == 0)]
            axes.plot([], [], marker, color=colour, label=code, markersize=7)
            for k, (_, setting, cpu, error, done) in enumerate(sorted(rows, key=lambda row: row[2])):
                fill = colour if done else "none"
                percent = 100 * max(error, LEAST)
                axes.plot(cpu, percent, marker, color=colour, markerfacecolor=fill, markersize=7)
                # Above and below in turn, leftwards of what is far right: neighbours' labels stay apart.
                side, up = ("right", -6) if cpu > (8 if problem.startswith("pile") else 4) else ("left", 6), 6 if k % 2 else -13
                if error <= LEAST:
                    up, floor = -13 - 11 * floor, floor + 1
                axes.annotate(setting, (cpu, percent), xytext=(side[1], up), textcoords="offset points", fontsize=7.5,
                              color=colour, ha=side[0])
        axes.set(xscale="log", yscale="log", title=TITLES[problem], xlabel="CPU time of one thread [s]", ylabel="error [%]")
        axes.set_xlim(0.04, 60)
        if floor:
            axes.set_ylim(LEAST, 3 * axes.get_ylim()[1])
        if problem.startswith("pile"):
            axes.set_ylim(10, 200)
        axes.margins(y=0.15)
    panels[0][0].legend(loc="lower left")
    figure.tight_layout()
    figure.savefig(arguments.out, dpi=130)


if __name__ == "__main__":
    main()
