"""Peak force of the sphere between plates against the size of its mesh: reads mesh.csv, draws mesh.png.

    PYTHONPATH=scripts $(scripts/python_env) benchmarks/runs/2026-11-21-survival/mesh.py
"""

import csv
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from plot_history import COLOURS, STYLE

here = os.path.dirname(os.path.abspath(__file__))
with open(os.path.join(here, "mesh.csv"), newline="") as file:
    rows = list(csv.DictReader(file))
with plt.rc_context(STYLE):
    figure, axes = plt.subplots(figsize=(5.6, 4.0), layout="constrained")
    for colour, patch, label in ((COLOURS[0], "4", "patch of 4 mm"), (COLOURS[1], "0", "single nodes")):
        found = [(int(row["cells"]), float(row["peak"]) / 1e3, row["end"]) for row in rows if row["patch"] == patch]
        axes.plot([x for x, _, _ in found], [y for _, y, _ in found], "o-", color=colour, label=label)
        for x, y, end in found:
            if end != "finished":
                axes.annotate("stopped early", (x, y), textcoords="offset points", xytext=(4, 6), fontsize=8)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(sorted({int(row["cells"]) for row in rows}))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
        axis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    axes.set_xlabel("cells of the sphere")
    axes.set_ylabel("largest force within 0.1 mm [kN]")
    axes.legend()
    figure.savefig(os.path.join(here, "mesh.png"), dpi=150)
