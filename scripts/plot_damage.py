#!/usr/bin/env python3
"""Draws the damage law's curves from the program's own numbers.

    cargo run --release --example damage_curves | scripts/plot_damage.py --out docs
"""

import argparse
import csv
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from chart_style import COLOURS, STYLE, STYLES


def read(stream):
    curves = {}
    for row in csv.DictReader(stream):
        strain, stress = curves.setdefault(row["curve"], ([], []))
        strain.append(float(row["strain"]))
        stress.append(float(row["stress"]))
    if not curves:
        sys.exit("plot_damage.py: no curves on standard input")
    return curves


def draw(curves, path, title, lines):
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for at, (name, (strain, stress)) in enumerate(curves.items()):
        axes.plot(strain, stress, color=COLOURS[at], linestyle=STYLES[at % len(STYLES)], label=name)
    for value in lines:
        axes.axhline(value, color="#888888", linewidth=0.8)
    axes.set_xlabel("strain over the tensile peak strain $f_t/E$ (tension positive)")
    axes.set_ylabel("stress over the tensile strength $f_t$")
    axes.set_title(title, fontsize=10)
    axes.legend()
    figure.savefig(path)
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="docs", help="folder for the two SVG files (default: docs)")
    folder = parser.parse_args().out
    os.makedirs(folder, exist_ok=True)
    curves = read(sys.stdin)
    softening = {name: curve for name, curve in curves.items() if name.startswith("N")}
    cycles = {name: curve for name, curve in curves.items() if name.startswith("w_c")}
    with plt.rc_context(STYLE):
        draw(softening, os.path.join(folder, "damage_softening.svg"), "Uniaxial tension; zero where d exceeds 0.99", [0])
        draw(cycles, os.path.join(folder, "damage_cycle.svg"), "Tension, compression, tension; N = 3, w_t = 0", [0])


if __name__ == "__main__":
    main()
