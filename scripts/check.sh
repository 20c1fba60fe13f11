#!/usr/bin/env bash
# Everything CI checks, in the order in which it fails fastest: format, lints, docs, tests.
# Release profile throughout, so that the dependencies are built once for `cargo run --release` too.
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="$PATH:$HOME/.cargo/bin"
cargo fmt --check
cargo clippy --release --all-targets --locked -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --release --no-deps --locked --quiet
cargo test --release --locked
