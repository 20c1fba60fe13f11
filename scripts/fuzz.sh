#!/bin/sh
# Fuzzes what riprap reads, so many seconds a target (60): scripts/fuzz.sh [SECONDS [TARGET ...]]
#
# Needs `cargo install cargo-fuzz` and a C++ compiler; no nightly Rust, since the sanitizers are left out (riprap has next to no unsafe code).
# Begins from the repository's own files. What is found stays in target/fuzz/TARGET, and what crashes in target/fuzz/artifacts.
set -eu
cd "$(dirname "$0")/.."
seconds=${1:-60}
[ $# -gt 0 ] && shift
[ $# -gt 0 ] || set -- case plan mesh laboratory journal
work=$PWD/target/fuzz
mkdir -p "$work/artifacts"

# A copy of each file, under a name of its own.
seed() { # TARGET FILE ...
    target=$1
    shift
    for file; do
        cp "$file" "$work/$target/$(echo "$file" | tr '/' '_')"
    done
}

for target; do
    mkdir -p "$work/$target"
    case $target in
    case) seed case $(find cases benchmarks/peers/cases -name '*.json' ! -path '*campaign*' ! -name '*.schema.json') ;;
    plan) seed plan $(grep -l '"members"\|"values"\|"cases"' -r cases --include='*.json' || true) ;;
    laboratory) seed laboratory $(find cases -name '*.csv') ;;
    mesh) python3 scripts/fuzz_seeds.py mesh "$work/mesh" ;;
    journal) python3 scripts/fuzz_seeds.py journal "$work/journal" ;;
    esac
    echo "== $target"
    cargo fuzz run --fuzz-dir solver_tests/fuzz --target-dir "${FUZZ_TARGET_DIR:-target/fuzz-build}" -s none "$target" "$work/$target" -- \
        -max_total_time="$seconds" -max_len=1048576 -timeout=20 -rss_limit_mb=4096 -artifact_prefix="$work/artifacts/$target-" \
        -print_final_stats=1
done
