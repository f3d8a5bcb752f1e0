#!/usr/bin/env bash
# The short forms of the campaigns of docs/measurements/reliability.md: ten minutes in all once everything is built. Fuzzing needs `cargo fuzz` and a
# nightly toolchain, faults of files need `strace`; a campaign whose tools are missing is skipped.
set -euo pipefail
cd "$(dirname "$0")/.."

step() { printf '\n== %s (%s s)\n' "$*" "$SECONDS"; }

step "kills, full disks, two programs at once"
TEACHTREE_KILLS=5 cargo test --test it -- faults::

if python3 -c 'import distributed, pytest, teachtree' 2>/dev/null; then
    step "a fleet on Dask whose workers are killed"
    pytest python/tests/test_fleet.py -k killed_at
else
    step "killed workers are skipped: they need the Python package, pytest and distributed"
fi

step "damaged files, and rows that cannot be"
PROPTEST_CASES=1000 cargo test --test it -- no_damage_to never_panics::

step "the engine, and what is proved, against the reference"
PROGRAMS=500 cargo test --test it -- --ignored many_programs many_proofs
PAIRS=5000 cargo test --test it -- --ignored --nocapture many_pairs

step "silent changes"
cargo example damage -- 5

if cargo fuzz --version >/dev/null 2>&1 && cargo +nightly --version >/dev/null 2>&1; then
    step "seeds"
    python3 fuzz/seeds.py
    fuzz/run.sh 8
else
    step "fuzzing is skipped: it needs cargo-fuzz and a nightly toolchain"
fi
step "all campaigns are over"
