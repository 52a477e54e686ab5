// SPDX-License-Identifier: MIT
// The hypothesis tests themselves: they pass what is right about as often as they should, and they can fail.
#include "tests/reference/host_random.h"
#include "tests/reference/statistics.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

using namespace clume::reference;

namespace {

double normal(HostRandom& random) {
    return std::sqrt(2 * random.exponential()) * std::cos(2 * std::numbers::pi * random.uniform());
}

/// 48² RGB image of mean `level` with the noise of `samples` exponential draws of that mean, and its variance estimate.
void noisy_image(double level, int samples, std::uint64_t seed, std::vector<double>& mean, std::vector<double>& variance) {
    HostRandom random(seed, 7);
    mean.clear();
    variance.clear();
    for (int i = 0; i < 3 * 48 * 48; ++i) {
        double sum = 0, squares = 0;
        for (int s = 0; s < samples; ++s) {
            const double v = level * random.exponential();
            sum += v, squares += v * v;
        }
        mean.push_back(sum / samples);
        variance.push_back((squares - sum * sum / samples) / (samples * (samples - 1.0)));
    }
}

std::vector<double> histogram(int bins, int n, double skew, std::uint64_t seed) {
    HostRandom random(seed, 0);
    std::vector<double> counts(static_cast<std::size_t>(bins), 0);
    for (int i = 0; i < n; ++i) {
        double u = random.uniform();
        u += skew * u * (1 - u);
        ++counts[static_cast<std::size_t>(u * bins)];
    }
    return counts;
}

}  // namespace

TEST_CASE("Statistics.chi_square_known_values", "[quick][statistics]") {
    const ChiSquare fair = chi_square({44, 56}, {50, 50});
    CHECK(fair.statistic == Approx(1.44));
    CHECK(fair.degrees == 1);
    CHECK(fair.p == Approx(0.230139340).epsilon(1e-8));
    CHECK(chi_square({16, 18, 16, 14, 12, 12}, {14, 14, 15, 15, 15, 15}).degrees == 5);
    CHECK(z_test_p(1.959963984540054) == Approx(0.05).epsilon(1e-12));
    CHECK(z_test_p(std::nan("")) == 0);
    CHECK(1 - std::pow(1 - sidak_threshold(0.01, 1000), 1000) == Approx(0.01).epsilon(1e-9));
    CHECK(chi_square({1, 2, 3, 40, 1}, {1, 2, 3, 40, 1}).degrees == 1);  // pooled to {6, 41}
    CHECK(chi_square({5, 1, 50}, {6, 0, 50}).p == 0);                    // a sample where none may be
}

TEST_CASE("Statistics.chi_square_passes_uniform_and_finds_one_percent", "[quick][statistics]") {
    const int bins = 40, n = 4000000;
    const std::vector<double> expected(bins, static_cast<double>(n) / bins);
    double least = 1, mean = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const double p = chi_square(histogram(bins, n / 40, 0, seed), std::vector<double>(bins, n / 40.0 / bins)).p;
        least = std::min(least, p);
        mean += p / 20;
    }
    CHECK(least >= sidak_threshold(0.01, 20));
    CHECK(mean == Approx(0.5).margin(0.2));  // p-values are uniform
    CHECK(chi_square(histogram(bins, n, 0.01, 3), expected).p < 1e-3);
    CHECK(chi_square_two(histogram(bins, n, 0, 1), histogram(bins, n / 2, 0, 2)).p > 1e-3);
    CHECK(chi_square_two(histogram(bins, n, 0, 1), histogram(bins, n, 0.02, 2)).p < 1e-3);
}

TEST_CASE("Statistics.images_equal_pass", "[quick][statistics]") {
    int failures = 0;
    std::vector<double> a, va, b, vb;
    for (std::uint64_t trial = 0; trial < 40; ++trial) {
        noisy_image(0.7, 4, 2 * trial, a, va);
        noisy_image(0.7, trial % 2 == 0 ? 4 : 16, 2 * trial + 1, b, vb);
        failures += !compare_images(a, va, b, vb, 48, 48).pass;
    }
    CHECK(failures <= 3);  // 0.4 expected at alpha = 0.01
}

TEST_CASE("Statistics.images_one_percent_bias_is_found", "[quick][statistics]") {
    std::vector<double> a, va, b, vb;
    noisy_image(1.0, 512, 1, a, va);
    noisy_image(1.01, 512, 2, b, vb);
    const ImageTest test = compare_images(a, va, b, vb, 48, 48);
    CHECK_FALSE(test.pass);
    CHECK(test.global_ratio[0] == Approx(1 / 1.01).epsilon(0.01));
}

TEST_CASE("Statistics.images_local_faults_are_found", "[quick][statistics]") {
    std::vector<double> a, va, b, vb;
    noisy_image(1.0, 32, 5, a, va);
    noisy_image(1.0, 32, 6, b, vb);
    REQUIRE(compare_images(a, va, b, vb, 48, 48).pass);
    auto spot = a;
    for (int y = 16; y < 24; ++y)
        for (int x = 8; x < 16; ++x) spot[3 * (static_cast<std::size_t>(y) * 48 + x) + 1] *= 1.2;
    const ImageTest found = compare_images(spot, va, b, vb, 48, 48);
    CHECK_FALSE(found.pass);
    CHECK((found.worst_x == 8 && found.worst_y == 16 && found.worst_channel == 1));
    auto broken = a;
    broken[100] = std::nan("");
    CHECK_FALSE(compare_images(broken, va, b, vb, 48, 48).pass);
    const std::vector<double> black(a.size(), 0);
    CHECK_FALSE(compare_images(black, black, b, vb, 48, 48).pass);
    CHECK(compare_images(black, black, black, black, 48, 48).pass);
}

TEST_CASE("Statistics.normal_z_values_are_uniform_in_p", "[quick][statistics]") {
    HostRandom random(11, 0);
    std::vector<double> counts(20, 0);
    for (int i = 0; i < 20000; ++i) ++counts[std::min<std::size_t>(19, static_cast<std::size_t>(z_test_p(normal(random)) * 20))];
    CHECK(chi_square(counts, std::vector<double>(20, 1000)).p > 1e-3);
}
