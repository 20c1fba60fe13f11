"""A disc between two plates, across its diameter (Brazilian test), elastic: tension in its middle over 2 P / (pi D t).

Without units: D = 2, t = 0.6, E = 1000, nu = 0.2, approach 0.004. The disc is a prism of 32 sides, and stands on a flat of 11.25
degrees. The tension is the mean over cells whose middle is within 0.2 of the axis. The answer is a plane disc's mean there, under
line loads, times what Hondros (1959) takes off for a pressure spread evenly over the flat. A thick disc's differs from it.
CalculiX has the meshes that riprap makes, as tet10; soft springs hold the disc until it is touched. CalculiX has no law by which
rock crushes and cells vanish; how riprap's disc breaks is in cases/crushing.
"""

import math
import os

import numpy

import meshes
from codes import calculix, riprap, riprap_meshes

RADIUS, LENGTH, MODULUS, POISSON, APPROACH, SIDES, NEAR = 1.0, 0.6, 1000.0, 0.2, 0.004, 32, 0.2
SPRING = 0.03

MESHES = [("cells 0.5", 0.5), ("cells 0.4", 0.4)]
PENALTIES = [("K=1e5", 1e5), ("K=1e6", 1e6)]


def plane_tension():
    """Mean of the horizontal stress of a plane disc under line loads P over the near part of it, in 2 P / (pi D t).

    Timoshenko and Goodier, art. 41, about the middle: 1 - 2 [x^2 (1 - y) / r1^4 + x^2 (1 + y) / r2^4], unit radius.
    """
    steps = numpy.linspace(-NEAR, NEAR, 201)
    x, y = numpy.meshgrid(steps, steps)
    inside = x**2 + y**2 < NEAR**2
    above, below = (x**2 + (1 - y) ** 2) ** 2, (x**2 + (1 + y) ** 2) ** 2
    return (1 - 2 * (x**2 * (1 - y) / above + x**2 * (1 + y) / below))[inside].mean()


FLAT = math.pi / SIDES  # half the flat's angle
ANSWER = plane_tension() * (math.sin(2 * FLAT) / FLAT - 1)


def case(fidelity, size):
    plate = {"shape": {"box": [2, 1, 0.5]}, "fidelity": "rigid"}
    disc = {"shape": {"cylinder": {"radius": RADIUS, "length": LENGTH, "sides": SIDES}}, "mesh_size": size, "fidelity": fidelity}
    inner = RADIUS * math.cos(math.pi / SIDES)
    return {
        "title": "Disc across its diameter",
        "scene": {"bodies": [
            {"name": "bottom", "position": [0, 0, -0.25], "fixed": True, **plate},
            {"name": "disc", "position": [0, 0, inner], "rotation": [math.pi / 2, 0, 0], **disc},
            {"name": "top", "position": [0, 0, 2 * inner + 0.25], **plate},
        ]},
        "rock": {"density": 1000, "youngs_modulus": MODULUS, "poissons_ratio": POISSON},
        "contact": {"friction": 0.3},
        "stages": [{"kind": "load", "increments": 4, "bodies": {"top": {"displacement": [0, 0, -APPROACH], "rotation": [0, 0, 0]}}}],
    }


def near_axis(points, cells):
    """Which cells have their middle within NEAR of the axis, and the volumes of all."""
    corners = points[cells[:, :4]]
    middles = corners.mean(axis=1)
    volumes = abs(numpy.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    return numpy.hypot(middles[:, 0], middles[:, 2] - RADIUS * math.cos(math.pi / SIDES)) < NEAR, volumes


def tension(near, volumes, stresses, force):
    """Mean horizontal stress by volume of the cells near the axis, in 2 P / (pi D t)."""
    return numpy.average(stresses[near], weights=volumes[near]) * math.pi * RADIUS * LENGTH / force


def deck(points, cells, penalty):
    """The disc between two plates of one C3D8 each; its soft springs are at three nodes far apart."""
    n, c, top = len(points), len(cells), 2 * RADIUS * math.cos(math.pi / SIDES)
    outer = meshes.outer_faces(cells)
    text = "*NODE,NSET=ALL\n" + meshes.nodes_text(points)
    text += "*ELEMENT,TYPE=C3D10,ELSET=DISC\n" + meshes.cells_text(cells)
    surfaces = ""
    for k, (name, low, face, level) in enumerate((("BOTTOM", -0.5, 2, 0.0), ("TOP", top, 1, top))):
        first, number = n + 1 + 8 * k, c + 1 + k
        text += "*NODE,NSET=ALL\n" + meshes.nodes_text(meshes.box_points((-1, -0.5, low), (1, 0.5, low + 0.5)), first)
        text += "*ELEMENT,TYPE=C3D8,ELSET=PLATES\n" + meshes.cells_text([range(8)], first, number)
        text += meshes.set_text(name, range(first, first + 8))
        # The flat, and half of the next sides.
        rim = [(e, f) for e, f in outer if all(abs(points[cells[e][i]][2] - level) < 0.1 for i in meshes.FACES[f - 1])
               and numpy.ptp([points[cells[e][i]][1] for i in meshes.FACES[f - 1]]) > 1e-6]
        surfaces += meshes.surface_text(f"{name}RIM", rim) + f"*SURFACE,NAME={name}FACE,TYPE=ELEMENT\n{number},S{face}\n"
    places = [int(numpy.argmax(points @ numpy.array(way))) + 1 for way in ((1, 0.3, 0), (-1, 0.3, 0), (0.1, -1, 1))]
    for direction in (1, 2, 3):
        first = c + 3 * direction
        text += f"*ELEMENT,TYPE=SPRING1,ELSET=SPRINGS{direction}\n" + "".join(f"{first + k},{n}\n" for k, n in enumerate(places))
        text += f"*SPRING,ELSET=SPRINGS{direction}\n{direction}\n{SPRING:g}\n"
    text += surfaces + "*ELSET,ELSET=NEAR\n" + "".join(f"{e + 1}\n" for e in numpy.flatnonzero(near_axis(points, cells)[0]))
    text += f"*MATERIAL,NAME=ROCK\n*ELASTIC\n{MODULUS:g},{POISSON:g}\n"
    text += "*SOLID SECTION,ELSET=DISC,MATERIAL=ROCK\n*SOLID SECTION,ELSET=PLATES,MATERIAL=ROCK\n"
    text += meshes.contact_text([(f"{name}RIM", f"{name}FACE") for name in ("BOTTOM", "TOP")], penalty, 0.3, penalty / 100)
    text += "*BOUNDARY\nBOTTOM,1,3\nTOP,1,2\n*STEP,NLGEOM,INC=200\n*STATIC\n0.25,1.0,1e-4,0.25\n"
    text += f"*BOUNDARY\nTOP,3,3,{-APPROACH:g}\n*NODE PRINT,NSET=TOP,TOTALS=ONLY,FREQUENCY=100\nRF\n"
    text += "*EL PRINT,ELSET=NEAR,FREQUENCY=100\nS\n*END STEP\n"
    return text, 3 * n


def printed_stresses(path, count):
    """Horizontal stress of each cell, the mean over its integration points, of the last *EL PRINT in a .dat file."""
    text = open(path).read().split("stresses")[-1]
    lines = [line.split() for line in text.splitlines()[1:] if len(line.split()) == 8]
    numbers, values = numpy.array([int(row[0]) - 1 for row in lines]), numpy.array([float(row[2]) for row in lines])
    return numpy.bincount(numbers, values, count) / numpy.maximum(1, numpy.bincount(numbers, minlength=count))


def rows(program, folder, limit, has):
    """One row a run: code, setting, unknowns, cost, value, answer."""
    import h5py

    for name, size in MESHES:
        points, cells = riprap_meshes(program, folder, "mesh", case("condensed", size))["disc"]
        near, volumes = near_axis(points, cells)
        for fidelity in ("condensed", "full") if has["riprap"] else ():
            cost = riprap(program, folder, "disc", case(fidelity, size), limit)
            value = None
            if not cost["trouble"]:
                with h5py.File(os.path.join(folder, "disc.vtkhdf"), locking=False) as file:
                    count = file["VTKHDF/NumberOfCells"][-1]
                    of_disc = file["VTKHDF/CellData/grain"][:count] == 1
                    stresses = file["VTKHDF/CellData/stress"][-count:, 0][of_disc]
                value = tension(near, volumes, stresses, abs(cost["bodies"]["top"]["reaction_force"][-1][2]))
            yield "riprap", f"{fidelity}, area, {name}", "", cost, value, ANSWER, "plane disc"
        for stiffness, penalty in PENALTIES if has["CalculiX"] else []:
            text, unknowns = deck(points, cells, penalty)
            cost = calculix(folder, "disc", text, limit)
            value = None
            if cost["reactions"] and not cost["trouble"]:
                stresses = printed_stresses(os.path.join(folder, "disc.dat"), len(cells))
                value = tension(near, volumes, stresses, abs(cost["reactions"][-1][2][2]))
            yield "CalculiX", f"tet10, {name}, {stiffness}", unknowns, cost, value, ANSWER, "plane disc"
