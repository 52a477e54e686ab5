# SPDX-License-Identifier: MIT
# The stages of `./clume test --deep` (and --tsan), for tests/stages.sh: every vector width on every implementation; every kernel under
# Oclgrind's checks; the host's code under the sanitizers; clang's warnings and clang-tidy over every file.

jobs=$(nproc)

# A stage without Catch2: what COMMAND says is a failure, saying nothing is passing.
clean() {
    local said
    said=$("$@" 2>&1) || said+=$'\n'"ended with $?"
    if [[ -z $said ]]; then
        echo '1 passed, 0 failed'
    else
        printf '%s\n0 passed, 1 failed\n' "$said"
    fi
}

# Every entry point on tiny scenes. Not optimised: Oclgrind 21.10 does not know LLVM's `freeze`, and what the optimiser has removed
# can't be checked. A cache of its own, since that option is not part of a program's key.
under_oclgrind() {
    local cache=$build/oclgrind-cache log=$build/oclgrind.log
    rm -rf -- "$cache" "$log"
    env XDG_CACHE_HOME="$cache" oclgrind --build-options -cl-opt-disable --data-races --uninitialized --check-api --num-threads 1 --log "$log" \
        "$tests" '[entry]' >"$build/oclgrind.out" 2>&1 || tail -n 40 "$build/oclgrind.out"
    grep -q '^1 passed, 0 failed$' "$build/oclgrind.out" || echo 'the entry points were not run'
    [[ ! -s $log ]] || head -n 200 "$log"
}

# built PRESET TARGET: configures and builds; says what failed. Warnings are no errors: GCC's are not reliable under sanitizers, and the
# first stage's build has had them.
built() {
    local log=$build/$1.log
    if ! { cmake --preset "$1" && cmake --build "$build/$1" --target "$2" --parallel "$jobs"; } >"$log" 2>&1; then
        grep -m 1 -A 40 -E '^FAILED:|error:|CMake Error' "$log" || tail -n 40 "$log"
        echo '0 passed, 1 failed'
        return 1
    fi
}

under_asan() {
    built asan clume_tests || return
    ASAN_OPTIONS=detect_stack_use_after_return=1 UBSAN_OPTIONS=print_stacktrace=1 \
        LSAN_OPTIONS=suppressions=$root/tests/leaks.supp:print_suppressions=0 "$build/asan/tests/clume_tests" '[quick]'
}

under_tsan() {
    built tsan clume_dispatcher_tests || return
    TSAN_OPTIONS=halt_on_error=0 "$(find "$build/tsan" -name clume_dispatcher_tests -type f -print -quit)"
}

# clang's warnings are reported by its tidy, too: the flags of GCC's build, but what only GCC knows. libFuzzer's main is not in that build.
tidy() {
    (cd -- "$root" && git ls-files 'src/*.cpp' 'runtime/*.cpp' 'bench/*.cpp' 'tests/*.cpp' 'scenes/*.cpp' ':!tests/fuzz/libfuzzer_main.cpp') |
        (cd -- "$root" && xargs -P "$jobs" -n 1 clang-tidy -p "$build/release" --quiet --extra-arg=-Wno-unknown-warning-option 2>/dev/null)
}

# Every width on every implementation, then the checkers; ThreadSanitizer is a stage of its own.
deep_stages() {
    stage 'every width on every implementation' on_all "$tests" '[.deep]'
    if command -v oclgrind >/dev/null; then
        stage "every kernel under Oclgrind's checks" clean under_oclgrind
    fi
    stage 'AddressSanitizer and UndefinedBehaviorSanitizer' under_asan
    if command -v clang-tidy >/dev/null; then
        stage 'clang-tidy' clean tidy
    else
        skip 'clang-tidy (not installed)'
    fi
}
