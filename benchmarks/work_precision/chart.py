#!/usr/bin/env python3
"""Errors of the recorded runs against their scene's reference, and a chart of cost against error.

    benchmarks/work_precision/chart.py RECORDS --out chart.svg

RECORDS holds runs.csv, curves.csv and forces.csv of run.py, which says what the reference of each scene is. Errors, relative:

- q, volume strain, of the disc the plate's force: root mean square over the last stage, at the strains of the run, over the reference's
  largest value; mean q: the mean over the stage, over the reference's;
- contact forces: root of the summed squared differences of the force between each pair of bodies behind the last
  stage, over the root of the reference's squares;
- dissipation: friction work, over the reference's.

What is next to the reference in increments, tolerance and mesh is a dashed line: how well the reference itself is known. Of several packings: the mean
error and the mean cost (without making the specimen). Writes errors.csv beside the records (or reads it where there is no forces.csv), and prints the front of each scene.
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
REFERENCE, NEXT = "reference", "next to the reference"
ERRORS = ["q", "mean q", "volume strain", "contact forces", "dissipation"]

NAMES = {("disc", "q"): "the plate's force"}
TITLES = {"hertz": "two balls", "pile": "pile of six boxes", "wedge": "wedge between walls", "disc": "disc that breaks",
          "specimen_20": "20 grains to 0.2 %", "specimen_60": "60 grains to 1 %", "specimen_300": "300 grains to 1 %"}


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


def mean_error(rows, reference, column):
    """Of the mean over what both runs have of the last stage's strain."""
    (e, y), (e0, y0) = (shear(of, "axial_strain", column) for of in (rows, reference))
    mean = numpy.trapezoid(numpy.interp(e, e0, y0), e)
    return abs(numpy.trapezoid(y, e) / mean - 1)


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


def is_of(variant, name):
    return variant.split(", ", 1)[1] == name


def recorded(folder):
    """The errors that were written before, where the forces that they come from (megabytes) were not kept."""
    rows = read(os.path.join(folder, "errors.csv"))
    numbers = ("cpu_s", *ERRORS)
    return [{k: float(v) if k in numbers and v != "" else v for k, v in row.items()} for row in rows]


def errors_of(folder):
    if not os.path.exists(os.path.join(folder, "forces.csv")):
        return recorded(folder)
    runs, curves, forces = (grouped(read(os.path.join(folder, name + ".csv"))) for name in ("runs", "curves", "forces"))
    bases = {key[:2]: key for key, [run] in runs.items() if is_of(key[2], REFERENCE) and run["status"] == "finished"}
    found = []
    for key, [run] in runs.items():
        base = bases.get(key[:2])
        if base is None:
            continue
        row = {k: run[k] for k in ("scene", "seed", "variant", "fidelity", "status", "factorisations")}
        row["cpu_s"] = float(run["cpu_s"]) - float(run["cpu_specimen_s"])
        row.update({name: "" for name in ERRORS})
        if run["status"] == "finished":
            if key in curves:
                row["q"] = shear_error(curves[key], curves[base], "deviatoric_stress_Pa")
                row["mean q"] = mean_error(curves[key], curves[base], "deviatoric_stress_Pa")
                if curves[key][0]["volumetric_strain"]:
                    row["volume strain"] = shear_error(curves[key], curves[base], "volumetric_strain")
            if key in forces:
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
        if row[error] != "" and not is_of(row["variant"], REFERENCE):
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
        wanted = ["q"] if scene == "disc" else ["q", "contact forces"] if scene.startswith("specimen") else ["contact forces"]
        of_scene = [row for row in rows if row["scene"] == scene]
        panels += [(scene, error) for error in wanted if means(of_scene, error)]
    across = 2 if len(panels) == 4 else min(3, len(panels))
    down = -(-len(panels) // across)
    plt.rcParams.update({"font.size": 8, "axes.spines.top": False, "axes.spines.right": False,
                         "svg.hashsalt": "work_precision"})
    figure, axes = plt.subplots(down, across, figsize=(4.0 * across, 3.3 * down), squeeze=False)
    for axis, (scene, error) in zip(axes.flat, panels):
        points = means([row for row in rows if row["scene"] == scene], error)
        least = 1e-6
        near = [value for variant, _, _, value in points if is_of(variant, NEXT)]
        points = [point for point in points if not is_of(point[0], NEXT)]
        for value in near:
            axis.axhline(max(value, least), color="#777777", lw=0.8, ls="--")
        for variant, fidelity, cost, value in points:
            colour, marker = LOOKS[fidelity]
            is_default = variant.endswith(", default")
            axis.plot(cost, max(value, least), marker, color=colour, ms=8 if is_default else 4.5,
                      mfc=colour if is_default else "none")
        best = front(points)
        print(scene, error, *(f"{p[0]} {p[2]:.1f} s {p[3]:.2g};" for p in best), "next", *(f"{value:.2g}" for value in near))
        axis.plot([p[2] for p in best], [max(p[3], least) for p in best], "-", color="#777777", lw=0.8, zorder=0)
        named = numpy.inf
        for variant, _, cost, value in best:
            if value > 0.8 * named:
                continue  # No better than the one named last, to the eye.
            named = value
            axis.annotate(variant.split(", ", 1)[1], (cost, max(value, least)), xytext=(4, 3), textcoords="offset points",
                          fontsize=6, color="#444444")
        axis.set(xscale="log", yscale="log", xlabel="CPU time, one thread [s]",
                 ylabel=f"error in {NAMES.get((scene, error), error)}, relative [-]", title=TITLES[scene])
        axis.xaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
        axis.grid(True, which="major", color="#e4e4e4", lw=0.6)
    for axis in axes.flat[len(panels):]:
        axis.axis("off")
    handles = [plt.Line2D([], [], color=c, marker=m, ls="", label=f) for f, (c, m) in LOOKS.items()]
    figure.legend(handles=handles, ncols=4, loc="lower center", frameon=False)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    figure.savefig(given.out, metadata={"Date": None} if given.out.endswith(".svg") else None)


if __name__ == "__main__":
    main()
