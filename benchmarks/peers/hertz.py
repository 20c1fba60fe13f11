"""A ball pressed onto a rigid plane: force at an approach of a hundredth of the radius.

Hertz (1882) for half-spaces: F = 4/3 E / (1 - nu^2) sqrt(R) d^1.5. Without units: R = 1, E = 1000, nu = 0.3, d = 0.01, so F = 1.4652 and
the contact radius a = 0.1.
CalculiX has a quarter of the lower half of the ball and drives its middle plane by d: F is 5.67 % above Hertz's. riprap has the whole
ball and drives its mean displacement by d: 10.0 %. Both by axisymmetric finite elements (axisymmetric.py 0.3).
ipctk has CalculiX's quarter as tet4, a barrier's distance above the plane.
"""

import math

import numpy

import meshes
from codes import calculix, potential, riprap

RADIUS, MODULUS, POISSON, APPROACH = 1.0, 1000.0, 0.3, 0.01
CONTACT = math.sqrt(RADIUS * APPROACH)
HERTZ = 4 / 3 * MODULUS / (1 - POISSON**2) * math.sqrt(RADIUS) * APPROACH**1.5
WHOLE, HALF = 1.1000 * HERTZ, 1.0567 * HERTZ

CALCULIX = [
    ("coarsest, K=2e6", 0.6, 3, 3, 2e6),
    ("coarse, K=2e5", 0.4, 4, 4, 2e5),
    ("coarse, K=2e6", 0.4, 4, 4, 2e6),
    ("middle, K=2e5", 0.25, 6, 5, 2e5),
    ("middle, K=2e6", 0.25, 6, 5, 2e6),
]
IPC = [
    ("tet4, coarse, barrier 1e-4", 0.4, 4, 4, 1e-4),
    ("tet4, middle, barrier 1e-4", 0.25, 6, 5, 1e-4),
    ("tet4, fine, barrier 1e-4", 0.15, 9, 8, 1e-4),
]
RIPRAP = [
    ("rigid, by its contact spring", "rigid", None, 5),
    ("condensed, cells 1.2 a", "condensed", 1.2, 5),
    ("condensed, cells 0.8 a", "condensed", 0.8, 5),
    ("condensed, cells 0.5 a", "condensed", 0.5, 5),
]


def stations(fine):
    """Shares of the way from pole to equator: steps of `fine` contact radii to 1.5 a, growing by a third from there."""
    step, at = fine * CONTACT / (math.pi / 2), [0.0]
    while at[-1] < 1:
        if at[-1] * math.pi / 2 > 1.5 * CONTACT:
            step *= 1.33
        at.append(at[-1] + step)
    at = at[:-1] if 1 - at[-2] < 0.5 * (at[-1] - at[-2]) else at
    return numpy.array(at) / at[-1]


def linear(fine, across, around):
    """tet4 mesh of the quarter x, y >= 0 of the lower half ball, pole at the origin: fans from axis to surface, turned by 90 degrees."""
    along = stations(fine)
    places = numpy.empty((len(along), across + 1, around + 1, 3))
    for i, s in enumerate(along):
        axis = numpy.array([0.0, s * RADIUS])
        arc = RADIUS * numpy.array([math.sin(s * math.pi / 2), 1 - math.cos(s * math.pi / 2)])
        for j in range(across + 1):
            r, z = axis + (arc - axis) * j / across
            for k in range(around + 1):
                turn = math.pi / 2 * k / around
                places[i, j, k] = r * math.cos(turn), r * math.sin(turn), z
    number, points = meshes.merged(places.reshape(-1, 3), RADIUS)
    return points, meshes.tetrahedra(number.reshape(places.shape[:3]), points)


def quarter(fine, across, around):
    """The same as tet10, its surface on the ball."""
    points, cells = linear(fine, across, around)
    centre = numpy.array([0.0, 0.0, RADIUS])

    def curve(a, b, middle):
        if all(abs(numpy.linalg.norm(p - centre) - RADIUS) < 1e-6 for p in (a, b)):
            out = middle - centre
            return centre + RADIUS * out / numpy.linalg.norm(out)
        return middle

    return meshes.quadratic(points, cells, curve)


def deck(fine, across, around, penalty):
    points, cells = quarter(fine, across, around)
    centre = numpy.array([0.0, 0.0, RADIUS])
    on_ball = numpy.abs(numpy.linalg.norm(points - centre, axis=1) - RADIUS) < 1e-6
    near = numpy.linalg.norm(points, axis=1) < 2.5 * CONTACT
    touching = [(c, f) for c, f in meshes.outer_faces(cells)
                if all(on_ball[cells[c][k]] and near[cells[c][k]] for k in meshes.FACES[f - 1])]
    plane = meshes.box_points((-0.5, -0.5, -0.5), (0.5, 0.5, 0.0))
    n, c = len(points), len(cells)
    equator = numpy.flatnonzero(points[:, 2] > RADIUS - 1e-6)
    text = "*NODE,NSET=ALL\n" + meshes.nodes_text(points) + meshes.nodes_text(plane, n + 1)
    text += "*ELEMENT,TYPE=C3D10,ELSET=BALL\n" + meshes.cells_text(cells)
    text += "*ELEMENT,TYPE=C3D8,ELSET=PLANE\n" + meshes.cells_text([range(8)], n + 1, c + 1)
    for axis, name in enumerate("XY"):
        text += meshes.set_text("SIDE" + name, 1 + numpy.flatnonzero(numpy.abs(points[:, axis]) < 1e-6))
    text += meshes.set_text("EQUATOR", 1 + equator) + meshes.set_text("GROUND", range(n + 1, n + 9))
    text += meshes.surface_text("SKIN", touching) + f"*SURFACE,NAME=FLOOR,TYPE=ELEMENT\n{c + 1},S2\n"
    text += f"*MATERIAL,NAME=ROCK\n*ELASTIC\n{MODULUS:g},{POISSON:g}\n"
    text += "*SOLID SECTION,ELSET=BALL,MATERIAL=ROCK\n*SOLID SECTION,ELSET=PLANE,MATERIAL=ROCK\n"
    text += meshes.contact_text([("SKIN", "FLOOR")], penalty)
    text += "*BOUNDARY\nSIDEX,1,1\nSIDEY,2,2\nGROUND,1,3\n"
    text += "*STEP,NLGEOM,INC=200\n*STATIC\n0.2,1.0,1e-4,0.25\n"
    text += f"*BOUNDARY\nEQUATOR,3,3,{-APPROACH:g}\n*NODE PRINT,NSET=EQUATOR,TOTALS=ONLY,FREQUENCY=1\nRF\n*END STEP\n"
    return text, 3 * n


def barrier_problem(fine, across, around, barrier):
    """The quarter for ipc.py, a barrier's distance above the plane; its equator goes down as in CalculiX."""
    points, cells = linear(fine, across, around)
    points = points + [0, 0, barrier]
    count = len(points)
    plane = meshes.box_points((-0.5, -0.5, -0.5), (1.5, 1.5, 0.0))
    sides = [3 * numpy.flatnonzero(numpy.abs(points[:, axis]) < 1e-6) + axis for axis in (0, 1)]
    held = 3 * numpy.flatnonzero(points[:, 2] > RADIUS + barrier - 1e-6) + 2
    return {
        "points": numpy.vstack([points, plane]),
        "cells": cells,
        "faces": numpy.vstack([meshes.triangles(cells), meshes.box_triangles(count)]),
        "bodies": numpy.array([1] * count + [0] * 8),
        "fixed": numpy.concatenate([*sides, 3 * count + numpy.arange(24)]),
        "held": held,
        "targets": numpy.array([points.ravel()[held] - APPROACH * k / 5 for k in range(1, 6)]),
        "modulus": MODULUS, "poisson": POISSON, "friction": 0.0,
        "barrier": barrier, "stiffness": MODULUS, "slip": 1e-5, "drag": 0.0,
    }, 3 * count


def case(fidelity, cells, increments):
    ball = {"name": "ball", "shape": {"sphere": RADIUS}, "position": [0, 0, RADIUS], "fidelity": fidelity}
    if cells:
        size = cells * CONTACT
        ball |= {"mesh_size": max(0.5, size), "refine": {"point": [0, 0, -RADIUS], "radius": 1.5 * CONTACT, "mesh_size": size}}
    plane = {"name": "plane", "shape": {"box": [2, 2, 1]}, "position": [0, 0, -0.5], "fixed": True, "fidelity": "rigid"}
    drive = {"ball": {"displacement": [0, 0, -APPROACH], "rotation": [0, 0, 0]}}
    return {
        "title": "Hertz's ball on a plane",
        "scene": {"bodies": [plane, ball]},
        "rock": {"density": 1000, "youngs_modulus": MODULUS, "poissons_ratio": POISSON},
        # The rounding is twice the approach.
        "contact": {"friction": 0, "rounding": 0.01},
        "stages": [{"kind": "load", "increments": increments, "bodies": drive}],
    }


def rows(program, folder, limit, has):
    """One row a run: code, setting, unknowns, cost, value, answer."""
    for setting, fidelity, cells, increments in RIPRAP if has["riprap"] else []:
        cost = riprap(program, folder, "hertz", case(fidelity, cells, increments), limit)
        forces = cost["bodies"].get("ball", {}).get("force", [])
        yield "riprap", setting, "", cost, forces[-1][2] if len(forces) and not cost["trouble"] else None, WHOLE, "Hertz, whole ball"
    for setting, fine, across, around, penalty in CALCULIX if has["CalculiX"] else []:
        text, unknowns = deck(fine, across, around, penalty)
        cost = calculix(folder, "hertz", text, limit)
        force = 4 * abs(cost["reactions"][-1][2][2]) if cost["reactions"] and not cost["trouble"] else None
        yield "CalculiX", setting, unknowns, cost, force, HALF, "Hertz, half a ball"
    for setting, fine, across, around, barrier in IPC if has["ipctk"] else []:
        problem, unknowns = barrier_problem(fine, across, around, barrier)
        cost = potential(folder, "hertz", problem, limit)
        force = 4 * abs(cost["rows"][-1]["force"][2]) if cost["rows"] and not cost["trouble"] else None
        yield "ipctk", setting, unknowns, cost, force, HALF, "Hertz, half a ball"
