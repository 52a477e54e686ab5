// SPDX-License-Identifier: MIT
// One Renderer, many runs: parts of a sample range add up to the whole, seeds interleaved do not touch each other, and what is
// set up or counted belongs to the right run.
#include <atomic>

#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

Scene lit_mixture() {
    Scene scene = random_mixture(KernelFamily::gaussian, 40, 3, 6, 3);
    scene.film = {24, 20};
    scene.lights = {point_light({1.5, 1, -1}, {3, 2, 1})};
    return scene;
}

bool same_bits(const RenderImage& a, const RenderImage& b) {
    return a.rgb == b.rgb && a.alpha == b.alpha && a.variance == b.variance && a.samples == b.samples && a.tests == b.tests;
}

}  // namespace

TEST_CASE("Renderer.PartsOfInterleavedSeedsAddUpToSingleRuns", "[quick]") {
    Scene scene = lit_mixture();
    RenderOptions options;
    options.count_work = true;
    Renderer renderer(scene, options);
    Accumulation a = renderer.start(5), b = renderer.start(6), late = renderer.start(5, 4);
    for (const std::uint32_t end : {1u, 2u, 4u, 9u}) {
        renderer.extend(a, end);
        renderer.extend(b, end);
    }
    renderer.extend(late, 9);
    renderer.extend(late, 3);  // nothing left to do
    CHECK(a.complete());
    CHECK(late.begin() == 4);
    CHECK(late.end() == 9);
    const std::atomic<bool> stop{false};
    scene.render.spp = 9;
    const auto single = [&](std::uint64_t seed, std::uint32_t begin) {
        scene.render.seed = seed;
        options.sample_begin = begin;
        return render(scene, options, {}, stop);
    };
    const RenderResult whole = single(5, 0), parts = renderer.result(a);
    CHECK(same_bits(parts.image, whole.image));
    CHECK(parts.stats.work == whole.stats.work);
    CHECK(parts.stats.paths == whole.stats.paths);
    CHECK(parts.stats.layout_hash == single(6, 0).stats.layout_hash);  // the seed is no part of the layout
    CHECK(same_bits(renderer.result(b).image, single(6, 0).image));
    CHECK(same_bits(renderer.result(late).image, single(5, 4).image));
    CHECK_FALSE(same_bits(whole.image, single(6, 0).image));
}

TEST_CASE("Renderer.AStoppedRunIsNotComplete", "[quick]") {
    Renderer renderer(lit_mixture(), {});
    const std::atomic<bool> stop{true};
    Accumulation film = renderer.start(0);
    renderer.extend(film, 8, {{}, &stop, {}});
    CHECK_FALSE(film.complete());
    const RenderStats stats = renderer.result(film).stats;
    CHECK(stats.interrupted);
    CHECK(stats.samples_max == 0);
    Accumulation limited = renderer.start(0);
    renderer.extend(limited, 100000000, {{}, nullptr, 0.05});
    CHECK_FALSE(limited.complete());
    CHECK(renderer.result(limited).stats.time_limited);
}
