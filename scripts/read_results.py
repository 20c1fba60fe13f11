#!/usr/bin/env python3
"""Reads tables and fields of riprap's results files into pandas and xarray where they are installed, else into dicts of numpy arrays.

    scripts/read_results.py results/quick_start.vtkhdf                # what is in it, and the end of its history

    from read_results import bodies, grains, contacts, states
    table = contacts("results/quick_start.vtkhdf")                    # pandas.DataFrame, one row a contact point of the last state
    table["normal_force"].max(), table.attrs["units"]["normal_force"]
    fields = states("results/quick_start.vtkhdf")                     # xarray.Dataset over state, point, cell
    fields["displacement"][-1]                                    # of the last state

The history is `riprap.Results(path).frame()`. SI units; stresses of cells count tension positive.
`plain=True` gives numpy in any case. What MATLAB wants: `h5read(file, '/history/deviatoric_stress')`; every number in the
file is an IEEE float or an integer of 8, 32 or 64 bits, and every text a UTF-8 string.
"""

import sys

import numpy

from riprap_results import Results, ResultsError

try:
    import pandas
except ImportError:
    pandas = None
try:
    import xarray
except ImportError:
    xarray = None

VECTOR = ("x", "y", "z")
TENSOR = ("xx", "yy", "zz", "xy", "yz", "xz")


def bodies(path, plain=False):
    """`/bodies` of a scene: by name, a table with columns like `force_x`, one row an accepted increment."""
    with Results(path) as results:
        group = results.file["bodies"] if "bodies" in results.file else {}
        rows = len(results.history)
        found = {name: _columns(group[name], rows) for name in group}
    return {name: _table(columns, units, plain) for name, (columns, units) in found.items()}


def grains(path, plain=False):
    """What does not change of each grain: size, volume, shape. Where they are: `states`."""
    with Results(path) as results:
        group = results.file["grains"] if "grains" in results.file else {}
        fixed = {name: data for name, data in _measured(group) if data.maxshape[0] is not None}
        columns, units = _columns(fixed)
    return _table(columns, units, plain)


def contacts(path, state=-1, plain=False):
    """The contact points of a saved state."""
    with Results(path) as results:
        count = len(results.states)
        name = f"contacts/{state if state >= 0 else count + state}"
        if name not in results.file:
            raise ResultsError(f"{path}: has no /{name}; {count} states are saved")
        columns, units = _columns(dict(_measured(results.file[name])))
    return _table(columns, units, plain)


def states(path, plain=False):
    """Fields of the saved states: point and cell data of /VTKHDF, and position and rotation of the grains."""
    with Results(path) as results:
        count = len(results.states)
        if not count:
            raise ResultsError(f"{path}: no state has been saved")
        arrays = {"time": (("state",), results.states), "increment": (("state",), results.state_increments)}
        arrays["points"] = (("point", "axis"), results.points)
        root = results.file["VTKHDF"]
        for group, place, read in [
            ("PointData", "point", results.point_data),
            ("CellData", "cell", results.cell_data),
        ]:
            for name in root[group]:
                if root[group][name].maxshape[0] is not None:
                    arrays[name] = ((place,), read(name, 0))
                    continue
                block = numpy.stack([read(name, state) for state in range(count)])
                arrays[name] = (("state", place, *_last(block)), block)
        for name, data in _measured(results.file["grains"]) if "grains" in results.file else []:
            if data.maxshape[0] is None:
                # Cell data has a `damage` of its own; these are of whole grains.
                arrays[f"grain_{name}"] = (("state", "number", *_last(data)), data[:count])
    if xarray is None or plain:
        return {name: values for name, (_, values) in arrays.items()}
    return xarray.Dataset(arrays, coords={"axis": list(VECTOR), "component": list(TENSOR)})


def _measured(group):
    """Names and datasets of a group without its dimension scales, which only number the others' axes."""
    return [(name, data) for name, data in group.items() if data.attrs.get("CLASS") != b"DIMENSION_SCALE"]


def _last(values):
    """The dimension behind state and place: of vectors or tensors; none of numbers."""
    return {2: (), 3: ("axis",) if values.shape[-1] == 3 else ("component",)}[values.ndim]


def _columns(group, rows=None):
    """Datasets of a group as columns of numbers, vectors taken apart; and their units."""
    columns, units = {}, {}
    for name, data in group.items():
        values = data[:rows]
        parts = {name: values}
        if values.ndim == 2:
            parts = {f"{name}_{axis}": values[:, k] for k, axis in enumerate(VECTOR)}
        for part, numbers in parts.items():
            columns[part], units[part] = numbers, data.attrs["units"]
    return columns, units


def _table(columns, units, plain):
    if pandas is None or plain:
        return columns
    table = pandas.DataFrame(columns)
    table.attrs["units"] = units
    return table


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    path = sys.argv[1]
    try:
        with Results(path) as results:
            status, reason = results.status
            print(f"{results.title}: {status}{': ' + reason if reason else ''}")
            print(f"{len(results.history)} increments, {len(results.states)} saved states, stages {', '.join(results.stages)}")
            for name in results.history.names():
                values = results.history[name]
                last = values[-1] if len(values) else "nothing"
                print(f"{name:22} {last!s:>24} {results.history.units(name):6} {results.history.long_name(name)}")
    except ResultsError as error:
        print(f"read_results: {error}", file=sys.stderr)
        return 4
    except BrokenPipeError:
        # The reader has seen enough; nothing is left to flush to it.
        sys.stdout = None
    return 0


if __name__ == "__main__":
    sys.exit(main())
