#!/usr/bin/env python3
"""Cost of searching and of an increment against the number of bodies, with the slopes of straight lines through the logarithms.

    benchmarks/broad_phase/chart.py times.csv --out chart.svg
"""

import argparse
import csv

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy

# Okabe & Ito (2008), told apart by marker as well.
SERIES = [
    ("grains", "search_s", "search anew, hulls", "#0072B2", "o"),
    ("grains", "evaluation_s", "evaluate again, hulls", "#009E73", "^"),
    ("increment", "increment_s", "an increment, balls", "#D55E00", "s"),
]


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("times")
    arguments.add_argument("--out", required=True)
    arguments = arguments.parse_args()
    rows = list(csv.DictReader(open(arguments.times)))
    figure, axes = plt.subplots(figsize=(6.4, 4.2))
    for kind, column, label, colour, marker in SERIES:
        own = [row for row in rows if row["kind"] == kind and row[column]]
        bodies = numpy.array(sorted({int(row["bodies"]) for row in own}))
        times = numpy.array(
            [numpy.median([float(r[column]) for r in own if int(r["bodies"]) == n]) for n in bodies]
        )
        sound = times > 0
        slope = numpy.polyfit(numpy.log(bodies[sound]), numpy.log(times[sound]), 1)[0]
        print(f"{label}: CPU time ~ bodies^{slope:.2f}")
        axes.loglog(bodies[sound], 1e3 * times[sound], marker=marker, color=colour, label=f"{label}, slope {slope:.2f}")
    axes.set_xlabel("bodies")
    bodies = sorted({int(row["bodies"]) for row in rows})
    axes.set_xticks(bodies, [str(count) for count in bodies])
    axes.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    axes.set_ylabel("CPU time [ms], median of repetitions")
    axes.grid(True, which="major", color="0.85")
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(arguments.out)


if __name__ == "__main__":
    main()
