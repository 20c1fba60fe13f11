#!/usr/bin/env python3
"""Errors of the recorded runs against their scene's reference, and a chart of cost against error.

    benchmarks/work_precision/chart.py RECORDS --out chart.svg

RECORDS holds runs.csv, curves.csv and forces.csv of run.py. The reference of a scene is its run "full, reference" (four times
the increments, force tolerance 1e-5). Errors, relative:

- q, volume strain: root mean square over the shear stage, at the strains of the run, over the reference's largest value;
- contact forces: root of the summed squared differences of the force between each pair of bodies behind the last
  stage, over the root of the reference's squares;
- dissipation: friction work, over the reference's.

Writes errors.csv beside the records. Of several seeds: the mean error and the mean cost (without making the specimen).
"""

import argparse
import csv
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy

# Okabe & Ito (2008), told apart by marker as well.
LOOKS = {"rigid": ("#0072B2", "o"), "condensed": ("#D55E00", "s"), "full": ("#009E73", "^"), "auto": ("#CC79A7", "D")}
REFERENCE = "full, reference"
ERRORS = ["q", "volume strain", "contact forces", "dissipation"]


def read(path):
    if not os.path.exists(path):
        return []
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


def grouped(rows):
    groups = {}
    for row in rows:
        groups.setdefault((row["scene"], row["seed"], row["variant"]), []).append(row)
    return groups


def shear(rows, *columns):
    """Columns of the last stage."""
    last = max(int(r["stage"]) for r in rows)
    rows = [r for r in rows if int(r["stage"]) == last]
    return [numpy.array([float(r[k]) for r in rows]) for k in columns]


def shear_error(rows, reference, column):
    (e, y), (e0, y0) = (shear(of, "axial_strain", column) for of in (rows, reference))
    return numpy.sqrt(numpy.mean((y - numpy.interp(e, e0, y0)) ** 2)) / numpy.abs(y0).max()


def force_error(rows, reference):
    def forces(rows):
        last = max(int(r["stage"]) for r in rows)
        pairs = {}
        for r in rows:
            if int(r["stage"]) == last:
                pairs[r["body_a"], r["body_b"]] = numpy.array([float(r[k]) for k in ("x_N", "y_N", "z_N")])
        return pairs
    f, f0 = forces(rows), forces(reference)
    zero = numpy.zeros(3)
    square = sum(numpy.sum((f.get(k, zero) - f0.get(k, zero)) ** 2) for k in f.keys() | f0.keys())
    return numpy.sqrt(square / sum(numpy.sum(v ** 2) for v in f0.values()))


def errors_of(folder):
    runs = grouped(read(os.path.join(folder, "runs.csv")))
    curves = grouped(read(os.path.join(folder, "curves.csv")))
    forces = grouped(read(os.path.join(folder, "forces.csv")))
    found = []
    for (scene, seed, variant), [run] in runs.items():
        key, base = (scene, seed, variant), (scene, seed, REFERENCE)
        if base not in runs or runs[base][0]["status"] != "finished":
            continue
        row = {k: run[k] for k in ("scene", "seed", "variant", "fidelity", "status", "factorisations")}
        row["cpu_s"] = float(run["cpu_s"]) - float(run["cpu_specimen_s"])
        row.update({name: "" for name in ERRORS})
        if run["status"] == "finished":
            if key in curves:
                row["q"] = shear_error(curves[key], curves[base], "deviatoric_stress_Pa")
                row["volume strain"] = shear_error(curves[key], curves[base], "volumetric_strain")
            row["contact forces"] = force_error(forces[key], forces[base])
            work = float(runs[base][0]["friction_J"])
            if work > 1e-9 * float(runs[base][0]["external_work_J"]):
                row["dissipation"] = abs(float(run["friction_J"]) / work - 1)
        found.append(row)
    with open(os.path.join(folder, "errors.csv"), "w", newline="") as stream:
        table = csv.DictWriter(stream, list(found[0]))
        table.writeheader()
        table.writerows({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()} for row in found)
    return found


def means(rows, error):
    """(variant, fidelity, cost, error), each the mean over seeds."""
    groups = {}
    for row in rows:
        if row[error] != "" and row["variant"] != REFERENCE:
            groups.setdefault((row["variant"], row["fidelity"]), []).append((row["cpu_s"], row[error]))
    return [(*key, *numpy.mean(values, axis=0)) for key, values in groups.items()]


def front(points):
    """Points that none beats in both."""
    best, kept = numpy.inf, []
    for point in sorted(points, key=lambda p: (p[2], p[3])):
        if point[3] < best:
            best = point[3]
            kept.append(point)
    return kept


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("records")
    parser.add_argument("--out", required=True)
    given = parser.parse_args()
    rows = errors_of(given.records)
    panels = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        wanted = ["q", "contact forces"] if scene.startswith("specimen") else ["contact forces"]
        panels += [(scene, error) for error in wanted]
    across = 2 if len(panels) == 4 else min(3, len(panels))
    down = -(-len(panels) // across)
    plt.rcParams.update({"font.size": 8, "axes.spines.top": False, "axes.spines.right": False,
                         "svg.hashsalt": "work_precision"})
    figure, axes = plt.subplots(down, across, figsize=(4.0 * across, 3.3 * down), squeeze=False)
    for axis, (scene, error) in zip(axes.flat, panels):
        points = means([row for row in rows if row["scene"] == scene], error)
        least = 1e-6
        for variant, fidelity, cost, value in points:
            colour, marker = LOOKS[fidelity]
            is_default = variant.endswith(", default")
            axis.plot(cost, max(value, least), marker, color=colour, ms=8 if is_default else 4.5,
                      mfc=colour if is_default else "none")
        best = front(points)
        axis.plot([p[2] for p in best], [max(p[3], least) for p in best], "-", color="#777777", lw=0.8, zorder=0)
        named = numpy.inf
        for variant, _, cost, value in best:
            if value > 0.8 * named:
                continue  # No better than the one named last, to the eye.
            named = value
            axis.annotate(variant.split(", ")[1], (cost, max(value, least)), xytext=(4, 3), textcoords="offset points",
                          fontsize=6, color="#444444")
        axis.set(xscale="log", yscale="log", xlabel="CPU time, one thread [s]",
                 ylabel=f"error in {error}, relative [-]", title=scene.replace("_", " "))
        axis.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        axis.grid(True, which="major", color="#e4e4e4", lw=0.6)
    for axis in axes.flat[len(panels):]:
        axis.axis("off")
    handles = [plt.Line2D([], [], color=c, marker=m, ls="", label=f) for f, (c, m) in LOOKS.items()]
    figure.legend(handles=handles, ncols=3, loc="lower center", frameon=False)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    figure.savefig(given.out, metadata={"Date": None} if given.out.endswith(".svg") else None)


if __name__ == "__main__":
    main()
