#!/usr/bin/env python3
"""The same problems by riprap and by what users would pick: CPU time, memory and error.

    benchmarks/peers/run.py RIPRAP OUT [hertz block pile_closed pile_gapped stack wedge arch disc triaxial triaxial_5]

Needs numpy, scipy and h5py. CalculiX (`ccx`) and YADE (`yade`) are taken from the path, ipctk from python's modules.
Codes that are not there are left out, and named in OUT/versions.txt.
Runs go one after the other, each on one thread and for at most LIMIT seconds (environment, 300), REPEAT times (3).
CODES (environment, names with commas between) leaves out all others.
OUT/runs.csv has a row a run, appended to where it exists. chart.py draws it. Each problem's module says what is asked and how
its error is meant.
"""

import csv
import importlib.metadata
import os
import subprocess
import sys
import tempfile

import block
import codes
import disc
import hertz
import limits
import pile
import triaxial

HEAD = ["problem", "code", "setting", "unknowns", "repetition", "cpu_s", "memory_MB", "value", "answer", "answer_by", "error", "status"]
PROBLEMS = {
    "hertz": hertz.rows,
    "block": block.rows,
    "pile_closed": lambda *all: pile.rows(*all, "closed"),
    "pile_gapped": lambda *all: pile.rows(*all, "gapped"),
    "stack": lambda *all: limits.rows(*all, "stack"),
    "wedge": lambda *all: limits.rows(*all, "wedge"),
    "arch": lambda *all: limits.rows(*all, "arch"),
    "disc": disc.rows,
    "triaxial": lambda *all: triaxial.rows(*all, 0.01),
    "triaxial_5": lambda *all: triaxial.rows(*all, 0.05),
}


def said(command):
    try:
        return subprocess.run(command, capture_output=True, text=True).stdout.strip()
    except OSError:
        return "not installed"


def version(module):
    try:
        return importlib.metadata.version(module)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def main():
    program, out, *wanted = sys.argv[1:]
    program, limit, repeat = os.path.abspath(program), float(os.environ.get("LIMIT", "300")), int(os.environ.get("REPEAT", "3"))
    os.makedirs(out, exist_ok=True)
    has = codes.installed()
    with open(os.path.join(out, "versions.txt"), "w") as stream:
        stream.write(said([program, "--version"]) + "\n")
        stream.write("CalculiX: " + (said(["ccx", "-v"]) if has["CalculiX"] else "not installed") + "\n")
        stream.write((said(["yade", "--version"]) if has["YADE"] else "YADE: not installed") + "\n")
        for module in ("ipctk", "numpy", "scipy"):
            stream.write(f"{module}: {version(module)}\n")
        stream.write("not installed: " + ", ".join(name for name, here in has.items() if not here) + "\n")
    path = os.path.join(out, "runs.csv")
    if not os.path.exists(path):
        with open(path, "w", newline="") as stream:
            csv.writer(stream).writerow(HEAD)
    chosen = os.environ.get("CODES", ",".join(has)).split(",")
    has = {name: here and name in chosen for name, here in has.items()}
    for problem in wanted or PROBLEMS:
        for repetition in range(1, repeat + 1):
            with tempfile.TemporaryDirectory() as folder:
                for code, setting, unknowns, cost, value, answer, by in PROBLEMS[problem](program, folder, limit, has):
                    error = "" if value is None or not answer else f"{value / answer - 1:.4g}"
                    row = [problem, code, setting, unknowns, repetition, f"{cost['cpu_s']:.2f}", f"{cost['memory_MB']:.0f}",
                           "" if value is None else f"{value:.7g}", "" if answer is None else f"{answer:.7g}", by, error,
                           cost["trouble"] or "finished"]
                    with open(path, "a", newline="") as stream:
                        csv.writer(stream).writerow(row)
                    print(*row, flush=True)


if __name__ == "__main__":
    main()
