"""A results file as numpy, pandas and PyVista have it; `riprap_results` reads, this shapes."""

import riprap_results
from riprap_results import ResultsError

import numpy

TENSOR = ("xx", "yy", "zz", "xy", "yz", "xz")
# Corners of the triangles of a VTK tetrahedron, outward.
TRIANGLES = numpy.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
# Cosine of 45 degrees, and the fewest grains of a chain (Peters et al. 2005, as `chained_fraction` of the history).
ALIGNED, FEWEST = 0.5**0.5, 3


class Results(riprap_results.Results):
    """An open results file; `state` counts the saved states, -1 is the last."""

    def frame(self):
        """`/history` as a pandas.DataFrame; `attrs["units"]` has the units."""
        import pandas

        table = pandas.DataFrame({name: self.history[name] for name in self.history.names()})
        table.attrs["units"] = {name: self.history.units(name) for name in self.history.names()}
        return table

    def to_pyvista(self, state=-1, moved=True):
        """A saved state as pyvista.UnstructuredGrid with all fields; points where they are in it, or in the reference configuration."""
        import pyvista

        types, connectivity, offsets = self.cells()
        cells = numpy.insert(connectivity, offsets[:-1], numpy.diff(offsets))
        points = self.points + self.point_data("displacement", state) if moved else self.points
        grid = pyvista.UnstructuredGrid(cells, types, points)
        for name in self.file["VTKHDF/PointData"]:
            grid.point_data[name] = self.point_data(name, state)
        for name in self._cell_fields():
            grid.cell_data[name] = self.cell_data(name, state)
        stress = grid.GetCellData().GetArray("stress")
        for k, name in enumerate(TENSOR):
            stress.SetComponentName(k, name)
        return grid

    def force_chains(self, state=-1):
        """Contacts between grains in a state, pair by pair: a dict of numpy arrays.

        `grains` (pairs, 2), `ends` (pairs, 2, 3) their centres [m], `force` (pairs) the normal force [N], `strong` whether above the mean,
        `chained` whether both grains are linked in a force chain (Peters et al. 2005, Phys. Rev. E 72:041307).
        """
        number = state if state >= 0 else len(self.states) + state
        if f"contacts/{number}" not in self.file or "grains/position" not in self.file:
            raise ResultsError(f"{self.path}: has no contacts of grains in state {state}")
        table, centres = self.file[f"contacts/{number}"], self.file["grains/position"][number]
        bodies = numpy.stack([table["body_a"][:], table["body_b"][:]], axis=1)
        between = ((bodies >= 0) & (bodies < len(centres))).all(axis=1)
        pairs, which = numpy.unique(numpy.sort(bodies[between], axis=1), axis=0, return_inverse=True)
        force = numpy.bincount(which.reshape(-1), weights=table["normal_force"][:][between], minlength=len(pairs))
        ends = centres[pairs]
        links = self._links(pairs, ends, number)
        sizes = _chain_sizes(len(centres), pairs[links])
        return {
            "grains": pairs,
            "ends": ends,
            "force": force,
            "strong": force > force.mean() if len(force) else numpy.zeros(0, bool),
            "chained": links & (sizes[pairs[:, 0]] >= FEWEST) if len(pairs) else numpy.zeros(0, bool),
        }

    def to_stl(self, path, state=-1):
        """Writes the grains of a state, where they are in it, as one binary STL [m]; returns the number of triangles. Deleted cells are left out."""
        corners = self._surface(state)
        normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = numpy.linalg.norm(normals, axis=1, keepdims=True)
        normals = numpy.divide(normals, length, out=numpy.zeros_like(normals), where=length > 0)
        record = numpy.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("pad", "<u2")])
        record["normal"], record["corners"] = normals, corners
        with open(path, "wb") as file:
            file.write(b"riprap, all bodies, in metres".ljust(80, b" "))
            file.write(numpy.uint32(len(record)).tobytes())
            file.write(record.tobytes())
        return len(record)

    def _cell_fields(self):
        return list(self.file["VTKHDF/CellData"])

    def _surface(self, state):
        """Corners (triangles, 3, 3) of the facets of grains that only one cell has. Cells of grains that can break share no points: places count."""
        types, connectivity, offsets = self.cells()
        here = (types == riprap_results.VTK_QUADRATIC_TETRA) & (self.cell_data("grain", state) >= 0)
        here &= self.cell_data("failed", state) == 0
        points = self.points
        _, place = numpy.unique(points.round(9), axis=0, return_inverse=True)
        tetrahedra = connectivity[offsets[:-1][here][:, None] + numpy.arange(4)]
        facets = tetrahedra[:, TRIANGLES].reshape(-1, 3)
        body = numpy.repeat(self.cell_data("fragment", state)[here], 4)
        keys = numpy.column_stack([numpy.sort(place.reshape(-1)[facets], axis=1), body])
        _, first, count = numpy.unique(keys, axis=0, return_index=True, return_counts=True)
        moved = points + self.point_data("displacement", state)
        return moved[facets[numpy.sort(first[count == 1])]]

    def _links(self, pairs, ends, number):
        """Which pairs are links: both grains strong, the line between them along both their directions of largest compression."""
        xx, yy, zz, xy, yz, xz = self.file["grains/stress"][number].T
        stress = -numpy.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1)
        values, vectors = numpy.linalg.eigh(numpy.nan_to_num(stress))
        strong = values[:, 2] > values[:, 2].mean() * (1 + 1e-9)
        branch = ends[:, 1] - ends[:, 0]
        branch = branch / numpy.linalg.norm(branch, axis=1, keepdims=True)
        along = numpy.abs((vectors[pairs, :, 2] * branch[:, None, :]).sum(axis=2))
        return strong[pairs].all(axis=1) & (along >= ALIGNED).all(axis=1)


def _chain_sizes(grains, links):
    """How many grains are in the chain of each grain."""
    name = numpy.arange(grains)

    def root(grain):
        while name[grain] != grain:
            grain = name[grain]
        return grain

    for a, b in links:
        x, y = root(a), root(b)
        name[max(x, y)] = min(x, y)
    roots = numpy.array([root(grain) for grain in range(grains)], dtype=int)
    return numpy.bincount(roots, minlength=grains)[roots]
