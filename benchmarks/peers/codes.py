"""How the codes of this folder are found, run and read.

Every run is one process on one thread. Its cost is its CPU time and its peak resident memory, as the kernel counts them.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time

ONE_THREAD = dict.fromkeys(
    ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "CCX_NPROC_EQUATION_SOLVER", "CCX_NPROC_RESULTS", "RAYON_NUM_THREADS"], "1"
)


def has_module(name):
    import importlib.util

    return importlib.util.find_spec(name) is not None


def installed():
    """Which codes are here. MuJoCo and GetFEM, which the record names, are not run by these scripts."""
    return {
        "riprap": True,
        "CalculiX": shutil.which("ccx") is not None,
        "YADE": shutil.which("yade") is not None,
        "ipctk": has_module("ipctk"),
        "MuJoCo": has_module("mujoco"),
        "GetFEM": has_module("getfem"),
    }


def measured(command, folder, limit, more={}):
    """Runs a command in a folder for at most `limit` seconds, with `more` in its environment.

    Gives the CPU time [s], the peak resident memory [MB], the exit code (-15, of riprap 130: ended by the limit) and what it printed.
    """
    with open(os.path.join(folder, "output.txt"), "w") as stream:
        process = subprocess.Popen(command, cwd=folder, stdout=stream, stderr=subprocess.STDOUT, env={**os.environ, **ONE_THREAD, **more})
        clock = threading.Timer(limit, process.terminate)
        clock.start()
        _, status, usage = os.wait4(process.pid, 0)
        clock.cancel()
    process.returncode = os.waitstatus_to_exitcode(status)
    output = open(os.path.join(folder, "output.txt"), errors="replace").read()
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, process.returncode, output


def calculix(folder, name, deck, limit):
    """Runs a deck; gives cost, the totals of reaction forces by set at each printed time, and what went wrong, if anything."""
    with open(os.path.join(folder, name + ".inp"), "w") as stream:
        stream.write(deck)
    begun = time.time()
    cpu, memory, code, output = measured(["ccx", "-i", name], folder, limit)
    reactions = reaction_totals(os.path.join(folder, name + ".dat"))
    trouble = ""
    if code < 0:
        trouble = f"ended after {time.time() - begun:.0f} s"
    elif code or "*ERROR" in output or "Job finished" not in output:
        trouble = "did not converge" if "increment size smaller than minimum" in output else f"exit {code}"
    return {"cpu_s": cpu, "memory_MB": memory, "trouble": trouble, "reactions": reactions}


def reaction_totals(path):
    """[(set, time, (fx, fy, fz))] of *NODE PRINT ... TOTALS=ONLY in a .dat file."""
    totals = []
    if not os.path.exists(path):
        return totals
    head = re.compile(r"total force \(fx,fy,fz\) for set (\S+) and time\s+(\S+)")
    lines = iter(open(path).read().splitlines())
    for line in lines:
        found = head.search(line)
        if found:
            values = next(row for row in lines if row.strip())
            totals.append((found.group(1), float(found.group(2)), tuple(float(x) for x in values.split())))
    return totals


def potential(folder, name, problem, limit):
    """Runs ipc.py on a problem (arrays by name); gives cost, trouble and the driven freedoms' force after each increment."""
    import numpy

    path, answer = os.path.join(folder, name + ".npz"), os.path.join(folder, name + "_forces.json")
    numpy.savez(path, **problem)
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "ipc.py")
    begun = time.time()
    cpu, memory, code, _ = measured([sys.executable, script, path, answer], folder, limit)
    rows = json.load(open(answer)) if os.path.exists(answer) else []
    trouble = ""
    if code < 0:
        trouble = f"ended after {time.time() - begun:.0f} s at {rows[-1]['share'] if rows else 0:.2f} of the way"
    elif code:
        trouble = f"exit {code}"
    elif not all(row["rest"] for row in rows):
        trouble = f"{sum(not row['rest'] for row in rows)} of {len(rows)} increments did not come to rest"
    return {"cpu_s": cpu, "memory_MB": memory, "trouble": trouble, "rows": rows}


def measured_yade(folder, script, settings, limit):
    """Runs a script of YADE's with settings in its environment; gives cost, trouble and what it wrote, if anything."""
    path = os.path.join(folder, "yade.json")
    if os.path.exists(path):
        os.remove(path)
    given, begun = {"SETTINGS": json.dumps(settings), "ANSWER": path}, time.time()
    cpu, memory, code, _ = measured(["yade", "-n", "-x", "-j1", script], folder, limit, given)
    cost = {"cpu_s": cpu, "memory_MB": memory, "trouble": "", "answer": None}
    if os.path.exists(path):
        return cost | {"answer": json.load(open(path))}
    return cost | {"trouble": f"ended after {time.time() - begun:.0f} s" if code < 0 else f"exit {code}"}


def yade(folder, script, settings, limit):
    """Runs a triaxial test of YADE's; gives the cost of 1 % of strain, trouble and the rows that the script wrote."""
    cost = measured_yade(folder, script, settings, limit)
    found = cost["answer"]
    if not found:
        return cost | {"rows": []}
    memory = cost["memory_MB"]
    cpu = found["shear_s"] * 0.01 / found["rows"][-1]["strain"] if found["rows"] else found["consolidation_s"]
    return {"cpu_s": cpu, "memory_MB": memory, "trouble": "" if found["settled"] else "did not consolidate", "rows": found["rows"]}


def riprap(program, folder, name, case, limit, options=()):
    """Runs a case (an object); gives cost, trouble, the share of the way that it came and the rows of /bodies by name."""
    import h5py

    path, results = os.path.join(folder, name + ".json"), os.path.join(folder, name + ".vtkhdf")
    with open(path, "w") as stream:
        json.dump(case, stream)
    command = [program, "run", path, "--out", results, "--force", "--threads", "1", "--quiet", *options]
    begun = time.time()
    cpu, memory, code, _ = measured(command, folder, limit)
    trouble = ""
    bodies, history, reached = {}, {}, 0.0
    if os.path.exists(results):
        with h5py.File(results, locking=False) as file:
            reached = float(file["history/time"][-1]) / len(case["stages"]) if len(file["history/time"]) else 0.0
            if code:
                trouble = f"stopped by itself at {reached:.2f} of the way"
                if code in (130, -15):
                    trouble = f"ended after {time.time() - begun:.0f} s at {reached:.2f} of the way"
            bodies = {body: {key: rows[:] for key, rows in group.items()} for body, group in file.get("bodies", {}).items()}
            history = {key: rows[:] for key, rows in file["history"].items()}
    elif code:
        trouble = f"exit {code}"
    return {"cpu_s": cpu, "memory_MB": memory, "trouble": trouble, "bodies": bodies, "history": history, "reached": reached}


def riprap_meshes(program, folder, name, case):
    """The tet10 mesh that riprap makes of each body of a scene: {body: (points, cells)}, cells in VTK's order of nodes."""
    import h5py
    import numpy

    case = json.loads(json.dumps(case))
    # Nothing moves: only the meshes of state 0 are wanted.
    case["stages"] = [{"kind": "load", "increments": 1, "bodies": {}}]
    for body in case["scene"]["bodies"]:
        body["fixed"] = True
    path, results = os.path.join(folder, name + ".json"), os.path.join(folder, name + ".vtkhdf")
    with open(path, "w") as stream:
        json.dump(case, stream)
    measured([program, "run", path, "--out", results, "--force", "--threads", "1", "--quiet"], folder, 120)
    with h5py.File(results, locking=False) as file:
        fields = file["VTKHDF"]
        number = fields["NumberOfCells"][0]
        points = fields["Points"][:]
        cells = fields["Connectivity"][: 10 * number].reshape(-1, 10)
        body_of = fields["CellData/grain"][:number].astype(int)
        order = [b["name"] for b in case["scene"]["bodies"]]
    meshes = {}
    for k, body in enumerate(order):
        of_body = cells[body_of == k]
        if len(of_body):
            nodes, local = numpy.unique(of_body, return_inverse=True)
            meshes[body] = (points[nodes], local.reshape(-1, 10))
    return meshes


def read_case(path):
    """A case file without its comments."""
    return json.loads(re.sub(r"(^|\s)//.*$", "", open(path).read(), flags=re.M))
