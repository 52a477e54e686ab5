// SPDX-License-Identifier: MIT
// Pairs of a distance strategy and a transmittance estimator on mixed scenes: all unbiased ones give one mean image, the
// host path tracer's; biased ones are found to be biased. Between them the pairs have every strategy, every estimator, every
// bound and both ways of root finding, if not every combination: each is a program of its own.
#include "tests/pairs.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

struct Rendering {
    std::string name;
    Estimate colour, alpha;
};

Rendering by_host(const Scene& scene, std::uint32_t spp) {
    const HostImage host = HostTracer(scene, 32).trace(spp, 81, 2);
    REQUIRE(host.not_finite == 0);
    return {"host", colour_of(host), alpha_of(host, spp)};
}

/// Every pair against the host and every other, all with numbers of their own; one test in 1e4 of such families fails by chance.
void check_all_equal(const std::string& scene_name, const Scene& scene, const std::vector<Pair>& pairs, std::uint32_t spp) {
    std::vector<Rendering> all{by_host(scene, spp)};
    for (const Pair& pair : pairs) {
        INFO(pair.name());
        const RenderResult r = render_pair(pair, scene, spp, all.size());
        if (std::string(pair.strategy) == "progressive") CHECK(r.stats.nonfinite_samples == 0);
        else check_clean(r);
        all.push_back({pair.name(), colour_of(r.image), alpha_of(r.image)});
    }
    const double alpha = sidak_threshold(1e-4, all.size() * (all.size() - 1));
    for (std::size_t a = 0; a < all.size(); ++a)
        for (std::size_t b = a + 1; b < all.size(); ++b) {
            const std::string name = scene_name + ": " + all[a].name + " and " + all[b].name;
            check_same(name, all[a].colour, all[b].colour, alpha);
            check_same(name + ", alpha", all[a].alpha, all[b].alpha, alpha);
        }
}

/// A difference that chance does not explain.
void check_biased(const Pair& pair, const Scene& scene, const Estimate& truth, std::uint32_t spp) {
    const ImageTest t = compare(colour_of(render_pair(pair, scene, spp, 9).image), truth);
    INFO(pair.name() << ": least p " << t.min_p << ", ratio of means " << t.global_ratio[0] << ", z " << t.global_z[0]);
    CHECK_FALSE(t.pass);
    CHECK(t.min_p < 1e-8);
}

}  // namespace

TEST_CASE("Pairs.UnbiasedOnesGiveOneImageOfAMixture") {
    const std::vector<Pair> pairs{{"delta", "analytic", "tree"},
                                  {"delta", "ratio", "tree"},
                                  {"delta", "residual-ratio", "tree"},
                                  {"delta", "binary", "tree"},
                                  {"delta", "ratio", "scene"},
                                  {"delta", "binary", "grid"},
                                  {"regular", "analytic"},
                                  {"regular", "residual-ratio", "grid"},
                                  {"regular", "binary", "auto", "bisection", "cells"},
                                  {"decomposition", "analytic", "auto", "newton", "cells"},
                                  {"decomposition", "residual-ratio", "scene"},
                                  {"decomposition", "binary", "auto", "newton", "bvh"},
                                  {"progressive", "ratio"}};
    check_all_equal("mixture", mixed_scene(), pairs, 256);
}

TEST_CASE("Pairs.UnbiasedOnesGiveOneImageOfAMixtureAndAGrid") {
    const std::vector<Pair> pairs{{"delta", "analytic", "grid"},
                                  {"delta", "ratio", "tree"},
                                  {"delta", "residual-ratio", "scene"},
                                  {"delta", "binary", "tree"},
                                  {"regular", "ratio", "grid"},
                                  {"regular", "binary", "auto", "bisection"},
                                  {"decomposition", "residual-ratio", "tree"},
                                  {"progressive", "binary"}};
    check_all_equal("mixture_and_grid", mixed_grid_scene(), pairs, 128);
}

TEST_CASE("Pairs.BiasedOnesAreFoundBiased") {
    // Few large bodies of depth about 5, lit from one side: where in a segment or a step light scatters shows.
    Scene scene = mixed_scene();
    for (auto& m : scene.media) {
        m.primitives.resize(1);
        m.primitives[0].axes = glm::dmat3(0.5);
        m.primitives[0].center *= 0.3;
        m.primitives[0].sigma_t = 3;
    }
    scene.lights = {sunlight()};
    scene.render.step = 0.5;
    const Estimate truth = colour_of(render_pair({"delta"}, scene, 512, 1).image);
    check_biased({"march"}, scene, truth, 512);
    check_biased({"march-analytic"}, scene, truth, 512);
    check_biased({"regular-linear"}, scene, truth, 512);
    check_biased({"delta", "march"}, scene, truth, 512);
    // What they are compared with is not at fault: the unbiased kin of two of them passes.
    check_same("kin of the biased", colour_of(render_pair({"regular"}, scene, 512, 2).image), truth);
}

TEST_CASE("Pairs.BiasedOnesAreFoundBiasedInGrids") {
    Scene scene = mixed_grid_scene();
    scene.media.clear();
    scene.lights = {sunlight()};
    scene.render.step = 0.6;
    const Estimate truth = colour_of(render_pair({"delta"}, scene, 512, 1).image);
    check_biased({"march"}, scene, truth, 512);
    check_biased({"regular", "march"}, scene, truth, 512);
}
