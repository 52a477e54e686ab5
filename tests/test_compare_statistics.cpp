// SPDX-License-Identifier: MIT
// The statistics of `clume compare`: by hand where a hand can, and on simulated images of known bias, where intervals must hold
// the truth as often as they say, and tests must be wrong as rarely as they say and right where there is something to find.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "src/compare_statistics.h"
#include "src/strategies.h"

using namespace clume;

namespace {

constexpr int width = 48, height = 32;

/// Images of a grey ramp, each pixel the mean of `samples` exponential samples, its channels alike.
class Simulation {
public:
    explicit Simulation(std::uint64_t seed) : random_(seed) {}

    template <class Factor>
    Reference image(double samples, const Factor& factor) {
        Reference r{width, height, {}, {}, {}};
        std::gamma_distribution<double> sum(samples);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const double mean = (0.2 + 0.02 * x) * factor(x, y), value = mean * sum(random_) / samples;
                for (int c = 0; c < 3; ++c) {
                    r.rgb.push_back(value);
                    r.variance.push_back(value * value / samples);
                    r.sample_variance.push_back(value * value);
                }
            }
        return r;
    }
    Reference image(double samples) {
        return image(samples, [](int, int) { return 1.0; });
    }

private:
    std::mt19937_64 random_;
};

std::vector<float> floats(const Reference& r) { return {r.rgb.begin(), r.rgb.end()}; }

/// Eight seeds of 16 samples, against a reference of 256.
template <class Factor>
BiasTest bias_of(Simulation& simulation, const Factor& factor) {
    const Reference reference = simulation.image(256);
    const Tiles tiles(width, height);
    std::vector<std::vector<double>> seeds;
    for (int s = 0; s < 8; ++s) seeds.push_back(tiles.differences(floats(simulation.image(16, factor)), reference));
    return test_bias(seeds, 8 * 16, reference, tiles);
}

}  // namespace

TEST_CASE("CompareStatistics.ErrorsByHand", "[quick]") {
    // Two pixels; differences 1, 0, 0 and 0, −2, 4; mean of the reference 2, so 0.01 · 2² = 0.04.
    const Reference reference{2, 1, {1, 2, 3, 0, 4, 2}, {0.6, 0, 0, 0, 0, 0}, {}};
    const std::vector<float> image{2, 2, 3, 0, 2, 6};
    const ImageErrors e = image_errors(image, reference);
    CHECK(e.mse == Approx((1 + 4 + 16) / 6.0 - 0.1));
    CHECK(e.bias == Approx(3 / 6.0));
    CHECK(e.relmse == Approx((1 / 1.04 + 4 / 16.04 + 16 / 4.04) / 6));
    // Standard deviations √0.6, 0, 0: fully correlated channels give (√0.6 / 3)² for the pixel, halved twice for the image.
    CHECK(reference.variance_of_mean() == Approx(0.6 / 9 / 4));
    const Reference black{1, 1, {0, 0, 0}, {0, 0, 0}, {}};
    CHECK(image_errors(std::vector<float>{0, 0, 0}, black).relmse == 0);
}

TEST_CASE("CompareStatistics.StudentByTheTables", "[quick]") {
    CHECK(student_p(2.364624, 7) == Approx(0.05).epsilon(1e-5));
    CHECK(student_p(-12.706205, 1) == Approx(0.05).epsilon(1e-5));
    CHECK(student_p(1.959964, INFINITY) == Approx(0.05).epsilon(1e-5));
    CHECK(student_p(NAN, 7) == 0);
    const std::vector<double> values{1, 2, 3, 4};
    const Interval i = mean_interval(values);
    CHECK(i.mean == Approx(2.5));
    CHECK(i.half_width == Approx(3.182446 * std::sqrt(5.0 / 3 / 4)).epsilon(1e-5));
    // A shared error as large as the own one: variance doubles, Welch's degrees of freedom quadruple to 12.
    const Interval shared = mean_interval(values, 5.0 / 3 / 4);
    CHECK(shared.half_width == Approx(2.178813 * std::sqrt(2 * 5.0 / 3 / 4)).epsilon(1e-5));
    CHECK(std::isinf(mean_interval(std::vector<double>{3}).half_width));
    CHECK(sidak(0.01, 10) == Approx(1 - std::pow(0.99, 10)));
    CHECK(sidak(1e-20, 1000) == Approx(1e-17));
}

TEST_CASE("CompareStatistics.IntervalsHoldTheTruthAsOftenAsTheySay") {
    Simulation simulation(1);
    int held = 0;
    constexpr int trials = 400;
    for (int t = 0; t < trials; ++t) {
        const Reference reference = simulation.image(64);
        std::vector<double> bias;
        for (int s = 0; s < 8; ++s) bias.push_back(image_errors(floats(simulation.image(16, [](int, int) { return 1.02; })), reference).bias);
        const Interval i = mean_interval(bias, reference.variance_of_mean());
        const double truth = 0.02 * (0.2 + 0.02 * (width - 1) / 2.0);
        held += std::abs(i.mean - truth) <= i.half_width;
    }
    INFO(held);
    CHECK(held >= 0.915 * trials);  // 95 % within 3.2 standard deviations of the count
    CHECK(held <= 0.985 * trials);
}

TEST_CASE("CompareStatistics.NoBiasIsRarelyFoundWhereThereIsNone") {
    Simulation simulation(2);
    int found = 0;
    constexpr int trials = 300;
    for (int t = 0; t < trials; ++t) found += bias_of(simulation, [](int, int) { return 1.0; }).p < 0.05;
    INFO(found);
    CHECK(found <= 0.09 * trials);  // 5 % and 3.2 standard deviations
}

TEST_CASE("CompareStatistics.RareEventsAreNoBias") {
    // Every sample is 1, or 0 with a chance of 1 in 1000: two seeds of two samples see none in most tiles, and so no scatter.
    std::mt19937_64 random(5);
    const auto image = [&](int samples) {
        std::binomial_distribution<int> lost(samples, 0.001);
        Reference r{width, height, {}, {}, {}};
        for (int i = 0; i < width * height; ++i) {
            const double value = 1 - lost(random) / static_cast<double>(samples), variance = value * (1 - value);
            for (int c = 0; c < 3; ++c) {
                r.rgb.push_back(value);
                r.variance.push_back(variance / samples);
                r.sample_variance.push_back(variance);
            }
        }
        return r;
    };
    const Tiles tiles(width, height);
    int found = 0;
    constexpr int trials = 100;
    for (int t = 0; t < trials; ++t) {
        const Reference reference = image(512);
        const std::vector<std::vector<double>> seeds{tiles.differences(floats(image(2)), reference), tiles.differences(floats(image(2)), reference)};
        found += test_bias(seeds, 4, reference, tiles).p < 0.05;
        Reference without = reference;
        without.sample_variance.clear();
        REQUIRE(test_bias(seeds, 4, without, tiles).p < 1e-3);  // the trap that the floor is for
    }
    INFO(found);
    CHECK(found <= 0.12 * trials);
}

TEST_CASE("CompareStatistics.BiasOfEveryShapeIsFound", "[quick]") {
    Simulation simulation(3);
    const BiasTest everywhere = bias_of(simulation, [](int, int) { return 1.03; });
    CHECK(everywhere.p < 1e-4);
    CHECK(everywhere.p_mean < 1e-4);
    // As much too bright on the left of the middle column as too dark on its right: the means agree.
    const auto ramp = [](int x) { return 0.2 + 0.02 * x; };
    double left = 0, right = 0;
    for (int x = 0; x < width; ++x) (x < width / 2 ? left : right) += ramp(x);
    const BiasTest changing = bias_of(simulation, [&](int x, int) { return x < width / 2 ? 1 + 0.06 : 1 - 0.06 * left / right; });
    CHECK(changing.p < 1e-4);
    CHECK(changing.p_all_tiles < 1e-4);
    CHECK(changing.p_mean > 0.01);
    CHECK(changing.rms == Approx(0.03).epsilon(0.3));
    const BiasTest spot = bias_of(simulation, [](int x, int y) { return x < 8 && y < 8 ? 1.5 : 1.0; });
    CHECK(spot.p < 0.01);
    CHECK(spot.p_worst_tile < 1e-3);
    CHECK_FALSE(test_bias({}, 0, simulation.image(4), Tiles(width, height)).tested);
}

TEST_CASE("CompareStatistics.ExactPixelsAreNoEvidence", "[quick]") {
    // A background without noise agrees to rounding in every seed, and one that differs is found without any scatter.
    Reference exact{16, 16, std::vector<double>(768, 0.7), std::vector<double>(768, 0.0), {}};
    const Tiles tiles(16, 16);
    std::vector<float> image(768, 0.7f);
    CHECK(test_bias(std::vector(8, tiles.differences(image, exact)), 8, exact, tiles).p == 1);
    image.assign(768, 0.71f);
    CHECK(test_bias(std::vector(8, tiles.differences(image, exact)), 8, exact, tiles).p < 1e-6);
}

TEST_CASE("CompareStatistics.AgreementAcceptsEqualMeansAndRefusesOthers") {
    Simulation simulation(4);
    int refused = 0;
    constexpr int trials = 300;
    for (int t = 0; t < trials; ++t) refused += test_agreement(simulation.image(64), simulation.image(100)).p < 0.05;
    INFO(refused);
    CHECK(refused <= 0.09 * trials);
    const Agreement brighter = test_agreement(simulation.image(256), simulation.image(256, [](int, int) { return 1.02; }));
    CHECK_FALSE(brighter.accepted());
    CHECK(brighter.p_mean < 1e-4);
    const Agreement spot = test_agreement(simulation.image(256), simulation.image(256, [](int x, int y) { return x == 20 && y == 9 ? 3.0 : 1.0; }));
    CHECK_FALSE(spot.accepted());
    CHECK(spot.p_pixels < 1e-4);
    const Agreement chequered = test_agreement(simulation.image(256), simulation.image(256, [](int x, int y) { return (x / 8 + y / 8) % 2 ? 1.05 : 0.95; }));
    CHECK_FALSE(chequered.accepted());
    CHECK(chequered.p_tiles < 1e-4);
}

TEST_CASE("CompareStatistics.TilesCoverTheImageOnce", "[quick]") {
    for (const auto& [w, h] : {std::pair{8, 8}, {33, 17}, {500, 400}, {1, 900}}) {
        const Tiles tiles(w, h);
        CHECK(tiles.side >= 8);
        CHECK(tiles.columns <= 16);
        CHECK(tiles.rows <= 16);
        // A difference of 1 everywhere is 1 in every tile, whatever its size.
        const auto values = 3 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
        const Reference zero{w, h, std::vector<double>(values), std::vector<double>(values), {}};
        for (const double d : tiles.differences(std::vector<float>(values, 1.0f), zero)) REQUIRE(d == Approx(1));
    }
}

TEST_CASE("Strategies.PairsAndTheirKinds", "[quick]") {
    Scene scene;
    scene.media.resize(1);
    scene.media[0].primitives.resize(1);
    const std::vector<MethodPair> all = all_pairs(scene, true), one_each = all_pairs(scene, false);
    CHECK(all.size() == strategies().size() * estimators().size());
    CHECK(one_each.size() == strategies().size());
    CHECK(MethodPair{"delta", "ratio"}.kind(true) == BiasKind::unbiased);
    CHECK(MethodPair{"delta", "march"}.kind(true) == BiasKind::biased);
    CHECK(MethodPair{"delta", "march"}.kind(false) == BiasKind::unbiased);
    CHECK(MethodPair{"progressive", "analytic"}.kind(true) == BiasKind::consistent);
    CHECK(MethodPair{"delta", "ratio", "scene"}.label() == "delta:scene/ratio");
    CHECK(MethodPair{"delta", "ratio", "scene"}.file_name() == "delta-scene_ratio");
}
