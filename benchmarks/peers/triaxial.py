"""Three hundred grains of 20 to 60 mm sheared by 1 or 5 % at 0.8 MPa: CPU seconds for 1 % of strain against the unbalanced force ratio.

riprap: the polyhedra of `cases/shuibuya/p0800_300.json`, unbroken, rigid, between plates and a flexible cover, increments of 2e-4.
YADE: spheres, or clumps of four, between six frictionless walls (`yade_triaxial.py`), by contact modulus and inertial number.
Not the same test: grains, walls and contact laws differ. The time of shear alone is given, that of consolidation left out:
riprap's run starts from the results file of another that consolidates. The ratio is the mean over the rows of the shear stage.
"""

import math
import os

from codes import read_case, riprap, yade

HERE = os.path.dirname(os.path.abspath(__file__))
CASE = os.path.join(HERE, "..", "..", "cases", "shuibuya", "p0800_300.json")
INCREMENT = 2e-4

RIPRAP = [
    ("polyhedra, steps to 3e-3 (default)", 3e-3),
    ("polyhedra, strict balance", None),
]
YADE = [
    ("spheres, 0.3 GPa, I 1e-3", "spheres", 3e8, 1e-3),
    ("spheres, 30 GPa, I 1e-3", "spheres", 3e10, 1e-3),
    ("clumps, 0.3 GPa, I 1e-3", "clumps", 3e8, 1e-3),
    ("clumps, 0.3 GPa, I 1e-4", "clumps", 3e8, 1e-4),
    ("clumps, 30 GPa, I 1e-3", "clumps", 3e10, 1e-3),
    ("clumps, 30 GPa, I 1e-4", "clumps", 3e10, 1e-4),
]


def case(stabilisation, strain):
    """To this axial strain from `before.vtkhdf`; consolidated alone where it is none."""
    case = read_case(CASE)
    case["specimen"].pop("cells_per_grain", None)
    case["rock"]["damage"] = None
    case["solver"] = {"stabilisation": stabilisation, "fidelity": "rigid"}
    case["stages"][1] |= {"axial_strain": strain or INCREMENT, "increment": INCREMENT}
    case["stages"] = case["stages"][: 2 if strain else 1]
    if strain:
        case["start_from"] = "before.vtkhdf"
    return case


def settings(strain, shape, modulus, inertial):
    return {
        "pressure": 8e5, "density": 2180, "friction": 0.65, "sizes": [0.02, 0.04, 0.06], "shares": [0, 0.62, 1],
        "grains": 300, "seed": 1, "shape": shape, "modulus": modulus, "inertial": inertial, "strain": strain, "most": 60,
    }


def rows(program, folder, limit, has, strain):
    """One row a run: code, setting, unknowns, cost, value, answer. The cost is of 1 % of strain, the value the unbalanced ratio."""
    for setting, stabilisation in RIPRAP if has["riprap"] else []:
        riprap(program, folder, "before", case(stabilisation, None), limit)
        cost = riprap(program, folder, "triaxial", case(stabilisation, strain), limit)
        stage, unrest = (cost["history"].get(key, []) for key in ("stage", "unrest"))
        sheared = [u for s, u in zip(stage, unrest) if s == 1 and not math.isnan(u)]
        reached = max(cost["history"].get("axial_strain", []), default=0)
        cost["cpu_s"] = cost["cpu_s"] * 0.01 / (reached or strain)
        yield "riprap", setting, 1800, cost, sum(sheared) / len(sheared) if sheared else None, None, ""
    for setting, *given in YADE if has["YADE"] else []:
        cost = yade(folder, os.path.join(HERE, "yade_triaxial.py"), settings(strain, *given), limit)
        done = cost["rows"]
        mean = sum(row["unbalanced"] for row in done) / len(done) if done else None
        yield "YADE", setting, "", cost, mean, None, ""

