#!/usr/bin/env python3
"""Has PARDISO (oneMKL, by pypardiso) solve the matrices that the linear_solvers bench wrote, on one thread.

    MKL_NUM_THREADS=1 benchmarks/reference_solvers.py FOLDER GRAINS

CPU seconds of this process, three repetitions, in the columns of the bench. Nested dissection (METIS) as there;
"LU" is the unsymmetric matrix (mtype 11), "LU, structurally symmetric" mtype 1, "LLT" the symmetric one (mtype 2).
"""

import os
import sys
import time

os.environ["MKL_NUM_THREADS"] = "1"

import numpy
import pypardiso
import scipy.sparse


def main():
    folder, grains = sys.argv[1], sys.argv[2]
    read = lambda name, kind: numpy.fromfile(os.path.join(folder, name), dtype=kind)
    starts, rows, b = read("starts.i64", "<i8"), read("rows.i64", "<i8"), read("right_side.f64", "<f8")
    size = len(b)
    for _ in range(3):
        for way, name, mtype in (("LU", "exact.f64", 11), ("LU (structurally symmetric)", "exact.f64", 1),
                                 ("LLT", "symmetric.f64", 2)):
            a = scipy.sparse.csc_matrix((read(name, "<f8"), rows, starts), shape=(size, size)).tocsr()
            a.sort_indices()
            given = scipy.sparse.triu(a, format="csr") if mtype == 2 else a
            given.sort_indices()
            solver = pypardiso.PyPardisoSolver(mtype=mtype)
            marks = [time.process_time()]
            for phase in (11, 22, 33):
                solver.set_phase(phase)
                x = solver._call_pardiso(given, b)
                marks.append(time.process_time())
            left = numpy.linalg.norm(a @ x - b) / numpy.linalg.norm(b)
            solver.free_memory(everything=True)
            seconds = ",".join(f"{t - s:.4f}" for s, t in zip(marks, marks[1:]))
            print(f"{grains},{size},{a.nnz},PARDISO,{way},{seconds},{left:.1e}", flush=True)


if __name__ == "__main__":
    main()
