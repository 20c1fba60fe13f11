#!/usr/bin/env python3
"""Large strains: what a setting does to the means of several packings, beside what chance does.

    benchmarks/work_precision/bands.py RECORDS ... --out chart.svg [--scene specimen_60_deep] [--settings NAME ...] [--to 0.02]

RECORDS hold runs.csv and curves.csv of run.py; of several folders the packings are taken together, and of the settings those named (or all);
--to leaves out what lies behind that axial strain. Behind the first snap that goes another way single runs part for good, so each packing's run is
compared with the same packing's reference ("full, reference") by its mean of q over the shear and its friction work, over the means of the references,
and by its last volume strain, over the axial strain. A setting's error is the mean over packings (bars: standard error); chance is the reference at half the force
tolerance. Also printed: the strain to which q stays within 1 % of the reference's largest. Writes bands.csv beside the chart, and prints a table
and how much more deforming grains (condensed) dilate than full ones, packing by packing.
"""

import argparse
import csv
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import matplotlib.ticker
import numpy

from chart import LOOKS, REFERENCE, front, grouped, read, shear

CHANCE = "full, tolerance halved"
MEASURES = ["q", "volume strain", "friction"]
PARTED = 0.01
COLUMNS = ["axial_strain", "deviatoric_stress_Pa", "volumetric_strain", "friction_J"]
# What is varied, by the name of a setting.
WORDS = {"default": "2e-4", "increments x0.5": "4e-4", "increments x2": "1e-4", "accuracy 0.05": "acc. 0.05", "accuracy 0.1": "acc. 0.1"}


def measured(curve):
    """Mean q over the strain [Pa], last volume strain, friction work of the shear [J]."""
    e, q = curve["axial_strain"], curve["deviatoric_stress_Pa"]
    mean = numpy.trapezoid(q, e) / (e[-1] - e[0])
    return numpy.array([mean, curve["volumetric_strain"][-1], curve["friction_J"][-1] - curve["friction_J"][0]])


def together(curve, reference):
    """Strain to which q is the reference's within PARTED of its largest."""
    e, q, r = curve["axial_strain"], curve["deviatoric_stress_Pa"], reference["deviatoric_stress_Pa"]
    apart = numpy.abs(q - numpy.interp(e, reference["axial_strain"], r)) > PARTED * numpy.abs(r).max()
    return e[numpy.argmax(apart)] if apart.any() else e[-1]


def read_all(folders, name, settings):
    rows = [row for folder in folders for row in read(os.path.join(folder, name))]
    return [row for row in rows if not settings or row["variant"] in settings]


def until(curve, strain):
    """The part of a curve up to an axial strain."""
    kept = curve["axial_strain"] <= strain + 1e-9
    return {name: values[kept] for name, values in curve.items()}


def settings_of(folders, scene, settings, strain):
    """Up to an axial strain, per setting: CPU seconds, mean, standard error and root mean square of relative differences (a number a measure) and strains of parting."""
    runs = {key: rows[0] for key, rows in grouped(read_all(folders, "runs.csv", settings)).items() if key[0] == scene}
    curves = {key: until(dict(zip(COLUMNS, shear(rows, *COLUMNS))), strain) for key, rows in grouped(read_all(folders, "curves.csv", settings)).items() if key[0] == scene}
    done = {key for key, run in runs.items() if run["status"] == "finished"}
    variants = list(dict.fromkeys(variant for _, _, variant in runs))
    # Packings that all settings ran to their end.
    seeds = [s for s in dict.fromkeys(seed for _, seed, _ in runs) if all((scene, s, v) in done for v in variants)]
    if not seeds:
        raise SystemExit(f"{folders}: no packing of {scene} that all of {len(variants)} settings finished")
    base = numpy.mean([measured(curves[scene, s, REFERENCE]) for s in seeds], axis=0)
    base[1] = curves[scene, seeds[0], REFERENCE]["axial_strain"][-1]
    found = {}
    for variant in variants:
        keys = [(scene, s, variant) for s in seeds]
        apart = numpy.array([(measured(curves[k]) - measured(curves[scene, k[1], REFERENCE])) / numpy.abs(base) for k in keys])
        found[variant] = {
            "fidelity": runs[keys[0]]["fidelity"],
            "cpu_s": numpy.mean([float(runs[k]["cpu_s"]) - float(runs[k]["cpu_specimen_s"]) for k in keys]),
            "mean": apart.mean(axis=0),
            "error": apart.std(axis=0, ddof=1) / numpy.sqrt(len(seeds)) if len(seeds) > 1 else numpy.full(len(MEASURES), numpy.nan),
            "apart": apart,
            "single": numpy.sqrt((apart ** 2).mean(axis=0)),
            "together": [together(curves[k], curves[scene, k[1], REFERENCE]) for k in keys],
        }
    return seeds, found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("records", nargs="+")
    parser.add_argument("--out", required=True)
    parser.add_argument("--scene", default="specimen_60_deep")
    parser.add_argument("--settings", nargs="+", default=[])
    parser.add_argument("--to", type=float, default=1.0, help="axial strain up to which runs are compared")
    given = parser.parse_args()
    seeds, found = settings_of(given.records, given.scene, given.settings, given.to)
    count = len(seeds)
    print(f"seeds {', '.join(seeds)}\n")
    print("| setting | CPU s | " + " | ".join(f"{m}, mean (single)" for m in MEASURES) + " | q within 1 % to |")
    print("|---" * (len(MEASURES) + 3) + "|")
    with open(os.path.join(os.path.dirname(given.out), "bands.csv"), "w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(["setting", "cpu_s"] + [f"{m} {k}" for m in MEASURES for k in ("mean", "standard error", "rms")])
        for variant, row in found.items():
            mean, error, single = row["mean"], row["error"], row["single"]
            table.writerow([variant, f"{row['cpu_s']:.4g}"] + [f"{x:.4g}" for m in zip(mean, error, single) for x in m])
            spread = [f" ± {100 * b:.1f} ({100 * c:.1f})" if count > 1 else "" for b, c in zip(error, single)]
            cells = [f"{100 * a:+.1f}{apart} %" for a, apart in zip(mean, spread)]
            reach = ", ".join(f"{100 * x:.2f}" for x in row["together"])
            print(f"| {variant} | {row['cpu_s']:.0f} | " + " | ".join(cells) + f" | {reach} % |")
    # Each packing's mean over its condensed runs less that over its full ones: what the reference alone has by chance falls out.
    of = {f: numpy.mean([row["apart"] for row in found.values() if row["fidelity"] == f], axis=0) for f in ("condensed", "full")
          if any(row["fidelity"] == f for row in found.values())}
    if count > 1 and len(of) == 2:
        apart = 100 * (of["condensed"] - of["full"])
        error = apart.std(axis=0, ddof=1) / numpy.sqrt(count)
        for measure, mean, bar, single in zip(MEASURES, apart.mean(axis=0), error, apart.T):
            print(f"\ncondensed less full, {measure}: {mean:+.1f} ± {bar:.1f} % ({', '.join(f'{x:+.1f}' for x in single)})")
    plt.rcParams.update({"font.size": 8, "axes.spines.top": False, "axes.spines.right": False, "svg.hashsalt": "bands"})
    figure, axes = plt.subplots(1, len(MEASURES), figsize=(4.0 * len(MEASURES), 3.4))
    for k, (axis, measure) in enumerate(zip(axes, MEASURES)):
        chance = 100 * found[CHANCE]["single"][k] / numpy.sqrt(count)
        axis.axhspan(-chance, chance, color="#dddddd", zorder=0, label=f"chance over {count} packing{'s' * (count > 1)}")
        points = []
        for variant, row in found.items():
            if variant in (REFERENCE, CHANCE):
                continue
            colour, marker = LOOKS[row["fidelity"]]
            mean, bar = 100 * row["mean"][k], 100 * row["error"][k]
            filled = variant.endswith(", default")
            axis.errorbar(row["cpu_s"], mean, yerr=bar, fmt=marker, color=colour, ms=7 if filled else 5, lw=1, capsize=2,
                          mfc=colour if filled else "white")
            name = variant.split(", ")[1]
            words = WORDS.get(name, name)
            side = 1 if len(points) % 2 else -1
            axis.annotate(words, (row["cpu_s"], mean), xytext=(6 * side, 4), textcoords="offset points", fontsize=7, color=colour,
                          ha="left" if side > 0 else "right")
            points.append((variant, row["fidelity"], row["cpu_s"], abs(mean)))
        best = front(points)
        axis.plot([p[2] for p in best], [100 * found[p[0]]["mean"][k] for p in best], ":", color="#888888", lw=1, zorder=1,
                  label="Pareto front of the size of the mean")
        axis.axhline(0, color="black", lw=0.6)
        axis.set_xscale("log")
        axis.margins(x=0.25)
        axis.xaxis.set_major_formatter(matplotlib.ticker.ScalarFormatter())
        axis.xaxis.set_minor_locator(matplotlib.ticker.LogLocator(subs=(2, 3, 5)))
        axis.xaxis.set_minor_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
        axis.tick_params(axis="x", which="minor", labelsize=7)
        axis.set_xlabel("CPU time of a run [s]")
        axis.set_title(f"{measure} [% of the axial strain]" if k == 1 else f"{measure} [%]")
    axes[0].set_ylabel("mean over packings, off the full reference")
    shown = {row["fidelity"] for row in found.values()}
    for fidelity, (colour, marker) in ((f, look) for f, look in LOOKS.items() if f in shown):
        axes[0].plot([], [], marker, color=colour, label=fidelity)
    axes[0].legend(fontsize=6, frameon=False)
    reach = f" to {100 * given.to:g} %" if given.to < 1 else ""
    figure.suptitle(f"{given.scene}{reach}: {count} packing{'s' * (count > 1)}, against full grains at increments of 1e-4{' (bars: standard error)' * (count > 1)}", fontsize=9)
    figure.tight_layout()
    figure.savefig(given.out)
    figure.savefig(os.path.splitext(given.out)[0] + ".png", dpi=130)


if __name__ == "__main__":
    main()
