#!/usr/bin/env python3
"""Draws the stress-strain and volume-change curves of one or several results files, or their energy shares.

    scripts/plot_history.py results/a.vtkhdf results/b.vtkhdf --out curves.png
    scripts/plot_history.py results/a.vtkhdf --energy --out energy.svg
"""

import argparse
import os
import sys
import textwrap

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy

from riprap_results import Results, ResultsError

# Okabe & Ito (2008): told apart with any kind of colour vision; line styles tell them apart in print.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000"]
STYLES = ["-", (0, (6, 2)), (0, (2, 1.5)), (0, (7, 2, 1.5, 2))]
# Letters that fit below a chart.
LABEL = 74
# Peaks of which the numbers are written.
NOTES = 4
ENERGIES = [
    ("energy_elastic", "elastic, grains and contacts", "#56B4E9"),
    ("energy_membrane", "elastic, membrane", "#0072B2"),
    ("energy_friction", "friction", "#E69F00"),
    ("energy_damage", "damage", "#D55E00"),
    ("energy_stabilisation", "stabilisation", "#999999"),
]
STYLE = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "axes.edgecolor": "#555555",
    "xtick.color": "#333333",
    "ytick.color": "#333333",
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "svg.fonttype": "none",
}


def label_of(results):
    status, _ = results.status
    title = results.title or results.path
    return title if status == "finished" else f"{title} ({status})"


def shortened(text, most):
    """The text with its middle cut out, since names often differ at their ends."""
    if len(text) <= most:
        return text
    return f"{text[: most // 2].rstrip()}…{text[len(text) - (most - 1) // 2 :].lstrip()}"


def labels_of(files):
    """Labels that fit below a chart; files whose labels would be alike are told by their names."""
    cut = [shortened(label_of(results), LABEL) for results in files]
    alike = [cut.count(label) > 1 for label in cut]
    stems = [os.path.splitext(os.path.basename(results.path))[0] for results in files]
    if len(set(stems)) < len(files):
        stems = [os.path.splitext(results.path)[0] for results in files]
    names = [shortened(f"{stem}: {label_of(results)}", LABEL) for stem, results in zip(stems, files)]
    return [name if same else label for label, name, same in zip(cut, names, alike)]


def peak_of(strain, q):
    """Where q is largest, and whether the specimen bears less as it is strained on; else q may still be rising there."""
    at = int(numpy.nanargmax(q))
    return at, bool((strain[at + 1 :][numpy.isfinite(q[at + 1 :])] > strain[at]).any())


def reason_against(results, energy):
    """Why nothing can be drawn of a file; None where something can."""
    if not len(results.history):
        return "has no increments yet"
    if not len(results.shear_rows()[0]):
        return "did not get beyond its consolidation"
    if results.is_scene and not energy:
        return "is of a scene, which has no stress and strain; --energy draws its energies"
    return None


def draw_curves(files):
    """q and volumetric strain over axial strain, of the stages behind the consolidation."""
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(6.4, 7.0 + 0.19 * len(files)), sharex=True, height_ratios=[3, 2], layout="constrained"
    )
    notes = []
    for at, (results, label) in enumerate(zip(files, labels_of(files))):
        strain, q, volume = results.shear("axial_strain", "deviatoric_stress", "volumetric_strain")
        strain, q, volume = 100 * strain, q / 1e6, 100 * volume
        style = {"color": COLOURS[at % len(COLOURS)], "linestyle": STYLES[at % len(STYLES)]}
        top.plot(strain, q, label=label, **style)
        bottom.plot(strain, volume, **style)
        if not numpy.isfinite(q).any():
            continue
        peak, passed = peak_of(strain, q)
        if passed:
            top.plot(strain[peak], q[peak], "o", markersize=5, color=style["color"])
            notes.append((strain[peak], q[peak], style["color"]))
    # The highest first; numbers that would lie on those, or on those of many runs, are left to the curves.
    reach = max((line.get_xdata().max() for line in top.get_lines()), default=0.0)
    largest = max((y for _, y, _ in notes), default=0.0)
    clear = []
    for note in sorted(notes, key=lambda note: -note[1]) if len(notes) <= NOTES else []:
        if all(abs(note[0] - x) > 0.2 * reach or abs(note[1] - y) > 0.05 * largest for x, y, _ in clear):
            clear.append(note)
    for x, y, colour in clear:
        # Clear of the axes, whichever run it belongs to.
        share = x / reach
        top.annotate(
            f"{y:.3g} MPa at {x:.3g} %",
            (x, y),
            xytext=(6 if share < 0.15 else 0, 7),
            textcoords="offset points",
            ha="left" if share < 0.15 else "right" if share > 0.85 else "center",
            fontsize=8.5,
            color=colour,
        )
    top.set_ylabel("deviatoric stress  q  [MPa]")
    lowest = min((line.get_ydata().min() for line in top.get_lines()), default=0)
    low, high = top.get_ylim()
    # Rounding below zero is no reason to move the axis.
    top.set_ylim(bottom=min(0, low) if lowest < -0.01 * high else 0, top=1.06 * high)
    top.set_xlim(left=0)
    bottom.set_ylabel("volumetric strain  [%]\n(contraction positive)")
    bottom.set_xlabel("axial strain  [%]")
    bottom.axhline(0, color="#555555", linewidth=0.8)
    # Below the charts, where it covers nothing.
    figure.legend(loc="outside lower center", fontsize=9)
    figure.align_ylabels()
    return figure


def draw_energies(files):
    """Shares of the energies in the work done, over axial strain (of scenes over the stages), one chart a file."""
    figure, axes = plt.subplots(
        1, len(files), figsize=(1.2 + 4.6 * len(files), 4.2), sharey=True, squeeze=False, layout="constrained"
    )
    for ax, results in zip(axes[0], files):
        rows, _ = results.shear_rows()
        x = results.history["time"][rows] if results.is_scene else 100 * results.shear("axial_strain")[0]
        parts = [numpy.nan_to_num(results.history[name][rows]) for name, _, _ in ENERGIES]
        total = numpy.sum(parts, axis=0)
        started = total > 0
        ax.set_title(textwrap.fill(shortened(label_of(results), 150), 48), fontsize=10)
        ax.set_xlabel("progress  [stages]" if results.is_scene else "axial strain  [%]")
        if not started.any():
            ax.text(0.5, 0.5, "no energy booked yet", ha="center", transform=ax.transAxes)
            continue
        x = x[started]
        shares = [100 * part[started] / total[started] for part in parts]
        # A part that never reaches a thousandth would only clutter the legend.
        shown = [at for at, share in enumerate(shares) if share.max() > 0.1]
        ax.stackplot(
            x,
            *[shares[at] for at in shown],
            labels=[ENERGIES[at][1] for at in shown],
            colors=[ENERGIES[at][2] for at in shown],
            edgecolor="white",
            linewidth=0.6,
        )
        ax.set_xlim(x[0], max(x[-1], x[0] + 1e-9))
        ax.set_ylim(0, 100)
        ax.grid(False)
        error = results.history["energy_error"][rows]
        external = results.history["energy_external"][rows]
        worst = numpy.nanmax(numpy.abs(error)) / max(numpy.nanmax(numpy.abs(external)), 1e-300)
        ax.text(
            0.5, -0.2, f"{total[-1]:.4g} J in all; largest error of the ledger\n{100 * worst:.2g} % of the external work",
            transform=ax.transAxes, ha="center", va="top", fontsize=8, color="#777777",
        )
    axes[0][0].set_ylabel("share of the energy  [%]")
    handles = {label: handle for ax in axes[0] for handle, label in zip(*ax.get_legend_handles_labels())}
    labels = [label for _, label, _ in reversed(ENERGIES) if label in handles]
    if labels:
        figure.legend([handles[label] for label in labels], labels, loc="outside right center", fontsize=9)
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="results files (.vtkhdf, .h5)")
    parser.add_argument("--out", required=True, help="picture to write: .png, .svg or .pdf")
    parser.add_argument("--energy", action="store_true", help="draw the shares of the energies instead")
    options = parser.parse_args()
    plt.rcParams.update(STYLE)
    try:
        files = []
        for results in map(Results, options.files):
            reason = reason_against(results, options.energy)
            if reason:
                print(f"plot_history: left out: {results.path} {reason}", file=sys.stderr)
            else:
                files.append(results)
        if not files:
            sys.exit("plot_history: nothing is left to draw")
        figure = draw_energies(files) if options.energy else draw_curves(files)
        figure.savefig(options.out, dpi=160)
    except (ResultsError, OSError, ValueError) as error:
        sys.exit(f"plot_history: {error}")
    print(options.out)


if __name__ == "__main__":
    main()
