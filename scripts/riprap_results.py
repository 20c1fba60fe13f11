"""Reads the results files of riprap: numpy arrays out of HDF5, nothing else.

    from riprap_results import Results
    with Results("cases/results/quick_start.vtkhdf") as results:
        q = results.history["deviatoric_stress"]          # Pa, compression positive
        u = results.point_data("displacement", state=-1)  # m, shape (points, 3)

SI units. Strains, q and p in the history count compression positive; stresses of the cells count tension positive.
A file whose writer was killed in the middle of a write is put back to its last good increment first (`recover`).
"""

import json
import os
import struct
import time
import zlib

import h5py
import numpy

VTK_QUADRATIC_TETRA = 24


class ResultsError(Exception):
    """A file that is missing, damaged, or not of riprap; the message says which."""


HEAD = 4096


def _head(path):
    """Identity, commits done and begun, and the name that its run knew, of a file; None of an older one."""
    with open(path, "rb") as file:
        head = file.read(HEAD)
    if len(head) < HEAD or not head.startswith(b"riprap results\n\0"):
        return None
    commit, begun = struct.unpack_from("<QQ", head, 48)
    (length,) = struct.unpack_from("<H", head, 126)
    return head[24:40], commit, begun, head[128 : 128 + length].decode("utf-8", "replace")


def _journal(path, identity, commit):
    """The blocks of a journal of this file at this commit, and the file's length; None of any other."""
    try:
        with open(path, "rb") as source:
            data = source.read()
    except OSError:
        return None
    body, checksum = data[:-4], data[-4:]
    if len(data) < 52 or body[:8] != b"RIPRAPJ2" or struct.pack("<I", zlib.crc32(body)) != checksum:
        return None
    of, length, count = struct.unpack_from("<QQQ", body, 24)
    if body[8:24] != identity or of != commit:
        return None
    blocks, at = [], 48
    for _ in range(count):
        offset, size = struct.unpack_from("<QQ", body, at)
        blocks.append((offset, body[at + 16 : at + 16 + size]))
        at += 16 + size
    return length, blocks


def recover(path):
    """Puts a file back to its last commit if a killed writer left it within the next one; tells whether it had to.

    The layouts of head and journal are described in src/results/head.rs and journal.rs. A journal of another file, or of this file
    at another commit, is left alone.
    """
    path = os.path.realpath(path)
    head = _head(path)
    if head is None or (head[2] <= head[1] and not os.path.exists(f"{path}.journal")):
        return False
    with open(path, "r+b") as file:
        try:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:
            pass  # Windows: no flock
        except OSError:
            return False  # a live writer: its journal is its own
        identity, commit, begun, name = _head(path)
        found = None
        for journal in [f"{path}.journal"] + [f"{name}.journal"] * (begun > commit and name != ""):
            found = _journal(journal, identity, commit)
            if found:
                break
        if not found:
            if begun > commit:
                raise ResultsError(f"{path}: its run was killed within a commit; {name}.journal is not beside it")
            return False
        length, blocks = found
        for offset, data in blocks:
            file.seek(offset)
            file.write(data)
        file.truncate(length)
        file.flush()
        os.fsync(file.fileno())
        file.seek(48)
        file.write(struct.pack("<QQQ", commit, 0, 0))
        file.flush()
        os.fsync(file.fileno())
        # This may be a copy, and the file beside the journal still in need of it.
        if journal == f"{path}.journal" or (os.path.exists(name) and os.path.samefile(name, path)):
            os.remove(journal)
        return True


class History:
    """`/history` as arrays by name; `units` and `long_name` tell what they are."""

    def __init__(self, group):
        self._group = group
        self._rows = min((len(group[name]) for name in group), default=0)

    def __getitem__(self, name):
        if name not in self._group:
            raise ResultsError(f"no history of {name!r}; there are {', '.join(self._group)}")
        return self._group[name][: self._rows]

    def __len__(self):
        return self._rows

    def __contains__(self, name):
        return name in self._group

    def names(self):
        return list(self._group)

    def units(self, name):
        return self._group[name].attrs["units"]

    def long_name(self, name):
        return self._group[name].attrs["long_name"]


class Results:
    """An open results file."""

    def __init__(self, path):
        self.path = os.fspath(path)
        if not os.path.exists(self.path):
            raise ResultsError(f"{self.path}: no such file")
        recover(self.path)
        self.live = False
        try:
            self.file = self._open()
        except OSError as error:
            raise ResultsError(f"{self.path}: {error}") from error
        if "history" not in self.file or "case" not in self.file:
            self.file.close()
            raise ResultsError(f"{self.path}: has no /history and /case; is it a results file of riprap?")
        self.history = History(self.file["history"])

    def _open(self):
        try:
            return h5py.File(self.path, "r")
        except BlockingIOError:
            self.live = True
        # Its run goes on: read it as of its last commit, not in the midst of one.
        for _ in range(100):
            if not os.path.exists(f"{self.path}.journal"):
                break
            time.sleep(0.01)
        return h5py.File(self.path, "r", locking=False)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()

    @property
    def title(self):
        return self.file["case/title"].asstr()[()]

    @property
    def status(self):
        """`running`, `finished`, `interrupted`, `stopped` or `killed`, and the reason."""
        status = self.file["status"]
        text = status.asstr()[()]
        return "killed" if text == "running" and not self.live else text, status.attrs["reason"]

    @property
    def stages(self):
        """The kinds of the stages; `history["stage"]` counts into this list."""
        text = self.file["case/stages"].asstr()[()]
        return text.split("\n") if text else []

    @property
    def starts_consolidated(self):
        """Whether the run starts from the specimen of another one, and is sheared from its first row on."""
        rows, consolidated = self.shear_rows()
        given = json.loads(self.file["case/completed"].asstr()[()]).get("start_from")
        return given is not None and not consolidated and len(rows) > 0

    @property
    def is_scene(self):
        """Whether bodies were set by hand; its history has no strains and no q."""
        return "scene" in json.loads(self.file["case/completed"].asstr()[()])

    def shear(self, *names):
        """Columns of the history over `shear_rows`; strains count from the end of the consolidation, as laboratories report them.

        Where strains begin with the first increment, as in a run from the consolidated specimen of another one, a point at zero strain
        is put in front: strains 0, q by the secant modulus of the first row, other columns NaN.
        """
        rows, consolidated = self.shear_rows()
        columns = [self.history[name][rows] for name in names]
        for name, column in zip(names, columns):
            if consolidated and name in ("axial_strain", "volumetric_strain"):
                column[0] = 0
        q = self._stress_before_shear(rows, consolidated)
        if numpy.isfinite(q):
            start = {"axial_strain": 0.0, "volumetric_strain": 0.0, "deviatoric_stress": q}
            columns = [numpy.append(start.get(name, numpy.nan), column) for name, column in zip(names, columns)]
        return columns

    def _stress_before_shear(self, rows, consolidated):
        """Deviatoric stress [Pa] at zero strain, where that is before the first row; NaN where it is a row, or not known."""
        only_consolidated = all(kind == "consolidate" for kind in self.stages)
        if consolidated or only_consolidated or not len(rows) or "secant_modulus" not in self.history:
            return numpy.nan
        strain, q, secant = (self.history[name][0] for name in ("axial_strain", "deviatoric_stress", "secant_modulus"))
        return q - secant * strain if strain != 0 else numpy.nan

    def shear_rows(self):
        """Rows of the stages behind the leading consolidation, led by its last row where there is one, and whether so.

        No rows where the run did not come to those stages; all where the case has nothing but consolidations.
        """
        leading = 0
        for kind in self.stages:
            if kind != "consolidate":
                break
            leading += 1
        stage = self.history["stage"]
        if leading == len(self.stages):
            return numpy.arange(len(stage)), False
        rows = numpy.flatnonzero(stage >= leading)
        if len(rows) and rows[0] > 0:
            return numpy.concatenate([[rows[0] - 1], rows]), True
        return rows, False

    @property
    def states(self):
        """Pseudo-times of the saved states."""
        return self.file["VTKHDF/Steps/Values"][:] if "VTKHDF" in self.file else numpy.empty(0)

    @property
    def state_increments(self):
        return self.file["VTKHDF/Steps/Increments"][:] if "VTKHDF" in self.file else numpy.empty(0, int)

    @property
    def parts(self):
        """Names of the parts; cell data `part` counts into this list."""
        names = self.file["VTKHDF/CellData/part"].attrs["names"]
        return [name.split(" ", 1)[1] for name in names.split("; ") if name]

    @property
    def points(self):
        """Points in the reference configuration [m]."""
        return self.file["VTKHDF/Points"][:]

    def cells(self):
        """Types, connectivity and offsets of the cells, as VTK has them."""
        group = self.file["VTKHDF"]
        return group["Types"][:], group["Connectivity"][:], group["Offsets"][:]

    def point_data(self, name, state=-1):
        return self._field("PointData", name, state, "NumberOfPoints")

    def cell_data(self, name, state=-1):
        return self._field("CellData", name, state, "NumberOfCells")

    def _field(self, group, name, state, count):
        root = self.file["VTKHDF"]
        if name not in root[group]:
            raise ResultsError(f"{self.path}: no {name!r}; there are {', '.join(root[group])}")
        if not len(self.states):
            raise ResultsError(f"{self.path}: no state has been saved")
        start = root[f"Steps/{group}Offsets"][name][state]
        return root[group][name][start : start + root[count][0]]
