"""Twelve polyhedra between six plates, the lid driven down: the force on the lid.

`benchmarks/peers/cases/pile_closed.json`: they fill the box, face on face. `pile_gapped.json` beside it: gaps of 0.012 a side close first.
CalculiX has the meshes that riprap makes of the grains, as tet4 (corner nodes alone). No closed form: the reference is CalculiX
with the stiffest penalty in the table. The force of a run that stops is compared with the reference's at that share of the way.
Sticking is a hundred times softer than the penalty: as stiff as it, the closed pile's first increment did not converge and was cut.
In the gapped pile soft springs to ground hold each grain in CalculiX until it is touched. riprap needs none.
ipctk has the same tet4, and a drag as soft as those springs. Its barrier acts from a distance: in the gapped pile gaps are
shorter by that, in the closed one grains and plates are drawn apart by it.
"""

import itertools
import os

import numpy
import scipy.optimize

import meshes
from codes import calculix, potential, read_case, riprap, riprap_meshes

HERE = os.path.dirname(os.path.abspath(__file__))
SPRING = 0.03  # stiffness of each of nine springs a grain
REACH = 0.06  # faces nearer than this may touch
# Of each plate: the face that looks inward, in CalculiX's numbering of C3D8, and its normal.
INWARD = {
    "zl": (2, (0, 0, 1)),
    "zh": (1, (0, 0, -1)),
    "xl": (4, (1, 0, 0)),
    "xh": (6, (-1, 0, 0)),
    "yl": (5, (0, 1, 0)),
    "yh": (3, (0, -1, 0)),
}

CALCULIX = {
    "closed": [("tet4, K=2e5", 2e5), ("tet4, K=2e4", 2e4)],
    "gapped": [("tet4, K=2e5, soft springs", 2e5), ("tet4, K=2e4, soft springs", 2e4)],
}
# Barrier distances. The closed pile's grains and plates are drawn in by half of it: bodies in touch have no distance.
IPC = {
    "closed": [("tet4, barrier 2e-3", 2e-3), ("tet4, barrier 5e-4", 5e-4)],
    "gapped": [("tet4, barrier 2e-3", 2e-3), ("tet4, barrier 5e-4", 5e-4)],
}
INCREMENTS = 12
RIPRAP = [
    (f"{fidelity}, {faces}", ["--fidelity", fidelity, "--set", f'/contact/faces="{faces}"'])
    for fidelity, faces in [("rigid", "corners"), ("condensed", "corners"), ("rigid", "area"), ("condensed", "area"), ("full", "area")]
]


def facing(points, cell, face, number):
    """(cell number, face, centroid, outward normal) of a face of a cell."""
    a, b, c = (points[cell[k]] for k in meshes.FACES[face - 1])
    normal = numpy.cross(b - a, c - a)
    normal *= numpy.sign(numpy.dot(normal, a - points[cell].mean(0))) / numpy.linalg.norm(normal)
    return number, face, (a + b + c) / 3, normal


def opposite(mine, others):
    """Of these faces: those that have one of the others before them, near and turned towards them."""
    centres, normals = numpy.array([o[2] for o in others]), numpy.array([o[3] for o in others])
    found = []
    for number, face, centre, normal in mine:
        way = centres - centre
        if ((normals @ normal < -0.9) & (numpy.abs(way @ normal) < REACH) & (numpy.linalg.norm(way, axis=1) < 0.3)).any():
            found.append((number, face))
    return found


def pairs_of(faces, case):
    """Slave and master surface of each pair that may touch, and the text that defines the surfaces.

    Only faces that look at each other: whole skins would touch the far sides of their partners, too.
    """
    pairs, text = [], ""
    for a, b in itertools.combinations(faces, 2):
        slave, master = opposite(faces[a], faces[b]), opposite(faces[b], faces[a])
        if slave and master:
            names = f"{a}ON{b}".upper(), f"{b}UNDER{a}".upper()
            text += meshes.surface_text(names[0], slave, 0) + meshes.surface_text(names[1], master, 0)
            pairs.append(names)
    plates = {body["name"]: body for body in case["scene"]["bodies"] if body["name"] in INWARD}
    for (grain, of_grain), (plate, (_, inward)) in itertools.product(faces.items(), INWARD.items()):
        inward, body = numpy.array(inward), plates[plate]
        surface = numpy.dot(inward, body["position"]) + numpy.abs(inward) @ body["shape"]["box"] / 2
        touching = [(c, f) for c, f, centre, normal in of_grain if normal @ inward < -0.9 and abs(centre @ inward - surface) < REACH]
        if touching:
            name = f"{grain}ON{plate}".upper()
            text += meshes.surface_text(name, touching, 0)
            pairs.append((name, plate.upper()))
    return pairs, text


def deck(case, bodies, penalty, springs):
    """The deck and its unknowns. `bodies`: points and tet10 cells of each grain."""
    nodes, cells, surfaces, faces, ground, spring_nodes = "*NODE,NSET=ALL\n", "", "", {}, "", []
    node, cell, unknowns = 1, 1, 0
    for k, (name, (points, tet10)) in enumerate(bodies.items()):
        used, tet4 = corners(tet10)
        points = points[used]
        nodes += meshes.nodes_text(points, node)
        cells += "*ELEMENT,TYPE=C3D4,ELSET=GRAINS\n" + meshes.cells_text(tet4, node, cell)
        faces[name] = [facing(points, tet4[c], f, cell + c) for c, f in meshes.outer_faces(tet4)]
        # Three nodes far apart.
        first = 0
        second = int(numpy.argmax(numpy.linalg.norm(points - points[first], axis=1)))
        off = numpy.cross(points - points[first], points[second] - points[first])
        spring_nodes += [node + n for n in (first, second, int(numpy.argmax(numpy.linalg.norm(off, axis=1))))]
        node, cell, unknowns = node + len(points), cell + len(tet4), unknowns + 3 * len(points)
    for body in case["scene"]["bodies"]:
        name = body["name"]
        if name in bodies:
            continue
        centre, size = numpy.array(body["position"]), numpy.array(body["shape"]["box"])
        nodes += meshes.nodes_text(meshes.box_points(centre - size / 2, centre + size / 2), node)
        cells += "*ELEMENT,TYPE=C3D8,ELSET=PLATES\n" + meshes.cells_text([range(8)], node, cell)
        surfaces += f"*SURFACE,NAME={name.upper()},TYPE=ELEMENT\n{cell},S{INWARD[name][0]}\n"
        ground += meshes.set_text(name.upper(), range(node, node + 8))
        node, cell = node + 8, cell + 1
    if springs:
        for direction in (1, 2, 3):
            cells += f"*ELEMENT,TYPE=SPRING1,ELSET=SPRINGS{direction}\n"
            for n in spring_nodes:
                cells += f"{cell},{n}\n"
                cell += 1
            cells += f"*SPRING,ELSET=SPRINGS{direction}\n{direction}\n{SPRING:g}\n"
    pairs, pair_text = pairs_of(faces, case)
    surfaces += pair_text
    rock, friction = case["rock"], case["contact"]["friction"]
    text = nodes + cells + surfaces + ground
    text += f"*MATERIAL,NAME=ROCK\n*ELASTIC\n{rock['youngs_modulus']:g},{rock['poissons_ratio']:g}\n"
    text += "*SOLID SECTION,ELSET=GRAINS,MATERIAL=ROCK\n*SOLID SECTION,ELSET=PLATES,MATERIAL=ROCK\n"
    text += meshes.contact_text(pairs, penalty, friction, penalty / 100)
    text += "*BOUNDARY\n" + "".join(f"{p},1,3\n" for p in ("ZL", "XL", "XH", "YL", "YH")) + "ZH,1,2\n"
    way = case["stages"][0]["bodies"]["zh"]["displacement"][2]
    text += "*STEP,NLGEOM,INC=400\n*STATIC\n0.1,1.0,1e-4,0.2\n"
    text += f"*BOUNDARY\nZH,3,3,{way:g}\n*NODE PRINT,NSET=ZH,TOTALS=ONLY,FREQUENCY=1\nRF\n*END STEP\n"
    return text, unknowns


def corners(tet10):
    """Corner nodes that cells use, and the cells as tet4 on them."""
    used, local = numpy.unique(tet10[:, :4], return_inverse=True)
    return used, local.reshape(-1, 4)


def drawn_in(points, faces, depth):
    """The points, each of the surface moved by the least way that takes all of its faces' planes inward by `depth` or more.

    The least way within half spaces by Lawson and Hanson (1974), chapter 23.
    """
    normals = numpy.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    normals /= numpy.linalg.norm(normals, axis=1)[:, None]
    moved, last = points.copy(), numpy.array([0.0, 0.0, 0.0, 1.0])
    for node in numpy.unique(faces):
        planes = normals[(faces == node).any(axis=1)]
        system = numpy.vstack([-planes.T, numpy.ones(len(planes))])
        residual = system @ scipy.optimize.nnls(system, last)[0] - last
        moved[node] -= depth * residual[:3] / residual[3]
    return moved


def barrier_problem(case, bodies, barrier, inward):
    """The pile for ipc.py: grains drawn in by `inward`, plates out by it, the lid driven down in equal increments."""
    points, cells, faces, labels, count = [], [], [], [], 0
    for number, (places, tet10) in enumerate(bodies.values(), 1):
        used, tet4 = corners(tet10)
        skin = meshes.triangles(tet4)
        points.append(drawn_in(places[used], skin, inward))
        cells.append(count + tet4)
        faces.append(count + skin)
        labels += [number] * len(used)
        count += len(used)
    grains, lid = count, []
    for body in case["scene"]["bodies"]:
        if body["name"] in bodies:
            continue
        way = -inward * numpy.array(INWARD[body["name"]][1])
        centre, size = numpy.array(body["position"]) + way, numpy.array(body["shape"]["box"])
        points.append(meshes.box_points(centre - size / 2, centre + size / 2))
        faces.append(meshes.box_triangles(count))
        labels += [0] * 8
        lid = list(range(count, count + 8)) if body["name"] == "zh" else lid
        count += 8
    points, held = numpy.vstack(points), (3 * numpy.array(lid)[:, None] + numpy.arange(3)).ravel()
    down = numpy.array([0, 0, case["stages"][0]["bodies"]["zh"]["displacement"][2]])
    rock = case["rock"]
    return {
        "points": points, "cells": numpy.vstack(cells), "faces": numpy.vstack(faces), "bodies": numpy.array(labels),
        "fixed": numpy.setdiff1d(3 * grains + numpy.arange(3 * (count - grains)), held),
        "held": held,
        "targets": numpy.array([(points[lid] + down * k / INCREMENTS).ravel() for k in range(1, INCREMENTS + 1)]),
        "modulus": rock["youngs_modulus"], "poisson": rock["poissons_ratio"], "friction": case["contact"]["friction"],
        "barrier": barrier, "stiffness": rock["youngs_modulus"], "slip": 1e-5, "drag": 9 * SPRING * len(bodies) / grains,
    }, 3 * grains


def rows(program, folder, limit, has, kind):
    """One row a run: code, setting, unknowns, cost, value, answer."""
    case = read_case(os.path.join(HERE, "cases", f"pile_{kind}.json"))
    by, reference = "CalculiX, " + CALCULIX[kind][0][0], None
    meshed = {name: mesh for name, mesh in riprap_meshes(program, folder, "mesh", case).items() if name.startswith("g")}
    if has["CalculiX"]:
        for setting, penalty in CALCULIX[kind]:
            text, unknowns = deck(case, meshed, penalty, kind == "gapped")
            cost = calculix(folder, "pile", text, limit)
            times = [0.0] + [time for _, time, _ in cost["reactions"]]
            forces = [0.0] + [abs(force[2]) for _, _, force in cost["reactions"]]
            if reference is None and not cost["trouble"]:
                reference = times, forces
            answer = numpy.interp(times[-1], *reference) if reference else None
            yield "CalculiX", setting, unknowns, cost, forces[-1] if times[-1] > 0 else None, answer, by
    for setting, barrier in IPC[kind] if has["ipctk"] else []:
        problem, unknowns = barrier_problem(case, meshed, barrier, barrier / 2 if kind == "closed" else 0.0)
        cost = potential(folder, "pile", problem, limit)
        last = cost["rows"][-1] if cost["rows"] else {"share": 0.0, "force": (0.0, 0.0, 0.0)}
        answer = numpy.interp(last["share"], *reference) if reference else None
        yield "ipctk", setting, unknowns, cost, abs(last["force"][2]) if cost["rows"] else None, answer, by
    for setting, options in RIPRAP if has["riprap"] else []:
        cost = riprap(program, folder, "pile", case, limit, options)
        forces = cost["bodies"].get("zh", {}).get("reaction_force", [])
        answer = numpy.interp(cost["reached"], *reference) if reference else None
        yield "riprap", setting, "", cost, abs(forces[-1][2]) if len(forces) else None, answer, by
