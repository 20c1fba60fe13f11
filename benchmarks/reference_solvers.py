#!/usr/bin/env python3
"""Has other libraries solve the matrices that the linear_solvers bench wrote, on one thread.

    benchmarks/reference_solvers.py FOLDER GRAINS [PARDISO MUMPS UMFPACK SuperLU]

Libraries by PyPI wheels: pypardiso (oneMKL), python-mumps (0.0.2, numpy below 2), kvxopt or cvxopt (UMFPACK), scipy (SuperLU).
What is not installed is left out, and named on stderr; versions are printed there, too.
CPU seconds of this process, three repetitions (environment, REPEAT), in the columns of the bench.
The second factorisation has the same values and keeps the analysis, as a Newton step does.
"""

import importlib.metadata
import os
import sys
import time

for variable in ("MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy
import scipy.sparse


class System:
    """The matrices and the right side that the bench wrote."""

    def __init__(self, folder):
        def read(name, kind):
            return numpy.fromfile(os.path.join(folder, name), dtype=kind)

        starts, rows = read("starts.i64", "<i8").astype(numpy.int32), read("rows.i64", "<i8").astype(numpy.int32)
        self.right_side = read("right_side.f64", "<f8")
        shape = (len(self.right_side),) * 2
        self.exact = scipy.sparse.csc_matrix((read("exact.f64", "<f8"), rows, starts), shape=shape)
        self.symmetric = scipy.sparse.csc_matrix((read("symmetric.f64", "<f8"), rows, starts), shape=shape)

    def left(self, matrix, x):
        return numpy.linalg.norm(matrix @ x - self.right_side) / numpy.linalg.norm(self.right_side)


class Clock:
    """CPU seconds of this process at each mark."""

    def __init__(self):
        self.marks = [time.process_time()]

    def mark(self):
        self.marks.append(time.process_time())

    def spans(self):
        return [later - earlier for earlier, later in zip(self.marks, self.marks[1:])]


def pardiso(system):
    """mtype 11: unsymmetric; 1: of a symmetric pattern; 2: symmetric positive. Nested dissection (METIS), its default."""
    import pypardiso

    for way, matrix, mtype in (
        ("LU", system.exact, 11),
        ("LU (structurally symmetric)", system.exact, 1),
        ("LLT", system.symmetric, 2),
    ):
        given = (scipy.sparse.triu(matrix) if mtype == 2 else matrix).tocsr()
        given.sort_indices()
        solver = pypardiso.PyPardisoSolver(mtype=mtype)
        solver.set_iparm(18, -1)  # count the factor's entries
        clock = Clock()
        for phase in (11, 22, 22, 33):
            solver.set_phase(phase)
            x = solver._call_pardiso(given, system.right_side)
            clock.mark()
        entries = solver.get_iparm(18)
        solver.free_memory(everything=True)
        yield way, clock, system.left(matrix, x), entries


def mumps(system):
    """Nested dissection (METIS) of A + A', MUMPS's own defaults else."""
    import mumps

    context = mumps.Context()
    context.set_matrix(system.exact.tocoo())
    clock = Clock()
    context.analyze(ordering="metis")
    clock.mark()
    for _ in range(2):
        context.factor(reuse_analysis=True)
        clock.mark()
    x = context.solve(system.right_side)
    clock.mark()
    yield "LU (METIS)", clock, system.left(system.exact, x), context.factor_stats.nonzeros


def umfpack(system):
    """All by its own defaults. kvxopt tells the factor's entries, cvxopt does not (0)."""
    try:
        import kvxopt as wheel
        from kvxopt import umfpack as solver
    except ImportError:
        import cvxopt as wheel
        from cvxopt import umfpack as solver

    matrix = system.exact
    columns = numpy.repeat(numpy.arange(matrix.shape[0]), numpy.diff(matrix.indptr))
    given = wheel.spmatrix(matrix.data, matrix.indices.astype(int), columns, matrix.shape)
    x = wheel.matrix(system.right_side)
    clock = Clock()
    symbolic = solver.symbolic(given)
    clock.mark()
    for _ in range(2):
        numeric = solver.numeric(given, symbolic)
        clock.mark()
    solver.solve(given, numeric, x)
    clock.mark()
    entries = 0
    if hasattr(solver, "get_numeric"):
        lower, upper = solver.get_numeric(given, numeric)[:2]
        entries = len(lower.V) + len(upper.V)
    yield "LU", clock, system.left(matrix, numpy.array(x).ravel()), entries


def superlu(system):
    """scipy's SuperLU analyses and factorises in one call: the analysis is in both factorisations."""
    import scipy.sparse.linalg

    leaning = {"diag_pivot_thresh": 0.1, "options": {"SymmetricMode": True}}
    ways = {"LU (COLAMD)": {"permc_spec": "COLAMD"}, "LU (minimum degree in symmetric mode)": {"permc_spec": "MMD_AT_PLUS_A", **leaning}}
    for way, how in ways.items():
        clock = Clock()
        clock.mark()
        for _ in range(2):
            factor = scipy.sparse.linalg.splu(system.exact, **how)
            clock.mark()
        x = factor.solve(system.right_side)
        clock.mark()
        yield way, clock, system.left(system.exact, x), factor.nnz


LIBRARIES = {
    "PARDISO": (pardiso, ["pypardiso", "mkl"]),
    "MUMPS": (mumps, ["python-mumps"]),
    "UMFPACK": (umfpack, ["kvxopt", "cvxopt"]),
    "SuperLU": (superlu, ["scipy"]),
}


def version(package):
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def main():
    folder, grains, *wanted = sys.argv[1:]
    system = System(folder)
    for library in wanted or LIBRARIES:
        solve, packages = LIBRARIES[library]
        print(library, *(f"{package} {version(package)}" for package in packages), file=sys.stderr)
        for _ in range(int(os.environ.get("REPEAT", "3"))):
            try:
                for way, clock, left, entries in solve(system):
                    seconds = ",".join(f"{span:.4f}" for span in clock.spans())
                    size, given = system.exact.shape[0], system.exact.nnz
                    print(f"{grains},{size},{given},{library},{way},{seconds},{left:.1e},{entries}", flush=True)
            except ImportError as missing:
                print(f"left out: {library} ({missing})", file=sys.stderr)
                break


if __name__ == "__main__":
    main()
