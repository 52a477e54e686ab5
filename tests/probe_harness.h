// SPDX-License-Identifier: MIT
// What the tests of the kernels' building blocks share: one device, probes per vector width, bits of floats, input sets and
// how a worst error is reported.
#pragma once

#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "tests/cases.h"

namespace clume::probing {

inline constexpr auto& kWidths = cases::vector_widths;

inline std::uint32_t bits(float f) { return std::bit_cast<std::uint32_t>(f); }
inline float from_bits(std::uint32_t b) { return std::bit_cast<float>(b); }

/// The device that the tests run on: the best one of the machine.
const DeviceInfo& test_device();

/// A probe without a scene, kept for the life of the process.
Probe& bare_probe(int width);

/// A probe of the program that spreads random numbers evenly.
Probe sobol_probe(const DeviceInfo& device, int width);

/// Index of the first element whose bytes differ between two arrays of equal size, or their size.
template <class T>
std::size_t first_difference(const std::vector<T>& a, const std::vector<T>& b) {
    static_assert(sizeof(T) % 4 == 0);
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::bit_cast<std::array<std::uint32_t, sizeof(T) / 4>>(a[i]) != std::bit_cast<std::array<std::uint32_t, sizeof(T) / 4>>(b[i])) return i;
    return a.size();
}

/// Uniform doubles of a seeded test.
class TestRandom {
public:
    explicit TestRandom(std::uint64_t seed) : engine_(seed) {}
    std::uint32_t word() { return static_cast<std::uint32_t>(engine_() >> 32); }
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
    /// e^x uniform in x.
    double spread(double lo, double hi) { return lo * std::pow(hi / lo, uniform()); }
    int below(int n) { return static_cast<int>(uniform() * n); }

private:
    std::mt19937_64 engine_;
};

/// Floats log-uniform in [lo, hi], the ends and their neighbours inside, and powers of two with theirs.
std::vector<float> log_spaced(float lo, float hi, std::size_t count, std::uint64_t seed);

/// Floats uniform in [lo, hi], the ends, and a dense even grid.
std::vector<float> evenly_spaced(float lo, float hi, std::size_t count, std::uint64_t seed);

/// Prints with -s only: a figure that the documentation quotes.
void report(const std::string& text);

}  // namespace clume::probing
