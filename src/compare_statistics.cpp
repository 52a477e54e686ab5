// SPDX-License-Identifier: MIT
// Distributions come from Boost.Math. Sums run in image order in double precision, so results are reproducible.
#include "src/compare_statistics.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cassert>
#include <cmath>
#include <limits>

namespace clume {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Moments {
    double mean = 0, variance = 0;  ///< variance of one value, n − 1 in the denominator; 0 for one value
    double count = 0;
};

template <class Get>
Moments moments(std::size_t count, const Get& get) {
    Moments m;
    m.count = static_cast<double>(count);
    for (std::size_t i = 0; i < count; ++i) m.mean += get(i) / m.count;
    for (std::size_t i = 0; i < count; ++i) m.variance += (get(i) - m.mean) * (get(i) - m.mean);
    m.variance = count > 1 ? m.variance / (m.count - 1) : 0;
    return m;
}

/// Variance of a mean over seeds with a shared error, and its Welch degrees of freedom; the seeds' part is at least `floor`.
struct Error {
    double variance, degrees = infinity;
    Error(const Moments& m, double shared, double floor = 0) {
        const double own = std::max(m.variance / m.count, floor);
        variance = own + shared;
        if (own > 0) degrees = (m.count - 1) * (variance / own) * (variance / own);
    }
};

/// Student's p for a mean of 0, or NaN where there is nothing to test: no scatter, and no difference but rounding.
double p_of_mean(const Moments& m, double shared, double floor, double rounding) {
    const Error e(m, shared, floor);
    if (e.variance <= 0 && std::abs(m.mean) <= rounding) return NAN;
    return student_p(m.mean / std::sqrt(e.variance + rounding * rounding), e.degrees);
}

/// Upper tail of χ².
double chi_square_p(double statistic, double degrees) {
    if (degrees < 1) return 1;
    return std::isfinite(statistic) ? boost::math::gamma_q(degrees / 2, statistic / 2) : 0;
}

/// Sums over some pixels of two images, one channel.
struct Pool {
    double a = 0, b = 0, variance_a = 0, variance_b = 0;

    void add(const Reference& x, const Reference& y, std::size_t i) {
        a += x.rgb[i], variance_a += x.variance[i];
        b += y.rgb[i], variance_b += y.variance[i];
    }
    bool enough() const { return a > 0 && b > 0 && a * a >= 100 * variance_a && b * b >= 100 * variance_b; }
    /// For equal means. An image that happens to be low has a low variance estimate, too; so the variances are taken at the
    /// pooled mean, each growing in proportion to it (a sum of random contributions of some size).
    double z() const {
        double variance = variance_a + variance_b;
        if (a > 0 && b > 0 && variance_a > 0 && variance_b > 0) {
            const double size_a = variance_a / a, size_b = variance_b / b;
            variance = (size_a + size_b) * (a / size_a + b / size_b) / (1 / size_a + 1 / size_b);
        }
        const double rounding = 1e-6 * (std::abs(a) + std::abs(b));
        return std::abs(a - b) <= rounding ? 0 : (a - b) / std::sqrt(variance + rounding * rounding);
    }
};

/// Visits the tiles as (tile index, value index) over all pixels, one channel.
template <class Visit>
void each_pixel(const Tiles& t, std::size_t channel, const Visit& visit) {
    for (int y = 0; y < t.height; ++y)
        for (int x = 0; x < t.width; ++x)
            visit(static_cast<std::size_t>(x / t.side + t.columns * (y / t.side)),
                  3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(t.width) + static_cast<std::size_t>(x)) + channel);
}

std::vector<double> pixels_per_tile(const Tiles& t) {
    std::vector<double> count(t.count());
    each_pixel(t, 0, [&](std::size_t tile, std::size_t) { ++count[tile]; });
    return count;
}

/// Per tile and channel Σ value(i) / pixels^power.
template <class Value>
std::vector<double> tile_sums(const Tiles& t, double power, const Value& value) {
    const std::vector<double> pixels = pixels_per_tile(t);
    std::vector<double> out(3 * t.count());
    for (std::size_t c = 0; c < 3; ++c) {
        each_pixel(t, c, [&](std::size_t tile, std::size_t i) { out[c * t.count() + tile] += value(i); });
        for (std::size_t k = 0; k < t.count(); ++k) out[c * t.count() + k] /= std::pow(pixels[k], power);
    }
    return out;
}

}  // namespace

double Reference::mean() const {
    double sum = 0;
    for (const double v : rgb) sum += v;
    return sum / static_cast<double>(rgb.size());
}

double Reference::mean_variance() const {
    double sum = 0;
    for (const double v : variance) sum += v;
    return sum / static_cast<double>(variance.size());
}

double Reference::variance_of_mean() const {
    double sum = 0;
    for (std::size_t i = 0; i < variance.size(); i += 3) {
        const double deviation = (std::sqrt(variance[i]) + std::sqrt(variance[i + 1]) + std::sqrt(variance[i + 2])) / 3;
        sum += deviation * deviation;
    }
    const double pixels = static_cast<double>(variance.size()) / 3;
    return sum / (pixels * pixels);
}

ImageErrors image_errors(std::span<const float> rgb, const Reference& reference) {
    assert(rgb.size() == reference.rgb.size());
    ImageErrors e;
    const double mean = reference.mean(), floor = 0.01 * mean * mean;
    for (std::size_t i = 0; i < rgb.size(); ++i) {
        const double r = reference.rgb[i], d = static_cast<double>(rgb[i]) - r;
        e.mse += d * d;
        if (d != 0) e.relmse += d * d / (r * r + floor);
        e.bias += d;
    }
    const auto count = static_cast<double>(rgb.size());
    e.mse = e.mse / count - reference.mean_variance();
    e.relmse /= count;
    e.bias /= count;
    return e;
}

double student_p(double t, double degrees) {
    if (std::isnan(t)) return 0;
    if (std::isinf(t)) return 0;
    if (!(degrees < 1e8)) return std::erfc(std::abs(t) * std::sqrt(0.5));
    return 2 * boost::math::cdf(boost::math::complement(boost::math::students_t(degrees), std::abs(t)));
}

double sidak(double least, double count) {
    return least >= 1 ? 1 : -std::expm1(count * std::log1p(-least));
}

Interval mean_interval(std::span<const double> values, double shared_variance) {
    const Moments m = moments(values.size(), [&](std::size_t i) { return values[i]; });
    if (values.size() < 2) return {m.mean, infinity};
    const Error e(m, shared_variance);
    const double quantile = e.degrees < 1e8 ? boost::math::quantile(boost::math::students_t(e.degrees), 0.975) : 1.9599639845400545;
    return {m.mean, quantile * std::sqrt(e.variance)};
}

Tiles::Tiles(int w, int h)
    : width(w), height(h), side(std::max(8, (std::max(w, h) + 15) / 16)), columns((w + side - 1) / side), rows((h + side - 1) / side) {}

std::vector<double> Tiles::differences(std::span<const float> rgb, const Reference& reference) const {
    assert(rgb.size() == reference.rgb.size());
    return tile_sums(*this, 1, [&](std::size_t i) { return static_cast<double>(rgb[i]) - reference.rgb[i]; });
}

std::vector<double> Tiles::means(std::span<const double> values) const {
    return tile_sums(*this, 1, [&](std::size_t i) { return values[i]; });
}

std::vector<double> Tiles::variances(std::span<const double> values) const {
    return tile_sums(*this, 2, [&](std::size_t i) { return values[i]; });
}

BiasTest test_bias(const std::vector<std::vector<double>>& seeds, double samples, const Reference& reference, const Tiles& tiles) {
    BiasTest result;
    if (seeds.size() < 2) return result;
    result.tested = true;
    const std::vector<double> shared = tiles.variances(reference.variance), level = tiles.means(reference.rgb), pixels = pixels_per_tile(tiles);
    std::vector<double> floor(shared.size());
    if (!reference.sample_variance.empty() && samples > 0) floor = tiles.variances(reference.sample_variance);
    for (double& v : floor) v /= std::max(1.0, samples);
    const double all_pixels = static_cast<double>(tiles.width) * tiles.height;
    constexpr double float_rounding = 3e-7;
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t first = c * tiles.count();
        double fisher = 0, tested = 0, least = 1, shared_mean = 0, floor_mean = 0, mean_level = 0;
        for (std::size_t k = first; k < first + tiles.count(); ++k) {
            const double share = pixels[k - first] / all_pixels;
            shared_mean += shared[k] * share * share;
            floor_mean += floor[k] * share * share;
            mean_level += std::abs(level[k]) * share;
            const Moments m = moments(seeds.size(), [&](std::size_t s) { return seeds[s][k]; });
            square += share * (m.mean * m.mean - Error(m, shared[k]).variance) / 3;
            const double p = p_of_mean(m, shared[k], floor[k], float_rounding * std::abs(level[k]));
            if (std::isnan(p)) continue;
            fisher -= 2 * std::log(std::max(p, 1e-300));
            ++tested;
            least = std::min(least, p);
        }
        const Moments whole = moments(seeds.size(), [&](std::size_t s) {
            double sum = 0;
            for (std::size_t k = 0; k < tiles.count(); ++k) sum += seeds[s][first + k] * pixels[k] / all_pixels;
            return sum;
        });
        const double p = p_of_mean(whole, shared_mean, floor_mean, float_rounding * mean_level);
        if (!std::isnan(p)) result.p_mean = std::min(result.p_mean, p);
        if (tested > 0) result.p_worst_tile = std::min(result.p_worst_tile, sidak(least, tested));
        result.p_all_tiles = std::min(result.p_all_tiles, chi_square_p(fisher, 2 * tested));
    }
    result.rms = std::sqrt(std::max(0.0, square));
    result.p = sidak(std::min({result.p_mean, result.p_worst_tile, result.p_all_tiles}), 9);
    return result;
}

Agreement test_agreement(const Reference& a, const Reference& b) {
    assert(a.rgb.size() == b.rgb.size());
    Agreement result;
    Tiles tiles(a.width, a.height);
    tiles.side = 8;
    tiles.columns = (a.width + 7) / 8;
    tiles.rows = (a.height + 7) / 8;
    double least = 1;
    for (std::size_t c = 0; c < 3; ++c) {
        Pool all, group;
        std::vector<Pool> tile_pools(tiles.count());
        bool open = false;
        const auto close = [&] {
            least = std::min(least, student_p(group.z(), infinity));
            ++result.tests;
            group = {};
            open = false;
        };
        each_pixel(tiles, c, [&](std::size_t tile, std::size_t i) {
            for (Pool* pool : {&all, &group, &tile_pools[tile]}) pool->add(a, b, i);
            open = true;
            if (group.enough()) close();
        });
        if (open) close();
        double chi = 0, degrees = 0;
        Pool tile;
        for (std::size_t k = 0; k < tiles.count(); ++k) {
            const Pool& p = tile_pools[k];
            tile.a += p.a, tile.b += p.b, tile.variance_a += p.variance_a, tile.variance_b += p.variance_b;
            if (!tile.enough() && k + 1 < tiles.count()) continue;
            if (tile.variance_a + tile.variance_b > 0 || tile.z() != 0) chi += tile.z() * tile.z(), ++degrees;
            tile = {};
        }
        result.p_tiles = std::min(result.p_tiles, chi_square_p(chi, degrees));
        result.p_mean = std::min(result.p_mean, student_p(all.z(), infinity));
    }
    result.p_pixels = sidak(least, static_cast<double>(result.tests));
    result.p = sidak(std::min({result.p_pixels, result.p_tiles, result.p_mean}), 7);
    return result;
}

}  // namespace clume
