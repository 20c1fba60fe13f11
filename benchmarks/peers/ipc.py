"""Incremental potential contact on linear tetrahedra: ipctk's barrier and friction in a Newton iteration of this folder's own.

    ipc.py PROBLEM.npz ANSWER.json

Each increment minimises the energy of the solids (St. Venant and Kirchhoff), of the barrier, of friction and of springs that drive
nodes to their targets; friction's normal forces are those of the iterate before, LAGS times an increment. A drag of `drag` a
node towards the increment's start holds what nothing touches. Steps are cut where ipctk says that surfaces would meet.
Where given, `loads` of an increment pull at all freedoms, and a run ends where nodes moved by `most` or did not come to rest.
At rest: the largest force out of balance is BALANCE of the largest force of the barrier at a node.
"""

import json
import sys
import time

import ipctk
import numpy
import scipy.sparse
import scipy.sparse.linalg

BALANCE, FLOOR, LAGS, STEPS = 1e-3, 1e-7, 3, 80
HOLD = 1e6  # stiffness of a driven node's spring in each direction


class Solid:
    """Energy, forces and tangent of linear tetrahedra; forces are gradients of the energy."""

    def __init__(self, points, cells, modulus, poisson):
        self.cells, self.size = cells, points.size
        self.first = modulus * poisson / ((1 + poisson) * (1 - 2 * poisson))
        self.second = modulus / (2 * (1 + poisson))
        edges = numpy.swapaxes(points[cells[:, 1:]] - points[cells[:, :1]], 1, 2)
        self.volumes = numpy.linalg.det(edges) / 6
        inner = numpy.linalg.inv(edges)
        self.slopes = numpy.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)  # of the four shape functions
        freedoms = (3 * cells[:, :, None] + numpy.arange(3)).reshape(len(cells), 12)
        self.rows = numpy.repeat(freedoms, 12, axis=1).ravel()
        self.columns = numpy.tile(freedoms, (1, 12)).ravel()
        self.freedoms = freedoms.ravel()

    def strained(self, x):
        """Deformation gradients, Green's strains and second Piola-Kirchhoff stresses."""
        gradients = numpy.einsum("eai,eaj->eij", x[self.cells], self.slopes)
        strains = (numpy.einsum("eki,ekj->eij", gradients, gradients) - numpy.eye(3)) / 2
        traces = numpy.trace(strains, axis1=1, axis2=2)
        return gradients, strains, self.first * traces[:, None, None] * numpy.eye(3) + 2 * self.second * strains

    def energy(self, x):
        _, strains, stresses = self.strained(x)
        return 0.5 * numpy.einsum("eij,eij,e->", strains, stresses, self.volumes)

    def gradient(self, x):
        gradients, _, stresses = self.strained(x)
        forces = numpy.einsum("e,eij,ejk,eak->eai", self.volumes, gradients, stresses, self.slopes)
        return numpy.bincount(self.freedoms, forces.ravel(), minlength=self.size)

    def hessian(self, x):
        """Without what compression takes from the geometric part, so that it is positive."""
        gradients, _, stresses = self.strained(x)
        values, axes = numpy.linalg.eigh(stresses)
        pulled = numpy.einsum("eij,ej,ekj->eik", axes, numpy.maximum(values, 0), axes)
        turned = numpy.einsum("eij,eaj->eai", gradients, self.slopes)
        alike = numpy.einsum("eai,ebi->eab", self.slopes, self.slopes)
        blocks = self.first * numpy.einsum("eai,ebk->eaibk", turned, turned)
        blocks += self.second * numpy.einsum("ebi,eak->eaibk", turned, turned)
        left = numpy.einsum("eij,ekj->eik", gradients, gradients)
        blocks += self.second * numpy.einsum("eik,eab->eaibk", left, alike)
        geometric = numpy.einsum("eai,eij,ebj->eab", self.slopes, pulled, self.slopes)
        blocks += numpy.einsum("eab,ik->eaibk", geometric, numpy.eye(3))
        blocks *= self.volumes[:, None, None, None, None]
        shape = (self.size, self.size)
        return scipy.sparse.coo_matrix((blocks.ravel(), (self.rows, self.columns)), shape=shape).tocsc()


class Touch:
    """ipctk's barrier and lagged friction between nodes of different bodies."""

    def __init__(self, points, faces, bodies, barrier, stiffness, friction, slip):
        faces = numpy.asfortranarray(faces, dtype=numpy.int32)
        self.mesh = ipctk.CollisionMesh.build_from_full_mesh(points, ipctk.edges(faces), faces)
        kept = bodies[[self.mesh.to_full_vertex_id(k) for k in range(self.mesh.num_vertices)]]
        # Nodes of one body, or of two plates, never touch.
        self.mesh.can_collide = ipctk.make_vertex_patches_filter(numpy.asarray(kept, dtype=numpy.int32))
        self.barrier_distance, self.friction = barrier, friction
        self.barrier = ipctk.BarrierPotential(barrier, stiffness, use_physical_barrier=True)
        self.rubbing = ipctk.FrictionPotential(slip)
        self.lagged, self.start = ipctk.TangentialCollisions(), None

    def places(self, x):
        return numpy.asfortranarray(self.mesh.vertices(numpy.asfortranarray(x)))

    def near(self, v):
        collisions = ipctk.NormalCollisions()
        collisions.use_area_weighting = True
        collisions.build(self.mesh, v, self.barrier_distance)
        return collisions

    def lag(self, x, start):
        """Takes friction's normal forces and directions from x; slip counts from `start`."""
        v, self.start = self.places(x), self.places(start)
        self.lagged = ipctk.TangentialCollisions()
        self.lagged.build(self.mesh, v, self.near(v), self.barrier, self.friction)

    def energy(self, x):
        v = self.places(x)
        return self.barrier(self.near(v), self.mesh, v) + self.rubbing(self.lagged, self.mesh, self.slip(v))

    def gradients(self, x):
        """Of the barrier, and of friction."""
        v = self.places(x)
        pressed = self.barrier.gradient(self.near(v), self.mesh, v)
        rubbed = self.rubbing.gradient(self.lagged, self.mesh, self.slip(v))
        return self.mesh.to_full_dof(pressed), self.mesh.to_full_dof(rubbed)

    def hessian(self, x):
        v, clamp = self.places(x), ipctk.PSDProjectionMethod.CLAMP
        pressed = self.barrier.hessian(self.near(v), self.mesh, v, clamp)
        return self.mesh.to_full_dof(pressed + self.rubbing.hessian(self.lagged, self.mesh, self.slip(v), clamp))

    def slip(self, v):
        return numpy.asfortranarray(v - self.start)

    def free_step(self, x, step):
        """The share of the step that keeps surfaces apart, a tenth of it left as a margin where it is cut."""
        share = ipctk.compute_collision_free_stepsize(self.mesh, self.places(x), self.places(x + step))
        return share if share == 1 else 0.9 * share


class Equilibrium:
    """One increment after another."""

    def __init__(self, given):
        points = numpy.asfortranarray(given["points"])
        self.x = points.copy()
        self.solid = Solid(points, given["cells"], float(given["modulus"]), float(given["poisson"]))
        barrier, stiffness, friction, slip = (float(given[k]) for k in ("barrier", "stiffness", "friction", "slip"))
        self.touch = Touch(points, given["faces"], given["bodies"], barrier, stiffness, friction, slip)
        self.held, self.drag = given["held"], float(given["drag"])  # freedoms
        self.free = numpy.setdiff1d(numpy.arange(points.size), given["fixed"])
        self.targets, self.load, self.start = self.x.ravel()[self.held], numpy.zeros(points.size), self.x.copy()
        self.newtons = 0

    def pulls(self, x):
        """Forces that the springs of driven freedoms exert."""
        return HOLD * (self.targets - x.ravel()[self.held])

    def energy(self, x):
        drag, pulls = self.drag / 2 * ((x - self.start) ** 2).sum(), (self.pulls(x) ** 2).sum() / (2 * HOLD)
        return self.solid.energy(x) + self.touch.energy(x) + drag + pulls - self.load @ (x - self.start).ravel()

    def gradient(self, x):
        """The whole, and the largest of the barrier's forces at a node."""
        pressed, rubbed = self.touch.gradients(x)
        whole = self.solid.gradient(x) + pressed + rubbed + self.drag * (x - self.start).ravel() - self.load
        whole[self.held] -= self.pulls(x)
        return whole, abs(pressed).max()

    def step(self, x, gradient):
        springs = numpy.full(x.size, self.drag)
        springs[self.held] += HOLD
        matrix = self.solid.hessian(x) + self.touch.hessian(x) + scipy.sparse.diags(springs, format="csc")
        matrix = matrix[self.free][:, self.free].tocsc()
        factor = scipy.sparse.linalg.splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
        step = numpy.zeros(x.size)
        step[self.free] = factor.solve(-gradient[self.free])
        return step.reshape(x.shape)

    def rest(self):
        """Newton's iteration; whether it came to rest."""
        energy = self.energy(self.x)
        for _ in range(STEPS):
            gradient, pressed = self.gradient(self.x)
            if abs(gradient[self.free]).max() <= BALANCE * pressed + FLOOR:
                return True
            step, self.newtons = self.step(self.x, gradient), self.newtons + 1
            share = self.touch.free_step(self.x, step)
            for _ in range(30):
                trial = numpy.asfortranarray(self.x + share * step)
                lower = self.energy(trial)
                if lower <= energy + 1e-12 * abs(energy):
                    break
                share /= 2
            else:
                return False
            self.x, energy = trial, lower
        return False

    def advance(self, targets, load):
        """Whether the increment to these targets and loads came to rest with friction's forces settled."""
        self.targets, self.load, self.start = targets, load, self.x.copy()
        return all([self.lagged_rest() for _ in range(LAGS)])

    def lagged_rest(self):
        self.touch.lag(self.x, self.start)
        return self.rest()


def main():
    problem, answer = sys.argv[1:]
    ipctk.set_num_threads(1)
    ipctk.set_logger_level(ipctk.LoggerLevel.error)
    given = dict(numpy.load(problem))
    begun, equilibrium = time.time(), Equilibrium(given)
    rows, count = [], len(given["targets"])
    loads = given.get("loads", numpy.zeros((count, equilibrium.x.size)))
    for number, (targets, load) in enumerate(zip(given["targets"], loads), 1):
        rest = bool(equilibrium.advance(targets, load))
        pulls, axes = equilibrium.pulls(equilibrium.x), given["held"] % 3
        moved = float(numpy.linalg.norm(equilibrium.x - given["points"], axis=1).max())
        rows.append({"share": number / count, "rest": rest, "moved": moved, "newtons": equilibrium.newtons,
                     "seconds": time.time() - begun, "force": [float(pulls[axes == k].sum()) for k in range(3)]})
        with open(answer, "w") as stream:
            json.dump(rows, stream)
        if "most" in given and not (rest and moved < given["most"]):
            break


if __name__ == "__main__":
    main()
