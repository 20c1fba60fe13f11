#!/usr/bin/env python3
"""What a Newton iteration, a step of a fall and an increment cost against the number of grains, with slopes of straight lines through the logarithms.

    benchmarks/scaling/chart.py scaling.csv --out scaling.png
"""

import argparse
import csv

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy

# What one Newton iteration with one evaluation takes; the ordering by how often it is needed.
ITERATION = ["contacts", "residual", "tangents", "assembly", "assembly", "cover", "factor", "solve"]
# Okabe & Ito (2008), told apart by marker as well.
COLOURS = ["#0072B2", "#009E73", "#D55E00", "#CC79A7", "#E69F00"]
MARKERS = ["o", "^", "s", "D", "v"]


def slope(x, y):
    return numpy.polyfit(numpy.log(x), numpy.log(y), 1)[0]


def draw(axes, grains, series, unit):
    for (label, values), colour, marker in zip(series, COLOURS, MARKERS):
        values = numpy.array(values, dtype=float)
        sound = values > 0
        if sound.sum() < 3:
            continue
        power = slope(grains[sound], values[sound])
        print(f"{label}: grains^{power:.2f}")
        axes.loglog(grains[sound], values[sound], marker=marker, color=colour, label=f"{label}, slope {power:.2f}")
    axes.set_xlabel("grains")
    axes.set_xticks(grains, [str(int(count)) for count in grains])
    axes.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    axes.set_ylabel(unit)
    axes.grid(True, which="major", color="0.85")
    axes.legend(frameon=False, fontsize=8)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("rows")
    arguments.add_argument("--out", required=True)
    arguments = arguments.parse_args()
    rows = list(csv.DictReader(open(arguments.rows)))

    def column(name):
        return numpy.array([float(row.get(name) or "nan") for row in rows])

    grains = column("grains")
    ordering = column("ordering_ms") * column("ordering_calls") / column("factor_calls")
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2))
    calls = [
        ("a Newton iteration", sum(column(f"{kernel}_ms") for kernel in ITERATION) + ordering),
        ("evaluation of all contacts", column("contacts_ms")),
        ("tangents", column("tangents_ms")),
        ("ordering and factorisation", ordering + column("factor_ms")),
        ("search anew", column("search_ms")),
    ]
    draw(left, grains, calls, "CPU time a call [ms]")
    per = [
        ("steps of seating", column("seating_steps")),
        ("factorisations a shear increment", column("shear_factorisations") / column("shear_increments")),
        ("CPU s a shear increment", column("shear_cpu_s") / column("shear_increments")),
    ]
    draw(right, grains, per, "number, or CPU time [s]")
    figure.tight_layout()
    figure.savefig(arguments.out, dpi=120)


if __name__ == "__main__":
    main()
