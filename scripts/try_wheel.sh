#!/usr/bin/env bash
# Installs a wheel into a fresh virtual environment and runs the quick start from Python: scripts/try_wheel.sh PYTHON WHEEL
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
python=$1
wheel=$(cd "$(dirname "$2")" && pwd)/$(basename "$2")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$python" -m venv "$folder/venv"
bin=$folder/venv/bin
[ -d "$bin" ] || bin=$folder/venv/Scripts
"$bin/python" -m pip install --quiet --disable-pip-version-check "$wheel"
cp "$here/cases/quick_start.json" "$folder"
cd "$folder"
"$bin/riprap" --version
"$bin/riprap" verify
"$bin/python" - <<'PROGRAM'
import riprap

print(riprap.check("quick_start.json"))
rows = []
results = riprap.run("quick_start.json", "quick.vtkhdf", set={"/stages/1/axial_strain": 0.003}, progress=rows.append)
status, reason = results.status
assert status == "finished", (status, reason)
q = results.history["deviatoric_stress"]
assert len(q) > 10 and q.max() > 1e5, q
chains = results.force_chains()
assert len(chains["force"]) > 10 and chains["force"].min() >= 0
assert results.to_stl("grains.stl") > 1000
try:
    riprap.check({"specimen": {}})
except riprap.RiprapError as error:
    assert error.code == 1 and "grading" in str(error), error
else:
    raise AssertionError("a case without anything was called sound")
print(f"{len(q)} increments, largest q {q.max() / 1e6:.3f} MPa, {len(chains['force'])} pairs of grains touch")
PROGRAM
