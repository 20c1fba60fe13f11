#!/usr/bin/env python3
"""A bar of tet10 cells pulled, closed and pulled again, by three laws of damage: a scalar one, and two with a potential. Needs numpy and scipy.

    bar.py > bar.csv

Two cubes of 7 mm, six cells each, 25 GPa, 4 MPa in tension (2 % less in one cube), 80 MPa in compression, softening exponent 1.2. The ends are tied along the axis.
The elongation goes to 6, back to -2, to 6 and to 8 times that of the peak, in equal increments; damage and stiffness of an increment follow
its last strain, by repetition.

- scalar: stress (1 - d) C e, d by the tensile share of the principal stresses (riprap's until then).
- split: stress from g+ psi+ + g- psi-, psi+- = lambda/2 <+-tr e>^2 + mu sum <+-e_i>^2 (Miehe et al. 2010), g+ = (1 - d_c)(1 - d_t),
  g- = (1 - d_c)(1 - (1 - w_c) d_t).
- orthogonal: the same with psi- of a solid without tension (Del Piero 1989), psi+ the rest (docs/formulation.md, section 10).

missed: work (trapezoids) less stored energy less what growing damage sets free at fixed strain (trapezoids), over the work. least: the least such work less
stored energy of an increment, over the work; below 0 damage gives energy back.
"""

import csv
import itertools
import sys

import numpy
import scipy.sparse
import scipy.sparse.linalg

EDGE, BRICKS = 7e-3, 2
MODULUS, TENSION, COMPRESSION, EXPONENT = 25e9, 4e6, 80e6, 1.2
SPAN = EDGE * BRICKS
PEAK = TENSION / MODULUS * SPAN
WAY = [0, 6, -2, 6, 8]
MOST_ROUNDS, MOST_GROWTH, FAILED = 120, 0.1, 0.99


def mesh():
    points, cells = {}, []
    number = lambda p: points.setdefault(tuple(round(v, 9) for v in p), len(points))
    for brick in range(BRICKS):
        for order in itertools.permutations(range(3)):
            at = numpy.array([0.0, 0.0, brick])
            corners = [at.copy()]
            for axis in order:
                at[axis] += 1
                corners.append(at.copy())
            if numpy.linalg.det(numpy.array(corners[1:]) - corners[0]) < 0:
                corners[2], corners[3] = corners[3], corners[2]
            middles = [0.5 * (corners[i] + corners[j]) for i, j in EDGES]
            cells.append([number(p) for p in corners + middles])
    return EDGE * numpy.array(list(points)), numpy.array(cells)


EDGES = [(0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3)]


def slopes(r, s, t):
    """Derivatives of the shape functions by r, s, t."""
    area = [1 - r - s - t, r, s, t]
    by = numpy.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    corners = [(4 * area[i] - 1) * by[i] for i in range(4)]
    return numpy.array(corners + [4 * (area[i] * by[j] + area[j] * by[i]) for i, j in EDGES]).T


class Bar:
    def __init__(self, law, recovery, poisson):
        self.law, self.recovery = law, recovery
        self.mu, self.lame = MODULUS / 2 / (1 + poisson), MODULUS * poisson / (1 + poisson) / (1 - 2 * poisson)
        self.nodes, self.cells = mesh()
        inner, outer = 0.1381966011250105, 0.5854101966249685
        strain, volume = [], []
        for place in ((inner,) * 3, (outer, inner, inner), (inner, outer, inner), (inner, inner, outer)):
            of = slopes(*place)
            jacobian = numpy.einsum("an,enk->eak", of, self.nodes[self.cells])
            d = numpy.einsum("eka,an->ekn", numpy.linalg.inv(jacobian), of)
            b = numpy.zeros((len(self.cells), 6, 30))
            for k in range(3):
                b[:, k, k::3] = d[:, k]
                i, j = [(0, 1), (1, 2), (2, 0)][k]
                b[:, 3 + k, i::3], b[:, 3 + k, j::3] = d[:, j], d[:, i]
            strain.append(b)
            volume.append(numpy.linalg.det(jacobian) / 24)
        self.strain, self.volume = numpy.stack(strain, 1).reshape(-1, 6, 30), numpy.stack(volume, 1).ravel()
        self.cell_of = numpy.repeat(numpy.arange(len(self.cells)), 4)
        self.unknowns = (3 * self.cells[:, :, None] + numpy.arange(3)).reshape(-1, 30)
        height = self.nodes[self.cells[:, :4]][:, :, 2].mean(1)
        self.strength = numpy.repeat(numpy.where(numpy.abs(height - SPAN / 2) < EDGE / 2, 0.98 * TENSION, TENSION), 4)
        z = self.nodes[:, 2]
        self.top = 3 * numpy.flatnonzero(z > SPAN - 1e-9) + 2
        origin, beside = (numpy.argmin(numpy.linalg.norm(self.nodes - p, axis=1)) for p in ([0, 0, 0], [EDGE, 0, 0]))
        self.bottom = numpy.concatenate([3 * numpy.flatnonzero(z < 1e-9) + 2, [3 * origin, 3 * origin + 1, 3 * beside + 1]])
        self.displacement = numpy.zeros(3 * len(self.nodes))
        self.histories = numpy.zeros((2, len(self.volume)))

    def strains(self, u):
        return numpy.einsum("pij,pj->pi", self.strain, u[self.unknowns][self.cell_of])

    def damage(self, histories):
        peaks = [self.strength / MODULUS, COMPRESSION / MODULUS]
        parts = [numpy.where(h > p, 1 - (p / numpy.maximum(h, p)) ** EXPONENT, 0) for h, p in zip(histories, peaks)]
        # What has failed keeps a little, so that nothing is singular.
        return [numpy.where(part > FAILED, 1 - 1e-6, part) for part in parts]

    def response(self, strains, histories):
        """Secant stiffness and stored energy per volume of each point."""
        d_t, d_c = self.damage(histories)
        sound = numpy.diag([2 * self.mu] * 3 + [self.mu] * 3)
        sound[:3, :3] += self.lame
        values, axes = principal(strains)
        energy = lambda stiffness: 0.5 * numpy.einsum("pi,pij,pj->p", strains, stiffness, strains)
        if self.law == "scalar":
            stresses = self.lame * values.sum(1)[:, None] + 2 * self.mu * values
            total = numpy.abs(stresses).sum(1)
            share = numpy.where(total > 0, numpy.maximum(stresses, 0).sum(1) / numpy.maximum(total, 1e-300), 0)
            stiffness = sound * ((1 - d_c) * (1 - (1 - self.recovery * (1 - share)) * d_t))[:, None, None]
            return stiffness, energy(stiffness)
        if self.law == "orthogonal":
            closed = self.closed(values, axes)
            d_c, d_t = d_c[:, None, None], d_t[:, None, None]
            left = [(1 - d_c) * (1 - d_t), (1 - d_c) * (1 - (1 - self.recovery) * d_t)]
            stiffness = left[0] * sound + (left[1] - left[0]) * closed
            return stiffness, energy(stiffness)
        onto = numpy.zeros((len(strains), 6, 6))
        for i, j in itertools.product(range(3), repeat=2):
            apart = values[:, i] - values[:, j]
            opens = (values[:, i] > 0).astype(float)
            differ = numpy.abs(apart) > 1e-14
            part = (numpy.maximum(values[:, i], 0) - numpy.maximum(values[:, j], 0)) / numpy.where(differ, apart, 1)
            share = numpy.where(differ, part, opens)
            q = voigt(axes, i, j)
            onto += share[:, None, None] * numpy.einsum("pa,pb->pab", q, q)
        volume = numpy.outer([1, 1, 1, 0, 0, 0], [1, 1, 1, 0, 0, 0])
        swells = (values.sum(1) > 0).astype(float)[:, None, None]
        tensile = self.lame * swells * volume + 2 * self.mu * onto
        compressive = self.lame * (1 - swells) * volume + 2 * self.mu * (numpy.diag([1, 1, 1, 0.5, 0.5, 0.5]) - onto)
        left = [(1 - d_c) * (1 - d_t), (1 - d_c) * (1 - (1 - self.recovery) * d_t)]
        stiffness = left[0][:, None, None] * tensile + left[1][:, None, None] * compressive
        return stiffness, energy(stiffness)

    def closed(self, values, axes):
        """Stiffness of a solid without tension at principal strains (the least first) and axes."""
        lame, mu, e, n = self.lame, self.mu, values[:, ::-1], axes[:, :, ::-1]
        plane, young = 2 * mu * lame / (lame + 2 * mu), mu * (3 * lame + 2 * mu) / (lame + mu)
        pulled = [lame * e.sum(1) + 2 * mu * e[:, 0], plane * (e[:, 1] + e[:, 2]) + 2 * mu * e[:, 1], e[:, 2]]
        opened = numpy.cumprod(numpy.stack(pulled, 1) > 0, 1).sum(1)
        of = numpy.zeros((4, 3, 3))  # by the number of open directions: a solid, a sheet, a bar, nothing
        of[0] = lame + 2 * mu * numpy.eye(3)
        of[1, 1:, 1:] = plane + 2 * mu * numpy.eye(2)
        of[2, 2, 2] = young
        stiffness = of[opened]
        stresses = numpy.einsum("pij,pj->pi", stiffness, e)
        out = numpy.zeros((len(e), 6, 6))
        for i, j in itertools.product(range(3), repeat=2):
            out += stiffness[:, i, j][:, None, None] * numpy.einsum("pa,pb->pab", voigt(n, i, i), voigt(n, j, j))
            if i < j:
                apart = e[:, i] - e[:, j]
                ratio = numpy.clip((stresses[:, i] - stresses[:, j]) / numpy.where(apart > 1e-14, apart, 1), 0, 2 * mu)
                turning = numpy.where((opened > i) & (opened <= j) & (apart > 1e-14), ratio, numpy.where(opened > i, 0, 2 * mu))
                q = voigt(n, i, j)
                out += 2 * turning[:, None, None] * numpy.einsum("pa,pb->pab", q, q)
        return out

    def stored(self, strains, histories):
        return (self.volume * self.response(strains, histories)[1]).sum()

    def grown(self, strains, histories):
        """Histories at these strains, damage growing by so much at most; and whether all grew as asked."""
        values, _ = principal(strains)
        asked = [numpy.linalg.norm(numpy.maximum(sign * values, 0), axis=1) for sign in (1, -1)]
        new = numpy.maximum(histories, asked)
        before, after = self.damage(histories)[0], self.damage(new)[0]
        too_much = after - before > MOST_GROWTH
        most = numpy.minimum(before + MOST_GROWTH, FAILED + 1e-4)
        held = self.strength / MODULUS * (1 - most) ** (-1 / EXPONENT)
        new[0] = numpy.where(too_much, numpy.maximum(histories[0], held), new[0])
        return new, not too_much.any()

    def pull(self, elongation):
        """Displacements, strains, histories and force at an elongation, and the rounds that it took."""
        u, histories = self.displacement, self.histories
        strains = self.strains(u)
        held = numpy.concatenate([self.bottom, self.top])
        values = numpy.concatenate([numpy.zeros(len(self.bottom)), numpy.full(len(self.top), elongation)])
        free = numpy.setdiff1d(numpy.arange(len(u)), held)
        rows, columns = numpy.repeat(self.unknowns, 30, 1).ravel(), numpy.tile(self.unknowns, (1, 30)).ravel()
        for rounds in range(1, MOST_ROUNDS + 1):
            stiffness, _ = self.response(strains, histories)
            cells = numpy.einsum("p,pia,pij,pjb->pab", self.volume, self.strain, stiffness, self.strain, optimize=True)
            cells = cells.reshape(len(self.cells), 4, 30, 30).sum(1)
            matrix = scipy.sparse.csc_matrix((cells.ravel(), (rows, columns)), [len(u)] * 2)
            u = numpy.zeros(len(u))
            u[held] = values
            u[free] = scipy.sparse.linalg.splu(matrix[free][:, free].tocsc()).solve(-(matrix @ u)[free])
            found = self.strains(u)
            new, is_all = self.grown(found, histories)
            moved = numpy.abs(found - strains).max() / max(numpy.abs(found).max(), 1e-12)
            moved = max(moved, (numpy.abs(new - histories) / numpy.maximum(histories, 1e-12)).max())
            strains, histories = found, new
            if is_all and moved < 1e-9:
                break
        return u, strains, histories, (matrix @ u)[self.top].sum(), rounds


def voigt(axes, i, j):
    """The symmetric product of two axes."""
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
    return numpy.stack([0.5 * (axes[:, a, i] * axes[:, b, j] + axes[:, b, i] * axes[:, a, j]) for a, b in pairs], 1)


def principal(strains):
    tensor = numpy.zeros((len(strains), 3, 3))
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))):
        tensor[:, i, j] = tensor[:, j, i] = strains[:, k] * (1 if k < 3 else 0.5)
    return numpy.linalg.eigh(tensor)


def cycle(law, recovery, poisson, increments):
    bar = Bar(law, recovery, poisson)
    work = freed = least = stored = force = elongation = 0.0
    rounds, forces = 0, []
    for start, end in zip(WAY, WAY[1:]):
        for k in range(1, increments + 1):
            to = PEAK * (start + (end - start) * k / increments)
            before, histories = bar.strains(bar.displacement), bar.histories
            u, strains, new, now, took = bar.pull(to)
            set_free = [bar.stored(at, histories) - bar.stored(at, new) for at in (before, strains)]
            step, after = 0.5 * (force + now) * (to - elongation), bar.stored(strains, new)
            work, freed, rounds = work + step, freed + 0.5 * sum(set_free), rounds + took
            least = min(least, step - (after - stored))
            bar.displacement, bar.histories = u, new
            stored, force, elongation = after, now, to
        forces.append(force / (TENSION * EDGE**2))
    return [law, recovery, poisson, 4 * increments, *(f"{x:.4g}" for x in (work, (work - stored - freed) / work, least / work, *forces)), rounds]


if __name__ == "__main__":
    table = csv.writer(sys.stdout, lineterminator="\n")
    table.writerow(["law", "recovery_in_compression", "poissons_ratio", "increments", "work_J", "missed", "least",
                    "force_pulled", "force_closed", "force_pulled_again", "force_end", "rounds"])
    for poisson in (0.0, 0.2):
        for recovery in (0.0, 0.3, 1.0):
            for law in ("scalar", "split", "orthogonal"):
                for increments in (8, 32):
                    table.writerow(cycle(law, recovery, poisson, increments))
                    sys.stdout.flush()
