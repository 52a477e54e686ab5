// SPDX-License-Identifier: MIT
// The noise threshold: counts from pilots by formula, means that they do not bias (and kept samples would), the error that was
// asked for reached on the image's own variance, and images that do not depend on devices and batches.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <random>

#include "runtime/device.h"
#include "src/adaptive.h"
#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

/// Twelve film tiles of unlike noise: two media, a light between them, an uneven sky.
Scene uneven() {
    Scene scene = random_mixture(KernelFamily::gaussian, 40, 3, 6, 3);
    scene.film = {60, 46};
    scene.media[0].primitives[7].emission = {4, 2, 0.4};
    scene.lights = {contrast_environment(true, 0.4), point_light({1.5, 1, -1}, {3, 2, 1})};
    scene.render.strategy = "delta";
    scene.render.transmittance = "analytic";
    scene.render.spp = 4096;
    scene.render.seed = 3;
    return scene;
}

RenderOptions within(double threshold) {
    RenderOptions options;
    options.noise_threshold = threshold;
    return options;
}

bool same_bits(const RenderImage& a, const RenderImage& b) {
    return a.rgb == b.rgb && a.alpha == b.alpha && a.variance == b.variance && a.samples == b.samples;
}

std::vector<NoiseTile> row_of(std::initializer_list<std::uint32_t> pixels) {
    std::vector<NoiseTile> tiles;
    std::uint32_t first = 0;
    for (const std::uint32_t n : pixels) {
        tiles.push_back({static_cast<int>(tiles.size()), 0, first, n});
        first += n;
    }
    return tiles;
}

/// Adds samples that are whole numbers to a grey film.
void add(FilmSums& film, std::uint32_t pixel, std::uint64_t sum, std::uint64_t sum_of_squares, std::uint32_t samples) {
    std::vector<std::uint64_t> words(FILM_WORDS, 0);
    words[1] = sum;
    words[3] = sum_of_squares;
    const std::uint32_t active[] = {pixel};
    film.add(active, 1, samples, words);
}

/// Largest ratio of a tile's RMS standard error to its mean, or a sixteenth of the image's; from the image alone.
double noisiest(const RenderImage& image) {
    const int width = image.window.x1 - image.window.x0, height = image.window.y1 - image.window.y0;
    const double least = mean_of(doubles(image.rgb)) / 16;
    double worst = 0;
    for (int ty = 0; ty < height; ty += 16)
        for (int tx = 0; tx < width; tx += 16) {
            double sum = 0, variance = 0, count = 0;
            for (int y = ty; y < std::min(ty + 16, height); ++y)
                for (int i = 3 * (tx + width * y); i < 3 * (std::min(tx + 16, width) + width * y); ++i) {
                    sum += image.rgb[static_cast<std::size_t>(i)];
                    variance += image.variance[static_cast<std::size_t>(i)];
                    count += 1;
                }
            worst = std::max(worst, std::sqrt(variance / count) / std::max(sum / count, least));
        }
    return worst;
}

}  // namespace

TEST_CASE("Adaptive.NeedFollowsFromVarianceAndMean", "[quick]") {
    const auto tiles = row_of({256, 256, 256, 256, 256, 4});
    std::vector<TileNoise> pilot(6);
    pilot[0] = {1, 2, 0.25, 8};     // (2 + 2 · 0.25) / (1 · 0.1)² = 250
    pilot[1] = {1, 0.1, 0, 8};      // 10 of its own: half of its neighbour's
    pilot[2] = {0, 0, 0, 8};        // black, but next to 10
    pilot[3] = {0, 0, 0, 8};        // black: next to the dark one
    pilot[4] = {0.001, 1e-4, 0, 8};  // relative to a sixteenth of the image's mean
    pilot[5] = {1, 0, 0, 8};        // bright, without noise
    const double least = (256 * 2.001 + 4) / (5 * 256 + 4) / 16;
    const std::vector<double> needed = samples_needed(tiles, pilot, 0.1);
    CHECK(needed[0] == Approx(250));
    CHECK(needed[1] == Approx(125));
    CHECK(needed[2] == Approx(5));
    CHECK(needed[4] == Approx(1e-4 / std::pow(0.1 * least, 2)));
    CHECK(needed[3] == Approx(needed[4] / 2));
    CHECK(needed[5] == Approx(needed[4] / 2));
    // All black: nothing is needed, not even by the floor.
    for (const double n : samples_needed(tiles, std::vector<TileNoise>(6), 0.1)) CHECK(n == 0);
    // Thresholds whose square is no number of double's range still ask for a number.
    for (const double n : samples_needed(tiles, std::vector<TileNoise>(6), 1e-200)) CHECK(n == 0);
    CHECK(samples_needed(tiles, pilot, 1e-200)[0] > 1e300);
    const std::vector<double> errors = relative_errors(tiles, pilot);
    CHECK(errors[0] == Approx(std::sqrt(2.0 / 8)));
    CHECK(errors[2] == 0);
    CHECK(errors[4] == Approx(std::sqrt(1e-4 / 8) / least));
    pilot[0].samples = 1;
    CHECK(std::isinf(relative_errors(tiles, pilot)[0]));
}

TEST_CASE("Adaptive.CountsAreRoundedUpWithinTheirLimits", "[quick]") {
    CHECK(sample_count(0, 16, 4096) == 16);
    CHECK(sample_count(16.01, 16, 4096) == 17);
    CHECK(sample_count(32.5, 16, 4096) == 34);
    CHECK(sample_count(1000, 16, 4096) == 1024);
    CHECK(sample_count(4095.5, 16, 4096) == 4096);
    CHECK(sample_count(4000, 16, 4001) == 4001);
    CHECK(sample_count(1e300, 16, 4096) == 4096);
    CHECK(sample_count(std::numeric_limits<double>::infinity(), 16, 4294967295u) == 4294967295u);
    CHECK(sample_count(4294967294.0, 16, 4294967295u) == 4294967295u);
    CHECK(sample_count(0, 16, 3) == 3);
    for (double needed = 16; needed < 1e6; needed *= 1.013) {
        const std::uint32_t n = sample_count(needed, 16, 1u << 30);
        CHECK(n >= needed);
        CHECK(n <= needed * 17 / 16 + 1);
    }
}

TEST_CASE("Adaptive.TilesAndTheirNoiseAreReadOffTheFilm", "[quick]") {
    // Columns 14..35 of a window that starts at 10: squares from 10, 26; rows 3..18 of one that starts at 3, and row 19.
    std::vector<device::uint> pixels;
    for (int ty : {3, 19})
        for (int tx : {10, 26})
            for (int y = ty; y < std::min(ty + 16, 20); ++y)
                for (int x = std::max(tx, 14); x < std::min(tx + 16, 36); ++x) pixels.push_back(static_cast<device::uint>(x + 40 * y));
    const auto tiles = noise_tiles(pixels, 40, {10, 3, 36, 20});
    REQUIRE(tiles.size() == 4);
    const int expected[4][4] = {{0, 0, 0, 12 * 16}, {1, 0, 12 * 16, 10 * 16}, {0, 1, 22 * 16, 12}, {1, 1, 22 * 16 + 12, 10}};
    for (std::size_t t = 0; t < 4; ++t) {
        CHECK(tiles[t].column == expected[t][0]);
        CHECK(tiles[t].row == expected[t][1]);
        CHECK(tiles[t].first == static_cast<std::uint32_t>(expected[t][2]));
        CHECK(tiles[t].count == static_cast<std::uint32_t>(expected[t][3]));
    }
    CHECK(noise_tiles({}, 40, {10, 3, 36, 20}).empty());

    FilmSums film(3, 1, 0.5);  // radiance is twice what the film holds
    add(film, 0, 2, 4, 2);     // 0, 2: mean 1, variance 2
    add(film, 1, 2, 2, 2);     // 1, 1
    add(film, 2, 9, 45, 3);    // 0, 3, 6: mean 3, variance 9
    const auto noise = measure_noise(row_of({2, 1}), film);
    CHECK(noise[0].mean == Approx(2));
    CHECK(noise[0].variance == Approx(4 * 1));
    CHECK(noise[0].variance_error == Approx(4 * 1));  // of 2 and 0: deviation √2, by √2
    CHECK(noise[0].samples == 2);
    CHECK(noise[1].mean == Approx(6));
    CHECK(noise[1].variance == Approx(4 * 9));
    CHECK(noise[1].variance_error == Approx(4 * 9));
    CHECK(film.paths() == 7);
}

TEST_CASE("Adaptive.PilotsKeepTheMeanThatKeptSamplesBias") {
    // A sample is 100 in one of 100 cases, else 0: its mean is 1. Counts decided by the first of the samples that are kept give
    // tiles that have seen nothing yet the least weight of samples, and so too low a mean on average; a pilot's do not.
    constexpr std::uint32_t pixels = 16, first = 16, most = 1024, trials = 4000;
    std::mt19937_64 random(1);
    const auto draw = [&](FilmSums& film, std::uint32_t n) {
        for (std::uint32_t p = 0; p < pixels; ++p) {
            const std::uint64_t hits = std::binomial_distribution<std::uint32_t>(n, 0.01)(random);
            add(film, p, 100 * hits, 10000 * hits, n);
        }
    };
    const auto tile = row_of({pixels});
    const auto count_by = [&](const FilmSums& film) { return sample_count(samples_needed(tile, measure_noise(tile, film), 0.3)[0], first, most); };
    double sum[2]{}, squares[2]{};
    for (std::uint32_t trial = 0; trial < trials; ++trial) {
        FilmSums pilot(pixels, 1, 1), kept(pixels, 1, 1), naive(pixels, 1, 1);
        draw(pilot, first);
        draw(kept, count_by(pilot));
        draw(naive, first);
        if (const std::uint32_t n = count_by(naive); n > first) draw(naive, n - first);
        const double mean[2] = {measure_noise(tile, kept)[0].mean, measure_noise(tile, naive)[0].mean};
        for (int k = 0; k < 2; ++k) sum[k] += mean[k], squares[k] += mean[k] * mean[k];
    }
    const auto z = [&](int k) {
        const double mean = sum[k] / trials;
        return (mean - 1) / std::sqrt((squares[k] / trials - mean * mean) / trials);
    };
    INFO("means " << sum[0] / trials << " and " << sum[1] / trials);
    CHECK(std::abs(z(0)) < 4);
    CHECK(z(1) < -6);
}

TEST_CASE("Adaptive.MeanIsThatOfAUniformRender") {
    // A sky with one texel that is 80 times brighter, found by chance only: a pilot misses it or not, and counts vary tenfold.
    Scene scene = grey_mixture();
    scene.film = {32, 16};
    scene.lights = {contrast_environment(false, 0.4)};
    scene.render.light_sampling = LightSampling::phase;
    scene.render.strategy = "delta";
    scene.render.transmittance = "analytic";
    constexpr std::uint32_t seeds = 64;
    Renderer renderer(scene, within(0.5));
    Estimate adaptive{32, 16, std::vector<double>(3 * 512), std::vector<double>(3 * 512)};
    std::uint32_t least = UINT32_MAX, most = 0;
    for (std::uint32_t seed = 0; seed < seeds; ++seed) {
        Accumulation film = renderer.start(seed);
        renderer.extend(film, 2048);
        const RenderResult r = renderer.result(film);
        check_clean(r);
        least = std::min(least, r.image.samples[16 + 32 * 8]);
        most = std::max(most, r.image.samples[16 + 32 * 8]);
        for (std::size_t i = 0; i < adaptive.mean.size(); ++i) {
            adaptive.mean[i] += static_cast<double>(r.image.rgb[i]) / seeds;
            adaptive.variance[i] += static_cast<double>(r.image.variance[i]) / seeds / seeds;
        }
    }
    INFO("from " << least << " to " << most << " samples");
    CHECK(most >= least + least / 4);
    check_same("adaptive", adaptive, colour_of(render_by(delta, scene, 8192, 1000).image));
}

TEST_CASE("Adaptive.TheErrorIsWhatWasAskedFor") {
    for (const double threshold : {0.1, 0.05}) {
        const RenderResult r = render_now(uneven(), within(threshold));
        check_clean(r);
        REQUIRE(r.stats.noise);
        INFO(r.stats.noise->summary() << "; " << r.stats.samples_min << " to " << r.stats.samples_max);
        CHECK(r.stats.noise->tiles == 12);
        CHECK(r.stats.noise->worst == Approx(noisiest(r.image)).epsilon(1e-4));
        CHECK(r.stats.noise->worst < 1.1 * threshold);
        CHECK(r.stats.noise->worst > 0.5 * threshold);
        CHECK(r.stats.noise->above <= 1);
        CHECK(r.stats.noise->capped == 0);
        CHECK(r.stats.samples_min >= 16);
        CHECK(r.stats.samples_max > 3 * r.stats.samples_min);
        CHECK(r.stats.noise->pilot_paths < r.stats.paths / 2);
        CHECK(r.stats.samples_mean == Approx(mean_of(doubles(r.image.samples))));
        // Half the samples of a uniform image that is nowhere noisier, or less.
        CHECK(static_cast<double>(r.stats.paths + r.stats.noise->pilot_paths) < 0.7 * r.stats.samples_max * 60 * 46);
    }
}

TEST_CASE("Adaptive.DevicesAndBatchesDoNotMatter") {
    const Scene scene = uneven();
    const RenderResult reference = render_now(scene, within(0.08));
    CHECK(reference.stats.samples_max > reference.stats.samples_min);
    for (const std::uint32_t batch : {1u, 7u, 4096u}) {
        RenderOptions options = within(0.08);
        options.batch_samples = batch;
        CHECK(same_bits(render_now(scene, options).image, reference.image));
    }
    const std::vector<DeviceInfo> devices = list_devices();
    if (std::none_of(devices.begin(), devices.end(), [](const DeviceInfo& d) { return d.type == "cpu" && d.compute_units >= 2; })) return;
    RenderOptions split = within(0.08);
    split.cpu_split = 2;
    split.devices = {"cpu"};
    const RenderResult r = render_now(scene, split);
    CHECK(r.stats.devices.size() >= 2);
    CHECK(same_bits(r.image, reference.image));
    CHECK(r.stats.noise->pilot_paths == reference.stats.noise->pilot_paths);
    std::uint64_t paths = 0;
    for (const DeviceShare& device : r.stats.devices) paths += device.paths;
    CHECK(paths == r.stats.paths + r.stats.noise->pilot_paths);
}

TEST_CASE("Adaptive.TilesHoldTheFirstSamplesOfAUniformRender") {
    // What a tile keeps are samples 0 to its count, none of the pilot's.
    Scene scene = uneven();
    const RenderImage adaptive = render_now(scene, within(0.1)).image;
    scene.render.spp = adaptive.samples[0];
    const RenderImage uniform = render_now(scene, {}).image;
    std::size_t equal = 0;
    for (std::size_t i = 0; i < adaptive.samples.size(); ++i) {
        if (adaptive.samples[i] != adaptive.samples[0]) continue;
        ++equal;
        for (std::size_t c = 0; c < 3; ++c) REQUIRE(adaptive.rgb[3 * i + c] == uniform.rgb[3 * i + c]);
    }
    CHECK(equal >= 256);
}

TEST_CASE("Adaptive.SamplesPerPixelAreTheLimit", "[quick]") {
    Scene scene = uneven();
    for (const std::uint32_t spp : {1u, 16u, 24u}) {
        scene.render.spp = spp;
        const RenderResult r = render_now(scene, within(1e-5));
        CHECK(r.stats.samples_min == spp);
        CHECK(r.stats.samples_max == spp);
        CHECK(r.stats.noise->above == 12);
        CHECK(r.stats.noise->capped == 12);
        CHECK(same_bits(r.image, render_now(scene, {}).image));
    }
}

TEST_CASE("Adaptive.DarkAndEmptyScenesEnd", "[quick]") {
    Scene scene = uneven();
    scene.lights.clear();
    scene.media[0].primitives[7].emission = {0, 0, 0};
    const RenderResult dark = render_now(scene, within(0.01));
    CHECK(dark.stats.samples_max == 16);
    CHECK(dark.stats.noise->above == 0);
    CHECK(dark.stats.noise->worst == 0);
    scene.lights = {constant_light({1, 1, 1}, true)};
    scene.camera.target = 2.0 * scene.camera.origin - scene.camera.target;  // away from it all
    const RenderResult empty = render_now(scene, within(0.01));
    CHECK(empty.stats.noise->tiles == 0);
    CHECK(empty.image.rgb[0] == 1);
    CHECK(empty.stats.noise->above == 0);
}

TEST_CASE("Adaptive.FewPixelsGetAPilotOfAsManyPaths", "[quick]") {
    // Two pixels that see the whole scene: 8 samples of each would often find nothing, and an image of nothing be within the threshold.
    Scene scene = uneven();
    scene.camera.fov_rad = 1.1;
    scene.film = {2, 1};
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
        scene.render.seed = seed;
        const RenderResult r = render_now(scene, within(0.1));
        INFO("seed " << seed << ": " << r.stats.noise->summary());
        CHECK(r.stats.noise->pilot_paths >= 2048);
        CHECK(r.stats.samples_min > 16);
        CHECK(r.stats.noise->worst < 0.15);
    }
}

TEST_CASE("Adaptive.CropsAndProgressiveWorkToo") {
    Scene scene = uneven();
    RenderOptions options = within(0.1);
    options.crop = CropWindow{5, 2, 58, 37};
    const RenderResult crop = render_now(scene, options);
    CHECK(crop.stats.noise->worst < 0.11);
    CHECK(crop.stats.noise->worst == Approx(noisiest(crop.image)).epsilon(1e-4));
    scene.render.strategy = "progressive";
    const RenderResult reference = render_now(scene, options);
    CHECK(reference.stats.noise->worst < 0.11);
    CHECK(reference.stats.samples_max > reference.stats.samples_min);
    options.batch_samples = 3;
    CHECK(same_bits(render_now(scene, options).image, reference.image));
}

TEST_CASE("Adaptive.StoppedRunsKeepWhatIsDone", "[quick]") {
    for (const std::string part : {"first samples", "measuring noise", ""}) {
        Renderer renderer(uneven(), within(part.empty() ? 2e-2 : 1e-4));  // the pilot is to end, the image not
        std::atomic<bool> stop{false};
        bool seen = false;
        Accumulation film = renderer.start(1);
        RunControl control;
        control.stop = &stop;
        control.progress = [&](const Progress& p) {
            if (p.what != part) return;
            seen = true;
            stop = true;
        };
        renderer.extend(film, 100000000, control);
        const RenderStats stats = renderer.result(film).stats;
        INFO(part);
        CHECK(seen);
        CHECK(stats.interrupted);
        CHECK_FALSE(film.complete());
        CHECK(stats.samples_min >= 1);
        if (part == "measuring noise") CHECK(stats.samples_min == 16);
        if (part == "") CHECK(stats.samples_max > 16);
        else CHECK(stats.samples_max <= 16);
    }
    Renderer renderer(uneven(), within(1e-4));
    Accumulation film = renderer.start(1);
    renderer.extend(film, 100000000, {{}, nullptr, 1.0});
    const RenderStats stats = renderer.result(film).stats;
    CHECK(stats.time_limited);
    CHECK(stats.samples_min >= 1);
    CHECK(stats.render_s < 5);
}
