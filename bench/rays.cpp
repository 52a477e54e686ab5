// SPDX-License-Identifier: MIT
#include "bench/rays.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <random>

namespace clume::bench {

std::vector<ProbeRay> inside_rays(const DeviceScene& scene, std::size_t count, std::uint64_t seed) {
    const device::float4 &a = scene.params.bounds_min, &b = scene.params.bounds_max;
    const glm::dvec3 lower(a.x, a.y, a.z), upper(b.x, b.y, b.z), center = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
    const double radius = std::min({half.x, half.y, half.z});
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<double> u(0, 1);
    const auto direction = [&] {
        const double z = 1 - 2 * u(engine), r = std::sqrt(std::max(0.0, 1 - z * z)), phi = 2 * std::numbers::pi * u(engine);
        return glm::dvec3(r * std::cos(phi), r * std::sin(phi), z);
    };
    std::vector<ProbeRay> rays(count);
    for (ProbeRay& ray : rays) {
        const double r = radius * std::cbrt(u(engine));
        const glm::dvec3 o = center + r * direction(), d = direction();
        for (int k = 0; k < 3; ++k) {
            ray.origin[k] = static_cast<float>(o[k]);
            ray.direction[k] = static_cast<float>(d[k]);
        }
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
