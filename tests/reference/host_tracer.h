// SPDX-License-Identifier: MIT
// The independent host path tracer: plain double-precision C++, delta tracking through uniform cell lists, no closed form,
// no roulette, and light sampling only for the lights that no path can hit. It is the oracle of the image tests and the
// yardstick of the benchmarks, so it shares no algorithm, random number or code with the kernels.
// Results depend on the scene, the seed and the cells alone, never on the thread count or the crop.
#pragma once

#include "src/scene.h"
#include "tests/reference/host_camera.h"
#include "tests/reference/host_lights.h"
#include "tests/reference/host_medium.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace clume::reference {

/// Pixels x0 ≤ x < x1, y0 ≤ y < y1 of the film.
struct HostCrop {
    int x0, y0, x1, y1;
};

struct HostOptions {
    std::uint32_t spp = 16;
    std::uint64_t seed = 0;
    int threads = 2;
    int cells = 48;                ///< along the longest side of the media's bounds
    std::optional<int> max_depth;  ///< default: the scene's
    std::optional<HostCrop> crop;  ///< default: the whole film
};

/// The crop's pixels, row by row from the top.
struct HostImage {
    int width = 0, height = 0;
    std::vector<double> rgb;       ///< mean, 3 per pixel
    std::vector<double> alpha;     ///< 1 per pixel
    std::vector<double> variance;  ///< of the mean, 3 per pixel; 0 when spp is 1
    double seconds = 0;            ///< tracing alone, wall clock
    double build_seconds = 0;
    std::uint64_t paths = 0;
    std::uint64_t not_finite = 0;  ///< samples that added 0 because they weren't finite
};

struct FlightRate {
    double flights_per_s = 0;
    double mean_flight = 0;  ///< mean distance to the collision, of the flights that had one [world units]
    std::uint64_t flights = 0;
    std::uint64_t collided = 0;
};

class HostTracer {
public:
    explicit HostTracer(const Scene& scene, int cells = 48, std::optional<int> max_depth = {});

    HostImage trace(std::uint32_t spp, std::uint64_t seed, int threads = 2, std::optional<HostCrop> crop = {}) const;

    /// `inside`: origins uniform in the ball inscribed in the bounds, directions uniform; else camera rays over the film.
    FlightRate free_flights(std::uint64_t n, bool inside, std::uint64_t seed = 0, int threads = 2) const;

    const HostMedium& medium() const { return medium_; }
    const HostCamera& camera() const { return camera_; }
    double build_seconds() const { return build_seconds_; }

private:
    struct Sample {
        glm::dvec3 radiance;
        bool opaque;
    };

    double build_seconds_, build_start_;
    Film film_;
    int max_depth_;
    HostCamera camera_;
    HostLights lights_;
    HostMedium medium_;

    Sample trace_path(HostRay ray, HostRandom& random) const;
    glm::dvec3 direct_light(const glm::dvec3& x, const glm::dvec3& d, const Phase& phase, HostRandom& random) const;
    void trace_row(HostImage& image, const HostCrop& crop, int row, std::uint32_t spp, std::uint64_t seed) const;
};

/// Builds and traces.
HostImage render_host(const Scene& scene, const HostOptions& options = {});

/// Builds and flies.
FlightRate free_flights_host(const Scene& scene, std::uint64_t n, bool inside, int threads = 2, int cells = 48);

/// 48 or 96, whichever traces this scene faster here; takes about half a second beside the two builds.
int best_cell_resolution(const Scene& scene, int threads = 2);

}  // namespace clume::reference
