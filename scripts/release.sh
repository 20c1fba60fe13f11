#!/usr/bin/env bash
# Builds and tries what is handed out on Linux: scripts/release.sh FOLDER
# The wheel runs from glibc 2.17 on: zig compiles and links its C against that. A first build takes as long as any other.
set -euo pipefail
out=$(mkdir -p "$1" && cd "$1" && pwd)
cd "$(dirname "$0")/.."
venv=target/release-venv
[ -x "$venv/bin/maturin" ] || { python3 -m venv "$venv" && "$venv/bin/pip" install --quiet "maturin>=1.8,<2" "cmake>=3.26,<4.5" ziglang; }
export PATH="$PWD/$venv/bin:$PATH"
target=$(rustc -vV | sed -n 's/^host: //p')
maturin build --profile dist --zig --compatibility manylinux_2_17 --target "$target" --locked --out "$out"
wheel=$(ls -t "$out"/riprap-*.whl | head -n 1)
scripts/try_wheel.sh python3 "$wheel"
# The tutorials, typed as they tell.
cargo test --release --locked --test pages -- --ignored
# The crate: its size, and that what is in it builds by itself, with the wheel's cmake.
cargo package --allow-dirty --locked --target-dir target/package-check
cp target/package-check/package/riprap-*.crate "$out"
du -h "$out"/*
