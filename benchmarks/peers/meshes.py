"""Structured tetrahedral meshes, and the parts of CalculiX decks that are the same in every problem.

Cells are tet10 in the order of nodes of CalculiX and VTK: four corners, then edges 01, 12, 20, 03, 13, 23.
"""

import itertools

import numpy

EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
# Faces of a tetrahedron by corner, in CalculiX's numbering S1 to S4.
FACES = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]


def tetrahedra(grid, place):
    """Kuhn's six tetrahedra in each hexahedron of a grid of node numbers; those that collapsed edges flatten are left out."""
    cells = []
    shape = grid.shape
    for i, j, k in itertools.product(*(range(n - 1) for n in shape)):
        for order in itertools.permutations(range(3)):
            corner = [i, j, k]
            cell = [grid[i, j, k]]
            for axis in order:
                corner[axis] += 1
                cell.append(grid[tuple(corner)])
            if len(set(cell)) == 4:
                a, b, c, d = (place[n] for n in cell)
                volume = numpy.dot(numpy.cross(b - a, c - a), d - a)
                cells.append(cell if volume > 0 else [cell[0], cell[2], cell[1], cell[3]])
    return numpy.array(cells)


def merged(points, size):
    """Numbers of points, equal ones alike, and the points so numbered."""
    keys = numpy.round(points / (1e-7 * size)).astype(numpy.int64)
    _, first, number = numpy.unique(keys, axis=0, return_index=True, return_inverse=True)
    return number.reshape(-1), points[first]


def quadratic(points, cells, curve=None):
    """tet10 from tet4: a node in the middle of each edge. `curve(a, b, middle)` may move it onto a boundary."""
    points, number, out = list(points), {}, []
    for cell in cells:
        row = list(cell)
        for i, j in EDGES:
            edge = tuple(sorted((cell[i], cell[j])))
            if edge not in number:
                a, b = points[edge[0]], points[edge[1]]
                middle = (a + b) / 2
                number[edge] = len(points)
                points.append(curve(a, b, middle) if curve else middle)
            row.append(number[edge])
        out.append(row)
    return numpy.array(points), numpy.array(out)


def outer_faces(cells):
    """[(cell, face from 1)] of the faces that one cell alone has."""
    seen = {}
    for c, cell in enumerate(cells):
        for f, face in enumerate(FACES):
            seen.setdefault(tuple(sorted(cell[k] for k in face)), []).append((c, f + 1))
    return [places[0] for places in seen.values() if len(places) == 1]


def box_triangles(first=0):
    """The surface of box_points as triangles, normals outward."""
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return first + numpy.array([(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads])


def triangles(cells):
    """The outer triangles of tetrahedra, normals outward."""
    return numpy.array([[cells[c][k] for k in reversed(FACES[f - 1])] for c, f in outer_faces(cells)])


def nodes_text(points, first=1):
    return "".join(f"{first + n},{x:.12g},{y:.12g},{z:.12g}\n" for n, (x, y, z) in enumerate(points))


def cells_text(cells, first_node=1, first_cell=1):
    return "".join(f"{first_cell + c}," + ",".join(str(first_node + n) for n in cell) + "\n" for c, cell in enumerate(cells))


def set_text(name, numbers):
    return f"*NSET,NSET={name}\n" + "".join(f"{n}\n" for n in sorted(numbers))


def surface_text(name, faces, first_cell=1):
    return f"*SURFACE,NAME={name},TYPE=ELEMENT\n" + "".join(f"{first_cell + c},S{f}\n" for c, f in faces)


def box_points(low, high):
    """Corners of a box in CalculiX's order for C3D8; its faces S1 to S6 are z low, z high, y low, x high, y high, x low."""
    (a, b, c), (d, e, f) = low, high
    return numpy.array([(a, b, c), (d, b, c), (d, e, c), (a, e, c), (a, b, f), (d, b, f), (d, e, f), (a, e, f)], dtype=float)


def contact_text(pairs, penalty, friction=None, stick=None):
    """Face-to-face penalty contact of (slave, master) surfaces; sticking by `stick` in place of the normal direction's penalty."""
    text = "*SURFACE INTERACTION,NAME=TOUCH\n*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR\n" + f"{penalty:g}\n"
    if friction:
        text += f"*FRICTION\n{friction:g},{stick or penalty:g}\n"
    return text + "".join(f"*CONTACT PAIR,INTERACTION=TOUCH,TYPE=SURFACE TO SURFACE\n{a},{b}\n" for a, b in pairs)
