// SPDX-License-Identifier: MIT
#include "bench/rays.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <random>

namespace clume::bench {

namespace {

/// Uniform directions and points of the ball inscribed in the media's bounds.
struct BallPoints {
    BallPoints(const DeviceScene& scene, std::uint64_t seed) : engine(seed) {
        const device::float4 &a = scene.params.bounds_min, &b = scene.params.bounds_max;
        const glm::dvec3 lower(a.x, a.y, a.z), upper(b.x, b.y, b.z), half = 0.5 * (upper - lower);
        center = 0.5 * (lower + upper);
        inner = std::min({half.x, half.y, half.z});
        outer = glm::length(half);
    }
    glm::dvec3 direction() {
        const double z = 1 - 2 * u(engine), r = std::sqrt(std::max(0.0, 1 - z * z)), phi = 2 * std::numbers::pi * u(engine);
        return {r * std::cos(phi), r * std::sin(phi), z};
    }
    glm::dvec3 point() {
        const double r = inner * std::cbrt(u(engine));
        return center + r * direction();
    }
    std::mt19937_64 engine;
    std::uniform_real_distribution<double> u{0, 1};
    glm::dvec3 center;
    double inner, outer;  ///< radii
};

ProbeRay ray(const glm::dvec3& o, const glm::dvec3& d) {
    ProbeRay r;
    for (int k = 0; k < 3; ++k) {
        r.origin[k] = static_cast<float>(o[k]);
        r.direction[k] = static_cast<float>(d[k]);
    }
    return r;
}

}  // namespace

std::vector<ProbeRay> inside_rays(const DeviceScene& scene, std::size_t count, std::uint64_t seed) {
    BallPoints ball(scene, seed);
    std::vector<ProbeRay> rays;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 o = ball.point(), d = ball.direction();
        rays.push_back(ray(o, d));
    }
    return rays;
}

std::vector<ProbeRay> crossing_rays(const DeviceScene& scene, std::size_t count, std::uint64_t seed) {
    BallPoints ball(scene, seed);
    std::vector<ProbeRay> rays;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 o = ball.center + ball.outer * ball.direction(), towards = ball.point();
        rays.push_back(ray(o, glm::normalize(towards - o)));
    }
    return rays;
}

std::vector<ProbeRay> camera_rays(Probe& probe, int film_width, int film_height, int stride, std::uint32_t sample) {
    std::vector<std::uint32_t> pixels;
    for (int y = 0; y < film_height; y += stride)
        for (int x = 0; x < film_width; x += stride) pixels.push_back(static_cast<std::uint32_t>(x + film_width * y));
    return probe.camera_rays(pixels, sample);
}

}  // namespace clume::bench
