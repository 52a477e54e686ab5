// SPDX-License-Identifier: MIT
// How libFuzzer changes large binary files (nvdb, vdb, environment).
#include <cstddef>
#include <cstdint>
#include <cstring>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);  // NOLINT(readability-identifier-naming): libFuzzer's

/// Such files are mostly tables of zeros, in which a change means little: every other time, change bytes near one that isn't 0.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {  // NOLINT(readability-identifier-naming): libFuzzer's
    constexpr std::size_t window = 32;
    if (size <= 4 * window || seed % 2 == 0) return LLVMFuzzerMutate(data, size, most);
    std::size_t at = 0;
    for (std::uint64_t tries = 0, state = seed; tries < 64; ++tries) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        at = static_cast<std::size_t>((state >> 33) % (size - window));
        if (data[at + 8] != 0) break;
    }
    std::uint8_t bytes[window];
    std::memcpy(bytes, data + at, window);
    LLVMFuzzerMutate(bytes, window, window);
    std::memcpy(data + at, bytes, window);
    return size;
}
