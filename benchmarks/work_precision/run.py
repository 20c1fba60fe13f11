#!/usr/bin/env python3
"""Runs the scenes of this folder in many settings and records what each cost and what came out.

    benchmarks/work_precision/run.py RIPRAP OUT [SCENE ...]

Every run is one process on one thread; its cost is the CPU time of that process (the machine may be shared, wall times are
recorded beside it). cpu_specimen_s is the part of it that made the specimen, by its share of the wall time in the run's own profile.

SEEDS="1 2" runs a specimen with these seeds, ONLY="rigid,condensed reference" runs these fidelities or runs alone, LIMIT=600 ends a run
after so many seconds, SET="/stages/1/axial_strain=0.02" changes the case of every run.

OUT gets, appended to where they exist: runs.csv (one row a run), curves.csv (one row an increment of a specimen; of the disc the plate's
way [m] and force [N] in the place of strain and stress), forces.csv (one row a pair of bodies: the force between them behind each stage).
No errors: chart.py has those.
"""

import csv
import os
import resource
import subprocess
import sys
import tempfile
import time

import h5py
import numpy

HERE = os.path.dirname(os.path.abspath(__file__))
RUNS = ["scene", "variant", "seed", "fidelity", "cpu_s", "cpu_specimen_s", "wall_s", "status", "increments",
        "augmentations", "newton_iterations", "factorisations", "cuts", "external_work_J", "friction_J", "elastic_J",
        "energy_error_J"]
CURVES = ["scene", "variant", "seed", "stage", "axial_strain", "deviatoric_stress_Pa", "volumetric_strain", "friction_J"]
FORCES = ["scene", "variant", "seed", "stage", "body_a", "body_b", "x_N", "y_N", "z_N"]

# What is varied around the default. "increments": a factor on the number of increments of each stage.
INCREMENTS = {"default": {}} | {f"increments x{k}": {"increments": k} for k in (0.5, 2, 4)}
TOLERANCES = {f"force tolerance {t}": {"/solver/force_tolerance": float(t)} for t in ("1e-2", "1e-4")}
GAPS = {f"gap tolerance {t}": {"/solver/gap_tolerance": float(t)} for t in ("1e-4", "1e-7")}
UNREST = {f"unrest {u}": {"/solver/stabilisation": float(u)} for u in ("3e-2", "1e-2", "1e-3")}
STRICT = {"/solver/stabilisation": "null"}
CHOSEN = {f"accuracy {a}": {"/solver/accuracy": a} for a in (0.02, 0.05, 0.1)}
CELLS = {f"{n} cells": {"/specimen/cells_per_grain": n} for n in (12, 100, 250)}
MESHES = {f"cells of {size} mm": {"/scene/bodies/1/mesh_size": f"{size} mm"} for size in (12, 10, 9, 7)}
# The disc's rock with a fracture energy, which does not take the mesh out of its peak.
ENERGY = {"/rock/damage/fracture_energy": 100}
SCENE = {"increments": 4, "/solver/force_tolerance": 1e-5, "/solver/gap_tolerance": 1e-8}
# The converged run of a scene, and the one next to it in every respect: their difference is the reference's own error.
# The disc's peak is the same to 3 % on cells of 16 to 9 mm (benchmarks/runs/2026-11-30-broken-disc).
REFERENCES = {
    "scene": ("full", {"reference": SCENE, "next to the reference": SCENE | {"increments": 2}}),
    "disc": ("condensed", {"reference": MESHES["cells of 9 mm"], "next to the reference": MESHES["cells of 10 mm"]}),
    "specimen": ("condensed", {
        "reference": STRICT | {"increments": 4} | CELLS["250 cells"],
        "next to the reference": STRICT | {"increments": 2} | CELLS["100 cells"],
    }),
}


def plan(scene):
    """(fidelity, variant, settings) of a scene; the converged reference first."""
    kind = scene if scene in REFERENCES else scene.split("_")[0]
    fidelity, references = REFERENCES.get(kind, REFERENCES["scene"])
    yield from ((fidelity, name, settings) for name, settings in references.items())
    if kind == "specimen":
        unrest = UNREST | {"strict": STRICT}
        yield "full", "default", {}
        yield from (("condensed", name, settings) for name, settings in {**INCREMENTS, **unrest, **CELLS}.items())
        yield from (("rigid", name, settings) for name, settings in {**INCREMENTS, **unrest}.items())
    elif kind == "disc":
        others = {name: MESHES[name] for name in MESHES if MESHES[name] not in references.values()}
        tough = {"100 J/m2": ENERGY} | {f"100 J/m2 on {name}": settings | ENERGY for name, settings in MESHES.items()}
        yield from (("condensed", name, settings) for name, settings in {**INCREMENTS, **others, **tough}.items())
        return
    else:
        for fidelity in ("full", "condensed", "rigid"):
            gaps = GAPS if fidelity == "condensed" else {}
            yield from ((fidelity, name, settings) for name, settings in {**INCREMENTS, **TOLERANCES, **gaps}.items())
    yield from (("auto", name, settings) for name, settings in CHOSEN.items())


def increments_of(scene, factor):
    """Overrides that multiply the increments of every stage."""
    import json
    import re

    text = open(os.path.join(HERE, "cases", scene + ".json")).read()
    case = json.loads(re.sub(r"^\s*//.*$", "", text, flags=re.M))
    for k, stage in enumerate(case["stages"]):
        if "increments" in stage:
            yield f"/stages/{k}/increments={max(1, round(factor * stage['increments']))}"
        else:
            yield f"/stages/{k}/increment={stage['increment'] / factor}"


def measured(command):
    """CPU and wall seconds of a process, and its exit code."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.time()
    code = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, time.time() - begun, code


def append(path, head, rows):
    fresh = not os.path.exists(path)
    with open(path, "a", newline="") as stream:
        table = csv.writer(stream)
        if fresh:
            table.writerow(head)
        table.writerows(rows)


def record(out, scene, fidelity, variant, seed, cost, path):
    name = f"{fidelity}, {variant}"
    key = [scene, name, seed]
    cpu, wall, code = cost
    if not os.path.exists(path):
        append(os.path.join(out, "runs.csv"), RUNS, [[*key, fidelity, cpu, 0, wall, f"exit {code}"] + [""] * 9])
        return
    with h5py.File(path) as file:
        history = {k: v[:] for k, v in file["history"].items()}
        stage = history["stage"].astype(int)
        parts = {k[:-8]: v[0] for k, v in file.get("profile", {}).items() if k.endswith("_seconds")}
        parts = {k: v for k, v in parts.items() if not k.startswith("kernel_")}
        specimen = cpu * parts.get("specimen", 0) / sum(parts.values()) if parts else 0.0
        total = [int(history[k].sum()) for k in ("augmentations", "newton_iterations", "factorisations", "cuts")]
        last = [history["energy_" + k][-1] if len(stage) else numpy.nan for k in ("external", "friction", "elastic", "error")]
        status = "finished" if code == 0 else f"exit {code}"
        append(os.path.join(out, "runs.csv"), RUNS, [
            [*key, fidelity, f"{cpu:.3f}", f"{specimen:.3f}", f"{wall:.2f}", status, len(stage), *total,
             *(f"{x:.8g}" for x in last)]])
        if scene.startswith("specimen"):
            columns = ("stage", "axial_strain", "deviatoric_stress", "volumetric_strain", "energy_friction")
            append(os.path.join(out, "curves.csv"), CURVES,
                   [[*key, int(row[0]), *(f"{x:.8g}" for x in row[1:])] for row in zip(*(history[k] for k in columns))])
        if scene == "disc":
            way, force = (numpy.abs(file[f"bodies/top/{what}"][:, 2]) for what in ("displacement", "force"))
            append(os.path.join(out, "curves.csv"), CURVES,
                   [[*key, 0, f"{d:.8g}", f"{f:.8g}", "", ""] for d, f in zip(way, force)])
            return
        shown = sorted(int(k) for k in file["contacts"])
        for number in sorted(set(stage)):
            of_stage = numpy.flatnonzero(stage == number)[-1] + 1
            kept = [k for k in shown if k <= of_stage]
            contacts = file[f"contacts/{kept[-1]}"]
            pairs = {}
            for a, b, force in zip(contacts["body_a"][:], contacts["body_b"][:], contacts["force"][:]):
                pairs[a, b] = pairs.get((a, b), 0) + force
            append(os.path.join(out, "forces.csv"), FORCES,
                   [[*key, number, a, b, *(f"{x:.8g}" for x in f)] for (a, b), f in sorted(pairs.items())])


def main():
    program, out, *scenes = sys.argv[1:]
    scenes = scenes or ["hertz", "pile", "wedge", "disc", "specimen_20", "specimen_60", "specimen_300"]
    seeds = [int(s) for s in os.environ.get("SEEDS", "1").split()]
    os.makedirs(out, exist_ok=True)
    for scene in scenes:
        case = os.path.join(HERE, "cases", scene + ".json")
        for seed in seeds if scene.startswith("specimen") else [1]:
            with tempfile.TemporaryDirectory() as folder:
                only = os.environ.get("ONLY", "full,condensed,rigid,auto").split(",")
                wanted = [row for row in plan(scene) if row[0] in only or f"{row[0]} {row[1]}" in only]
                for fidelity, variant, settings in wanted:
                    path = os.path.join(folder, "run.vtkhdf")
                    if os.path.exists(path):
                        os.remove(path)
                    sets = [f"/seed={seed}"] + os.environ.get("SET", "").split()
                    for key, value in settings.items():
                        sets += increments_of(scene, value) if key == "increments" else [f"{key}={value}"]
                    command = ["timeout", os.environ.get("LIMIT", "600"), program, "run", case, "--out", path]
                    command += ["--fidelity", fidelity, "--threads", "1", "--quiet", "--profile"]
                    command += [word for s in sets for word in ("--set", s)]
                    cpu, wall, code = measured(command)
                    record(out, scene, fidelity, variant, seed, (cpu, wall, code), path)
                    print(scene, seed, fidelity, variant, f"{cpu:.1f} s, exit {code}", flush=True)


if __name__ == "__main__":
    main()
