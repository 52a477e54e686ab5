// SPDX-License-Identifier: MIT
// Both furnaces: in a constant light of 1, whatever scatters everything, and whatever emits what it absorbs, is invisible.
// Without light sampling each single path carries exactly 1; with it the mean is 1.
#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

const std::vector<KernelFamily> families{KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform};
constexpr double densities[] = {0.1, 1, 10, 100};

/// Paths inside a dense furnace scatter some 10,000 times: few of them do.
std::uint32_t resize(Scene& scene, double density) {
    scene.film = density > 50 ? Film{4, 4} : density > 5 ? Film{8, 8} : Film{16, 16};
    return density > 50 ? 1 : 4;
}

double worst_from_one(const RenderImage& image) {
    double worst = 0;
    for (float v : image.rgb) worst = std::max(worst, std::abs(static_cast<double>(v) - 1));
    return worst;
}

void check_one_per_path(const Way& way, Scene scene, double density, double tolerance) {
    const std::uint32_t spp = resize(scene, density);
    const RenderResult r = render_by(way, scene, spp);
    check_clean(r);
    INFO(way.name() << ", density " << density << ", kernel " << static_cast<int>(scene.media[0].kernel));
    CHECK(worst_from_one(r.image) < tolerance);
    // Each sample, too, and not only their mean.
    CHECK(*std::max_element(r.image.variance.begin(), r.image.variance.end()) < tolerance * tolerance);
}

void check_mean_one(const Way& way, const std::string& name, const Scene& scene, std::uint32_t spp) {
    const RenderResult r = render_by(way, scene, spp, 5);
    check_clean(r);
    const Estimate e = colour_of(r.image);
    const std::vector<double> one(e.mean.size() / 3, 1);
    // Large blocks: where a path seldom meets anything, a small one may hold too few events for a z-test.
    check_same(name + " by " + way.name(), e, grey(e.width, e.height, one, {}), 1e-4, 8);
}

}  // namespace

TEST_CASE("WhiteFurnace.EveryPathCarriesOne") {
    for (const Way& way : unbiased_ways)
        for (KernelFamily family : families)
            for (double density : densities)
                for (bool inside : {false, true}) {
                    Scene scene = white_furnace(family, density, inside);
                    scene.render.light_sampling = inside ? LightSampling::mis : LightSampling::phase;
                    check_one_per_path(way, scene, density, 2e-6);
                }
}

TEST_CASE("WhiteFurnace.OnePath", "[quick]") {
    for (const Way& way : unbiased_ways) check_one_per_path(way, white_furnace(KernelFamily::gaussian, 1, false), 1, 2e-6);
}

TEST_CASE("WhiteFurnace.MeanOneWithLightSampling") {
    for (KernelFamily family : families)
        for (double density : densities)
            for (bool inside : {false, true}) {
                Scene scene = white_furnace(family, density, inside);
                resize(scene, density);
                scene.render.light_sampling = LightSampling::nee;
                for (const Way& way : unbiased_ways) {
                    if (&way != &unbiased_ways[0] && family != KernelFamily::epanechnikov) continue;
                    INFO("density " << density << (inside ? ", inside" : ", outside"));
                    check_mean_one(way, "white_furnace_nee", scene, density > 50 ? 8 : density > 5 ? 64 : density > 0.5 ? 128 : 512);
                }
            }
}

TEST_CASE("WhiteFurnace.MeanOneWithRouletteOnDimLight") {
    // Peaked forward or backward, most of the light that is sampled is worth little: its shadow rays are left to roulette.
    for (const double g : {0.7, -0.8})
        for (const LightSampling sampling : {LightSampling::nee, LightSampling::mis}) {
            Scene scene = white_furnace(KernelFamily::gaussian, 2, false);
            scene.film = {8, 8};
            scene.media[0].phase = {PhaseKind::henyey_greenstein, g};
            scene.render.light_sampling = sampling;
            // As an image it is sampled by `mis`, too.
            scene.lights[0].kind = LightKind::envmap;
            scene.lights[0].image.width = scene.lights[0].image.height = 2;
            scene.lights[0].image.rgb.assign(12, 1.0f);
            for (const Way& way : {delta, decomposition_bvh}) check_mean_one(way, "white_furnace_dim_light", scene, 2048);
        }
}

TEST_CASE("WhiteFurnace.ImageOfOneIsAConstant") {
    // As an environment image the same light takes MIS, whose two halves must add up to 1.
    for (double density : {1.0, 10.0}) {
        Scene scene = white_furnace(KernelFamily::gaussian, density, false);
        Light& light = scene.lights[0];
        light.kind = LightKind::envmap;
        light.image.width = 3;
        light.image.height = 5;
        light.image.rgb.assign(45, 0.25f);
        light.scale = 4;
        for (const LightSampling sampling : {LightSampling::mis, LightSampling::nee}) {
            scene.render.light_sampling = sampling;
            check_mean_one(delta, "white_furnace_image", scene, 128);
        }
    }
}

TEST_CASE("EmissiveFurnace.EveryPathCarriesOne") {
    for (const Way& way : {delta, decomposition_bvh})
        for (KernelFamily family : families)
            for (double density : densities)
                for (bool inside : {false, true}) {
                    Scene scene = emissive_furnace(family, density, inside);
                    scene.render.rr_depth = 1 << 20;  // roulette keeps the mean alone
                    check_one_per_path(way, scene, density, 4e-6);
                }
}

TEST_CASE("EmissiveFurnace.MeanOneWithRoulette") {
    for (KernelFamily family : families)
        for (double density : {1.0, 100.0}) {
            Scene scene = emissive_furnace(family, density, true);
            scene.render.rr_depth = 0;
            check_mean_one(delta, "emissive_furnace_roulette", scene, 64);
        }
}

TEST_CASE("EmissiveFurnace.MeanOneWithLightSampling") {
    for (KernelFamily family : families)
        for (double density : densities) {
            Scene scene = emissive_furnace(family, density, density < 5);
            scene.render.light_sampling = LightSampling::nee;
            check_mean_one(family == KernelFamily::uniform ? decomposition_bvh : delta, "emissive_furnace_nee", scene, density > 0.5 ? 64 : 1024);
        }
}
