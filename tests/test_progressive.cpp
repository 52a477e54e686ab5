// SPDX-License-Identifier: MIT
// `progressive` as a whole: from bounds far too low its bias falls below the noise as passes grow, what it says of its bounds
// falls with it, and an image is a function of seed and samples alone.
#include "runtime/device.h"
#include "src/strategies.h"
#include "tests/pairs.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

const Pair kProgressive{"progressive"};

RenderOptions from_too_low(int warm_up) {
    RenderOptions options;
    options.progressive_start = 0.01;
    options.progressive_warm_up = warm_up;
    return options;
}

Scene body() {
    Scene scene = mixed_grid_scene();
    scene.film = {12, 10};
    return scene;
}

struct Bias {
    double mean, noise;  ///< of the whole image, one number of all channels
    double z() const { return mean / noise; }
};

Bias bias_of(const RenderImage& image, const Estimate& truth) {
    const Estimate e = colour_of(image);
    Bias b{0, 0};
    for (std::size_t i = 0; i < e.mean.size(); ++i) {
        b.mean += e.mean[i] - truth.mean[i];
        b.noise += e.variance[i] + truth.variance[i];
    }
    b.noise = std::sqrt(b.noise);
    return b;
}

double share_above(const RenderStats& s) { return static_cast<double>(s.bound_violations) / static_cast<double>(s.work[WORK_DENSITIES]); }

}  // namespace

TEST_CASE("Progressive.BiasFallsBelowTheNoise") {
    // No passes before the image, which begins a hundred times below the usual start; one bound for each medium, which a few
    // look-ups teach: with many cells a hundred paths a pass would take far more passes.
    const Scene scene = body();
    const Pair pair{"progressive", "analytic", "scene"};
    const Estimate truth = colour_of(render_pair({"delta"}, scene, 8192, 5).image);
    std::vector<Bias> bias;
    std::vector<double> above, excess;
    const auto begin = from_too_low(0);
    for (const std::uint32_t spp : {2u, 16u, 128u, 1024u}) {
        const RenderResult r = render_pair(pair, scene, spp, 3, begin);
        bias.push_back(bias_of(r.image, truth));
        above.push_back(share_above(r.stats));
        excess.push_back(r.stats.excess / static_cast<double>(r.stats.work[WORK_DENSITIES]));
        REQUIRE(r.stats.notes.size() == 1);
        UNSCOPED_INFO(spp << " spp: bias " << bias.back().mean << ", noise " << bias.back().noise << "; " << r.stats.notes[0]);
    }
    CHECK(std::abs(bias[0].z()) > 8);
    CHECK(std::abs(bias.back().z()) < 4);
    for (std::size_t i = 1; i < bias.size(); ++i) {
        // Three doublings: passes under low bounds weigh an eighth.
        CHECK(std::abs(bias[i].mean) < 0.5 * std::abs(bias[i - 1].mean) + 3 * bias[i].noise);
        CHECK(above[i] < 0.5 * above[i - 1]);
        CHECK(excess[i] < 0.5 * excess[i - 1]);
    }
    // The first pass alone finds most densities above their bounds.
    CHECK(share_above(render_pair(pair, scene, 1, 3, begin).stats) > 0.3);
    CHECK(above.back() < 2e-3);
}

TEST_CASE("Progressive.LearnsBeforeTheImageBegins") {
    // The passes that no image holds make up for the low start, cell by cell: already a few samples pass, the first one too. They
    // look into every cell they cross, so three of them do: without that, bounds so low lead to hardly any look-ups.
    const Scene scene = body();
    const Estimate truth = colour_of(render_pair({"delta"}, scene, 2048, 5).image);
    for (const std::uint32_t spp : {1u, 4u, 16u, 256u}) {
        const RenderResult r = render_pair(kProgressive, scene, spp, 3, from_too_low(3));
        CHECK(share_above(r.stats) < 2e-3);
        const Bias bias = bias_of(r.image, truth);
        INFO(spp << " spp: z " << bias.z());
        // One sample has no variance of its own: that of a path, from the truth's many.
        if (spp > 1) CHECK(std::abs(bias.z()) < 4);
        if (spp > 4) check_same("progressive", colour_of(r.image), truth);
    }
}

TEST_CASE("Progressive.IsAFunctionOfTheSamples") {
    // Bounds are raised by whichever batch and device comes first, and are the same after every pass.
    Scene scene = body();
    for (const int warm_up : {0, 24}) {
        RenderOptions options = from_too_low(warm_up);
        const RenderResult first = render_pair(kProgressive, scene, 21, 3, options);
        const auto check = [&](const char* what) {
            const RenderResult again = render_pair(kProgressive, scene, 21, 3, options);
            INFO(what << ", warm-up of " << warm_up);
            CHECK(again.image.rgb == first.image.rgb);
            CHECK(again.image.variance == first.image.variance);
            CHECK(again.stats.bound_violations == first.stats.bound_violations);
            CHECK(again.stats.excess == first.stats.excess);
        };
        check("again");
        options.batch_samples = 3;
        check("batches of 3");
        options.vector_width = 4;
        check("width 4");
        options.vector_width = 0;
        const std::vector<DeviceInfo> devices = list_devices();
        if (std::none_of(devices.begin(), devices.end(), [](const DeviceInfo& d) { return d.type == "cpu" && d.compute_units >= 2; })) continue;
        options.cpu_split = 2;
        options.devices = {"cpu"};
        check("two devices");
    }
}

TEST_CASE("Progressive.PartsOfInterleavedSeedsAddUpToSingleRuns") {
    // What one seed has learned is no part of the other, and a pass may end in the middle.
    Scene scene = with_pair(body(), {"progressive", "analytic"});
    RenderOptions options = from_too_low(1);
    Renderer renderer(scene, options);
    Accumulation a = renderer.start(5), b = renderer.start(6);
    for (const std::uint32_t end : {1u, 3u, 5u, 6u, 13u, 21u}) {
        renderer.extend(a, end);
        renderer.extend(b, end);
    }
    for (const auto& [film, seed] : {std::pair{&a, 5u}, {&b, 6u}}) {
        Renderer alone(scene, options);
        Accumulation whole = alone.start(seed);
        alone.extend(whole, 21);
        CHECK(renderer.result(*film).image.rgb == alone.result(whole).image.rgb);
        CHECK(renderer.result(*film).stats.excess == alone.result(whole).stats.excess);
    }
}
