// SPDX-License-Identifier: MIT
// Single building blocks of the renderer run over arrays on one device (kernels/probe.cl): free flights, transmittances,
// chords of one group, elementary functions, random numbers, phase functions. For tests and benchmarks; the code is the
// renderer's own, under the same defines. Positions are normalised (layout.h), directions have length 1.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kernels/layout.h"
#include "runtime/device.h"
#include "src/device_scene.h"

namespace clume {

/// A ray from `origin` up to `t_end`.
struct ProbeRay {
    float origin[3];
    float t_end = 1e30f;
    float direction[3];
    float unused = 0;
};

/// What one ray gave; t is 1e30 and primitive CLUME_NO_PRIMITIVE if it escaped. `primitive` is only set by `decomposition`
/// and in programs that look something up per primitive. `work`: groups, primitives and voxels
/// evaluated; 0 unless the scene was made with RenderOptions::count_work.
struct ProbeHit {
    float t;
    std::uint32_t primitive;
    float transmittance;
    std::uint32_t work;
    bool collided() const { return t < 1e30f; }
};

/// What one ray gave against one voxel grid: depth up to t_end, t at which it reaches `tau` (1e30 if not), density at t_end,
/// light of the emission grids along it, first channel. ProbeRay::unused is tau.
struct ProbeGrid {
    float depth, t, density, emission;
};

/// One ray against the 16 lanes of one group, as `probe_group` takes it: interval [t0, t1], optical depth tau.
struct ProbeGroupRay {
    float origin[3];
    float t0 = 0;
    float direction[3];
    float t1 = 1e30f;
    float tau = 1;
    float unused[3] = {};
};

/// Per lane; t_in, t_out and flight are 1e30 where there is none.
struct ProbeChord {
    float d2[16], t_in[16], t_out[16], density[16], depth[16], flight[16];
};

/// PROBE_* of self_test.cl.
enum class MathFunction : std::uint32_t {
    rcp, divide, rsqrt, sqrt, exp, log, exponential, erfc, erfc_inverse, epanechnikov_inverse, asin, atan2, sin_turns, cos_turns, erf_between, uniform,
    acos, from_uint, normalize_x
};

/// What `group_work` times, over every ray and group.
enum class GroupWork : std::uint32_t { intersect, intersect_quadratic, density, depth, flight };

/// Values of a launch and the seconds that the kernel ran on the device (code generation excluded).
template <class T>
struct ProbeRun {
    std::vector<T> values;
    double device_s = 0;
};

class Probe {
public:
    /// Builds the program for the scene's defines (strategy and accelerator among them) and the vector width (0: the
    /// device's own), uploads the buffers. Programs are kept for the life of the process. Throws DeviceError.
    Probe(const DeviceInfo& info, const DeviceScene& scene, int width = 0);
    /// No scene: for groups, math, random numbers and phase functions of every family.
    explicit Probe(const DeviceInfo& info, int width = 0) : Probe(info, DeviceScene{}, width) {}
    ~Probe();
    Probe(Probe&&) noexcept;

    int width() const { return width_; }

    /// Free flights by the program's strategy; ray i draws as pixel i, sample `sample`.
    ProbeRun<ProbeHit> flights(std::span<const ProbeRay> rays, std::uint32_t sample = 0);
    /// The same, never side by side in a work-item.
    ProbeRun<ProbeHit> single_flights(std::span<const ProbeRay> rays, std::uint32_t sample = 0);
    /// Exact transmittances up to t_end.
    ProbeRun<ProbeHit> transmittances(std::span<const ProbeRay> rays);
    /// Transmittances up to t_end by the program's estimator.
    ProbeRun<ProbeHit> estimated_transmittances(std::span<const ProbeRay> rays, std::uint32_t sample = 0);
    /// Those of `analytic`: exact up to a depth, by roulette beyond.
    ProbeRun<ProbeHit> roulette_transmittances(std::span<const ProbeRay> rays, std::uint32_t sample = 0);
    /// Every ray against grid g of the scene alone, which has one.
    ProbeRun<ProbeGrid> grid(std::span<const ProbeRay> rays, std::uint32_t g = 0);
    /// Camera rays of film pixels (x + width · y), as the renderer's sample `sample` has them.
    std::vector<ProbeRay> camera_rays(std::span<const std::uint32_t> pixels, std::uint32_t sample = 0);

    /// Ray i against group i (176 floats each, layout.h) of one family with squared extent e2; quadratic: rows hold Σ⁻¹.
    std::vector<ProbeChord> groups(std::span<const ProbeGroupRay> rays, std::span<const float> groups, device::uint family, float e2, bool quadratic = false);
    /// One building block of every ray against every group, for timing: the results summed per ray. Density is taken at t1,
    /// depth and flight start at the entry or at 0. `intersect_quadratic` takes rows of Σ⁻¹.
    ProbeRun<float> group_work(GroupWork what, std::span<const ProbeGroupRay> rays, std::span<const float> groups, device::uint family, float e2);
    /// f(x[i], y[i]); integers go in as bits. y may be empty for functions of one argument.
    std::vector<float> math(MathFunction f, std::span<const float> x, std::span<const float> y = {});

    struct Words {
        std::uint32_t v[4];
    };
    /// Those of draws (sample, pixel, depth, draw) under a seed.
    std::vector<Words> draws(std::span<const Words> counters, std::uint32_t seed_lo, std::uint32_t seed_hi);
    std::vector<Words> philox(std::span<const Words> counters, std::span<const Words> keys);
    /// Bits of primitives first .. first + count under a key.
    std::vector<std::uint32_t> primitive_bits(std::uint32_t first, std::uint32_t key_lo, std::uint32_t key_hi, std::size_t count);
    /// Directions sampled about d: x cosine, y pdf returned, z value at the cosine, w squared length.
    std::vector<device::float4> phases(device::uint kind, float g, const float (&d)[3], std::uint32_t seed, std::size_t count);
    /// A ray as a lamp sees it, from t0 to t1, and equiangular places on it, counted from the foot (lamp.cl).
    struct LampView {
        float foot, gap, t0, t1;
    };
    struct LampPlace {
        float place, begin, end, span;
    };
    std::vector<LampPlace> lamp_places(std::span<const LampView> views, std::span<const float> u);

private:
    struct Impl;
    int width_;
    std::unique_ptr<Impl> impl_;
    ProbeRun<ProbeHit> rays(std::span<const ProbeRay> rays, std::uint32_t sample, std::uint32_t what);
};

}  // namespace clume
