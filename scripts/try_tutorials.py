#!/usr/bin/env python3
"""Types what the tutorials tell to type, page by page, in a copy of the folder; ends with 1 at the first command that fails.

    $(scripts/python_env) scripts/try_tutorials.py target/release/riprap [lab_sheet step_size …]

A block is a command if its first word is one (`COMMANDS`), Python if it says so, and an output else. Python of a block that the page
tells to save goes into that file; the other blocks of Python of a page are one program. `pip install` is left to
scripts/try_wheel.sh.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = ["lab_sheet", "step_size", "chains_and_breakage", "notebook"]
COMMANDS = ("riprap", "py=", "$py", "PYTHONPATH=")
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def script(page):
    """The page as a shell script, and the files that it has saved first."""
    text = (ROOT / "docs/tutorials" / f"{page}.md").read_text(encoding="utf-8")
    commands, files, cells = [], {}, []
    for block in BLOCK.finditer(text):
        language, body = block.groups()
        saved = re.search(r"Save this as `([\w.]+)`:\s*$", text[: block.start()])
        if language == "python" and saved:
            files[saved.group(1)] = body
        elif language == "python":
            cells.append(body)
        elif not language and body.startswith(COMMANDS):
            commands.append(body)
    if cells:
        files[f"{page}_cells.py"] = "\n".join(cells)
        commands.append(f"PYTHONPATH=scripts {sys.executable} {page}_cells.py")
    if not commands:
        raise SystemExit(f"{page}: has no command")
    return "\n".join(commands), files


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for part in ("cases", "scripts", "Cargo.toml"):
            if (ROOT / part).is_dir():
                shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("results"))
            else:
                shutil.copy(ROOT / part, folder / part)
        (folder / "bin").mkdir()
        (folder / "bin/riprap").symlink_to(program)
        # The pages ask this script for a Python; this one has what they need.
        (folder / "scripts/python_env").write_text(f"#!/bin/sh\necho {sys.executable}\n")
        path = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
        environment = dict(os.environ, PATH=path, RIPRAP=str(program), MPLBACKEND="Agg")
        for page in sys.argv[2:] or PAGES:
            commands, files = script(page)
            for name, text in files.items():
                (folder / name).write_text(text, encoding="utf-8")
            print(f"== {page}", flush=True)
            done = subprocess.run(["bash", "-euxo", "pipefail", "-c", commands], cwd=folder, env=environment)
            if done.returncode != 0:
                raise SystemExit(f"{page}: exit code {done.returncode}")


if __name__ == "__main__":
    main()
