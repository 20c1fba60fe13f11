#!/usr/bin/env python3
"""Draws survival curves of single grains crushed between plates, with Weibull fits, and strength against size.

    scripts/plot_survival.py cases/crushing/results/survival --out survival.png --table survival.csv

Takes the results files of runs of a press (`scene.press`), or a folder of them, groups them by what stands before the
last underscore of their names (`small_seed3.vtkhdf` and `small_seed=3.vtkhdf` are of `small`), and for each group ranks the strengths

    sigma = F_peak / d^2,    d the distance of the plates at the start, F_peak the largest force on the upper plate

(Jaeger 1967; McDowell & Bolton 1998, "On the micromechanics of crushable aggregates", Geotechnique 48:667-679; Lim,
McDowell & Collop 2004, "The application of Weibull statistics to the strength of railway ballast", Granular Matter 6:229-237).
The i-th weakest of n has the survival probability 1 - i/(n + 1). Weibull's law `exp(-(sigma/sigma_0)^m)` is fitted by maximum
likelihood; intervals are 90 % of a parametric bootstrap. Where m is one number for all sizes and the weakest link rules,
sigma_0 falls with d^(-3/m): that line is drawn beside the fitted one, and that of the modulus of the cells' tensile strength where the case gives
it a `reference_size`. The two differ where the scatter of the grains is that of their shapes.
"""

import argparse
import csv
import glob
import json
import os
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy

from chart_style import COLOURS, STYLE
from riprap_results import Results, ResultsError

BOOTSTRAP = 2000
MARKS = ["o", "s", "^", "D", "v", "P"]


def weibull_fit(strengths):
    """Modulus and scale by maximum likelihood."""
    logs = numpy.log(strengths)
    top = logs.max()

    def excess(m):
        weight = numpy.exp(m * (logs - top))
        return (weight * logs).sum() / weight.sum() - 1 / m - logs.mean()

    low, high = 1e-3, 1e3
    for _ in range(100):
        middle = numpy.sqrt(low * high)
        low, high = (middle, high) if excess(middle) < 0 else (low, middle)
    m = numpy.sqrt(low * high)
    return m, float(numpy.exp(top) * numpy.mean(numpy.exp(m * (logs - top))) ** (1 / m))


def intervals(m, scale, count, random):
    """90 % of refitted samples of the fitted law: (low, high) of modulus and scale."""
    fits = numpy.array([weibull_fit(scale * random.weibull(m, count)) for _ in range(BOOTSTRAP)])
    return numpy.quantile(fits, [0.05, 0.95], axis=0).T


def test_of(path):
    """Peak force [N], distance of the plates at the start [m], travel at the peak [m], whether the run finished, the cells' modulus.

    None where the run has no increments.
    """
    with Results(path) as results:
        case = json.loads(results.file["case/completed"].asstr()[()])
        press = case.get("scene", {}).get("press")
        if press is None:
            raise ResultsError(f"{path}: is no run of a press")
        half = {body["name"]: body["shape"]["box"][2] / 2 for body in case["scene"]["bodies"] if "box" in body["shape"]}
        top, bottom = (results.file[f"bodies/{press[role]}"] for role in ("top", "bottom"))
        force = top["force"][:, 2]
        if not len(force):
            return None
        start = top["position"][0, 2] - top["displacement"][0, 2]
        distance = start - half[press["top"]] - bottom["position"][0, 2] - half[press["bottom"]]
        at = int(numpy.argmax(force))
        law = case["rock"]["tensile_strength"]
        modulus = law.get("weibull_shape") if "reference_size" in law else None
        return float(force[at]), float(distance), float(-top["displacement"][at, 2]), results.status[0] == "finished", modulus


def group_of(name):
    """What a file's name says without its seed or number: `small_seed3`, `small_seed=3` and `small_3` are of `small`, `d=20` stays."""
    return re.sub(r"([_-]?seed[_=-]?|(?<![=.\d])[_-]?)\d+$", "", name) or name


def groups_of(paths):
    files = []
    for path in paths:
        endings = ("*.vtkhdf", "*.h5")
        found = [file for ending in endings for file in glob.glob(os.path.join(path, ending))]
        files += sorted(found) if os.path.isdir(path) else [path]
    groups = {}
    for path in files:
        name = os.path.splitext(os.path.basename(path))[0]
        groups.setdefault(group_of(name), []).append(path)
    if not groups:
        sys.exit("plot_survival.py: no results files")
    return groups


def draw(fits, cells, out):
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.4), layout="constrained", width_ratios=[3, 2])
    for at, fit in enumerate(fits):
        colour, strengths = COLOURS[at % len(COLOURS)], numpy.sort(fit["strengths"]) / 1e6
        survival = 1 - numpy.arange(1, len(strengths) + 1) / (len(strengths) + 1)
        low, high = fit["m_range"]
        label = f"{fit['name']}: d = {1e3 * fit['d']:.1f} mm, m = {fit['m']:.1f} ({low:.1f} to {high:.1f})"
        left.plot(strengths, survival, MARKS[at % len(MARKS)], color=colour, markersize=4.5, label=label)
        x = numpy.linspace(0, 1.05 * strengths.max(), 300)
        left.plot(x, numpy.exp(-((x / (fit["scale"] / 1e6)) ** fit["m"])), color=colour, linewidth=1.4)
    left.set_xlabel("strength $F_{peak}/d^2$ [MPa]")
    left.set_ylabel("survival probability")
    left.set_ylim(0, 1)
    left.set_xlim(left=0)
    left.legend(fontsize=8)
    sizes = numpy.array([1e3 * fit["d"] for fit in fits])
    scales = numpy.array([fit["scale"] / 1e6 for fit in fits])
    errors = numpy.abs(numpy.array([fit["scale_range"] for fit in fits]).T / 1e6 - scales)
    right.errorbar(sizes, scales, yerr=errors, fmt="o", color="#000000", capsize=3, label="$\\sigma_0$, 37 % survive")
    slope = None
    if len(fits) > 1:
        slope, offset = numpy.polyfit(numpy.log(sizes), numpy.log(scales), 1)
        x = numpy.geomspace(0.9 * sizes.min(), 1.1 * sizes.max(), 50)
        right.plot(x, numpy.exp(offset) * x**slope, color=COLOURS[0], label=f"fitted slope {slope:+.2f}")
        mean = numpy.mean([fit["m"] for fit in fits])
        middle = numpy.exp(numpy.log(scales).mean()), numpy.exp(numpy.log(sizes).mean())
        line = middle[0] * (x / middle[1]) ** (-3 / mean)
        right.plot(x, line, color=COLOURS[1], linestyle="--", label=f"$-3/m$ of the curves, {-3 / mean:+.2f}")
        if cells is not None:
            line = middle[0] * (x / middle[1]) ** (-3 / cells)
            right.plot(x, line, color=COLOURS[2], linestyle=":", label=f"$-3/m$ of the cells, {-3 / cells:+.2f}")
        right.set_xscale("log")
        right.set_yscale("log")
        for axis in (right.xaxis, right.yaxis):
            axis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
            axis.set_minor_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
        right.tick_params(axis="both", which="minor", labelsize=8)
    right.set_xlabel("size $d$ [mm]")
    right.set_ylabel("strength [MPa]")
    right.legend(fontsize=8)
    figure.savefig(out, dpi=150)
    plt.close(figure)
    return slope


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", help="results files of runs of a press, or folders of them")
    parser.add_argument("--out", default="survival.png", help="the chart: .png, .svg or .pdf (default: survival.png)")
    parser.add_argument("--table", help="a CSV of all tests: group, file, d [m], peak force [N], strength [Pa], travel at the peak [m]")
    given = parser.parse_args()
    random = numpy.random.default_rng(1)
    fits, rows, cells = [], [], None
    try:
        for name, files in groups_of(given.runs).items():
            tests = []
            for path in files:
                test = test_of(path)
                if test is None:
                    print(f"plot_survival.py: left out: {path} has no increments", file=sys.stderr)
                else:
                    tests.append((path, *test))
            if tests:
                cells = tests[0][5]
            broken = [test for test in tests if test[1] > 0]
            strengths = numpy.array([force / d**2 for _, force, d, *_ in broken])
            rows += [(name, os.path.basename(path), d, force, force / d**2, travel) for path, force, d, travel, *_ in broken]
            if len(strengths) < 3 or strengths.std() == 0:
                print(f"{name}: {len(strengths)} strengths are too few or all the same; not fitted")
                continue
            m, scale = weibull_fit(strengths)
            m_range, scale_range = intervals(m, scale, len(strengths), random)
            fit = {"name": name, "strengths": strengths, "m": m, "scale": scale, "m_range": m_range, "scale_range": scale_range}
            fit["d"] = numpy.mean([d for _, _, d, *_ in broken])
            fits.append(fit)
            short = sum(not test[4] for test in tests)
            print(
                f"{name}: {len(strengths)} grains, d {1e3 * fit['d']:.2f} mm, mean strength {strengths.mean() / 1e6:.3f} MPa, "
                f"sigma_0 {scale / 1e6:.3f} MPa ({scale_range[0] / 1e6:.3f} to {scale_range[1] / 1e6:.3f}), "
                f"m {m:.2f} ({m_range[0]:.2f} to {m_range[1]:.2f})" + (f"; {short} runs stopped short" if short else "")
            )
    except (ResultsError, OSError, KeyError) as error:
        sys.exit(f"plot_survival.py: {error}")
    if not fits:
        sys.exit("plot_survival.py: nothing to draw")
    with plt.rc_context(STYLE):
        slope = draw(sorted(fits, key=lambda fit: fit["d"]), cells, given.out)
    if slope is not None:
        print(f"slope of ln sigma_0 over ln d: {slope:+.3f}; -3/m: {-3 / numpy.mean([fit['m'] for fit in fits]):+.3f}")
    if given.table:
        with open(given.table, "w", newline="") as file:
            table = csv.writer(file)
            table.writerow(["group", "file", "d [m]", "peak_force [N]", "strength [Pa]", "travel_at_peak [m]"])
            table.writerows([(name, path, f"{d:.6e}", f"{f:.6e}", f"{s:.6e}", f"{t:.6e}") for name, path, d, f, s, t in rows])


if __name__ == "__main__":
    main()
