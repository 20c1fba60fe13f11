#!/usr/bin/env python3
"""Draws runs.csv of run.py: CPU seconds against error, one panel a problem; hollow where a run stopped short.

    benchmarks/peers/chart.py RUNS.csv --out CHART.png

The triaxial panels have the unbalanced force ratio in place of an error, and CPU seconds for 1 % of strain. Settings stand beside
a panel, in the order of their numbers.
"""

import argparse
import csv
import os
import statistics
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plot
from matplotlib import ticker

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts"))
from chart_style import COLOURS, STYLE  # noqa: E402

TITLES = {
    "hertz": "Hertz: force at an approach",
    "block": "Pushed block: T / N",
    "pile_closed": "Closed pile: force on the lid",
    "pile_gapped": "Gapped pile: force on the lid",
    "stack": "Stack: tilt or push at which it tips",
    "wedge": "Wedge in a groove: tilt or push at which it slides",
    "arch": "Arch of 12 blocks: tilt at which it falls",
    "disc": "Disc across its diameter: tension in its middle",
    "triaxial": "300 grains, triaxial, to 1 %",
    "triaxial_5": "300 grains, triaxial, to 5 %",
}
CODES = {
    "riprap": (COLOURS[0], "o"),
    "CalculiX": (COLOURS[1], "s"),
    "ipctk": (COLOURS[2], "^"),
    "YADE": (COLOURS[3], "D"),
}
LEAST = 1e-6  # errors below it are drawn there
SPAN = 30  # least ratio of the ends of an axis


def medians(path):
    """{problem: [(code, setting, CPU seconds, error, finished)]}, with the median CPU time of the repetitions.

    The reference itself has no error, and is left out.
    """
    runs = {}
    for row in csv.DictReader(open(path)):
        shown = row["value"] if row["problem"].startswith("triaxial") else row["error"]
        reference = row["answer_by"] == f"{row['code']}, {row['setting']}"
        if shown and not reference:
            key = row["problem"], row["code"], row["setting"], row["status"] == "finished"
            runs.setdefault(key, []).append((float(row["cpu_s"]), abs(float(shown))))
    out = {}
    for (problem, code, setting, done), each in runs.items():
        out.setdefault(problem, []).append((code, setting, statistics.median(c for c, _ in each), each[0][1], done))
    return out


def apart(points, width, height):
    """Heights of labels for points (x, y), in shares of the panel, from the top down and never nearer than `height` where x is near."""
    placed = []
    for x, y in points:
        at = y
        while any(abs(x - other) < width and abs(at - up) < height for other, up in placed):
            at -= height
        placed.append((x, at))
    return [at for _, at in placed]


def draw(axes, problem, rows):
    sheared = problem.startswith("triaxial")
    rows = sorted(rows, key=lambda row: (list(CODES).index(row[0]), row[2]))
    errors = [max(error, LEAST) * (1 if sheared else 100) for _, _, _, error, _ in rows]
    axes.set(xscale="log", yscale="log", title=TITLES[problem])
    axes.set_xlabel("CPU time of 1 % of strain [s]" if sheared else "CPU time of one thread [s]")
    axes.set_ylabel("unbalanced force ratio" if sheared else "error [%]")
    for number, ((code, _, cpu, _, done), error) in enumerate(zip(rows, errors), 1):
        colour, marker = CODES[code]
        axes.plot(cpu, error, marker, color=colour, markerfacecolor=colour if done else "none", markersize=7)
    axes.margins(x=0.12, y=0.18)
    for ends, limit, axis in ((axes.get_xlim, axes.set_xlim, axes.xaxis), (axes.get_ylim, axes.set_ylim, axes.yaxis)):
        low, high = ends()
        more = max(1, (SPAN * low / high) ** 0.5)
        limit(low / more, high * more)
        axis.set_minor_formatter(ticker.NullFormatter())
    axes.figure.canvas.draw()
    places = [axes.transAxes.inverted().transform(axes.transData.transform((row[2], error))) for row, error in zip(rows, errors)]
    order = sorted(range(len(rows)), key=lambda k: -places[k][1])
    heights = dict(zip(order, apart([places[k] for k in order], 0.05, 0.05)))
    for k, (code, setting, *_) in enumerate(rows):
        colour = CODES[code][0]
        axes.annotate(str(k + 1), (places[k][0] + 0.018, heights[k]), xycoords="axes fraction", fontsize=8, color=colour, va="center")
        axes.annotate(f"{k + 1}  {code}: {setting}", (1.03, 0.98 - 0.075 * k), xycoords="axes fraction", fontsize=7.5,
                      color=colour, va="top", annotation_clip=False)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    plot.rcParams.update(STYLE)
    problems = medians(arguments.runs)
    shown = [p for p in TITLES if p in problems]
    figure, panels = plot.subplots((len(shown) + 1) // 2, 2, figsize=(15, 3.9 * ((len(shown) + 1) // 2)), squeeze=False)
    figure.subplots_adjust(left=0.06, right=0.82, wspace=0.95, hspace=0.4, top=0.96, bottom=0.06)
    for axes, problem in zip(panels.flat, shown):
        draw(axes, problem, problems[problem])
    for axes in panels.flat[len(shown):]:
        axes.axis("off")
    figure.savefig(arguments.out, dpi=110)


if __name__ == "__main__":
    main()
