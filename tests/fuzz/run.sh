#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Fuzzes every reader of files for SECONDS each (20): ./clume test --fuzz[=SECONDS], or this with the release build there.
# Needs clang. A crash, a hang, a leak or memory beyond the reader's bound ends it with exit code 1 and the input's place.
#   tests/fuzz/run.sh [SECONDS] [TARGET...]
set -euo pipefail

root=$(cd -- "$(dirname -- "$(readlink -f -- "$0")")/../.." && pwd)
seconds=${1:-20}
shift || true
targets=("$@")
((${#targets[@]})) || targets=(scene ply vol raw nvdb vdb environment)
build=$root/build/fuzz
log=$build/build.log
jobs=$(nproc)

say() { printf 'clume: %s\n' "$*" >&2; }

mkdir -p "$build"
say 'building the fuzzers'
cd -- "$root"
if ! { cmake --preset fuzz && cmake --build --preset fuzz --parallel "$jobs"; } >"$log" 2>&1; then
    say "building the fuzzers failed; the end of $log:"
    tail -n 40 "$log" >&2
    exit 1
fi
rm -rf -- "$build/seeds"
"$root/build/release/tests/clume_fuzz_seeds" "$build/seeds"

# What is found is kept in corpus/ for the next time.
fuzz() {
    local target=$1 options=()
    local corpus=$build/corpus/$target crash=$build/crashes/$target-
    mkdir -p "$corpus" "$build/crashes"
    if [[ -f $build/seeds/$target.dict ]]; then options+=("-dict=$build/seeds/$target.dict"); fi
    # The slowest inputs, half a gigabyte of tiles, take a second or two by themselves, and a minute on a machine that is busy.
    if ! "$build/tests/fuzz/fuzz_$target" "$corpus" "$build/seeds/$target" "${options[@]}" -max_total_time="$seconds" -timeout=300 -report_slow_units=300 \
        -rss_limit_mb=6000 -artifact_prefix="$crash" -print_final_stats=1 >"$build/$target.log" 2>&1; then
        say "fuzzing $target failed; the end of $build/$target.log:"
        tail -n 40 "$build/$target.log" >&2
        say "the input is named above, in $build/crashes: keep it in tests/fuzz/regressions/$target"
        return 1
    fi
    say "fuzz $target: $(awk '/^stat::number_of_executed_units/ { runs = $2 } /^stat::average_exec_per_sec/ { rate = $2 }
        END { printf "%d runs, %d per second", runs, rate }' "$build/$target.log"), nothing found"
}

failed=0
for ((i = 0; i < ${#targets[@]}; i += jobs)); do
    running=()
    for target in "${targets[@]:i:jobs}"; do
        fuzz "$target" &
        running+=($!)
    done
    for process in "${running[@]}"; do wait "$process" || ((failed += 1)); done
done
printf '%d passed, %d failed\n' $((${#targets[@]} - failed)) "$failed"
((failed == 0))
