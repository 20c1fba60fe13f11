"""A triaxial test of random convex polyhedra by YADE, as far as an allowance of CPU time goes.

    SETTINGS='{"pressure": 8e5, ...}' ANSWER=out.json yade -n -x -j1 yade_polyhedra.py

Polyhedra with 8 to 16 corners on spheres of the grading fill a box of six frictionless walls without touching. Each wall moves by what
its pressure lacks, at SPEED at most, until the forces are within 1 % of the pressure and the unbalanced ratio is below 1e-2, or
`settle_s` CPU seconds are gone. Then the two walls across z close at a strain rate by its inertial number, the others keep the pressure.
`modulus` is the material's `young` [N/m3]: the normal force is half of it times the volume of overlap. The tangential stiffness [N/m]
is half of young * poisson, so `poisson` is by default an area: AREA, a tenth of the smallest diameter squared. With a Poisson ratio of
0.2 in its place tangential springs are some thousand times too stiff for the step.
The step is a share of sqrt(mass / (modulus * AREA)) of the smallest grain.
The unbalanced ratio is YADE's: mean force out of balance over mean contact force.
"""

import json
import math
import os
import time

import numpy
from yade import pack, polyhedra_utils

settings = json.loads(os.environ["SETTINGS"])
PRESSURE, DENSITY, FRICTION = settings["pressure"], settings["density"], settings["friction"]
SIZES, SHARES, GRAINS = settings["sizes"], settings["shares"], settings["grains"]
MIDDLE = (SIZES[0] + SIZES[-1]) / 2
LOOSE = 0.65  # porosity of the spheres in which the polyhedra are
SPEED, SETTLED, SHARE = 3.0, 1e-2, 0.25
AREA = 0.1 * SIZES[0] ** 2
POISSON = settings.get("poisson", AREA)
random = numpy.random.default_rng(settings["seed"])


def polyhedron(rock, centre, radius):
    """The hull of 8 to 16 random points on a sphere."""
    points = random.normal(size=(random.integers(8, 17), 3))
    points *= radius / numpy.linalg.norm(points, axis=1)[:, None]
    return polyhedra_utils.polyhedra(rock, v=[Vector3(*(numpy.array(centre) + point)) for point in points])


def fill():
    """The grains and the ids of the walls, low and high across x, y and z."""
    rock = PolyhedraMat(young=settings["modulus"], poisson=POISSON, frictionAngle=math.atan(0.2), density=DENSITY, label="rock")
    smooth = PolyhedraMat(young=settings["modulus"], poisson=POISSON, frictionAngle=0, density=DENSITY, label="smooth")
    O.materials.append(rock)
    O.materials.append(smooth)
    # Grains in a volume of one, sizes even by mass between those of the grading.
    numbers = sum((q - p) * 3 / math.pi * (a**-2 - b**-2) / (b - a) for a, b, p, q in zip(SIZES, SIZES[1:], SHARES, SHARES[1:]))
    side = (GRAINS / numbers / (1 - LOOSE)) ** (1 / 3)
    cloud = pack.SpherePack()
    count = cloud.makeCloud((0, 0, 0), (side, side, side), psdSizes=SIZES, psdCumm=SHARES, num=GRAINS, distributeMass=True,
                            seed=settings["seed"])
    for centre, radius in cloud:
        O.bodies.append(polyhedron(rock, centre, radius))
    walls = [O.bodies.append(wall(place, axis=axis, sense=0, material=smooth)) for axis in range(3) for place in (0, side)]
    smallest = min(b.state.mass for b in O.bodies if b.id not in walls)
    O.dt = SHARE * math.sqrt(smallest / (settings["modulus"] * AREA))
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Polyhedra_Aabb(), Bo1_Wall_Aabb()], verletDist=0.05 * SIZES[0]),
        InteractionLoop([Ig2_Polyhedra_Polyhedra_PolyhedraGeom(), Ig2_Wall_Polyhedra_PolyhedraGeom()],
                        [Ip2_PolyhedraMat_PolyhedraMat_PolyhedraPhys()], [Law2_PolyhedraGeom_PolyhedraPhys_Volumetric()]),
        PyRunner(command="steer()", iterPeriod=1),
        NewtonIntegrator(damping=0.3),
    ]
    return walls, count


def lengths():
    return [O.bodies[walls[2 * k + 1]].state.pos[k] - O.bodies[walls[2 * k]].state.pos[k] for k in range(3)]


def pressures():
    """On each wall, positive in compression."""
    size = lengths()
    volume = size[0] * size[1] * size[2]
    return [abs(O.forces.f(number)[k // 2]) * size[k // 2] / volume for k, number in enumerate(walls)]


def steer():
    """Moves the walls: by what pressure lacks, or across z at the rate of shear."""
    size = lengths()
    for k, pressure in enumerate(pressures()):
        axis, inward = k // 2, 1 - 2 * (k % 2)
        speed = SPEED * max(-1.0, min(1.0, 1 - pressure / PRESSURE))
        if rate and axis == 2:
            speed = rate * size[2] / 2
        velocity = Vector3(0, 0, 0)
        velocity[axis] = inward * speed
        O.bodies[walls[k]].state.vel = velocity


def measure():
    return {"pressures": pressures(), "unbalanced": unbalancedForce(), "contacts": sum(1 for c in O.interactions if c.isReal),
            "lengths": lengths(), "steps": O.iter, "cpu_s": time.process_time()}


rate = 0.0
walls, count = fill()
solid = sum(b.state.mass for b in O.bodies if b.id not in walls) / DENSITY
start, settling, status = time.process_time(), [], "did not settle"
while time.process_time() - start < settings["settle_s"]:
    O.run(20, True)
    settling.append(measure())
    off = max(abs(p / PRESSURE - 1) for p in settling[-1]["pressures"])
    if off < 0.01 and settling[-1]["unbalanced"] < SETTLED:
        status = "finished"
        break
before = time.process_time() - start
before_steps = O.iter

# Contacts that were made with less friction take the new one, as they are made again or at once.
for body in O.bodies:
    if body.material.label == "rock":
        body.material.frictionAngle = math.atan(FRICTION)
for contact in O.interactions:
    if contact.isReal and contact.id1 not in walls and contact.id2 not in walls:
        contact.phys.tangensOfFrictionAngle = FRICTION
rate = settings["inertial"] / (MIDDLE * math.sqrt(DENSITY / PRESSURE))
first, height, rows = time.process_time(), lengths()[2], []
while not rows or rows[-1]["strain"] < settings["strain"] and time.process_time() - first < settings["shear_s"]:
    O.run(10, True)
    rows.append(measure() | {"strain": 1 - lengths()[2] / height})
with open(os.environ["ANSWER"], "w") as stream:
    json.dump({"status": status, "before_s": before, "before_steps": before_steps, "count": count,
               "porosity": 1 - solid / (settling[-1]["lengths"][0] * settling[-1]["lengths"][1] * settling[-1]["lengths"][2]),
               "unbalanced_before": settling[-1]["unbalanced"], "dt": O.dt, "rate": rate, "settling": settling,
               "shear_s": time.process_time() - first, "shear_steps": O.iter - before_steps, "rows": rows}, stream)
