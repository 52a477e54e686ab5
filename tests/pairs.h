// SPDX-License-Identifier: MIT
// Pairs of a distance strategy and a transmittance estimator, and mixed scenes on which they are compared.
#pragma once

#include <fmt/format.h>

#include "tests/cases.h"
#include "tests/grid_scenes.h"
#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::test {

/// A program: what is drawn by which strategy, what lights are seen through by which estimator.
struct Pair {
    const char *strategy, *estimator = "analytic", *bound = "auto", *root = "newton", *accelerator = "auto", *sampler = "independent";
    std::string name() const { return fmt::format("{} {} {} {} {} {}", strategy, estimator, bound, root, accelerator, sampler); }
    bool sobol() const { return std::string_view(sampler) == "sobol"; }
};

inline RenderResult render_pair(const Pair& pair, Scene scene, std::uint32_t spp, std::uint64_t seed, const RenderOptions& options = {}) {
    scene.render.transmittance = pair.estimator;
    scene.render.bound = pair.bound;
    scene.render.root_finding = pair.root;
    scene.render.sobol = pair.sobol();
    return render_by({pair.strategy, pair.accelerator}, scene, spp, seed, options);
}

/// The scene with the pair's names in its own settings.
inline Scene with_pair(Scene scene, const MethodPair& pair) {
    scene.render.strategy = pair.strategy;
    scene.render.transmittance = pair.estimator;
    scene.render.bound = pair.bound;
    return scene;
}

inline Light sunlight() { return cases::light(LightKind::directional); }
inline Light small_environment() { return cases::light(LightKind::envmap); }

/// Ellipsoids of three families in each other, an albedo and an emission for each, many with a g of their own; a sun and an
/// environment, both sampled.
inline Scene mixed_scene() {
    Scene scene;
    scene.path = "mixed";
    scene.film = {16, 12};
    scene.camera.origin = {0.5, 0.8, -3.4};
    scene.camera.fov_rad = 0.6;
    const KernelFamily kernels[] = {KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform};
    const double extents[] = {2.5, 3, 1.5};
    for (std::uint64_t m = 0; m < 3; ++m) {
        EllipsoidMedium medium = reference::random_mixture(kernels[m], 16, 30 + m, 4, 2.5).media[0];
        medium.extent = extents[m];
        for (std::size_t i = 0; i < medium.primitives.size(); ++i) {
            Primitive& p = medium.primitives[i];
            p.albedo = {0.5 + 0.03 * static_cast<double>(i), 0.9, 0.95 - 0.05 * static_cast<double>(i)};
            if (i % 4 == m) p.emission = {0.3, 0.1 * static_cast<double>(m), 0.05};
            p.has_g = i % 2 == 0;
            p.g = 0.08f * static_cast<float>(i) - 0.6f;
        }
        scene.media.push_back(medium);
    }
    scene.media[1].phase = {PhaseKind::henyey_greenstein, 0.4};
    scene.lights = {sunlight(), small_environment()};
    return scene;
}

/// The same, and a turned sparse grid across it.
inline Scene mixed_grid_scene() {
    Scene scene = mixed_scene();
    const auto axes = probing::turned_axes(0.055);
    scene.grids = {probing::grid_medium(probing::voxel_grid({3, -7, 0}, {43, 40, 45}, probing::smooth_samples(40), true, axes, axes * glm::dvec3(-21, -18, -21)), 3)};
    scene.grids[0].albedo = {0.9, 0.6, 0.8};
    scene.grids[0].emission = {0, 0.1, 0.2};
    scene.grids[0].phase = {PhaseKind::henyey_greenstein, -0.5};
    return scene;
}

}  // namespace clume::test
