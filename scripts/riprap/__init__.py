"""riprap from Python: run and check cases, and read what came out.

    import riprap
    print(riprap.check("quick_start.json"))                   # every fault at once, or what it would build and cost
    results = riprap.run("quick_start.json", "quick.vtkhdf")  # a case file, or a dict with its content
    frame = results.frame()                                   # pandas, one row an accepted increment
    frame.plot("axial_strain", "deviatoric_stress")
    results.to_pyvista().plot(scalars="damage")               # the last saved state, moved
    riprap.Results("quick.vtkhdf").force_chains()["force"]    # of a file that is there already

SI units. Strains, q and p in the history count compression positive, stresses of cells and grains tension positive.
numpy and h5py are needed; pandas, pyvista where they are used. The program itself is the command `riprap` beside this package.
"""

from riprap_results import ResultsError

from .program import RiprapError, check, program, run
from .results import Results

__all__ = ["Results", "ResultsError", "RiprapError", "check", "program", "run"]
