#!/usr/bin/env python3
"""An elastic ball on a rigid plane without friction, by axisymmetric six-node triangles: force over Hertz's at an approach of R t^2.

    benchmarks/peers/axisymmetric.py [POISSON]

Two ways to press it: `whole`, the ball's mean motion is prescribed and uniform inertia balances the plane; `half`, the middle plane of the lower half is.
Its nodes lie on the ball, those on the surface touch. Meshes are graded towards the pole and refined three times.
"""

import math
import sys

import numpy
import scipy.sparse
import scipy.sparse.linalg


def graded(contact, fine, end):
    """Places from 0 to `end`: steps of a share `fine` of the contact radius, from one and a half of it on growing with the way."""
    places = [0.0]
    while places[-1] < end:
        places.append(places[-1] + fine * max(contact, places[-1] - 0.5 * contact))
    return numpy.array(places) * end / places[-1]


def mesh(t, fine, whole):
    """Nodes (radius, height) and triangles of the half disc, or the quarter below the centre; the pole is at the origin, R = 1."""
    angles = graded(t, fine, math.pi if whole else math.pi / 2)
    depths = graded(t, fine, 1.0)
    fill = lambda p: numpy.sort(numpy.concatenate([p, 0.5 * (p[1:] + p[:-1])]))
    angles, depths = fill(angles), fill(depths)
    number, points, cells = {}, [], []

    def node(i, k):
        # At the centre all angles are one point.
        key = (0, k) if k == len(depths) - 1 else (i, k)
        if key not in number:
            r = 1 - depths[k]
            number[key] = len(points)
            points.append((r * math.sin(angles[i]) if r else 0.0, 1 - r * math.cos(angles[i])))
        return number[key]

    for i in range(0, len(angles) - 1, 2):
        for k in range(0, len(depths) - 1, 2):
            quad = [[node(i + a, k + b) for b in range(3)] for a in range(3)]
            inner = k + 2 < len(depths) - 1
            cells.append([quad[0][0], quad[2][0], quad[0][2], quad[1][0], quad[1][1] if inner else quad[2][1], quad[0][1]])
            if inner:
                cells.append([quad[2][0], quad[2][2], quad[0][2], quad[2][1], quad[1][2], quad[1][1]])
    used, cells = numpy.unique(cells, return_inverse=True)
    return numpy.array(points)[used], cells.reshape(-1, 6)


def assembled(x, cells, modulus, poisson):
    """Stiffness and vertical mass of unit density."""
    shear, lame = modulus / 2 / (1 + poisson), modulus * poisson / (1 + poisson) / (1 - 2 * poisson)
    law = numpy.diag([2 * shear] * 3 + [shear])
    law[:3, :3] += lame
    a, b = 0.445948490915965, 0.091576213509771
    rule = [(p, q, w) for c, w in ((a, 0.223381589678011), (b, 0.109951743655322))
            for p, q in ((c, c), (1 - 2 * c, c), (c, 1 - 2 * c))]
    count = len(cells)
    stiffness, mass = numpy.zeros((count, 12, 12)), numpy.zeros((count, 6))
    for r, s, w in rule:
        q = 1 - r - s
        shape = numpy.array([q * (2 * q - 1), r * (2 * r - 1), s * (2 * s - 1), 4 * q * r, 4 * r * s, 4 * s * q])
        slope = numpy.array([[1 - 4 * q, 4 * r - 1, 0, 4 * (q - r), 4 * s, -4 * s], [1 - 4 * q, 0, 4 * s - 1, -4 * r, 4 * r, 4 * (q - s)]])
        jacobian = numpy.einsum("an,enk->eak", slope, x[cells])
        d = numpy.einsum("eka,an->ekn", numpy.linalg.inv(jacobian), slope)
        radius = x[cells][:, :, 0] @ shape
        strain = numpy.zeros((count, 4, 12))
        strain[:, 0, 0::2], strain[:, 1, 1::2], strain[:, 2, 0::2] = d[:, 0], d[:, 1], shape / radius[:, None]
        strain[:, 3, 0::2], strain[:, 3, 1::2] = d[:, 1], d[:, 0]
        volume = math.pi * radius * numpy.abs(numpy.linalg.det(jacobian)) * w
        stiffness += numpy.einsum("e,eia,ij,ejb->eab", volume, strain, law, strain, optimize=True)
        mass += volume[:, None] * shape
    unknowns = numpy.stack([2 * cells, 2 * cells + 1], 2).reshape(count, 12)
    rows, columns = numpy.repeat(unknowns, 12, 1).ravel(), numpy.tile(unknowns, (1, 12)).ravel()
    total = numpy.zeros(2 * len(x))
    numpy.add.at(total, 2 * cells + 1, mass)
    return scipy.sparse.csc_matrix((stiffness.ravel(), (rows, columns)), [2 * len(x)] * 2), total


def over_hertz(t, fine, poisson, whole):
    x, cells = mesh(t, fine, whole)
    stiffness, mass = assembled(x, cells, 1.0, poisson)
    approach, n = t * t, len(mass)
    touching = numpy.flatnonzero((numpy.abs(numpy.hypot(x[:, 0], x[:, 1] - 1) - 1) < 1e-9) & (x[:, 0] < 2 * t) & (x[:, 1] < 1))
    axis = 2 * numpy.flatnonzero(x[:, 0] < 1e-12)
    driven = numpy.zeros(0, int) if whole else 2 * numpy.flatnonzero(x[:, 1] > 1 - 1e-9) + 1
    weights = scipy.sparse.csc_matrix(mass[:, None] / mass.sum())
    matrix = scipy.sparse.bmat([[stiffness, weights], [weights.T, None]] if whole else [[stiffness]]).tocsc()
    load = numpy.zeros(matrix.shape[0])
    load[n:] = -approach
    active = touching[x[touching, 0] < t]
    while True:
        held = numpy.concatenate([axis, driven, 2 * active + 1])
        u = numpy.zeros(len(load))
        u[driven], u[2 * active + 1] = -approach, -x[active, 1]
        free = numpy.setdiff1d(numpy.arange(len(load)), held)
        u[free] = scipy.sparse.linalg.splu(matrix[free][:, free]).solve((load - matrix @ u)[free])
        force, gap = (matrix @ u)[2 * active + 1], x[touching, 1] + u[2 * touching + 1]
        fitting = numpy.union1d(active[force > 0], touching[gap < -1e-14])
        if len(fitting) == len(active) and (fitting == active).all():
            return force.sum() / (4 / 3 / (1 - poisson**2) * t**3)
        active = fitting


if __name__ == "__main__":
    poisson = float(sys.argv[1]) if len(sys.argv) > 1 else 0.2
    for t in (0.1, 0.05, 0.025):
        for whole in (True, False):
            found = ", ".join(f"{over_hertz(t, fine, poisson, whole):.4f}" for fine in (0.2, 0.1, 0.05))
            print(f"nu {poisson}, t {t}, {'whole' if whole else 'half'}: {found}", flush=True)
