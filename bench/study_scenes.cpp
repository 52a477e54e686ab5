// SPDX-License-Identifier: MIT
#include "bench/study_scenes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <numbers>
#include <string>

#include "src/scene_reader.h"
#include "tests/reference/analytic_scenes.h"
#include "tests/reference/host_phase.h"
#include "tests/reference/host_random.h"

namespace clume::bench {
namespace {
constexpr double pi = std::numbers::pi;
}

double kernel_mass(KernelFamily family, double extent) {
    const double e3 = extent * extent * extent;
    switch (family) {
        case KernelFamily::gaussian: return 4 * pi * (std::sqrt(pi / 2) * std::erf(extent / std::sqrt(2.0)) - extent * std::exp(-extent * extent / 2));
        case KernelFamily::epanechnikov: return 8 * pi * e3 / 15;
        case KernelFamily::uniform: return 4 * pi * e3 / 3;
    }
    return 0;
}

double support_radius(const BallSpec& spec) { return std::cbrt(spec.overlap / spec.n); }

Scene study_ball(const BallSpec& spec, int side) {
    Scene scene;
    scene.path = "ball";
    scene.film = {side, side};
    scene.camera.kind = CameraKind::orthographic;
    scene.camera.origin = {0, 0, -3};
    scene.camera.width = 1.4;
    Light light;
    if (spec.sun) {
        light.kind = LightKind::directional;
        light.direction = {0.6, -0.64, 0.48};
        light.irradiance = glm::dvec3(pi);
    } else {
        light.radiance = glm::dvec3(1);
    }
    scene.lights.push_back(light);

    EllipsoidMedium medium;
    medium.kernel = spec.family;
    medium.extent = reference::default_extent(spec.family);
    const double scale = support_radius(spec) / medium.extent, a = std::cbrt(spec.anisotropy);
    const glm::dvec3 axes = scale * (spec.needles ? glm::dvec3(a * a, 1 / a, 1 / a) : glm::dvec3(a, a, 1 / (a * a)));
    medium.primitives.reserve(spec.n);
    reference::HostRandom random(spec.seed, 2);
    for (std::uint32_t i = 0; i < spec.n; ++i) {
        const double radius = std::cbrt(random.uniform());
        const glm::dvec3 center = reference::sample_sphere(random) * radius;
        const double u = random.uniform(), v = random.uniform();
        medium.primitives.push_back(reference::make_primitive(center, axes, 1, {u, v, random.uniform()}));
    }
    // Mean extinction of the ball at peak 1: n masses over its volume.
    const double mean = spec.n * kernel_mass(spec.family, medium.extent) * scale * scale * scale / (4 * pi / 3);
    medium.density_scale = spec.depth / (2 * mean);
    scene.media.push_back(std::move(medium));
    return scene;
}

Scene study_file(const char* name, int side) {
    Scene scene = read_scene(std::filesystem::path(CLUME_SCENES_DIR) / fmt::format("{}.json", name));
    const double shrink = std::sqrt(static_cast<double>(scene.film.width) * scene.film.height) / side;
    scene.film.width = std::max(1, static_cast<int>(std::lround(scene.film.width / shrink)));
    scene.film.height = std::max(1, static_cast<int>(std::lround(scene.film.height / shrink)));
    return scene;
}

}  // namespace clume::bench
