#!/bin/sh
# Kills runs fifty times at scattered moments and checks that the continued ones come to the bits of uninterrupted ones.
# Some minutes. A few of these kills are in the ordinary tests; `solver_tests/faults/kills.rs` has both.
set -eu
cd "$(dirname "$0")/.."
exec cargo test --release --locked --test faults -- --exact --ignored --nocapture kills::fifty_kills_change_no_bit
