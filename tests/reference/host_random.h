// SPDX-License-Identifier: MIT
// xoshiro256+ of the host path tracer, seeded per pixel by splitmix64, so that no result depends on the thread that made
// it. It shares nothing with the kernels' counter-based generator. Source: Blackman and Vigna, "Scrambled linear
// pseudorandom number generators", doi 10.1145/3460772; public domain code by the same authors.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace clume::reference {

class HostRandom {
public:
    /// Stream `stream` of `seed`; streams are independent for all practical purposes.
    HostRandom(std::uint64_t seed, std::uint64_t stream) {
        std::uint64_t z = mix(seed) ^ mix(stream + 0x632be59bd9b4e019u);
        for (auto& word : state_) word = mix(z += 0x9e3779b97f4a7c15u);
    }

    /// Uniform in [0, 1), 53 bits.
    double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }

    /// Exponential with mean 1, > 0 and finite.
    double exponential() { return -std::log(static_cast<double>((next() >> 11) + 1) * 0x1p-53); }

private:
    std::uint64_t state_[4];

    static std::uint64_t mix(std::uint64_t z) {
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    std::uint64_t next() {
        const std::uint64_t result = state_[0] + state_[3], t = state_[1] << 17;
        state_[2] ^= state_[0];
        state_[3] ^= state_[1];
        state_[1] ^= state_[2];
        state_[0] ^= state_[3];
        state_[2] ^= t;
        state_[3] = std::rotl(state_[3], 45);
        return result;
    }
};

}  // namespace clume::reference
