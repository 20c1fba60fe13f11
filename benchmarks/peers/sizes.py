#!/usr/bin/env python3
"""What 1 % of axial strain costs against the number of grains: riprap's polyhedra, YADE's spheres, clumps of four and polyhedra.

    benchmarks/peers/sizes.py RIPRAP OUT [riprap spheres clumps polyhedra]

The tests of triaxial.py at other numbers of grains: the grading stays, so the smallest grain and with it YADE's time step stay.
OUT/sizes.csv gets a row a run, appended to where it exists. GRAINS="100 300" (environment) runs these sizes alone, MODULUS="3e8" these
moduli, INERTIAL="1e-3" these inertial numbers; POISSON is that of YADE's polyhedra; LIMIT (900) ends a run after so many seconds.

YADE's steps for 1 % are 0.01 / (rate dt), with the strain rate I / (d sqrt(density / pressure)), d halfway from the smallest to the
largest grain. YADE chooses dt, 0.8 of the least sqrt(mass / stiffness) of a grain: it goes with d_min sqrt(density / modulus).
"product": those steps times CPU seconds a step, dt and seconds taken after the first PROBE steps of shear or more.
"measured": a run to 1 %, at sizes up to WHOLE; beyond, the probe alone, at the smallest inertial number, for all of them.
Polyhedra have a fixed step (`yade_polyhedra.py`). Seconds of shear alone; what brings a specimen to its pressure is in its own column.
"""

import csv
import math
import os
import sys
import tempfile

import triaxial
from codes import measured_yade, riprap

HERE = os.path.dirname(os.path.abspath(__file__))
HEAD = ["code", "grain", "modulus", "inertial_number", "grains", "step_s", "steps_for_1_percent", "cpu_s_per_step", "cpu_s_product",
        "steps_measured", "cpu_s_measured", "unbalanced_mean", "unbalanced_end", "strain_reached", "cpu_s_before_shear",
        "steps_before_shear", "unbalanced_before_shear", "memory_MB", "status"]
SIZES = {"riprap": [100, 300, 1000], "spheres": [100, 300, 1000, 3000, 10000], "clumps": [100, 300, 1000, 3000, 10000],
         "polyhedra": [64, 300]}
MODULI = {"riprap": [3e10], "spheres": [3e8, 3e10], "clumps": [3e8, 3e10], "polyhedra": [1e10]}
INERTIAL = [1e-3, 1e-4]
ALLOWED = {64: (60, 200), 300: (400, 300)}  # CPU seconds before and in shear, of polyhedra
WHOLE, PROBE, SHORT = 1000, 300, 2.5e-4


def chosen(name, default):
    return [float(word) for word in os.environ.get(name, "").split()] or default


def of_riprap(program, folder, limit, grains):
    """The specimen of triaxial.py with so many grains; its steps are factorisations."""
    def case(strain):
        given = triaxial.case(3e-3, strain)
        given["specimen"]["grains"] = grains
        return given

    before = riprap(program, folder, "before", case(None), limit)
    cost = riprap(program, folder, "triaxial", case(0.01), limit)
    stage, unrest, strain, factorisations = (cost["history"].get(key, []) for key in ("stage", "unrest", "axial_strain", "factorisations"))
    sheared = [k for k, s in enumerate(stage) if s == 1 and not math.isnan(unrest[k])]
    return {
        "steps_for_1_percent": sum(int(factorisations[k]) for k in sheared) if len(factorisations) else "",
        "cpu_s_measured": cost["cpu_s"], "unbalanced_mean": sum(unrest[k] for k in sheared) / len(sheared) if sheared else "",
        "strain_reached": max(strain, default=0), "cpu_s_before_shear": before["cpu_s"], "memory_MB": cost["memory_MB"],
        "status": cost["trouble"] or "finished",
    }


def strain_rate(settings, inertial):
    middle = (settings["sizes"][0] + settings["sizes"][-1]) / 2
    return inertial / (middle * math.sqrt(settings["density"] / settings["pressure"]))


def of_yade(folder, limit, shape, modulus, inertial, grains):
    """Spheres or clumps; to 1 % up to WHOLE grains, over SHORT beyond that."""
    whole = grains <= WHOLE
    settings = triaxial.settings(0.01 if whole else SHORT, shape, modulus, inertial) | {"grains": grains, "most": 200}
    settings["rows"] = 40 if whole else 1
    cost = measured_yade(folder, os.path.join(HERE, "yade_triaxial.py"), settings, limit)
    found = cost["answer"]
    if not found or not found["rows"]:
        return {"memory_MB": cost["memory_MB"], "status": cost["trouble"] or "did not consolidate"}
    rows = found["rows"]
    probe = next((row for row in rows if row["steps"] >= PROBE), rows[-1])
    steps, seconds = 0.01 / (strain_rate(settings, inertial) * probe["dt"]), probe["cpu_s"] / probe["steps"]
    row = {
        "step_s": probe["dt"], "steps_for_1_percent": steps, "cpu_s_per_step": seconds, "cpu_s_product": steps * seconds,
        "strain_reached": rows[-1]["strain"], "cpu_s_before_shear": found["consolidation_s"],
        "steps_before_shear": found["consolidation_steps"], "memory_MB": cost["memory_MB"],
        "status": "finished" if found["carrying"] > grains / 2 else f"{found['carrying']} grains carry",
    }
    if whole:
        share = 0.01 / rows[-1]["strain"]
        row |= {"steps_measured": found["shear_steps"] * share, "cpu_s_measured": found["shear_s"] * share,
                "unbalanced_mean": sum(row["unbalanced"] for row in rows) / len(rows)}
    return row


def of_polyhedra(folder, limit, modulus, inertial, grains):
    """YADE's polyhedra: to 1 % or as far as the CPU time of yade_polyhedra.py's settings allows."""
    settle, shear = ALLOWED.get(grains, (60, 20))
    settings = triaxial.settings(0.01, "polyhedra", modulus, inertial) | {"grains": grains, "settle_s": settle, "shear_s": shear}
    if "POISSON" in os.environ:
        settings["poisson"] = float(os.environ["POISSON"])
    cost = measured_yade(folder, os.path.join(HERE, "yade_polyhedra.py"), settings, 3 * limit)
    found = cost["answer"]
    if not found:
        return {"memory_MB": cost["memory_MB"], "status": cost["trouble"]}
    seconds, steps, reached = found["shear_s"] / found["shear_steps"], 0.01 / (found["rate"] * found["dt"]), found["rows"][-1]["strain"]
    mean = sum(row["unbalanced"] for row in found["rows"]) / len(found["rows"])
    status = found["status"] + (f", poisson {settings['poisson']}" if "poisson" in settings else "")
    return {
        "step_s": found["dt"], "steps_for_1_percent": steps, "cpu_s_per_step": seconds, "cpu_s_product": steps * seconds,
        "cpu_s_measured": found["shear_s"] * 0.01 / reached if reached > 0.0099 else "", "unbalanced_mean": mean,
        "unbalanced_end": found["rows"][-1]["unbalanced"],
        "strain_reached": reached, "cpu_s_before_shear": found["before_s"], "steps_before_shear": found["before_steps"],
        "unbalanced_before_shear": found["unbalanced_before"], "memory_MB": cost["memory_MB"], "status": status,
    }


def text(value):
    return f"{value:.4g}" if isinstance(value, float) else value


def main():
    program, out, *wanted = sys.argv[1:]
    program, limit = os.path.abspath(program), float(os.environ.get("LIMIT", "900"))
    os.makedirs(out, exist_ok=True)
    path = os.path.join(out, "sizes.csv")
    if not os.path.exists(path):
        with open(path, "w", newline="") as stream:
            csv.writer(stream, lineterminator="\n").writerow(HEAD)
    for kind in wanted or SIZES:
        for grains in (int(n) for n in chosen("GRAINS", SIZES[kind])):
            for modulus in chosen("MODULUS", MODULI[kind]):
                numbers = {"riprap": [None], "polyhedra": INERTIAL[:1]}.get(kind, chosen("INERTIAL", INERTIAL))
                # Nothing but the number of steps hangs on the inertial number.
                for inertial in numbers if grains <= WHOLE else numbers[-1:]:
                    with tempfile.TemporaryDirectory() as folder:
                        if kind == "riprap":
                            row = of_riprap(program, folder, limit, grains)
                        elif kind == "polyhedra":
                            row = of_polyhedra(folder, limit, modulus, inertial, grains)
                        else:
                            row = of_yade(folder, limit, kind, modulus, inertial, grains)
                    row |= {"code": "riprap" if kind == "riprap" else "YADE", "grain": "polyhedra" if kind == "riprap" else kind,
                            "modulus": modulus, "inertial_number": inertial or "", "grains": grains}
                    with open(path, "a", newline="") as stream:
                        csv.writer(stream, lineterminator="\n").writerow([text(row.get(name, "")) for name in HEAD])
                    print({name: text(value) for name, value in row.items()}, flush=True)


if __name__ == "__main__":
    main()
