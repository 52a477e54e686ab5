#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The tests again and again: what `./clume test` does beside one run of clume_tests.
#   tests/stages.sh [--all-implementations] [--tsan] [--fuzz[=SECONDS]] [--deep] [ARGS]     ARGS go to the first run's Catch2
# --all-implementations  the tests of the kernels on Intel's CPU runtime, then all implementations beside each other
# --fuzz[=SECONDS]       every reader of files, for 20 s each: tests/fuzz/run.sh
# --tsan                 the dispatcher under ThreadSanitizer
# --deep                 all that, every width, and the checkers: tests/deep.sh
# What can't be had (no network, no such package) is skipped, and said in the closing line, which adds up those of all stages.
set -euo pipefail

root=$(cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")/.." && pwd)
build=$root/build
tests=$build/release/tests/clume_tests
here=$build/implementations
passed=0 failed=0 skipped=()

# stage TITLE COMMAND...: its last line is "N passed, M failed"; one that ends without is a failure.
stage() {
    local title=$1 line status=0
    shift
    printf '\n==== %s\n' "$title"
    "$@" | tee "$build/stage.log" || status=$?
    line=$(tail -n 1 "$build/stage.log")
    if [[ $line =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
        ((passed += BASH_REMATCH[1], failed += BASH_REMATCH[2])) || true
        ((status == 0 || BASH_REMATCH[2] > 0)) || ((failed += 1))
    else
        printf '%s: ended with %s and no count\n' "$title" "$status"
        ((failed += 1))
    fi
}

skip() {
    printf '\n==== skipped: %s\n' "$1"
    skipped+=("$1")
}

all=0 deep=0 fuzz=0 tsan=0 arguments=()
for argument; do
    case $argument in
        --all-implementations) all=1 ;;
        --tsan) tsan=1 ;;
        --fuzz) fuzz=20 ;;
        --fuzz=*) fuzz=${argument#*=} ;;
        --deep) all=1 deep=1 tsan=1 ;;
        *) arguments+=("$argument") ;;
    esac
done

source "$root/tests/implementations.sh"
stage 'the tests' "$tests" "${arguments[@]}"
if ((all)); then
    if get_intel; then
        # What compares every building block of the kernels with other arithmetic, and what holds of any device.
        stage "the kernels on Intel's runtime" on_intel "$tests" -d yes '[kernels],Determinism.*,Launches.*,Film.*,Device.*,Program.*,Buffer.*,Queue.*'
    else
        skip "Intel's OpenCL runtime ($reason)"
    fi
    [[ -n $oclgrind ]] || skip 'Oclgrind (not installed)'
    stage 'all implementations beside each other' on_all "$tests" -d yes '[implementations]'
fi
((deep == 0 || fuzz > 0)) || fuzz=20
if ((fuzz)); then stage 'fuzzing the readers' "$root/tests/fuzz/run.sh" "$fuzz"; fi
source "$root/tests/deep.sh"
if ((tsan)); then stage 'ThreadSanitizer over the dispatcher' under_tsan; fi
if ((deep)); then deep_stages; fi

printf '\n%s passed, %s failed' "$passed" "$failed"
((${#skipped[@]} == 0)) || printf ', %s skipped: %s' "${#skipped[@]}" "$(printf '%s; ' "${skipped[@]}" | sed 's/; $//')"
printf '\n'
((failed == 0))
