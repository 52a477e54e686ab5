// SPDX-License-Identifier: MIT
// Adversarial pairs of ray and ellipsoid, by family. Primitives take the way of a real scene: chosen in normalised
// coordinates, put into a Scene of some size and place, normalised, whitened in double and packed as the device has them.
// Rays are floats from the start, as those of scattered paths are.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "src/probe.h"
#include "src/stress_oracle.h"

namespace clume {

/// Seeded doubles.
class StressRandom {
public:
    explicit StressRandom(std::uint64_t seed) : engine_(seed) {}
    std::uint32_t word() { return static_cast<std::uint32_t>(engine_() >> 32); }
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
    /// e^x uniform in x.
    double spread(double lo, double hi) { return lo * std::pow(hi / lo, uniform()); }
    int below(int n) { return static_cast<int>(uniform() * n); }
    double sign() { return below(2) ? 1 : -1; }

private:
    std::mt19937_64 engine_;
};

enum class Place { ahead, inside, boundary, centre, grazing, far };
enum class Span { any, whole, brief, entry_tail, exit_tail };

/// What a family varies; ranges are log-uniform.
struct ChordFamily {
    const char* name;
    Place place = Place::ahead;
    Span span = Span::any;
    double ratio[2] = {1, 10};          ///< longest axis over the shortest
    double scale[2] = {1e-3, 0.05};     ///< longest axis, normalised
    double density[2] = {0.1, 10};      ///< peak extinction times the scale along the ray
    double world[2] = {1, 1};           ///< size of the scene in world units, which lies up to 1000 times that from the origin
    bool axis_parallel = false, denormal = false;
    double extent = 0;                  ///< in place of the kernel's usual
};

const std::vector<ChordFamily>& chord_families();

struct ChordCase {
    ProbeGroupRay ray;
    std::vector<float> lane;       ///< CLUME_GROUP_ROWS floats
    oracle::Ellipsoid256 device;   ///< those floats
    oracle::Ellipsoid256 scene;    ///< the scene's doubles, normalised
    double ratio, distance, density;  ///< axis ratio; |o − mu| in scales; peak extinction times the scale along the ray
};

/// The kernels' own extents.
double usual_extent(KernelFamily kernel);

std::vector<ChordCase> chord_cases(const ChordFamily& family, KernelFamily kernel, std::size_t count, std::uint64_t seed);

}  // namespace clume
