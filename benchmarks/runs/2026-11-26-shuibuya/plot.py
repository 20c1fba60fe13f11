"""Draws stress_strain.png, energy.png, strict.png and full_size.png beside itself from p*.csv; scripts/python_env names a Python that has matplotlib."""

import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
from chart_style import COLOURS, STYLE, energy_bars  # noqa: E402

PRESSURES = [400, 800, 1600, 2500]
SOURCE = {800: (11.64, 3.52), 1600: (15.40, 7.04)}


def read(path):
    with open(path) as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def draw(axes, run, colour, label, line="-"):
    """q above and volume strain below, in shear."""
    shear = run["stage"] == 1
    strain = 100 * run["axial_strain"][shear]
    axes[0].plot(strain, run["deviatoric_stress"][shear] / 1e6, color=colour, ls=line, lw=1.2, label=label)
    axes[1].plot(strain, 100 * run["volumetric_strain"][shear], color=colour, ls=line, lw=1.2)


def finish(figure, axes, title, most, name):
    """Names the axes and saves the figure; `most` is the end of the axis of q [MPa]."""
    above, below = axes
    above.set_ylim(0, most)
    above.set_ylabel("deviatoric stress [MPa]")
    above.set_title(title, loc="left")
    below.set_xlabel("axial strain [%]")
    below.set_ylabel("volume strain [%], contraction positive")
    below.axhline(0, color="#888888", lw=0.8)
    figure.tight_layout()
    figure.savefig(HERE / name, dpi=150)


plt.rcParams.update(STYLE)
figure, axes = plt.subplots(2, 1, figsize=(6.4, 7.6), sharex=True)
ends = []
for pressure, colour in zip(PRESSURES, COLOURS):
    run = read(HERE / f"p{pressure:04d}.csv")
    draw(axes, run, colour, f"{pressure / 1000} MPa")
    if pressure in SOURCE:
        axes[0].plot(*SOURCE[pressure], "o", color=colour, ms=7, mfc="white", mew=1.8)
    ends.append({name: column[-1] for name, column in run.items()})
axes[0].plot([], [], "o", color="#555555", mfc="white", mew=1.8, label="peaks of the source")
axes[0].legend(loc="upper left", ncol=2)
finish(figure, axes, "Three hundred grains that break, contacts that crush", 13, "stress_strain.png")

figure, axes = plt.subplots(figsize=(6.4, 3.2))
energy_bars(axes, ends, [f"{p / 1000} MPa" for p in PRESSURES])
figure.savefig(HERE / "energy.png", dpi=150, bbox_inches="tight")

figure, axes = plt.subplots(2, 1, figsize=(6.4, 7.6), sharex=True)
for pressure, colour in [(800, 1), (1600, 2)]:
    draw(axes, read(HERE / f"p{pressure:04d}.csv"), COLOURS[colour], f"{pressure / 1000} MPa, unrest of 0.1 %")
    draw(axes, read(HERE / f"p{pressure:04d}_strict.csv"), COLOURS[colour], f"{pressure / 1000} MPa, every row at rest", "--")
axes[0].legend(loc="upper left", ncol=2)
finish(figure, axes, "Rows that move a little, and rows at rest", 10, "strict.png")

figure, axes = plt.subplots(2, 1, figsize=(6.4, 6.4), sharex=True)
draw(axes, read(HERE / "p0800.csv"), COLOURS[1], "300 grains, forty steps an increment")
draw(axes, read(HERE / "p0800_3643.csv"), COLOURS[3], "3643 grains, four steps")
axes[0].plot(*SOURCE[800], "o", color="#555555", ms=7, mfc="white", mew=1.8, label="peak of the source")
axes[0].legend(loc="lower center")
finish(figure, axes, "The source's own size at 0.8 MPa", 6, "full_size.png")
