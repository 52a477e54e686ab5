// SPDX-License-Identifier: MIT
#include "tests/probe_harness.h"

#include <cmath>
#include <map>

namespace clume::probing {

const DeviceInfo& test_device() {
    static const DeviceInfo info = select_devices({}).front();
    return info;
}

Probe& bare_probe(int width) {
    static auto& all = *new std::map<int, Probe>;
    return all.try_emplace(width, test_device(), width).first->second;
}

Probe sobol_probe(const DeviceInfo& device, int width) {
    DeviceScene scene;
    scene.defines.emplace_back("CLUME_SOBOL", "1");
    return Probe(device, scene, width);
}

std::vector<float> log_spaced(float lo, float hi, std::size_t count, std::uint64_t seed) {
    TestRandom random(seed);
    std::vector<float> x{lo, hi, std::nextafter(lo, hi), std::nextafter(hi, lo)};
    const auto add = [&](float v) {
        if (v >= lo && v <= hi) x.push_back(v);
    };
    for (int e = std::ilogb(lo); e <= std::ilogb(hi); ++e)
        for (int k = -2; k <= 2; ++k) add(from_bits(static_cast<std::uint32_t>(static_cast<int>(bits(std::ldexp(1.0f, e))) + k)));
    for (std::size_t i = 0; i < count; ++i) add(static_cast<float>(random.spread(static_cast<double>(lo), static_cast<double>(hi))));
    return x;
}

std::vector<float> evenly_spaced(float lo, float hi, std::size_t count, std::uint64_t seed) {
    TestRandom random(seed);
    std::vector<float> x{lo, hi, std::nextafter(lo, hi), std::nextafter(hi, lo)};
    const double a = static_cast<double>(lo), b = static_cast<double>(hi);
    const std::size_t half = count / 2;
    for (std::size_t i = 0; i < half; ++i) x.push_back(static_cast<float>(a + (b - a) * (static_cast<double>(i) + 0.5) / static_cast<double>(half)));
    for (std::size_t i = 0; i < half; ++i) x.push_back(static_cast<float>(random.uniform(a, b)));
    return x;
}

void report(const std::string& text) { SUCCEED(text); }

}  // namespace clume::probing
