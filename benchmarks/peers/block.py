"""A block pressed onto a rigid plane, then pushed along it: tangential over normal force against the friction coefficient.

Without units: edges 1, 1, 0.5, E = 1000, nu = 0.3, mu = 0.3. The push, 0.02, is enough to slide in every setting.
CalculiX clamps the block's top and moves it, 0.00005 down, then along. riprap cannot clamp a face: it presses with 0.1 N and moves
the block as a whole. ipctk moves the top as CalculiX does.
"""

import itertools

import numpy

import meshes
from codes import calculix, potential, riprap

EDGE, HEIGHT, MODULUS, POISSON, FRICTION, PRESS, FORCE, PUSH = 1.0, 0.5, 1000.0, 0.3, 0.3, 0.00005, 0.1, 0.02

CALCULIX = [
    ("tet10, 2 cells an edge, K=1e5", 2, 1e5),
    ("tet10, 4 cells an edge, K=1e5", 4, 1e5),
    ("tet10, 8 cells an edge, K=1e5", 8, 1e5),
]
IPC = [
    ("tet4, 4 cells an edge, barrier 1e-3", 4, 1e-3),
    ("tet4, 8 cells an edge, barrier 1e-3", 8, 1e-3),
]
RIPRAP = [
    ("rigid", "rigid", "corners", None),
    ("condensed, corners, cells 0.3", "condensed", "corners", 0.3),
    ("condensed, corners, cells 0.15", "condensed", "corners", 0.15),
    ("condensed, area, cells 0.3", "condensed", "area", 0.3),
    ("condensed, area, cells 0.15", "condensed", "area", 0.15),
]


def linear(edges):
    """Points and tet4 of the block."""
    shape = (edges, edges, max(1, edges // 2))
    grid = numpy.arange((shape[0] + 1) * (shape[1] + 1) * (shape[2] + 1)).reshape([n + 1 for n in shape])
    steps = [numpy.linspace(0, size, n + 1) for size, n in zip((EDGE, EDGE, HEIGHT), shape)]
    corners = numpy.array(list(itertools.product(*steps)))
    return corners, meshes.tetrahedra(grid, corners)


def deck(edges, penalty):
    points, cells = meshes.quadratic(*linear(edges))
    sole = [(c, f) for c, f in meshes.outer_faces(cells) if all(points[cells[c][k]][2] < 1e-9 for k in meshes.FACES[f - 1])]
    plane = meshes.box_points((-0.5, -0.5, -0.5), (1.5, 1.5, 0.0))
    n, c = len(points), len(cells)
    text = "*NODE,NSET=ALL\n" + meshes.nodes_text(points) + meshes.nodes_text(plane, n + 1)
    text += "*ELEMENT,TYPE=C3D10,ELSET=BLOCK\n" + meshes.cells_text(cells)
    text += "*ELEMENT,TYPE=C3D8,ELSET=PLANE\n" + meshes.cells_text([range(8)], n + 1, c + 1)
    text += meshes.set_text("TOP", 1 + numpy.flatnonzero(points[:, 2] > HEIGHT - 1e-9)) + meshes.set_text("GROUND", range(n + 1, n + 9))
    text += meshes.surface_text("SOLE", sole) + f"*SURFACE,NAME=FLOOR,TYPE=ELEMENT\n{c + 1},S2\n"
    text += f"*MATERIAL,NAME=ROCK\n*ELASTIC\n{MODULUS:g},{POISSON:g}\n"
    text += "*SOLID SECTION,ELSET=BLOCK,MATERIAL=ROCK\n*SOLID SECTION,ELSET=PLANE,MATERIAL=ROCK\n"
    text += meshes.contact_text([("SOLE", "FLOOR")], penalty, FRICTION) + "*BOUNDARY\nGROUND,1,3\n"
    for along in (0.0, PUSH):
        text += "*STEP,NLGEOM,INC=200\n*STATIC\n0.25,1.0,1e-4,0.25\n"
        text += f"*BOUNDARY\nTOP,1,1,{along:g}\nTOP,2,2,0\nTOP,3,3,{-PRESS:g}\n"
        text += "*NODE PRINT,NSET=TOP,TOTALS=ONLY,FREQUENCY=1\nRF\n*END STEP\n"
    return text, 3 * n


def barrier_problem(edges, barrier):
    """The block for ipc.py: it begins a barrier's distance above the plane, and its clamped top goes as in CalculiX, that distance less."""
    points, cells = linear(edges)
    points = points + [0, 0, barrier]
    count = len(points)
    plane = meshes.box_points((-0.5, -0.5, -0.5), (1.5, 1.5, 0.0))
    top = numpy.flatnonzero(points[:, 2] > HEIGHT + barrier / 2)
    held = (3 * top[:, None] + numpy.arange(3)).ravel()
    down, along = numpy.linspace(1, 4, 4) / 4, numpy.linspace(1, 8, 8) / 8
    ways = [(0, 0, -PRESS * share) for share in down] + [(PUSH * share, 0, -PRESS) for share in along]
    return {
        "points": numpy.vstack([points, plane]),
        "cells": cells,
        "faces": numpy.vstack([meshes.triangles(cells), meshes.box_triangles(count)]),
        "bodies": numpy.array([1] * count + [0] * 8),
        "fixed": 3 * count + numpy.arange(24),
        "held": held,
        "targets": numpy.array([(points[top] + way).ravel() for way in ways]),
        "modulus": MODULUS, "poisson": POISSON, "friction": FRICTION,
        "barrier": barrier, "stiffness": MODULUS, "slip": 1e-5, "drag": 0.0,
    }, 3 * count


def case(fidelity, faces, cells):
    block = {"name": "block", "shape": {"box": [EDGE, EDGE, HEIGHT]}, "position": [0, 0, HEIGHT / 2], "fidelity": fidelity}
    if cells:
        block["mesh_size"] = cells
    plane = {"name": "plane", "shape": {"box": [4, 4, 0.5]}, "position": [0, 0, -0.25], "fixed": True, "fidelity": "rigid"}
    held = {"displacement": [PUSH, 0, None], "rotation": [0, 0, 0]}
    return {
        "title": "Block pushed along a plane",
        "scene": {"bodies": [plane, block]},
        "rock": {"density": 1000, "youngs_modulus": MODULUS, "poissons_ratio": POISSON},
        "contact": {"friction": FRICTION, "faces": faces},
        "stages": [
            {"kind": "load", "increments": 4, "bodies": {"block": {"force": [0, 0, -FORCE]}}},
            {"kind": "load", "increments": 4, "bodies": {"block": held}},
        ],
    }


def rows(program, folder, limit, has):
    """One row a run: code, setting, unknowns, cost, value, answer."""
    for setting, fidelity, faces, cells in RIPRAP if has["riprap"] else []:
        cost = riprap(program, folder, "block", case(fidelity, faces, cells), limit)
        forces = cost["bodies"].get("block", {}).get("reaction_force", [])
        yield "riprap", setting, "", cost, abs(forces[-1][0]) / FORCE if len(forces) and not cost["trouble"] else None, FRICTION, "mu"
    for setting, edges, penalty in CALCULIX if has["CalculiX"] else []:
        text, unknowns = deck(edges, penalty)
        cost = calculix(folder, "block", text, limit)
        ratio = None
        if cost["reactions"] and not cost["trouble"]:
            x, _, z = cost["reactions"][-1][2]
            ratio = abs(x / z)
        yield "CalculiX", setting, unknowns, cost, ratio, FRICTION, "mu"
    for setting, edges, barrier in IPC if has["ipctk"] else []:
        problem, unknowns = barrier_problem(edges, barrier)
        cost = potential(folder, "block", problem, limit)
        ratio = None
        if cost["rows"] and not cost["trouble"]:
            x, _, z = cost["rows"][-1]["force"]
            ratio = abs(x / z)
        yield "ipctk", setting, unknowns, cost, ratio, FRICTION, "mu"
