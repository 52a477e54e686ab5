// SPDX-License-Identifier: MIT
// One picture, bit for bit, however the work is cut up, and noise that falls as it must: batches, sub-devices, vector widths,
// sample ranges, crops, launches; error against samples; and what the film counts beside its sums.
#include <numbers>

#include "tests/device_image.h"
#include "tests/flight_reference.h"
#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

/// Two media of different kernels in colour, some emission, an image environment by MIS and a point light.
Scene colourful() {
    Scene scene = random_mixture(KernelFamily::gaussian, 40, 3, 6, 3);
    scene.film = {24, 20};
    scene.media.push_back(random_mixture(KernelFamily::epanechnikov, 20, 4, 4, 3).media[0]);
    scene.media[1].phase = {PhaseKind::henyey_greenstein, 0.5};
    scene.media[0].primitives[7].emission = {1, 0.5, 0.1};
    scene.lights = {contrast_environment(true, 0.4), point_light({1.5, 1, -1}, {3, 2, 1})};
    return scene;
}

bool same_bits(const RenderImage& a, const RenderImage& b) {
    return a.rgb == b.rgb && a.alpha == b.alpha && a.variance == b.variance && a.samples == b.samples;
}

RenderResult render_with(const Way& way, const RenderOptions& options) { return render_by(way, colourful(), 21, 9, options); }

}  // namespace

TEST_CASE("Determinism.BatchesDoNotMatter", "[quick]") {
    RenderOptions whole;
    whole.batch_samples = 21;
    const RenderResult reference = render_with(delta, whole);
    check_clean(reference);
    CHECK(mean_of(doubles(reference.image.rgb)) > 0.01);
    for (std::uint32_t batch : {0u, 1u, 7u}) {
        RenderOptions options;
        options.batch_samples = batch;
        CHECK(same_bits(render_with(delta, options).image, reference.image));
    }
    // And the seed does matter.
    CHECK_FALSE(same_bits(render_by(delta, colourful(), 21, 10).image, reference.image));
}

TEST_CASE("Determinism.SplitDevicesDoNotMatter") {
    const RenderResult reference = render_with(delta, {});
    RenderOptions split;
    split.cpu_split = 2;
    split.batch_samples = 2;
    const std::vector<DeviceInfo> devices = list_devices();
    if (std::none_of(devices.begin(), devices.end(), [](const DeviceInfo& d) { return d.type == "cpu" && d.compute_units >= 2; })) return;
    split.devices = {"cpu"};
    const RenderResult r = render_with(delta, split);
    CHECK(r.stats.devices.size() >= 2);
    CHECK(same_bits(r.image, reference.image));
    CHECK(r.stats.layout_hash == reference.stats.layout_hash);
}

TEST_CASE("Determinism.VectorWidthsDoNotMatter") {
    // One sample and high overlap: a single rounding that differs, in a sum over many lanes, shows. Sums of densities and depths
    // (`march`, and light through the mixture), active chords (`regular`), the least of many (`decomposition`).
    Scene scene = colourful();
    scene.media[0] = random_mixture(KernelFamily::gaussian, 120, 3, 60, 0.3).media[0];
    scene.film = {64, 48};
    scene.lights = {point_light({1.5, 1, -1}, {3, 2, 1})};
    const std::pair<Way, std::vector<int>> cases[] = {{{"march", "cells"}, {8, 4, 1}}, {{"regular", "auto"}, {4}}, {decomposition_bvh, {1}}};
    for (const auto& [way, widths] : cases) {
        RenderOptions options;
        options.vector_width = 16;
        const RenderResult reference = render_by(way, scene, 1, 0, options);
        for (int width : widths) {
            options.vector_width = width;
            const RenderResult r = render_by(way, scene, 1, 0, options);
            INFO(way.name() << ", width " << width);
            CHECK(same_bits(r.image, reference.image));
            CHECK(r.stats.layout_hash == reference.stats.layout_hash);
        }
    }
}

TEST_CASE("Determinism.AcceleratorsDoNotMatterToDecomposition") {
    // Each primitive draws its own collision: the cells and the tree find the same winner.
    Scene scene = grey_mixture();
    CHECK(same_bits(render_by(decomposition, scene, 64).image, render_by(decomposition_bvh, scene, 64).image));
}

TEST_CASE("Determinism.SampleRangesAddUp") {
    const RenderResult whole = render_with(delta, {});
    RenderOptions options;
    options.sample_end = 8;
    const RenderImage first = render_with(delta, options).image;
    options.sample_begin = 8;
    options.sample_end = 21;
    const RenderImage rest = render_with(delta, options).image;
    double worst = 0;
    for (std::size_t i = 0; i < first.rgb.size(); ++i) {
        const double combined = (8 * static_cast<double>(first.rgb[i]) + 13 * static_cast<double>(rest.rgb[i])) / 21, v = whole.image.rgb[i];
        worst = std::max(worst, std::abs(combined - v) / (std::abs(v) + 1e-6));
    }
    CHECK(worst < 4e-7);  // the rounding of floats in a file, nothing else
    CHECK(first.samples[0] == 8);
    CHECK(rest.samples[0] == 13);
}

TEST_CASE("Determinism.CropsAreCutFromTheWhole") {
    const RenderImage whole = render_with(delta, {}).image;
    RenderOptions options;
    options.crop = CropWindow{5, 2, 18, 17};
    const RenderImage crop = render_with(delta, options).image;
    REQUIRE(crop.alpha.size() == 13 * 15);
    std::size_t different = 0;
    for (std::size_t y = 0; y < 15; ++y)
        for (std::size_t x = 0; x < 13; ++x) {
            const std::size_t i = x + 13 * y, j = x + 5 + 24 * (y + 2);
            different += crop.alpha[i] != whole.alpha[j];
            for (std::size_t c = 0; c < 3; ++c) different += crop.rgb[3 * i + c] != whole.rgb[3 * j + c] || crop.variance[3 * i + c] != whole.variance[3 * j + c];
        }
    CHECK(different == 0);
}

TEST_CASE("Launches.PathsGoOnInTheNext") {
    const Scene scene = colourful();
    for (const char* strategy : {"delta", "decomposition"}) {
        Scene s = scene;
        s.render.strategy = strategy;
        DeviceScene device = make_device_scene(s, {});
        const DeviceImage whole = render_device(s, device, 16);
        set_define(device, "CLUME_LAUNCH_EVENTS", "3");
        const DeviceImage cut = render_device(s, device, 16);
        INFO(strategy);
        CHECK(cut.same_bits(whole));
    }
}

TEST_CASE("Determinism.HowGpusAreUsedDoesNotMatter") {
    // A processor taken for a GPU: one float a vector, work-groups of 64, a context that queues share, buffers that are copies. Not
    // `progressive`, in groups of which Intel's runtime crashes (docs/design.md).
    DeviceInfo gpu = select_devices({}).front();
    gpu.type = "gpu";
    gpu.native_vector_width = 1;
    const Queue other(gpu);
    for (const char* strategy : {"delta", "decomposition"}) {
        Scene scene = colourful();
        scene.render.strategy = strategy;
        const DeviceScene device = make_device_scene(scene, {});
        INFO(strategy);
        CHECK(render_device(scene, device, 16, gpu).same_bits(render_device(scene, device, 16)));
        const auto rays = probing::random_rays(3000, 5);
        const auto flights = Probe(gpu, device).flights(rays, 2).values, same = Probe(select_devices({}).front(), device).flights(rays, 2).values;
        CHECK(probing::first_difference(flights, same) == rays.size());
    }
}

TEST_CASE("Launches.WorkItemsTakeManyRows") {
    // Few samples of many pixels: lanes go from row to row, in one launch or in many, and each path counts for its own.
    Scene scene = grey_mixture();
    scene.render.strategy = "delta";
    scene.film = {64, 48};
    DeviceScene device = make_device_scene(scene, {});
    const DeviceImage alone = render_device(scene, device, 3, select_devices({}).front(), 1);
    const auto check = [&](const char* events) {
        set_define(device, "CLUME_LAUNCH_EVENTS", events);
        for (const int width : {4, 16}) {
            INFO(width << " paths side by side, " << events << " events a row in a launch");
            CHECK(render_device(scene, device, 3, select_devices({}).front(), width).same_bits(alone));
        }
    };
    check("4096");
    check("2");
}

TEST_CASE("Launches.PausedFlightsKeepTheMean") {
    // A null-collision flight cut after every tentative collision, each launch after two events.
    Scene scene = grey_mixture();
    scene.render.strategy = "delta";
    scene.media[0].density_scale = 4;
    DeviceScene device = make_device_scene(scene, {});
    const DeviceImage whole = render_device(scene, device, 256);
    set_define(device, "CLUME_FLIGHT_DRAWS", "1");
    set_define(device, "CLUME_LAUNCH_EVENTS", "2");
    device.params.seed_lo = 1;
    check_same("paused_flights", colour_of(render_device(scene, device, 256), scene.film), colour_of(whole, scene.film));
}

TEST_CASE("Noise.FallsAsTheRootOfTheSamples") {
    const Scene scene = grey_mixture();
    const Estimate truth = colour_of(render_by(delta, scene, 8192, 1000).image);
    const double truth_variance = mean_of(truth.variance);
    std::vector<double> x, y;
    for (int k = 3; k <= 9; ++k) {
        const Estimate e = colour_of(render_by(delta, scene, 1u << k, static_cast<std::uint64_t>(k)).image);
        double square = 0;
        for (std::size_t i = 0; i < e.mean.size(); ++i) square += std::pow(e.mean[i] - truth.mean[i], 2);
        square = square / static_cast<double>(e.mean.size()) - truth_variance;
        x.push_back(k);
        y.push_back(0.5 * std::log2(square));
        // The variance that the image claims for its mean is the one it has: 256 pixels tell it to 9 %.
        CHECK(square / mean_of(e.variance) == Approx(1).margin(k < 6 ? 0.5 : 0.4));
    }
    const double mean_x = mean_of(x), mean_y = mean_of(y);
    double xy = 0, xx = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        xy += (x[i] - mean_x) * (y[i] - mean_y);
        xx += (x[i] - mean_x) * (x[i] - mean_x);
    }
    const double slope = xy / xx;
    INFO("slope " << slope);
    CHECK(std::abs(slope + 0.5) < 0.06);
    // No floor: the last point lies on the line of the others.
    CHECK(y.back() < mean_y - 0.5 * (x.back() - mean_x) + 0.25);
}

TEST_CASE("Noise.SeedsAreIndependent") {
    const Scene scene = grey_mixture();
    const Estimate truth = colour_of(render_by(delta, scene, 8192, 1000).image);
    const Estimate a = colour_of(render_by(delta, scene, 32, 0).image), b = colour_of(render_by(delta, scene, 32, 1).image),
                   c = colour_of(render_by(delta, scene, 32, std::uint64_t{1} << 32).image);
    const auto correlation = [&](const Estimate& p, const Estimate& q) {
        double pq = 0, pp = 0, qq = 0;
        for (std::size_t i = 0; i < truth.mean.size(); i += 3) {
            const double u = p.mean[i] - truth.mean[i], v = q.mean[i] - truth.mean[i];
            pq += u * v, pp += u * u, qq += v * v;
        }
        return pq / std::sqrt(pp * qq);
    };
    for (double r : {correlation(a, b), correlation(a, c), correlation(b, c)}) CHECK(std::abs(r) < 0.3);  // 256 pixels: σ 0.063
}

TEST_CASE("Noise.RouletteKeepsTheMean") {
    Scene scene = colourful();
    scene.render.rr_depth = 0;
    const RenderResult early = render_by(delta, scene, 256, 1);
    scene.render.rr_depth = 1000;
    const RenderResult never = render_by(delta, scene, 256, 2);
    check_same("roulette", colour_of(early.image), colour_of(never.image));
}

TEST_CASE("Film.TooLowABoundIsCounted") {
    const Scene scene = grey_mixture();
    DeviceScene device = make_device_scene(scene, {});
    CHECK(render_device(scene, device, 16).violations == 0);
    HostArray<device::Reference> references = device.references.values();
    for (device::Reference& r : references) r.scales += 0x00800080u;  // both twice as large
    device.references = std::move(references);
    CHECK(render_device(scene, device, 16).violations > 100);
}

TEST_CASE("Film.NonFiniteSamplesAddNothingAndAreCounted") {
    for (float bad : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(), -1.0f}) {
        const Scene scene = grey_mixture();
        DeviceScene device = make_device_scene(scene, {});
        device.lights[0].radiance = {bad, bad, bad, device.lights[0].radiance.w};
        const DeviceImage image = render_device(scene, device, 16);
        CHECK(image.nonfinite > 100);
        for (const FilmSums::Pixel& p : image.values) {
            REQUIRE(p.mean[0] == 0);
            REQUIRE(p.variance[0] == 0);
            REQUIRE(p.samples == 16);
        }
    }
}

TEST_CASE("Film.SumsAreExactAndCountersAddUp", "[quick]") {
    FilmSums film(2, 3, 0.5);
    std::vector<std::uint64_t> w(4 * FILM_WORDS, 0);  // two pixels, two splits
    w[0] = ~std::uint64_t{0};                          // pixel 0, split 0: 2^64 − 1 units
    w[2 * FILM_WORDS] = 1;                             // split 1: one more carries into the high word
    w[2 * FILM_WORDS + FILM_ALPHA] = 1;
    w[FILM_WORDS + FILM_NONFINITE] = 3;
    w[3 * FILM_WORDS + FILM_VIOLATIONS] = 2;
    const std::uint32_t both[] = {0, 1};
    film.add(both, 2, 2, w);
    const FilmSums::Pixel p = film.pixel(0);
    CHECK(p.mean[0] == 1);  // 1 unit of radiance / 2 samples / scale 0.5
    CHECK(p.mean[1] == 0);
    CHECK(p.alpha == 0.5);
    CHECK(p.samples == 2);
    CHECK(film.nonfinite() == 3);
    CHECK(film.violations() == 2);
}
