"""A triaxial test of spheres or clumps by YADE.

    SETTINGS='{"pressure": 8e5, ...}' ANSWER=out.json yade -n -x -j1 yade_triaxial.py

Six frictionless walls bring a cloud of grains to the pressure; then the lid goes down at a strain rate by its inertial number
I = rate * d * sqrt(density / pressure), d halfway from the smallest to the largest diameter, while the side walls keep the pressure.
The answer has the CPU seconds of either part, the steps, and rows of strain, stresses, unbalanced ratio, and CPU seconds and steps so far.
The unbalanced ratio is YADE's: mean force out of balance over mean contact force.
"""

import json
import math
import os
import time

from yade import pack

settings = json.loads(os.environ["SETTINGS"])
PRESSURE, DENSITY, FRICTION = settings["pressure"], settings["density"], settings["friction"]
SIZES, SHARES = settings["sizes"], settings["shares"]
MIDDLE = (SIZES[0] + SIZES[-1]) / 2
LOOSE = 0.8  # porosity of the cloud
TETRAHEDRON = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]


def fill():
    """The cloud, in a box of its own size between walls, and what moves the walls."""
    rock = FrictMat(young=settings["modulus"], poisson=0.3, frictionAngle=math.atan(0.2), density=DENSITY, label="rock")
    smooth = FrictMat(young=settings["modulus"], poisson=0.3, frictionAngle=0, density=0, label="smooth")
    O.materials.append(rock)
    O.materials.append(smooth)
    mean = math.pi / 6 * sum(s**3 for s in SIZES) / len(SIZES)
    side = (settings["grains"] * mean / (1 - LOOSE)) ** (1 / 3)
    O.bodies.append(aabbWalls([(0, 0, 0), (side, side, side)], thickness=0, material="smooth"))
    cloud = pack.SpherePack()
    cloud.makeCloud((0, 0, 0), (side, side, side), psdSizes=SIZES, psdCumm=SHARES, num=settings["grains"], distributeMass=True,
                    seed=settings["seed"])
    cloud.toSimulation(material="rock")
    if settings["shape"] == "clumps":
        shape = clumpTemplate(relRadii=[1] * 4, relPositions=[[0.7 * x for x in corner] for corner in TETRAHEDRON])
        O.bodies.replaceByClumps([shape], [1.0], discretization=10)
    walls = TriaxialStressController(internalCompaction=False, thickness=0, stressMask=7, max_vel=1.0,
                                     goal1=-PRESSURE, goal2=-PRESSURE, goal3=-PRESSURE)
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()]),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()],
                        [Law2_ScGeom_FrictPhys_CundallStrack()]),
        GlobalStiffnessTimeStepper(active=1, timeStepUpdateInterval=100, timestepSafetyCoefficient=0.8),
        walls,
        NewtonIntegrator(damping=0.2),
    ]
    return walls


def consolidate(walls):
    """To the pressure within 1 % and an unbalanced ratio of 1e-3; whether it came there."""
    for _ in range(settings["most"]):
        O.run(1000, True)
        mean = -sum(walls.stress(k)[k // 2] for k in (0, 2, 4)) / 3
        if unbalancedForce() < 1e-3 and abs(abs(mean) / PRESSURE - 1) < 0.01:
            return True
    return False


def carrying():
    """How many grains touch anything."""
    pairs = [(contact.id1, contact.id2) for contact in O.interactions if contact.isReal]
    touching = {k for pair in pairs for k in pair if isinstance(O.bodies[k].shape, Sphere)}
    return len({O.bodies[k].clumpId if O.bodies[k].clumpId >= 0 else k for k in touching})


def shear(walls):
    """Rows of strain, stresses and unbalanced ratio to the last strain."""
    for body in O.bodies:
        if body.material is not None and body.material.label == "rock":
            body.material.frictionAngle = math.atan(FRICTION)
    for contact in O.interactions:
        if contact.isReal and O.materials["rock"].id in [O.bodies[k].mat.id for k in (contact.id1, contact.id2)]:
            rocks = [O.bodies[k].mat.label == "rock" for k in (contact.id1, contact.id2)]
            contact.phys.tangensOfFrictionAngle = FRICTION if all(rocks) else 0.0
    rate = settings["inertial"] / (MIDDLE * math.sqrt(DENSITY / PRESSURE))
    walls.stressMask, walls.goal2, walls.max_vel = 5, -rate, 10.0
    begun, rows = walls.strain[1], []
    span = settings["strain"] / settings.get("rows", 40)
    first = O.iter, time.process_time()
    while not rows or rows[-1]["strain"] < settings["strain"]:
        O.run(max(1, int(span / (rate * O.dt))), True)
        stresses = [-walls.stress(k)[axis] for k, axis in ((walls.wall_right_id, 0), (walls.wall_top_id, 1), (walls.wall_front_id, 2))]
        rows.append({"strain": abs(walls.strain[1] - begun), "stresses": stresses, "unbalanced": unbalancedForce(), "dt": O.dt,
                     "steps": O.iter - first[0], "cpu_s": time.process_time() - first[1]})
    return rows


walls = fill()
marks = [time.process_time()]
settled = consolidate(walls)
marks.append(time.process_time())
steps, carry = O.iter, carrying()
rows = shear(walls) if settled else []
marks.append(time.process_time())
with open(os.environ["ANSWER"], "w") as stream:
    json.dump({"settled": settled, "carrying": carry, "consolidation_s": marks[1] - marks[0], "consolidation_steps": steps,
               "shear_s": marks[2] - marks[1], "shear_steps": O.iter - steps, "rows": rows}, stream)
