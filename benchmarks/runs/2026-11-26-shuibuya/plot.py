"""Draws stress_strain.png and energy.png beside itself from p*.csv; scripts/python_env names a Python that has matplotlib."""

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
from chart_style import COLOURS, STYLE  # noqa: E402

PRESSURES = [400, 800, 1600, 2500]
SOURCE = {800: (11.64, 3.52), 1600: (15.40, 7.04)}


def read(path):
    with open(path) as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


plt.rcParams.update(STYLE)
figure, (above, below) = plt.subplots(2, 1, figsize=(6.4, 7.6), sharex=True)
ends = []
for pressure, colour in zip(PRESSURES, COLOURS):
    run = read(HERE / f"p{pressure:04d}.csv")
    shear = run["stage"] == 1
    strain = 100 * run["axial_strain"][shear]
    above.plot(strain, run["deviatoric_stress"][shear] / 1e6, color=colour, lw=1.2, label=f"{pressure / 1000} MPa")
    below.plot(strain, 100 * run["volumetric_strain"][shear], color=colour, lw=1.2)
    if pressure in SOURCE:
        above.plot(*SOURCE[pressure], "o", color=colour, ms=7, mfc="white", mew=1.8)
    ends.append({name: run[f"energy_{name}"][-1] / run["energy_external"][-1]
                 for name in ("elastic", "friction", "damage", "crushing_contacts", "stabilisation")})
above.plot([], [], "o", color="#555555", mfc="white", mew=1.8, label="peaks of the source")
above.set_ylim(0, 13)
above.set_ylabel("deviatoric stress [MPa]")
above.legend(loc="upper left", ncol=2)
above.set_title("Three hundred grains that break, contacts that crush", loc="left")
below.set_xlabel("axial strain [%]")
below.set_ylabel("volume strain [%], contraction positive")
below.axhline(0, color="#888888", lw=0.8)
figure.tight_layout()
figure.savefig(HERE / "stress_strain.png", dpi=150)

figure, axes = plt.subplots(figsize=(6.4, 3.2))
left = np.zeros(len(PRESSURES))
parts = [("friction", "friction", COLOURS[0]), ("contacts that crush", "crushing_contacts", COLOURS[1]),
         ("cells that break", None, COLOURS[3]), ("elastic", "elastic", COLOURS[2]),
         ("stabilisation", "stabilisation", "#999999")]
for label, name, colour in parts:
    share = np.array([100 * (end[name] if name else end["damage"] - end["crushing_contacts"]) for end in ends])
    axes.barh(range(len(PRESSURES)), share, left=left, color=colour, label=label, height=0.6)
    left += share
axes.set_yticks(range(len(PRESSURES)), [f"{p / 1000} MPa" for p in PRESSURES])
axes.invert_yaxis()
axes.set_xlabel("share of the work to the end [%]")
axes.legend(loc="upper center", bbox_to_anchor=(0.45, -0.2), ncol=3)
figure.savefig(HERE / "energy.png", dpi=150, bbox_inches="tight")

figure, (above, below) = plt.subplots(2, 1, figsize=(6.4, 6.4), sharex=True)
for name, colour, label in [("p0800.csv", COLOURS[1], "300 grains"), ("p0800_3643.csv", COLOURS[3], "3643 grains")]:
    run = read(HERE / name)
    shear = run["stage"] == 1
    strain = 100 * run["axial_strain"][shear]
    above.plot(strain, run["deviatoric_stress"][shear] / 1e6, color=colour, lw=1.2, label=label)
    below.plot(strain, 100 * run["volumetric_strain"][shear], color=colour, lw=1.2)
above.plot(*SOURCE[800], "o", color="#555555", ms=7, mfc="white", mew=1.8, label="peak of the source")
above.set_ylim(0, 6)
above.set_ylabel("deviatoric stress [MPa]")
above.legend(loc="lower right")
above.set_title("The source's own size at 0.8 MPa, so far", loc="left")
below.set_xlabel("axial strain [%]")
below.set_ylabel("volume strain [%], contraction positive")
below.axhline(0, color="#888888", lw=0.8)
figure.tight_layout()
figure.savefig(HERE / "full_size.png", dpi=150)
