// SPDX-License-Identifier: MIT
// `sobol`: the words of a draw are nets over a pixel's samples, by the definition of nets; those of one sample are random,
// those of different draws know nothing of each other; images have the same mean and less noise.
#include "tests/image_test.h"
#include "tests/pairs.h"
#include "tests/probe_harness.h"

using namespace clume;
using namespace clume::probing;
using namespace clume::test;

namespace {

constexpr std::uint32_t kPhaseDraw = 0xf0000000u;
/// Words that make a two-dimensional sequence together.
constexpr std::array<std::array<int, 2>, 2> kPairs{{{0, 3}, {1, 2}}};

std::vector<Probe::Words> words_of(Probe& probe, std::uint32_t first, std::uint32_t count, std::uint32_t pixel, std::uint32_t depth, std::uint32_t draw, std::uint32_t seed) {
    std::vector<Probe::Words> counters;
    for (std::uint32_t i = 0; i < count; ++i) counters.push_back({{first + i, pixel, depth, draw}});
    return probe.draws(counters, seed, ~seed);
}

/// Whether every elementary interval of volume 1/n holds one of the n = 2^k points.
bool is_net(const std::vector<Probe::Words>& points, const std::array<int, 2>& pair) {
    const int k = static_cast<int>(std::bit_width(points.size())) - 1;
    for (int columns = 0; columns <= k; ++columns) {
        std::vector<int> held(points.size());
        for (const Probe::Words& w : points) {
            const std::uint64_t x = std::uint64_t{w.v[pair[0]]} << columns >> 32, y = std::uint64_t{w.v[pair[1]]} << (k - columns) >> 32;
            held[(x << (k - columns)) + y] += 1;
        }
        if (std::any_of(held.begin(), held.end(), [](int n) { return n != 1; })) return false;
    }
    return true;
}

double uniform_p(const std::vector<double>& counts, double total) {
    return reference::chi_square(counts, std::vector<double>(counts.size(), total / static_cast<double>(counts.size()))).p;
}

double pair_p(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
    std::vector<double> counts(1024);
    for (std::size_t i = 0; i < a.size(); ++i) counts[(a[i] >> 27) * 32 + (b[i] >> 27)] += 1;
    return uniform_p(counts, static_cast<double>(a.size()));
}

void check_family(const std::vector<double>& p) {
    const double least = *std::min_element(p.begin(), p.end()), threshold = reference::sidak_threshold(1e-4, p.size());
    INFO("least p " << least << " of " << p.size() << " tests, must be " << threshold);
    CHECK(least > threshold);
}

/// The numbers below 2^bits, in an order in which a bit is flipped by a coin of those before it: what `nested` is a hash for.
std::vector<std::uint32_t> nested_shuffle(int bits, TestRandom& random) {
    std::vector<std::uint32_t> order(std::size_t{1} << bits, 0);
    for (int j = 0; j < bits; ++j) {
        std::vector<std::uint32_t> coins(order.size() >> (j + 1));
        for (std::uint32_t& c : coins) c = random.word() & 1;
        for (std::size_t i = 0; i < order.size(); ++i) order[i] |= ((static_cast<std::uint32_t>(i >> j) & 1) ^ coins[i >> (j + 1)]) << (bits - 1 - j);
    }
    return order;
}

/// Σ over pixels of the variance of their means over `seeds` images, and the images' mean.
struct Spread {
    double variance = 0;
    Estimate mean;
};
Spread spread_of(const Pair& pair, const Scene& scene, std::uint32_t spp, int seeds) {
    Spread s;
    std::vector<double> sum, squares;
    for (int k = 0; k < seeds; ++k) {
        const RenderResult r = render_pair(pair, scene, spp, static_cast<std::uint64_t>(k));
        check_clean(r);
        const Estimate e = colour_of(r.image);
        sum.resize(e.mean.size());
        squares.resize(e.mean.size());
        for (std::size_t i = 0; i < e.mean.size(); ++i) sum[i] += e.mean[i], squares[i] += e.mean[i] * e.mean[i];
        s.mean = e;
    }
    for (std::size_t i = 0; i < sum.size(); ++i) {
        s.mean.mean[i] = sum[i] / seeds;
        const double variance = std::max(squares[i] - sum[i] * sum[i] / seeds, 0.0) / (seeds - 1);
        s.mean.variance[i] = variance / seeds;
        s.variance += variance;
    }
    return s;
}

Scene lit_mixture() {
    Scene scene = grey_mixture();
    scene.lights = {cases::light(LightKind::rectangle), cases::light(LightKind::directional)};
    return scene;
}

}  // namespace

TEST_CASE("Sampler.SobolPairsAreNets", "[kernels][quick]") {
    TestRandom random(5);
    for (const int width : kWidths) {
        Probe probe = sobol_probe(test_device(), width);
        for (int k = 0; k < 12; ++k) {
            const std::uint32_t count = 1u << k, first = k % 3 == 0 ? 0 : (random.word() << k);
            const auto points = words_of(probe, first, count, random.word(), static_cast<std::uint32_t>(random.below(9)), k % 2 ? random.word() : kPhaseDraw, random.word());
            for (const auto& pair : kPairs) {
                INFO("width " << width << ", samples " << first << " and on, 2^" << k << ", words " << pair[0] << " and " << pair[1]);
                CHECK(is_net(points, pair));
            }
        }
    }
}

TEST_CASE("Sampler.WordsOfOneSampleAreRandom", "[kernels][quick]") {
    // Over pixels, seeds and draws; also the words of one draw beside each other and beside those of the next draw and event.
    Probe probe = sobol_probe(test_device(), 16);
    constexpr std::uint32_t n = 1 << 17;
    std::vector<double> p;
    for (const std::uint32_t sample : {0u, 1u, 77u, 0x80000000u}) {
        std::vector<Probe::Words> counters, next, deeper;
        for (std::uint32_t i = 0; i < n; ++i) {
            counters.push_back({{sample, i, 0, kPhaseDraw}});
            next.push_back({{sample, i, 0, kPhaseDraw + 1}});
            deeper.push_back({{sample, i, 1, kPhaseDraw}});
        }
        const auto column = [&](const std::vector<Probe::Words>& c, int word) {
            std::vector<std::uint32_t> v;
            for (const Probe::Words& w : probe.draws(c, 3, 4)) v.push_back(w.v[word]);
            return v;
        };
        std::vector<std::vector<std::uint32_t>> own;
        for (int w = 0; w < 4; ++w) own.push_back(column(counters, w));
        for (int w = 0; w < 4; ++w) {
            for (int byte = 0; byte < 4; ++byte) {
                std::vector<double> counts(256);
                for (const auto v : own[static_cast<std::size_t>(w)]) counts[v >> (8 * byte) & 255] += 1;
                p.push_back(uniform_p(counts, n));
            }
            for (int other = 0; other < w; ++other) p.push_back(pair_p(own[static_cast<std::size_t>(w)], own[static_cast<std::size_t>(other)]));
            p.push_back(pair_p(own[static_cast<std::size_t>(w)], column(next, w)));
            p.push_back(pair_p(own[static_cast<std::size_t>(w)], column(deeper, w)));
        }
    }
    check_family(p);
}

TEST_CASE("Sampler.DrawsOfAPixelAreUnrelated", "[kernels][quick]") {
    // The share of a pixel's samples that lie in a box of two words: for words of one pair its variance over pixels is far below that
    // of independent samples; for words of other pairs, draws or events it is that of sequences shuffled with true coins.
    Probe probe = sobol_probe(test_device(), 16);
    constexpr std::uint32_t pixels = 2048, samples = 64;
    constexpr double a = 0.37, b = 0.62;
    const auto column = [&](std::uint32_t depth, std::uint32_t draw, int word) {
        std::vector<Probe::Words> counters;
        for (std::uint32_t i = 0; i < pixels * samples; ++i) counters.push_back({{i % samples, i / samples, depth, draw}});
        std::vector<double> u;
        for (const Probe::Words& w : probe.draws(counters, 8, 9)) u.push_back(w.v[word] * 0x1p-32);
        return u;
    };
    const auto ratio = [&](const std::vector<double>& u, const std::vector<double>& v) {
        const auto count = u.size() / samples;
        double sum = 0, squares = 0;
        for (std::size_t p = 0; p < count; ++p) {
            double inside = 0;
            for (std::size_t i = p * samples; i < (p + 1) * samples; ++i) inside += u[i] < a && v[i] < b ? 1.0 / samples : 0;
            sum += inside / static_cast<double>(count);
            squares += inside * inside / static_cast<double>(count);
        }
        CHECK(std::abs(sum - a * b) < 5 * std::sqrt(a * b * (1 - a * b) / static_cast<double>(u.size())));
        return (squares - sum * sum) / (a * b * (1 - a * b) / samples);
    };
    TestRandom random(6);
    const auto shuffled = [&] {
        std::vector<double> u;
        for (std::uint32_t p = 0; p < 16 * pixels; ++p) {
            const auto shift = static_cast<std::uint32_t>(random.below(samples));
            for (const std::uint32_t place : nested_shuffle(6, random)) u.push_back(((place ^ shift) + random.uniform()) / samples);
        }
        return u;
    };
    const double unrelated = ratio(shuffled(), shuffled());
    const auto first = column(0, 0, 0);
    CHECK(ratio(first, column(0, 0, 3)) < 0.1);
    CHECK(unrelated < 0.6);
    for (const double r : {ratio(first, column(0, 0, 1)), ratio(first, column(0, 0, 2)), ratio(first, column(0, 1, 0)), ratio(first, column(0, 1, 3)), ratio(first, column(1, 0, 0)), ratio(first, column(5, kPhaseDraw, 1))})
        CHECK(r == Approx(unrelated).epsilon(5 * std::sqrt(2.0 / pixels)));  // relative error of a variance
}

TEST_CASE("Sampler.SobolHasTheSameMean") {
    // Each image of a different seed, so that what samples of a pixel have in common shows in the spread.
    const Scene mixed = mixed_grid_scene();
    Scene lit = lit_mixture();
    const auto check = [](const Scene& scene, const char* strategy, const char* estimator, const char* bound) {
        const Spread even = spread_of({strategy, estimator, bound, "newton", "auto", "sobol"}, scene, 64, 16);
        check_same(std::string("sobol ") + strategy, even.mean, colour_of(render_pair({"delta"}, scene, 4096, 99).image));
    };
    check(lit, "delta", "analytic", "tree");
    check(lit, "delta", "binary", "tree");
    check(lit, "regular", "analytic", "auto");
    check(mixed, "delta", "ratio", "grid");
    check(mixed, "decomposition", "analytic", "auto");
}

TEST_CASE("Sampler.SobolKeepsTheFurnace") {
    for (const double density : {1.0, 10.0}) {
        Scene scene = reference::white_furnace(KernelFamily::gaussian, density, false);
        scene.film = {8, 8};
        scene.render.light_sampling = LightSampling::nee;
        const Spread even = spread_of({"delta", "analytic", "tree", "newton", "auto", "sobol"}, scene, 64, 16);
        check_same("sobol furnace", even.mean, grey(8, 8, std::vector<double>(64, 1), {}), 1e-4, 8);
    }
}

TEST_CASE("Sampler.SobolMakesLessNoise") {
    // Seeds tell the noise; the variance that an image says it has is that of independent samples, an upper bound.
    const Scene scene = lit_mixture();
    const Spread even = spread_of({"delta", "analytic", "tree", "newton", "auto", "sobol"}, scene, 256, 24), independent = spread_of({"delta", "analytic", "tree"}, scene, 256, 24);
    INFO("variance " << even.variance << " against " << independent.variance);
    CHECK(even.variance < 0.8 * independent.variance);
    const RenderResult one = render_pair({"delta", "analytic", "tree", "newton", "auto", "sobol"}, scene, 256, 3);
    double said = 0;
    for (const float v : one.image.variance) said += static_cast<double>(v);
    CHECK(said > even.variance);
    CHECK(said == Approx(independent.variance).epsilon(0.2));
}
