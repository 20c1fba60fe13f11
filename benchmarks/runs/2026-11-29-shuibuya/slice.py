"""Writes grains whose centres end within 20 mm of the plane y = 0 as CSV: slice.py RESULTS p0800_full_slice.csv [SI, displacements since the consolidation]."""

import csv
import sys

import h5py
import numpy as np

HALF = 0.02

file = h5py.File(sys.argv[1], "r", locking=False)
grains, history = file["grains"], file["history"]
times = file["VTKHDF/Steps/Values"][: len(grains["position"])]
consolidated = history["time"][:][history["stage"][:] == 0].max()
first = int(np.argmin(abs(times - consolidated)))
before, after = grains["position"][first], grains["position"][-1]
near = np.abs(after[:, 1]) < HALF
moved = after - before
columns = {
    "x": after[:, 0], "z": after[:, 2], "ux": moved[:, 0], "uz": moved[:, 2], "sieve_size": grains["sieve_size"][:],
    "local_shear_strain": grains["local_shear_strain"][-1], "turn": grains["turn"][-1],
}
with open(sys.argv[2], "w", newline="") as out:
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([f"{value:.4g}" for value in row] for row in zip(*(column[near] for column in columns.values())))
