"""Draws stress_strain.png, energy.png, full_size.png, void_ratio.png, rubber.png, size.png and motion.png beside itself from p*.csv; scripts/python_env names a Python that has matplotlib."""

import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parents[2] / "scripts"))
from chart_style import COLOURS, STYLE, energy_bars  # noqa: E402

PRESSURES = {400: COLOURS[0], 800: COLOURS[1], 1600: COLOURS[2], 2500: COLOURS[3]}
SOURCE = {800: (11.64, 3.52), 1600: (15.40, 7.04)}


def draw(axes, path, colour, line, width):
    """q above and volume strain below, in shear."""
    with open(path) as file:
        rows = [row for row in csv.DictReader(file) if row["stage"] == "1"]
    strain, q, volume = (np.array([float(row[name]) for row in rows])
                         for name in ("axial_strain", "deviatoric_stress", "volumetric_strain"))
    axes[0].plot(100 * strain, q / 1e6, line, color=colour, lw=width)
    axes[1].plot(100 * strain, 100 * volume, line, color=colour, lw=width)


def finish(figure, axes, title, most, legend, name):
    """Titles and labels of q above and volume strain below, and the file."""
    axes[0].set_title(title, loc="left")
    axes[0].set_ylim(0, most)
    axes[0].set_ylabel("deviatoric stress [MPa]")
    axes[0].legend(loc=legend, ncol=2)
    axes[1].set_xlabel("axial strain [%]")
    axes[1].set_ylabel("volume strain [%], contraction positive")
    axes[1].axhline(0, color="#888888", lw=0.8)
    figure.tight_layout()
    figure.savefig(HERE / name, dpi=150)


plt.rcParams.update(STYLE)
figure, axes = plt.subplots(2, 1, figsize=(6.4, 7.6), sharex=True)
for pressure, colour in PRESSURES.items():
    draw(axes, HERE / f"p{pressure:04d}.csv", colour, "-", 1.4)
    if pressure in SOURCE:
        axes[0].plot(*SOURCE[pressure], "o", color=colour, ms=7, mfc="white", mew=1.8)
    axes[0].plot([], [], color=colour, label=f"{pressure / 1000} MPa")
axes[0].plot([], [], "o", color="#555555", mfc="white", mew=1.8, label="peaks of the source")
finish(figure, axes, "300 grains that break", 13, "upper left", "stress_strain.png")

ends = []
for pressure in PRESSURES:
    with open(HERE / f"p{pressure:04d}.csv") as file:
        *_, last = csv.DictReader(file)
    ends.append({name: float(value) for name, value in last.items()})
figure, axes = plt.subplots(figsize=(6.4, 3.2))
energy_bars(axes, ends, [f"{p / 1000} MPa" for p in PRESSURES])
figure.savefig(HERE / "energy.png", dpi=150, bbox_inches="tight")

figure, axes = plt.subplots(2, 1, figsize=(6.4, 6.6), sharex=True)
for pressure, colour in PRESSURES.items():
    full = HERE / f"p{pressure:04d}_full.csv"
    if full.exists():
        draw(axes, full, colour, "-", 1.6)
        draw(axes, HERE / f"p{pressure:04d}.csv", colour, "--", 0.9)
        axes[0].plot([], [], color=colour, label=f"{pressure / 1000} MPa, 3643 grains")
    if pressure in SOURCE:
        axes[0].plot(*SOURCE[pressure], "o", color=colour, ms=7, mfc="white", mew=1.8)
axes[0].plot([], [], "--", color="#555555", lw=0.9, label="300 grains")
axes[0].plot([], [], "o", color="#555555", mfc="white", mew=1.8, label="peaks of the source")
finish(figure, axes, "At the source's size, and at a tenth of its grains", 14, "upper right", "full_size.png")

VOID_RATIOS = [
    ("p0800", COLOURS[1], "-", "300 grains, void ratio 0.57"), ("p0800_void_0.64", COLOURS[0], "-", "0.64"), ("p0800_void_0.70", COLOURS[2], "-", "0.70"),
    ("p0800_full", COLOURS[1], "--", "3643 grains, 0.48"), ("p0800_full_void_0.52", COLOURS[3], "--", "3523 grains, 0.52"),
]
COVERS = [("p0800", COLOURS[1], "-", "300 grains, pressure"), ("p0800_rubber", COLOURS[0], "-", "rubber, 6 mm of 3 MPa")]
SIZES = [
    ("p0800", COLOURS[0], "-", "300 grains, void ratio 0.57"), ("p0800_1000_20110105", COLOURS[2], "-", "1000, 0.52"), ("p0800_full", COLOURS[1], "-", "3643, 0.48"),
    ("p0800_10000", COLOURS[3], "-", "9996, 0.47"),
]
CHARTS = [("void_ratio.png", "Void ratio", 6, VOID_RATIOS), ("rubber.png", "Cover", 6.5, COVERS), ("size.png", "Size", 6.5, SIZES)]
for name, title, most, lines in CHARTS:
    figure, axes = plt.subplots(2, 1, figsize=(6.4, 6.0), sharex=True)
    for path, colour, line, label in lines:
        draw(axes, HERE / f"{path}.csv", colour, line, 1.4)
        axes[0].plot([], [], line, color=colour, label=label)
    axes[0].plot(*SOURCE[800], "o", color="#555555", ms=7, mfc="white", mew=1.8, label="the source's peak")
    finish(figure, axes, f"{title}: grains that break, 0.8 MPa", most, "upper left", name)

# Grains whose centres end within 20 mm of a plane through the axis.
with open(HERE / "p0800_full_slice.csv") as file:
    grains = list(csv.DictReader(file))
x, z, ux, uz, size, shear, turn = (np.array([float(grain[name]) for grain in grains])
                                   for name in ("x", "z", "ux", "uz", "sieve_size", "local_shear_strain", "turn"))
figure, (axes, scales) = plt.subplots(2, 3, figsize=(9.6, 5.2), height_ratios=[28, 1], layout="constrained")
axes[0].quiver(1e3 * x, 1e3 * z, ux, uz - uz.mean(), color=COLOURS[0], angles="xy", scale=0.5, width=4e-3)
axes[0].set_title("displacement, less its mean", loc="left")
scales[0].axis("off")
for of, scale, values, title in [(axes[1], scales[1], 100 * shear, "shear strain about a grain [%]"), (axes[2], scales[2], np.degrees(turn), "turn of a grain [deg]")]:
    dots = of.scatter(1e3 * x, 1e3 * z, c=values, s=(4e2 * size) ** 2, cmap="viridis", vmin=0, vmax=60, linewidths=0)
    figure.colorbar(dots, cax=scale, orientation="horizontal", extend="max")
    of.set_title(title, loc="left")
for of in axes:
    of.set_aspect("equal")
    of.set_xlim(-215, 215)
    of.set_ylim(-20, 580)
    of.set_xlabel("x [mm]")
    of.grid(False)
axes[0].set_ylabel("z [mm]")
figure.savefig(HERE / "motion.png", dpi=150)
