"""Three heaps at the limit: gravity turns until nothing balances any more; the tangent of the tilt at which that is.

stack: three cubes on each other tip about the foot's edge at 1/3, friction 0.65.
wedge: a wedge of half-angle 30 degrees in a groove, friction 0.3, slides along it at mu / sin 30 = 0.6 (Hoek and Bray 1981).
arch: a semicircle of 12 blocks, t/R = 0.15, friction 0.8, falls at what limit analysis gives (`thrust_limit`): an upper bound where
blocks would slide, exact where they only hinge.
Without units: edges about 1, weight of a unit volume 1, E = 1e6, nu = 0.2, so that it is rock in blocks of a metre. All go to
1.2 times the limit. The tilt found is that of the last state in balance in which nothing moved by MOVED.
CalculiX did not converge under turned gravity. It is pushed by a displacement in place of that: the stack along its top face, where
the largest push is 1/6 of the weight, the wedge along its end, where it is 0.6. It has no arch.
YADE's polyhedra fall in time: the tilt at which one has moved by MOVED.
"""

import math
import os

import numpy
import scipy.optimize

import meshes
from codes import calculix, measured_yade, potential, riprap
from pile import drawn_in

HERE = os.path.dirname(os.path.abspath(__file__))
MODULUS, POISSON, DENSITY, GRAVITY = 1e6, 0.2, 1000.0, 1e-3
BEYOND, TILTS, MOVED = 1.2, 24, 0.01
STEP, STEPS = 0.01, 40000  # of YADE's time; a cube of its stiffness has a period of 0.2, gravity takes 45 along an edge
RADIUS, THICKNESS, BLOCKS, HALF_ANGLE = 4.0, 0.6, 12, math.radians(30)
WEDGE, PUSH = 2 * math.tan(HALF_ANGLE), 1e-3  # the wedge's volume; CalculiX's way

RIPRAP = [
    ("rigid, area", "rigid", "area", None),
    ("rigid, corners", "rigid", "corners", None),
    ("condensed, area, cells 1", "condensed", "area", 1.0),
    ("condensed, area, cells 0.5", "condensed", "area", 0.5),
]
CALCULIX = [
    ("tet10, 2 cells an edge, K=1e7", 2, 1e7),
    ("tet10, 2 cells an edge, K=1e6", 2, 1e6),
    ("tet10, 4 cells an edge, K=1e7", 4, 1e7),
]
IPC = [
    ("tet4, 2 cells an edge, barrier 1e-3", 2, 1e-3),
    ("tet4, 2 cells an edge, barrier 1e-4", 2, 1e-4),
]
# Of a hexahedron in the order of meshes.box_points: coordinate and side of each face S1 to S6.
FACES = [(2, 0), (2, 1), (1, 0), (0, 1), (1, 1), (0, 0)]


def prism(outline, length):
    """Corners of a prism along y; its outline in x and z begins low left and goes around by low right."""
    (a, b), (c, d), (e, f), (g, h) = outline
    half = length / 2
    return numpy.array([(a, -half, b), (c, -half, d), (c, half, d), (a, half, b), (g, -half, h), (e, -half, f), (e, half, f), (g, half, h)])


def heap(kind):
    """Bodies by name as (corners, whether fixed); pairs of faces that touch; friction; direction of the tilt; the answer."""
    if kind == "stack":
        bodies = {"ground": (meshes.box_points((-2, -2, -1), (2, 2, 0)), True)}
        bodies |= {f"b{k}": (meshes.box_points((-0.5, -0.5, k), (0.5, 0.5, k + 1)), False) for k in range(3)}
        return bodies, [("b0", 1, "ground", 2), ("b1", 1, "b0", 2), ("b2", 1, "b1", 2)], 0.65, 0, 1 / 3
    if kind == "wedge":
        slope, low, high = math.tan(HALF_ANGLE), 0.5, 1.5
        bodies = {"wedge": (prism([(-low * slope, low), (low * slope, low), (high * slope, high), (-high * slope, high)], 1.0), False)}
        bottom, top, out = 0.2 * slope, 1.8 * slope, 0.5 / math.cos(HALF_ANGLE)
        bodies["right"] = prism([(bottom, 0.2), (bottom + out, 0.2), (top + out, 1.8), (top, 1.8)], 3.0), True
        bodies["left"] = prism([(-bottom - out, 0.2), (-bottom, 0.2), (-top, 1.8), (-top - out, 1.8)], 3.0), True
        return bodies, [("wedge", 4, "right", 6), ("wedge", 6, "left", 4)], 0.3, 1, 0.3 / math.sin(HALF_ANGLE)
    inner, outer = RADIUS - THICKNESS / 2, RADIUS + THICKNESS / 2

    def joint(k):
        """Inner and outer end of the joint before block k, from the right-hand abutment."""
        angle = math.pi * k / BLOCKS
        return [numpy.array([r * math.cos(angle), r * math.sin(angle)]) for r in (inner, outer)]

    bodies = {}
    for k in range(BLOCKS):
        (a, b), (c, d) = joint(k), joint(k + 1)
        bodies[f"b{k}"] = prism([a, b, d, c], 1.0), False
    for name, side in (("right", 1), ("left", -1)):
        low, high = sorted((side * (inner - 0.5), side * (outer + 0.5)))
        bodies[name] = meshes.box_points((low, -1, -1), (high, 1, 0)), True
    pairs = [(f"b{k}", 2, f"b{k + 1}", 1) for k in range(BLOCKS - 1)]
    pairs += [("b0", 1, "right", 2), (f"b{BLOCKS - 1}", 2, "left", 2)]
    return bodies, pairs, 0.8, 0, thrust_limit([joint(k) for k in range(BLOCKS + 1)], 0.8)


def thrust_limit(joints, friction):
    """The largest horizontal over vertical gravity at which forces in both ends of each joint hold every block (Livesley 1978).

    Linear programming over normal and tangential force at both ends, |T| <= friction N.
    """
    ends = len(joints) * 2
    balance, loads = numpy.zeros((3 * (len(joints) - 1), 2 * ends + 1)), numpy.zeros(3 * (len(joints) - 1))
    for k, (first, second) in enumerate(zip(joints, joints[1:])):
        corners = numpy.array([first[0], first[1], second[1], second[0]])
        after = numpy.roll(corners, -1, axis=0)
        cross = corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]
        area, centre = cross.sum() / 2, ((corners + after) * cross[:, None]).sum(axis=0) / (3 * cross.sum())
        for j, sign in ((k, 1.0), (k + 1, -1.0)):
            along = (joints[j][1] - joints[j][0]) / numpy.linalg.norm(joints[j][1] - joints[j][0])
            for end in range(2):
                for direction, column in ((numpy.array([-along[1], along[0]]), 0), (along, 1)):
                    arm, force = joints[j][end] - centre, sign * direction
                    column += 2 * (2 * j + end)
                    balance[3 * k : 3 * k + 3, column] = [*force, arm[0] * force[1] - arm[1] * force[0]]
        balance[3 * k, -1], loads[3 * k + 1] = area, area
    cone = numpy.zeros((2 * ends, 2 * ends + 1))
    for end in range(ends):
        cone[2 * end : 2 * end + 2, 2 * end : 2 * end + 2] = [[-friction, 1], [-friction, -1]]
    cost = numpy.zeros(2 * ends + 1)
    cost[-1] = -1
    ranges = [(0, None), (None, None)] * ends + [(0, None)]
    found = scipy.optimize.linprog(cost, cone, numpy.zeros(2 * ends), balance, loads, ranges)
    return found.x[-1] if found.success else math.nan


def cells(corners, edges):
    """Points of a hexahedron's grid, their coordinates in it from 0 to 1, and tet4; longer edges have no more cells."""
    grid = numpy.arange((edges + 1) ** 3).reshape([edges + 1] * 3)
    inside = numpy.array(list(numpy.ndindex(edges + 1, edges + 1, edges + 1))) / edges
    u, v, w = inside.T[:, :, None]
    a, b, c, d, e, f, g, h = corners
    low = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)
    high = (1 - v) * ((1 - u) * e + u * f) + v * ((1 - u) * h + u * g)
    points = (1 - w) * low + w * high
    return points, inside, meshes.tetrahedra(grid, points)


def deck(kind, edges, penalty):
    bodies, pairs, friction, axis, answer = heap(kind)
    nodes, elements, surfaces, ground, first, number = "*NODE,NSET=ALL\n", "", "", [], 1, 1
    pushed = []
    wanted = {(pair[k], pair[k + 1]) for pair in pairs for k in (0, 2)}
    for name, (corners, fixed) in bodies.items():
        faces = [face for body, face in wanted if body == name]
        if fixed:
            points, tets = corners, [range(8)]
            surfaces += "".join(f"*SURFACE,NAME={name}S{f},TYPE=ELEMENT\n{number},S{f}\n" for f in faces)
            ground += range(first, first + 8)
        else:
            points, inside, tet4 = cells(corners, edges)
            for f in faces:
                coordinate, side = FACES[f - 1]
                on = numpy.abs(inside[:, coordinate] - side) < 1e-9
                here = [(c, s) for c, s in meshes.outer_faces(tet4) if all(on[tet4[c][k]] for k in meshes.FACES[s - 1])]
                surfaces += meshes.surface_text(f"{name}S{f}", here, number)
            points, tets = meshes.quadratic(points, tet4)
            if name in ("b2", "wedge"):
                pushed = first + numpy.flatnonzero(points[:, 2] > 3 - 1e-9 if kind == "stack" else points[:, 1] < 1e-9 - 0.5)
        nodes += meshes.nodes_text(points, first)
        elements += f"*ELEMENT,TYPE={'C3D8,ELSET=FIXED' if fixed else 'C3D10,ELSET=ROCK'}\n" + meshes.cells_text(tets, first, number)
        first, number = first + len(points), number + len(tets)
    text = nodes + elements + surfaces + meshes.set_text("GROUND", ground) + meshes.set_text("PUSHED", pushed)
    text += f"*MATERIAL,NAME=ROCK\n*ELASTIC\n{MODULUS:g},{POISSON:g}\n*DENSITY\n{DENSITY:g}\n"
    text += "*SOLID SECTION,ELSET=ROCK,MATERIAL=ROCK\n*SOLID SECTION,ELSET=FIXED,MATERIAL=ROCK\n"
    text += meshes.contact_text([(f"{a}S{f}", f"{b}S{g}") for a, f, b, g in pairs], penalty, friction) + "*BOUNDARY\nGROUND,1,3\n"
    for load in (f"*DLOAD\nROCK,GRAV,{GRAVITY:g},0,0,-1\n", f"*BOUNDARY\nPUSHED,{axis + 1},{axis + 1},{PUSH:g}\n"):
        text += f"*STEP,NLGEOM,INC=400\n*STATIC\n0.05,1.0,1e-4,0.05\n{load}"
        text += "*NODE PRINT,NSET=PUSHED,TOTALS=ONLY,FREQUENCY=1\nRF\n*END STEP\n"
    return text, 3 * (first - 1 - len(ground))


def barrier_problem(kind, edges, barrier):
    """The heap for ipc.py: bodies drawn in so that those in touch are a little less than the barrier's distance apart."""
    bodies, _, friction, axis, answer = heap(kind)
    points, tets, faces, labels, fixed, forces, count = [], [], [], [], [], [], 0
    for number, (corners, held) in enumerate(bodies.values(), 1):
        if held:
            places, skin = corners, meshes.box_triangles()
        else:
            places, _, tet4 = cells(corners, edges)
            skin = meshes.triangles(tet4)
            tets.append(count + tet4)
            volumes = abs(numpy.linalg.det(places[tet4[:, 1:]] - places[tet4[:, :1]])) / 6
            weights = numpy.bincount(tet4.ravel(), numpy.repeat(volumes / 4, 4), len(places))
        forces.append(numpy.zeros(len(places)) if held else DENSITY * GRAVITY * weights)
        points.append(drawn_in(places, skin, 0.499 * barrier))
        faces.append(count + skin)
        labels += [0 if held else number] * len(places)
        fixed += range(3 * count, 3 * (count + len(places))) if held else []
        count += len(places)
    tilts = [0.0] + [BEYOND * answer * k / TILTS for k in range(1, TILTS + 1)]
    loads = numpy.zeros((len(tilts), count, 3))
    loads[:, :, 2], loads[:, :, axis] = -numpy.concatenate(forces), numpy.outer(tilts, numpy.concatenate(forces))
    return {
        "points": numpy.vstack(points), "cells": numpy.vstack(tets), "faces": numpy.vstack(faces), "bodies": numpy.array(labels),
        "fixed": numpy.array(fixed), "held": numpy.zeros(0, int), "targets": numpy.zeros((len(tilts), 0)),
        "loads": loads.reshape(len(tilts), -1), "most": MOVED,
        "modulus": MODULUS, "poisson": POISSON, "friction": friction,
        "barrier": barrier, "stiffness": MODULUS, "slip": 1e-6, "drag": 1e-4,
    }, 3 * count - len(fixed)


def case(kind, fidelity, faces, size):
    bodies, _, friction, axis, answer = heap(kind)
    listed = []
    for name, (corners, fixed) in bodies.items():
        middle = corners.mean(axis=0)
        body = {"name": name, "shape": {"polyhedron": (corners - middle).tolist()}, "position": middle.tolist(), "rounding": 1e-3}
        body |= {"fixed": True, "fidelity": "rigid"} if fixed else {"fidelity": fidelity} | ({"mesh_size": size} if size else {})
        listed.append(body)
    tilted = [0, 0, -GRAVITY]
    tilted[axis] = GRAVITY * BEYOND * answer
    return {
        "title": f"{kind} at the limit",
        "scene": {"bodies": listed},
        "rock": {"density": DENSITY, "youngs_modulus": MODULUS, "poissons_ratio": POISSON},
        "contact": {"friction": friction, "faces": faces},
        "stages": [
            {"kind": "load", "increments": 4, "gravity": [0, 0, -GRAVITY]},
            {"kind": "load", "increments": 20, "gravity": tilted},
        ],
        "solver": {"max_dwell": 0},
    }


def yade_settings(kind):
    bodies, _, friction, axis, answer = heap(kind)
    return {
        "bodies": [{"corners": corners.tolist(), "fixed": fixed} for corners, fixed in bodies.values()],
        "modulus": MODULUS, "density": DENSITY, "friction": friction, "gravity": GRAVITY, "axis": axis, "tilt": BEYOND * answer,
        "moved": MOVED, "step": STEP, "steps": STEPS,
    }


def rows(program, folder, limit, has, kind):
    """One row a run: code, setting, unknowns, cost, value, answer. To stop by itself under the tilt is what is asked."""
    *_, answer = heap(kind)
    by = "limit analysis" if kind == "arch" else "closed form"

    def found(cost, share, fell):
        """The tilt at this share of the way to BEYOND; an end by itself, or `fell`, is what is asked."""
        if share <= 0:
            return None
        if cost["trouble"].startswith(("stopped", "did not")) or "did not come" in cost["trouble"] or fell:
            cost["trouble"] = ""
        elif not cost["trouble"]:
            cost["trouble"] = f"stands at {BEYOND} of the limit"
        return BEYOND * answer * share

    for setting, *given in RIPRAP if has["riprap"] else []:
        cost = riprap(program, folder, kind, case(kind, *given), limit)
        ways = [numpy.linalg.norm(body["displacement"], axis=1) for body in cost["bodies"].values()]
        stood = numpy.max(ways, axis=0) < MOVED if ways else numpy.zeros(0, bool)
        share = max(cost["history"]["time"][: len(stood)][stood], default=0) - 1
        yield "riprap", setting, "", cost, found(cost, share, not stood.all()), answer, by
    for setting, *given in CALCULIX if has["CalculiX"] and kind != "arch" else []:
        text, unknowns = deck(kind, *given)
        cost = calculix(folder, kind, text, limit)
        weight = DENSITY * GRAVITY * (3 if kind == "stack" else WEDGE)
        pushes = [abs(force[heap(kind)[3]]) / weight for _, time, force in cost["reactions"] if time > 1]
        yield "CalculiX", setting, unknowns, cost, max(pushes, default=None), 1 / 6 if kind == "stack" else answer, by
    for setting, *given in IPC if has["ipctk"] else []:
        problem, unknowns = barrier_problem(kind, *given)
        cost = potential(folder, kind, problem, limit)
        stood = [row["share"] for row in cost["rows"] if row["rest"] and row["moved"] < MOVED]
        # The first increment is untilted. The limit is taken to be midway to the tilt at which it fell.
        share = max(stood) * (1 + 1 / TILTS) - 0.5 / TILTS if stood else 0.0
        yield "ipctk", setting, unknowns, cost, found(cost, share, len(stood) < len(cost["rows"])), answer, by
    if has["YADE"]:
        cost = measured_yade(folder, os.path.join(HERE, "yade_heap.py"), yade_settings(kind), limit)
        answered = cost["answer"]
        yield "YADE", "polyhedra", "", cost, found(cost, answered["share"], answered["moved"] > MOVED) if answered else None, answer, by
