#!/usr/bin/env python3
"""Draws sizes.csv of sizes.py: CPU seconds for 1 % of strain against grains, and prints the power of each line.

    benchmarks/peers/chart_sizes.py SIZES.csv --riprap benchmarks/runs/2026-11-29-steps/runs.csv --out CHART.png

Filled marks are runs to 1 %, hollow ones steps for 1 % times seconds a step. A line's label has the mean unbalanced force ratio where
it was measured, at 300 grains where there is a choice. Packings that fewer than half of the grains carry are left out, and
polyhedra with a poisson of their own.
--riprap: newer rows of riprap, those of that record whose `what` is size.
"""

import argparse
import csv
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plot
import numpy
from matplotlib.lines import Line2D

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "scripts"))
from chart_style import COLOURS, STYLE, STYLES  # noqa: E402

# Colour and marker by code and grain; the line's style by modulus and inertial number.
LOOKS = {
    ("riprap", "polyhedra"): (COLOURS[0], "o"),
    ("YADE", "spheres"): (COLOURS[3], "D"),
    ("YADE", "clumps"): (COLOURS[1], "s"),
    ("YADE", "polyhedra"): (COLOURS[2], "^"),
}
LINES = {(3e8, 1e-3): STYLES[2], (3e8, 1e-4): STYLES[1], (3e10, 1e-3): STYLES[3], (3e10, 1e-4): STYLES[0]}
NEWER = "riprap", "polyhedra", "newer", None
MODULI = {3e8: "0.3 GPa", 3e10: "30 GPa", 1e10: "1e10 N/m3"}


def lines(path, smallest):
    """{(code, grain, modulus, inertial number): [(grains, CPU seconds, measured, unbalanced)]}.

    Where one inertial number was probed alone, the others of that grain and modulus have the same seconds a step, and more or less steps.
    """
    found = {}
    for row in csv.DictReader(open(path)):
        inertial = float(row["inertial_number"]) if row["inertial_number"] else None
        key = row["code"], row["grain"], float(row["modulus"]), inertial
        measured, product = row["cpu_s_measured"], row["cpu_s_product"]
        if (measured or product) and not any(word in row["status"] for word in ("carry", "poisson")):
            ratio = float(row["unbalanced_mean"]) if row["unbalanced_mean"] else None
            found.setdefault(key, []).append((int(row["grains"]), float(measured or product), bool(measured), ratio))
    for (code, grain, modulus, inertial), points in list(found.items()):
        own = found.get((code, grain, modulus, smallest))
        if own and inertial != smallest:
            have = {point[0] for point in points}
            points += [(n, cpu * smallest / inertial, False, None) for n, cpu, *_ in own if n not in have]
    return {key: sorted(points) for key, points in found.items()}


def power(points):
    grains, seconds = numpy.log([[p[0], p[1]] for p in points]).T
    return numpy.polyfit(grains, seconds, 1)[0]


def label(key, points):
    code, grain, modulus, inertial = key
    ratios = {n: ratio for n, _, _, ratio in points if ratio is not None}
    ratio = ratios.get(300, next(iter(ratios.values()), None))
    if key == NEWER:
        text = "riprap, polyhedra, 2026-11-30"
    else:
        text = f"{code}, {grain}, {MODULI[modulus]}" + (f", I {inertial:.0e}".replace("e-0", "e-") if inertial else "")
    said = f"unbalanced {ratio:.0e}".replace("e-0", "e-").replace("e+00", "") if ratio is not None else "unbalanced not measured"
    said = said.replace("unbalanced", "unbalanced at most") if key == NEWER else said
    return f"{text}\n{said}, power {power(points):.2f}" if len(points) > 1 else f"{text}\n{said}"


def style_of(key):
    return (0, (1, 1)) if key == NEWER else LINES.get(key[2:], STYLES[0])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sizes")
    parser.add_argument("--riprap")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    plot.rcParams.update(STYLE)
    series = lines(arguments.sizes, 1e-4)
    if arguments.riprap:
        rows = [row for row in csv.DictReader(open(arguments.riprap)) if row["what"] == "size"]
        series[NEWER] = [(int(r["grains"]), float(r["of the shear [s]"]), True, float(r["largest unrest [1]"])) for r in rows]
    figure, axes = plot.subplots(figsize=(10.5, 6.6))
    figure.subplots_adjust(left=0.08, right=0.68, top=0.95, bottom=0.09)
    axes.set(xscale="log", yscale="log", xlabel="grains", ylabel="CPU time of one thread for 1 % of axial strain [s]",
             title="Shear to 1 % at 0.8 MPa, grains of 20 to 60 mm")
    order, handles = sorted(series, key=lambda key: -series[key][-1][1]), []
    for key in order:
        points = series[key]
        colour, marker = LOOKS[key[:2]]
        axes.plot([p[0] for p in points], [p[1] for p in points], linestyle=style_of(key), color=colour, linewidth=1.3)
        for n, seconds, measured, _ in points:
            axes.plot(n, seconds, marker, color=colour, markerfacecolor=colour if measured else "white", markersize=6)
        print(label(key, points).replace("\n", ": "), [(p[0], f"{p[1]:.3g}") for p in points])
    axes.set_xlim(50, 13000)
    axes.set_xticks([100, 300, 1000, 3000, 10000], ["100", "300", "1000", "3000", "10000"])
    axes.minorticks_off()
    # Numbers stand at the ends of lines, what they are to the right.
    for number, key in enumerate(order, 1):
        colour, marker = LOOKS[key[:2]]
        axes.annotate(str(number), series[key][-1][:2], (7, 0), textcoords="offset points", fontsize=9, color=colour, va="center")
        handles.append(Line2D([], [], color=colour, marker=marker, linestyle=style_of(key), linewidth=1.3, markersize=5))
    texts = [f"{number}  {label(key, series[key])}" for number, key in enumerate(order, 1)]
    axes.legend(handles, texts, loc="upper left", bbox_to_anchor=(1.02, 1.02), fontsize=8.5, labelspacing=0.9, handlelength=3.5)
    figure.savefig(arguments.out, dpi=110)


if __name__ == "__main__":
    main()
