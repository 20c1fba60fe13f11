#!/usr/bin/env python3
"""One row a run: what a call of each kernel and an increment took, in CPU time, from what `riprap run --profile --progress json` says.

    TIMEFORMAT='%U %R'; { time riprap run CASE --profile --progress json > N.jsonl 2> N.log; } 2> N.time
    benchmarks/scaling/collect.py N.jsonl ... > scaling.csv        # N: the number of grains; N.log and N.time stand beside

The profile's wall times are scaled by the process's CPU time over its wall time: on a busy machine one thread waits for the others.
"""

import csv
import json
import pathlib
import re
import sys

KERNELS = ["search", "contacts", "residual", "tangents", "assembly", "cover", "ordering", "factor", "solve"]
ANSI = re.compile(r"\x1b\[[0-9;]*m")


def profile_of(text):
    """Calls and seconds by name."""
    lines = re.findall(r"^ *(\w+) +(\d+) +([\d.]+) +[\d.]+ +[\d.]+$", ANSI.sub("", text), re.MULTILINE)
    return {name: (int(calls), float(seconds)) for name, calls, seconds in lines}


def events_of(path):
    for line in path.read_text().splitlines():
        if line.startswith("{"):
            yield json.loads(line)


def row_of(path):
    profile = profile_of(path.with_suffix(".log").read_text())
    cpu, wall = map(float, path.with_suffix(".time").read_text().split()[-2:])
    share = min(1.0, cpu / wall)
    events = list(events_of(path))
    row = {"grains": path.stem, "cpu_s": cpu, "wall_s": wall}
    for event in events:
        if event["event"] == "seated":
            row["seating_factorisations"] = event["factorisations"]
            row["seating_steps"] = event.get("falling_steps", 0)
    if "seating" in profile:
        row["seating_cpu_s"] = share * profile["seating"][1]
    for kind in ["consolidate", "shear"]:
        own = [event for event in events if event["event"] == "increment" and event["kind"] == kind]
        if own:
            row[f"{kind}_increments"] = len(own)
            row[f"{kind}_factorisations"] = sum(event["factorisations"] for event in own)
            row[f"{kind}_cpu_s"] = share * sum(event["seconds"] for event in own)
    for kernel in KERNELS:
        calls, seconds = profile[kernel]
        row[f"{kernel}_calls"] = calls
        if calls > 0:
            row[f"{kernel}_ms"] = 1e3 * share * seconds / calls
    return row


def main():
    rows = sorted((row_of(pathlib.Path(name)) for name in sys.argv[1:]), key=lambda row: int(row["grains"]))
    columns = list(dict.fromkeys(column for row in rows for column in row))
    table = csv.DictWriter(sys.stdout, columns, lineterminator="\n")
    table.writeheader()
    for row in rows:
        table.writerow({name: f"{value:.4g}" if isinstance(value, float) else value for name, value in row.items()})


if __name__ == "__main__":
    main()
