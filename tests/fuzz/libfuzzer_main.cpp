// SPDX-License-Identifier: MIT
// libFuzzer's entry points around one target, CLUME_FUZZ_TARGET: heap in use is counted, and its peak held to the target's bound.
#include <sanitizer/allocator_interface.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "tests/fuzz/targets.h"

namespace {

using clume::fuzz::Target;
const Target& target = clume::fuzz::CLUME_FUZZ_TARGET;

std::atomic<std::int64_t> held{0}, peak{0};

void on_malloc(const volatile void*, std::size_t size) {
    const std::int64_t now = held += static_cast<std::int64_t>(size);
    for (std::int64_t most = peak; now > most && !peak.compare_exchange_weak(most, now);) {}
}
void on_free(const volatile void* pointer) {
    if (pointer != nullptr) held -= static_cast<std::int64_t>(__sanitizer_get_allocated_size(pointer));
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {  // NOLINT(readability-identifier-naming): libFuzzer's
    target.run("");  // what is made once is no input's doing
    __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming): libFuzzer's
    peak = held = 0;
    try {
        target.run({reinterpret_cast<const char*>(data), size});
    } catch (const std::exception& error) {
        std::fprintf(stderr, "not a SceneError: %s\n", error.what());
        std::abort();
    }
    if (static_cast<std::uint64_t>(peak) > target.memory.of(size)) {
        std::fprintf(stderr, "%lld bytes of heap for %zu bytes of input; the bound is %llu\n", static_cast<long long>(peak), size,
                     static_cast<unsigned long long>(target.memory.of(size)));
        std::abort();
    }
    return 0;
}
