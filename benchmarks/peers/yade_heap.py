"""Heaps of polyhedra by YADE, gravity turned until something has moved.

    SETTINGS='{"bodies": [...], ...}' ANSWER=out.json yade -n -x -j1 yade_heap.py

The answer has the tilt as a share of the way at which a body has moved by `moved` and the whole CPU time.
A time step is a tenth of what mass over stiffness (modulus times the smallest edge) allows.
"""

import json
import math
import os
import time

from yade import polyhedra_utils

settings = json.loads(os.environ["SETTINGS"])
begun = time.process_time()
rock = PolyhedraMat(young=settings["modulus"], poisson=0.2, frictionAngle=math.atan(settings["friction"]), density=settings["density"])
for body in settings["bodies"]:
    O.bodies.append(polyhedra_utils.polyhedra(rock, v=[Vector3(*v) for v in body["corners"]], fixed=body["fixed"]))
O.dt = settings["step"]
motion = NewtonIntegrator(damping=0.3, gravity=(0, 0, -settings["gravity"]))
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Polyhedra_Aabb()]),
    InteractionLoop([Ig2_Polyhedra_Polyhedra_PolyhedraGeom()], [Ip2_PolyhedraMat_PolyhedraMat_PolyhedraPhys()],
                    [Law2_PolyhedraGeom_PolyhedraPhys_Volumetric()]),
    motion,
]
count, rest = settings["steps"], settings["steps"] // 5
O.run(rest, True)
start = [Vector3(b.state.pos) for b in O.bodies]
share, moved, chunk = 0.0, 0.0, max(1, count // 400)
while share < 1 and moved < settings["moved"]:
    share += chunk / count
    gravity = [0, 0, -settings["gravity"]]
    gravity[settings["axis"]] = settings["gravity"] * settings["tilt"] * share
    motion.gravity = gravity
    O.run(chunk, True)
    moved = max((b.state.pos - at).norm() for b, at in zip(O.bodies, start))
with open(os.environ["ANSWER"], "w") as stream:
    json.dump({"share": share, "moved": moved, "cpu_s": time.process_time() - begun, "unbalanced": unbalancedForce()}, stream)
