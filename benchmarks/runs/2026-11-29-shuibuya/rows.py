"""Writes the rows of a run that are charted as CSV: rows.py RESULTS p1600_full.csv [every so many, the last besides]."""

import csv
import sys

import h5py

NAMES = [
    "stage", "axial_strain", "volumetric_strain", "deviatoric_stress", "unrest", "factorisations", "deleted_cells", "fragments", "crushed_share",
    "energy_external", "energy_elastic", "energy_friction", "energy_damage", "energy_crushing_contacts", "energy_stabilisation", "energy_error",
]

every = int(sys.argv[3]) if len(sys.argv) > 3 else 1
history = h5py.File(sys.argv[1], "r", locking=False)["history"]
columns = [history[name][:] for name in NAMES]
last = len(columns[0]) - 1
with open(sys.argv[2], "w", newline="") as out:
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(NAMES)
    writer.writerows([f"{column[row]:.6g}" for column in columns] for row in range(last + 1) if row % every == 0 or row == last)
