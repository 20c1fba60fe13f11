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

# 2 P / (pi D t) is the tensile strength; the law's own measure of strain reaches its peak there (README.md).
LINES = {"$\\pi D t f_t / 2$": math.pi * 0.04 * 0.015 * 6e6 / 2 / 1e3, "onset of damage": 3.43}


def main():
    plot.rcParams.update(STYLE)
    curves = {}
    for row in csv.DictReader(open(os.path.join(HERE, "curves.csv"))):
        point = float(row["way_mm"]), float(row["force_kN"])
        curves.setdefault(row["fracture_energy"], {}).setdefault(row["cells_mm"], []).append(point)
    figure, panels = plot.subplots(1, 2, figsize=(11, 4.4), sharey=True)
    for axes, tough in zip(panels, ("", "100 J/m2")):
        for colour, (cells, points) in zip(COLOURS, curves[tough].items()):
            axes.plot(*zip(*points), color=colour, label=f"cells of {cells} mm")
        for name, force in LINES.items():
            axes.axhline(force, color="#555555", linestyle=(0, (4, 3)), linewidth=1)
            axes.annotate(name, (0.001, force), (0, 3), textcoords="offset points", fontsize=9, color="#555555")
        axes.set(xlabel="way of the plate [mm]", title=f"fracture energy {tough}" if tough else "no fracture energy given")
        axes.legend(fontsize=9)
    panels[0].set_ylabel("force on the plate [kN]")
    figure.tight_layout()
    figure.savefig(sys.argv[1], dpi=110)


if __name__ == "__main__":
    main()
