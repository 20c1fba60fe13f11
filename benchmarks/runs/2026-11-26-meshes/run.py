"""Rigid and condensed grains behind asperities on meshes of 12 to 250 cells: writes corner.csv and grains.csv beside itself.

Usage: python3 run.py RIPRAP [FOLDER FOR RESULTS FILES]; needs h5py and numpy.
"""

import csv
import json
import pathlib
import resource
import subprocess
import sys
import tempfile

import h5py
import numpy as np

RIPRAP = sys.argv[1]
SCRATCH = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp())
SCRATCH.mkdir(parents=True, exist_ok=True)
HERE = pathlib.Path(__file__).parent
ROCK = {"density": 2180, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2,
        "compressive_strength": "250 MPa", "tensile_strength": "25 MPa", "damage": None}


def run(name, case):
    """CPU seconds and the results file of a case."""
    path, out = SCRATCH / f"{name}.json", SCRATCH / f"{name}.vtkhdf"
    path.write_text(json.dumps(case))
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([RIPRAP, "run", path, "--out", out, "--force", "--threads", "1", "--quiet"], check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, h5py.File(out)


def corner(size):
    """A 40 mm cube on its corner, pressed by 0.1 mm onto a hard plate; rigid without a size of cells."""
    plate = {"name": "plate", "shape": {"box": [0.1, 0.1, 0.02]}, "position": [0, 0, -0.01], "fixed": True,
             "fidelity": "rigid", "rock": {"youngs_modulus": 1e13}}
    cube = {"name": "cube", "shape": {"box": [0.04] * 3}, "position": [0, 0, 0.034641016151377546],
            "rotation": [-1.5459306102231432, 1.5459306102231432, 0.0]}
    cube.update({"fidelity": "condensed", "mesh_size": size} if size else {"fidelity": "rigid"})
    press = lambda n, way: {"kind": "load", "increments": n,
                            "bodies": {"cube": {"displacement": [0, 0, -way], "rotation": [0, 0, 0]}}}
    return {"title": "corner", "scene": {"bodies": [plate, cube]}, "rock": ROCK,
            "contact": {"friction": 0.5, "normal": "asperity"},
            "stages": [press(2, 0.0005856406460550967), press(5, 1e-4)]}


def grains(seed, fidelity, cells):
    return {"title": "forty grains", "seed": seed,
            "specimen": {"diameter": "100 mm", "height": "160 mm", "grading": [["60 mm", 1.0], ["30 mm", 0.0]],
                         "void_ratio": 0.55, "unreachable": "nearest", "vertices": [8, 16], "cells_per_grain": cells},
            "rock": ROCK, "contact": {"normal": "asperity", "friction": 0.65}, "plates": {"friction": 0.65},
            "membrane": {"kind": "pressure"}, "solver": {"fidelity": fidelity},
            "stages": [{"kind": "consolidate", "pressure": "0.8 MPa"},
                       {"kind": "shear", "axial_strain": 0.02, "increment": 2e-4}]}


def main():
    with open(HERE / "corner.csv", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["cells_m", "force_n", "cpu_s"])
        for size in [None, 0.02, 0.01, 0.005, 0.0032]:
            cpu, results = run(f"corner_{size}", corner(size))
            force = results["bodies/cube/force"][-1][2]
            table.writerow([size or "rigid", f"{abs(force):.2f}", f"{cpu:.2f}"])
    with open(HERE / "grains.csv", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["seed", "fidelity", "cells", "consolidation_strain", "q_0p1_mpa", "q_0p5_mpa", "q_1_mpa",
                        "q_2_mpa", "volume_strain_1", "energy_error", "factorisations", "cpu_s"])
        for seed in [7, 8]:
            for fidelity, cells in [("rigid", 38)] + [("condensed", n) for n in (12, 38, 100, 250)]:
                cpu, results = run(f"{seed}_{fidelity}_{cells}", grains(seed, fidelity, cells))
                history = {key: results["history"][key][()] for key in (
                    "axial_strain", "deviatoric_stress", "volumetric_strain", "energy_error", "energy_external",
                    "factorisations")}
                start = np.argmax(history["deviatoric_stress"] > 1e3) - 1
                strain = history["axial_strain"] - history["axial_strain"][start]
                q = [np.interp(e, strain, history["deviatoric_stress"]) / 1e6 for e in (1e-3, 5e-3, 1e-2, 2e-2)]
                table.writerow([seed, fidelity, cells, f"{history['volumetric_strain'][start]:.4e}",
                                *(f"{x:.4f}" for x in q),
                                f"{np.interp(1e-2, strain, history['volumetric_strain']):.4e}",
                                f"{history['energy_error'][-1] / history['energy_external'][-1]:.1e}",
                                int(history["factorisations"].sum()), f"{cpu:.1f}"])
                file.flush()


if __name__ == "__main__":
    main()
