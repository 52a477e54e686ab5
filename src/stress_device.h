// SPDX-License-Identifier: MIT
// The entry points of kernels/stress.cl on one device, and the probes of what other programs have as well.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "src/probe.h"

namespace clume {

struct StressBits {
    std::uint32_t v[4];
};

class StressDevice {
public:
    /// Builds both programs. Throws DeviceError.
    explicit StressDevice(const DeviceInfo& info);
    ~StressDevice();

    Probe& probe() { return probe_; }

    /// The textbook's formulas; only lane 0 of each group is looked at, and no density is given.
    std::vector<ProbeChord> naive(std::span<const ProbeGroupRay> rays, std::span<const float> groups, device::uint family, float e2);

    struct Given {
        float t_perp, w, d2, has;              ///< the geometry; has: some of the chord lies between t0 and t1
        float start, stop, depth, flight;      ///< that part, its depth, the flight from its start
        float naive_depth, naive_flight, unused[2];
    };
    /// Of each group's first primitive.
    std::vector<Given> given(std::span<const ProbeGroupRay> rays, std::span<const float> groups, device::uint family, float e2);

    struct Phase {
        std::vector<device::float4> directions;  ///< w: pdf
        std::vector<float> values;               ///< at the versines given
    };
    /// directions[i].w is g.
    Phase phase(device::uint kind, std::span<const device::float4> directions, std::span<const float> versines, std::span<const StressBits> bits);

    struct FilmPoint {
        std::uint32_t x, y;
        float u, v;
    };
    std::vector<ProbeRay> camera(const DeviceScene& scene, std::span<const FilmPoint> points);

    struct LightSample {
        float direction[3], distance, value, pdf, lit, unused;
    };
    /// Two blocks of bits per point.
    std::vector<LightSample> lights(const DeviceScene& scene, std::span<const device::float4> points, std::span<const StressBits> bits);

    struct EnvironmentSample {
        std::vector<device::float4> directions;  ///< w: pdf
        std::vector<float> values;
        std::vector<StressBits> texels;  ///< sampled, found along the sample, found along the direction given
    };
    /// Of light 0, an image; two blocks of bits per sample, and as many directions to look up.
    EnvironmentSample environment(const DeviceScene& scene, std::span<const StressBits> bits, std::span<const device::float4> directions);

    /// Sums of the mixture's optical depths as transmittances; the scene has a bvh.
    std::vector<float> transmittances(const DeviceScene& scene, std::span<const ProbeRay> rays);

private:
    struct Impl;
    Probe probe_;
    std::unique_ptr<Impl> impl_;
};

}  // namespace clume
