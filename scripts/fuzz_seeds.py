#!/usr/bin/env python3
"""Files to begin fuzzing from that the repository does not hold: fuzz_seeds.py mesh|journal FOLDER

mesh: one tetrahedron in each format, behind the byte that tells the target which. journal: a results file of a small scene, alone and with a
journal of a commit that was cut short (layouts: src/results/head.rs and journal.rs). Only what comes with Python.
"""

import json
import pathlib
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
SCENE = {
    "title": "A block on a plate",
    "scene": {
        "bodies": [
            {"name": "plate", "shape": {"box": [1, 1, 0.1]}, "position": [0, 0, -0.05], "fixed": True},
            {"name": "block", "shape": {"box": [0.1, 0.1, 0.1]}, "position": [0, 0, 0.05]},
        ]
    },
    "rock": {"density": 2700, "youngs_modulus": "30 GPa", "poissons_ratio": 0.2, "damage": None},
    "contact": {"friction": 0.5},
    "stages": [{"kind": "load", "increments": 3, "bodies": {"block": {"force": [0, 0, "-20 N"]}}}],
}


def meshes():
    """(name, kind, bytes) of a tetrahedron in each format."""
    lines = lambda rows: "\n".join(" ".join(map(str, row)) for row in rows)
    vtu = (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>'
        '<Piece NumberOfPoints="4" NumberOfCells="1"><Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">'
        f"{lines(POINTS)}</DataArray></Points><Cells>"
        '<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray>'
        '<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>'
        '<DataArray type="UInt8" Name="types" format="ascii">10</DataArray>'
        "</Cells></Piece></UnstructuredGrid></VTKFile>"
    )
    numbered = lines((k + 1, *p) for k, p in enumerate(POINTS))
    msh2 = (
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{numbered}\n$EndNodes\n"
        "$Elements\n1\n1 4 2 0 1 1 2 3 4\n$EndElements\n"
    )
    msh4 = (
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n"
        f"{lines(POINTS)}\n$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n"
    )
    stl = b"\0" * 80 + struct.pack("<I", len(FACES))
    for face in FACES:
        stl += struct.pack("<12fH", 0, 0, 0, *(x for k in face for x in POINTS[k]), 0)
    obj = lines(("v", *p) for p in POINTS) + "\n" + lines(("f", *(k + 1 for k in f)) for f in FACES)
    ply = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
        f"property list uchar int vertex_indices\nend_header\n{lines(POINTS)}\n{lines((3, *f) for f in FACES)}\n"
    )
    texts = [("vtu", 0, vtu), ("msh2", 1, msh2), ("msh4", 1, msh4), ("obj", 3, obj), ("ply", 4, ply)]
    return [(name, kind, text.encode()) for name, kind, text in texts] + [("stl", 2, stl)]


def results():
    """A small results file."""
    with tempfile.TemporaryDirectory() as folder:
        case, out = pathlib.Path(folder, "block.json"), pathlib.Path(folder, "block.vtkhdf")
        case.write_text(json.dumps(SCENE))
        run = ["cargo", "run", "--release", "--locked", "--quiet", "--", "run", case, "--out", out, "--quiet"]
        subprocess.run(run, cwd=ROOT, check=True)
        return out.read_bytes()


def cut_short(whole):
    """The file with a commit under way, and its journal but for the checksum, which the target adds."""
    identity, commit = whole[24:40], struct.unpack_from("<Q", whole, 48)[0]
    file = bytearray(whole)
    struct.pack_into("<Q", file, 56, commit + 1)
    # The head is no part of a journal.
    block = bytes(file[4096:8192])
    journal = b"RIPRAPJ2" + identity + struct.pack("<3Q2Q", commit, len(file), 1, 4096, len(block)) + block
    return bytes(file), journal


def main():
    what, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    if what == "mesh":
        for name, kind, content in meshes():
            (folder / f"tetrahedron_{name}").write_bytes(bytes([kind]) + content)
        return
    whole = results()
    for name, (file, journal) in {"alone": (whole, b""), "cut_short": cut_short(whole)}.items():
        (folder / name).write_bytes(struct.pack("<I", len(file)) + file + journal)


if __name__ == "__main__":
    main()
