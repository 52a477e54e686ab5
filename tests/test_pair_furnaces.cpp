// SPDX-License-Identifier: MIT
// Furnaces for tracking by segments, by steps and under learned bounds. What scatters everything, or emits what it absorbs,
// is invisible in a constant light of 1, path by path and wherever paths scatter: that holds for biased strategies, too.
// With lights sampled, flights and transmittances must agree, and the mean is 1 for unbiased ones.
#include "tests/pairs.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

constexpr KernelFamily kGaussian = KernelFamily::gaussian, kEpanechnikov = KernelFamily::epanechnikov, kUniform = KernelFamily::uniform;

void check_one_per_path(const Pair& pair, Scene scene, double density) {
    scene.film = density > 5 ? Film{8, 8} : Film{16, 16};
    scene.render.step = 0.1;
    const RenderResult r = render_pair(pair, scene, 4, 2);
    CHECK(r.stats.nonfinite_samples == 0);
    double worst = 0;
    for (float v : r.image.rgb) worst = std::max(worst, std::abs(static_cast<double>(v) - 1));
    INFO(pair.name() << ", density " << density);
    CHECK(worst < 4e-6);
    CHECK(*std::max_element(r.image.variance.begin(), r.image.variance.end()) < 1.6e-11f);
    // Something was there to meet.
    CHECK(*std::max_element(r.image.alpha.begin(), r.image.alpha.end()) > 0);
}

/// A furnace with a grid across it, which scatters or emits as its ellipsoids do.
Scene with_grid(Scene scene, double density) {
    scene.grids = {mixed_grid_scene().grids[0]};
    GridMedium& m = scene.grids[0];
    m.density_scale = density;
    const bool emits = scene.media[0].primitives[0].emission.x > 0;
    m.albedo = emits ? glm::dvec3(0.2, 0.5, 0.8) : glm::dvec3(1);
    m.emission = glm::dvec3(emits ? 1 : 0);
    return scene;
}

}  // namespace

TEST_CASE("PairFurnaces.WhiteOnesHoldPathByPath") {
    const std::pair<Pair, KernelFamily> cases[] = {
        {{"regular"}, kGaussian}, {{"regular", "analytic", "auto", "bisection"}, kEpanechnikov}, {{"regular-linear"}, kEpanechnikov}, {{"march-analytic"}, kUniform}, {{"progressive"}, kGaussian}};
    for (const auto& [pair, family] : cases)
        for (const double density : {0.3, 30.0})
            for (const bool inside : {false, true}) {
                Scene scene = white_furnace(family, density, inside);
                scene.render.light_sampling = LightSampling::phase;
                check_one_per_path(pair, scene, density);
            }
}

TEST_CASE("PairFurnaces.EmissiveOnesWithAGridHoldPathByPath") {
    for (const Pair& pair : {Pair{"regular"}, {"progressive"}, {"march"}})
        for (const double density : {0.3, 30.0}) {
            Scene scene = with_grid(emissive_furnace(kGaussian, density, density < 1), density);
            scene.render.rr_depth = 1 << 20;
            check_one_per_path(pair, scene, density);
        }
}

TEST_CASE("PairFurnaces.MeanOneWithLightSampling") {
    for (const Pair& pair : {Pair{"regular", "ratio"}, {"progressive", "residual-ratio"}, {"delta", "binary"}})
        for (const double density : {0.3, 10.0}) {
            Scene scene = with_grid(white_furnace(kUniform, density, density > 1), density);
            scene.film = {8, 8};
            scene.render.light_sampling = LightSampling::nee;
            const RenderResult r = render_pair(pair, scene, 128, 4);
            INFO("density " << density);
            check_same("pair_furnace_nee by " + pair.name(), colour_of(r.image), grey(8, 8, std::vector<double>(64, 1), {}), 1e-4, 8);
        }
}
