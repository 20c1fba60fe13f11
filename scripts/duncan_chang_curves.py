#!/usr/bin/env python3
"""Curves of the hyperbolic Duncan-Chang model as a CSV file for `riprap report --lab`.

    scripts/duncan_chang_curves.py > cases/shuibuya/laboratory.csv

    q = e / (1/Ei + Rf e / qf)   up to qf        Ei = K pa (s3/pa)^n        phi = phi0 - dphi log10(s3/pa), no cohesion

The defaults are the main rockfill of Shuibuya as remembered from the literature: **not verified**, and the file says so. Volume
strains are left out, since no bulk parameters are at hand. Compression positive.
"""

import argparse

import numpy

ATMOSPHERE = 101325.0  # Pa

# Of the main rockfill of Shuibuya: phi0 and its drop [deg].
FRICTION = [52.0, 8.5]


def strength(pressure, friction=FRICTION):
    """Failure stress q_f [Pa] at a confining pressure [Pa]."""
    angle = numpy.radians(friction[0] - friction[1] * numpy.log10(pressure / ATMOSPHERE))
    return 2 * pressure * numpy.sin(angle) / (1 - numpy.sin(angle))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pressures", type=float, nargs="+", default=[0.4, 0.8, 1.6, 2.5], help="confining pressures [MPa]")
    parser.add_argument("--phi", type=float, nargs=2, default=FRICTION, metavar=("PHI0", "DPHI"), help="[deg]")
    parser.add_argument("--modulus", type=float, nargs=2, default=[1100.0, 0.35], metavar=("K", "N"))
    parser.add_argument("--failure-ratio", type=float, default=0.82)
    parser.add_argument("--label", default="Duncan-Chang (unverified)")
    parser.add_argument("--axial-strain", type=float, default=15.0, help="last point [%%]")
    arguments = parser.parse_args()
    print(
        f"# Hyperbolas of phi0 {arguments.phi[0]:g} deg, dphi {arguments.phi[1]:g} deg, K {arguments.modulus[0]:g}, n {arguments.modulus[1]:g},"
        f" Rf {arguments.failure_ratio:g} ({arguments.label}); scripts/duncan_chang_curves.py"
    )
    print("curve, axial_strain [%], deviatoric_stress [MPa], volumetric_strain [%]")
    for pressure in arguments.pressures:
        s3 = pressure * 1e6
        most = strength(s3, arguments.phi)
        initial = arguments.modulus[0] * ATMOSPHERE * (s3 / ATMOSPHERE) ** arguments.modulus[1]
        for strain in numpy.linspace(0, arguments.axial_strain / 100, 61):
            q = min(strain / (1 / initial + arguments.failure_ratio * strain / most), most)
            print(f"{arguments.label} at {pressure:g} MPa, {100 * strain:.3f}, {q / 1e6:.4f},")


if __name__ == "__main__":
    main()
