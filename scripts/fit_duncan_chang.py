#!/usr/bin/env python3
"""Fits the hyperbolic model of Duncan & Chang (E-B form) to the shear curves of several confining pressures.

    scripts/fit_duncan_chang.py p0400.vtkhdf p0800.vtkhdf p1600.vtkhdf

Source: Duncan & Chang (1970), J. Soil Mech. Found. Div. 96(SM5):1629-1653; bulk modulus and the choice of points after
Duncan, Byrne, Wong & Mabry (1980), UCB/GT/80-01. Compression positive, SI.

    q = e / (1/Ei + Rf e / qf)        Ei = K pa (s3/pa)^n            Rf = qf / q_ult
    B = Kb pa (s3/pa)^m               phi = phi0 - dphi log10(s3/pa), no cohesion

Of each curve, the hyperbola runs through the points at 70 % and 95 % of its peak qf. B is q/3 over the volume strain at
70 % of the peak, or where the volume is least if that comes before. With one pressure K, n and the like cannot be told
apart: only the values of that pressure are given. A run that ended before a peak has its largest q taken for qf, and is
marked; sudden drops before 95 % of the peak make a poor hyperbola, which `misfit` tells (root mean square over qf, up to the peak).
Curves that no hyperbola fits are named and left out; with none left it ends with 1.
"""

import argparse
import sys
from dataclasses import dataclass

import numpy

from riprap_results import Results, ResultsError

ATMOSPHERE = 101325.0  # Pa


@dataclass
class Curve:
    """A drained triaxial test: confining pressure and stress [Pa], strains [1], from the end of the consolidation."""

    pressure: float
    axial_strain: numpy.ndarray
    deviatoric_stress: numpy.ndarray
    volumetric_strain: numpy.ndarray
    name: str = ""


@dataclass
class Hyperbola:
    """What one curve says by itself."""

    name: str
    pressure: float  # Pa
    initial_modulus: float  # Pa
    ultimate_stress: float  # Pa
    failure_stress: float  # Pa
    bulk_modulus: float  # Pa; NaN where the volume does not decrease
    friction_angle: float  # rad
    peaked: bool
    misfit: float

    @property
    def failure_ratio(self):
        return self.failure_stress / self.ultimate_stress


def read_curve(path):
    with Results(path) as results:
        names = ("axial_strain", "volumetric_strain", "deviatoric_stress", "confining_pressure")
        strain, volume, q, pressure = results.shear(*names)
        return Curve(float(numpy.median(pressure)) if len(pressure) else numpy.nan, strain, q, volume, path)


def hyperbola(curve):
    """The hyperbola through 70 % and 95 % of the peak of a curve."""
    strain, q = curve.axial_strain, curve.deviatoric_stress
    good = numpy.isfinite(strain) & numpy.isfinite(q)
    strain, q, volume = strain[good], q[good], curve.volumetric_strain[good]
    if not len(q):
        raise ValueError(f"{curve.name}: has no shear to measure")
    if len(q) < 5 or not q.max() > 0:
        raise ValueError(f"{curve.name}: has no rising curve to fit")
    peak = int(q.argmax())
    # Where the curve first reaches a share of the peak.
    def reach(share):
        level = share * q[peak]
        after = int((q >= level).argmax())
        if after == 0:
            return strain[0]
        part = (level - q[after - 1]) / (q[after] - q[after - 1])
        return strain[after - 1] + part * (strain[after] - strain[after - 1])

    e70, e95 = reach(0.70), reach(0.95)
    if not e95 > e70 > 0:
        raise ValueError(f"{curve.name}: 70 % and 95 % of the peak lie in one increment")
    # e / q = a + b e
    y70, y95 = e70 / (0.70 * q[peak]), e95 / (0.95 * q[peak])
    b = (y95 - y70) / (e95 - e70)
    a = y70 - b * e70
    if not (a > 0 and b > 0):
        raise ValueError(f"{curve.name}: is no hyperbola between 70 % and 95 % of its peak")
    compressed = min(e70, strain[int(volume.argmax())])
    decrease = numpy.interp(compressed, strain, volume)
    bulk = numpy.interp(compressed, strain, q) / 3 / decrease if decrease > 0 else numpy.nan
    rising = slice(0, peak + 1)
    model = strain[rising] / (a + b * strain[rising])
    misfit = float(numpy.sqrt(numpy.mean((model - q[rising]) ** 2)) / q[peak])
    angle = numpy.arcsin(q[peak] / (q[peak] + 2 * curve.pressure))
    peaked = peak < len(q) - 1
    return Hyperbola(curve.name, curve.pressure, 1 / a, 1 / b, q[peak], bulk, angle, peaked, misfit)


def power_law(pressures, values):
    """(k, n) of `value = k pa (pressure/pa)^n`, least squares of the logarithms."""
    n, intercept = numpy.polyfit(numpy.log10(pressures / ATMOSPHERE), numpy.log10(values / ATMOSPHERE), 1)
    return 10**intercept, n


def hyperbolas(curves):
    """The hyperbolas of those curves that have one, and why the others have none."""
    found, reasons = [], []
    for curve in curves:
        try:
            found.append(hyperbola(curve))
        except ValueError as error:
            reasons.append(str(error))
    return found, reasons


def fit(found):
    """The parameters of the model from hyperbolas of at least two pressures; else none."""
    pressures = numpy.array([h.pressure for h in found])
    parameters = {}
    if len(numpy.unique(pressures.round())) > 1:
        parameters["K"], parameters["n"] = power_law(pressures, numpy.array([h.initial_modulus for h in found]))
        parameters["Rf"] = float(numpy.mean([h.failure_ratio for h in found]))
        bulk = numpy.array([h.bulk_modulus for h in found])
        known = numpy.isfinite(bulk)
        if len(numpy.unique(pressures[known].round())) > 1:
            parameters["Kb"], parameters["m"] = power_law(pressures[known], bulk[known])
        slope, phi0 = numpy.polyfit(numpy.log10(pressures / ATMOSPHERE), [h.friction_angle for h in found], 1)
        parameters["phi0 [deg]"], parameters["dphi [deg]"] = numpy.degrees(phi0), -numpy.degrees(slope)
    return parameters


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="results files (.vtkhdf, .h5), one a confining pressure")
    options = parser.parse_args()
    try:
        found, reasons = hyperbolas([read_curve(path) for path in options.files])
    except (ResultsError, OSError) as error:
        sys.exit(f"fit_duncan_chang: {error}")
    for reason in reasons:
        print(f"fit_duncan_chang: left out: {reason}", file=sys.stderr)
    if not found:
        sys.exit("fit_duncan_chang: no curve is left")
    parameters = fit(found)
    print(f"{'s3 [MPa]':>9} {'Ei [MPa]':>9} {'qf [MPa]':>9} {'Rf':>6} {'B [MPa]':>9} {'phi [deg]':>9} {'misfit':>7}")
    for h in found:
        print(
            f"{1e-6 * h.pressure:9.3f} {1e-6 * h.initial_modulus:9.1f} {1e-6 * h.failure_stress:9.3f} {h.failure_ratio:6.3f} "
            f"{1e-6 * h.bulk_modulus:9.1f} {numpy.degrees(h.friction_angle):9.2f} {h.misfit:7.3f}  {h.name}"
            + ("" if h.peaked else "  (no peak: its end is taken for it)")
        )
    for name, value in parameters.items():
        print(f"{name:10} {value:.4g}")
    if not parameters:
        print("K, n, Rf, Kb, m and phi0 need runs of at least two confining pressures")


if __name__ == "__main__":
    main()
