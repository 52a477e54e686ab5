// SPDX-License-Identifier: MIT
// Rays that the benchmarks fly, in the device's normalised coordinates.
#pragma once

#include <vector>

#include "src/probe.h"

namespace clume::bench {

/// What benchmarks call the rays of the three functions below.
inline constexpr const char* ray_sets[] = {"inside", "incoherent", "coherent"};

/// Origins uniform in the ball inscribed in the media's bounds, directions uniform: the host tracer's `inside`.
std::vector<ProbeRay> inside_rays(const DeviceScene& scene, std::size_t count, std::uint64_t seed);

/// From outside: origins uniform on the sphere about those bounds, each towards a point uniform in that ball.
std::vector<ProbeRay> crossing_rays(const DeviceScene& scene, std::size_t count, std::uint64_t seed);

/// Camera rays through every `stride`-th pixel of every `stride`-th row of the whole film, row by row (coherent).
std::vector<ProbeRay> camera_rays(Probe& probe, int film_width, int film_height, int stride, std::uint32_t sample);

}  // namespace clume::bench
