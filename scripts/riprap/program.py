"""The command `riprap`, called from Python."""

import contextlib
import json
import os
import shutil
import subprocess
import sysconfig
import tempfile
import warnings

from .results import Results

STOPPED, INTERRUPTED = 3, 130


class RiprapError(Exception):
    """What riprap refused or could not do, in its own words; `code` is its exit code (docs/results_file.md)."""

    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


def program():
    """Path of the command: $RIPRAP, else the one installed with this package, else the first on the PATH."""
    if os.environ.get("RIPRAP"):
        return os.environ["RIPRAP"]
    name = "riprap.exe" if os.name == "nt" else "riprap"
    for scheme in (None, "nt_user" if os.name == "nt" else "posix_user"):
        folder = sysconfig.get_path("scripts", scheme) if scheme else sysconfig.get_path("scripts")
        if os.path.isfile(os.path.join(folder, name)):
            return os.path.join(folder, name)
    found = shutil.which("riprap")
    if found is None:
        raise RiprapError(2, "the command riprap is not beside this Python and not on the PATH; set RIPRAP to its path")
    return found


def check(case, set=None):
    """What a case would build, cost, and holds that its author may not expect. `RiprapError` with every fault at once if it has any."""
    with _file(case) as path:
        return _call(["check", path, *_overrides(set)])


def run(case, out, set=None, threads=None, force=False, resume=False, progress=None):
    """Runs a case, a file or a dict, into the results file `out`; returns its open `Results`.

    `set`: values by JSON pointer, e.g. {"/stages/0/pressure": "0.4 MPa"}. `progress` is called with a dict for each thing that
    happens, an accepted increment among them. A run that stops short of the case's end warns and returns what it came to;
    `results.status` says why. Names of files in a dict are relative to the current folder.
    """
    out = os.fspath(out)
    options = ["--out", out, "--progress", "json", *_overrides(set)]
    options += ["--threads", str(threads)] if threads else []
    options += ["--force"] if force else []
    options += ["--resume"] if resume else []
    with _file(case) as path:
        code, told = _follow(["run", path, *options], progress)
    if code == INTERRUPTED:
        raise KeyboardInterrupt(f"{out} holds everything up to the last increment; resume=True goes on from there")
    if code not in (0, STOPPED):
        # The program speaks of its options.
        raise RiprapError(code, told.replace("--force", "force=True").replace("--resume", "resume=True"))
    if code == STOPPED:
        warnings.warn(told, stacklevel=2)
    return Results(out)


@contextlib.contextmanager
def _file(case):
    """The path of a case, which may be its content."""
    if not isinstance(case, dict):
        yield os.fspath(case)
        return
    with tempfile.NamedTemporaryFile("w", suffix=".json", dir=".", delete=False, encoding="utf-8") as file:
        json.dump(case, file, indent=2, default=_plain)
    try:
        yield file.name
    finally:
        os.remove(file.name)


def _plain(value):
    """What JSON has for a number or an array of NumPy."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{value!r} has no place in a case")


def _overrides(values):
    return [word for pointer, value in (values or {}).items() for word in ("--set", f"{pointer}={json.dumps(value, default=_plain)}")]


def _call(arguments):
    done = subprocess.run([program(), *arguments], capture_output=True, text=True, encoding="utf-8")
    if done.returncode != 0:
        raise RiprapError(done.returncode, done.stderr.strip() or done.stdout.strip())
    return done.stdout.rstrip()


def _follow(arguments, progress):
    """Runs the program, hands on each line of its progress; its exit code, and what it told on standard error."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as errors:
        with subprocess.Popen(
            [program(), *arguments], stdout=subprocess.PIPE, stderr=errors, text=True, encoding="utf-8"
        ) as running:
            try:
                for line in running.stdout:
                    if progress is not None and line.startswith("{"):
                        progress(json.loads(line))
            except BaseException:
                # Leaves a restart point, as Ctrl-C at a terminal does.
                running.terminate()
                raise
        errors.seek(0)
        return running.returncode, errors.read().strip()
