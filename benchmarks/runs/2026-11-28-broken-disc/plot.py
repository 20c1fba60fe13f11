#!/usr/bin/env python3
"""The plate's force against its way, of each mesh, from curves.csv beside this script.

    plot.py disc.png
"""

import csv
import math
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plot

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "..", "scripts"))
from chart_style import COLOURS, STYLE  # noqa: E402

CELLS = {"default": "16 mm", "reference": "9 mm", "next to the reference": "10 mm"}
CLOSED = math.pi * 0.04 * 0.015 * 6e6 / 2 / 1e3


def main():
    plot.rcParams.update(STYLE)
    curves = {}
    for row in csv.DictReader(open(os.path.join(HERE, "curves.csv"))):
        point = 1e3 * float(row["axial_strain"]), float(row["deviatoric_stress_Pa"]) / 1e3
        curves.setdefault(row["variant"].split(", ", 1)[1], []).append(point)
    figure, panels = plot.subplots(1, 2, figsize=(11, 4.4), sharey=True)
    for axes, tough in zip(panels, (False, True)):
        shown = {name: points for name, points in curves.items() if name.startswith("100 J/m2") == tough}
        for colour, (name, points) in zip(COLOURS, shown.items()):
            cells = name.removeprefix("100 J/m2").removeprefix(" on ").removeprefix("cells of ") or "16 mm"
            axes.plot(*zip(*points), color=colour, label=f"cells of {CELLS.get(cells, cells)}")
        axes.axhline(CLOSED, color="#555555", linestyle=(0, (4, 3)), linewidth=1)
        axes.annotate("$\\pi D t f_t / 2$", (0.001, CLOSED), (0, 3), textcoords="offset points", fontsize=9, color="#555555")
        axes.set(xlabel="way of the plate [mm]", title="fracture energy 100 J/m2" if tough else "no fracture energy given")
        axes.legend(fontsize=9)
    panels[0].set_ylabel("force on the plate [kN]")
    figure.tight_layout()
    figure.savefig(sys.argv[1], dpi=110)


if __name__ == "__main__":
    main()
