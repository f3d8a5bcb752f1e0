#!/usr/bin/env bash
# Builds all fuzz targets and runs each for some seconds: `fuzz/run.sh SECONDS [TARGET…]`. Ends with the first fault; prints a table of executions and coverage.
set -euo pipefail
cd "$(dirname "$0")"

seconds=${1:?how many seconds each target runs}
shift
host=$(rustc +nightly -vV | sed -n 's/^host: //p')
# Without AddressSanitizer: there is no unsafe code in this repository, and the targets run several times as fast.
cargo +nightly fuzz build --sanitizer none --fuzz-dir .
targets=${*:-$(cargo +nightly fuzz list --fuzz-dir .)}
# Files that targets write are in memory where the system has such a folder.
if [ -d /dev/shm ]; then export TMPDIR=/dev/shm; fi
mkdir -p artifacts
printf '| target | executions | per second | edges | inputs kept | memory |\n|---|---|---|---|---|---|\n'
for target in $targets; do
    words=()
    if [ -f "dictionaries/$target" ]; then words=("-dict=dictionaries/$target"); fi
    log="artifacts/$target.log"
    if ! "target/$host/release/$target" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=2048 -max_len=100000 -print_final_stats=1 -close_fd_mask=1 \
        "-artifact_prefix=artifacts/$target-" "${words[@]}" "corpus/$target" 2>"$log"; then
        tail -n 40 "$log"
        exit 1
    fi
    awk -v target="$target" '
        / cov: / { for (at = 1; at < NF; at++) { if ($at == "cov:") edges = $(at + 1); if ($at == "corp:") kept = $(at + 1) } }
        /number_of_executed_units/ { runs = $2 } /average_exec_per_sec/ { speed = $2 } /peak_rss_mb/ { memory = $2 }
        END { sub("/.*", "", kept); printf "| %s | %s | %s | %s | %s | %s MB |\n", target, runs, speed, edges, kept, memory }' "$log"
    # Each process leaves its files.
    rm -rf "${TMPDIR:-/tmp}"/teachtree-fuzz-*
done
