// SPDX-License-Identifier: MIT
// Tests described in the header. χ² p-values come from Boost's regularised incomplete gamma function.
#include "tests/reference/statistics.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <stdexcept>

namespace clume::reference {

namespace {

double chi_square_p(double statistic, int degrees) {
    if (degrees < 1) return 1;
    return std::isfinite(statistic) ? boost::math::gamma_q(degrees / 2.0, statistic / 2) : 0;
}

/// Sums over a region of both images.
struct Sums {
    double a = 0, b = 0, variance_a = 0, variance_b = 0;

    bool enough(double least) const { return a * a >= least * variance_a && b * b >= least * variance_b && a > 0 && b > 0; }

    /// Score z for equal means when each variance grows in proportion to its mean; plain z where a mean is 0.
    double z() const {
        double variance = variance_a + variance_b;
        if (a > 0 && b > 0 && variance > 0) {
            const double k_a = variance_a / a, k_b = variance_b / b;  // size of one contribution
            const double pooled = k_a > 0 && k_b > 0 ? (a / k_a + b / k_b) / (1 / k_a + 1 / k_b) : k_a > 0 ? b : a;
            variance = (k_a + k_b) * pooled;
        }
        const double difference = a - b, rounding = 1e-12 * (std::abs(a) + std::abs(b));
        if (std::abs(difference) <= rounding) return 0;
        return difference / std::sqrt(variance + rounding * rounding);
    }
};

}  // namespace

ChiSquare chi_square(const std::vector<double>& observed, const std::vector<double>& expected, int fitted,
                     double least_expected) {
    if (observed.size() != expected.size()) throw std::invalid_argument("chi_square: sizes differ");
    std::vector<std::pair<double, double>> bins;
    double o = 0, e = 0;
    for (std::size_t i = 0; i < observed.size(); ++i) {
        if (expected[i] <= 0 && observed[i] > 0) return {INFINITY, static_cast<int>(observed.size()) - 1, 0};
        o += observed[i];
        e += expected[i];
        if (e < least_expected) continue;
        bins.emplace_back(o, e);
        o = e = 0;
    }
    if (!bins.empty()) bins.back().first += o, bins.back().second += e;  // what is left over is too small alone
    ChiSquare result;
    for (const auto& [count, expectation] : bins)
        result.statistic += (count - expectation) * (count - expectation) / expectation;
    result.degrees = static_cast<int>(bins.size()) - 1 - fitted;
    result.p = chi_square_p(result.statistic, result.degrees);
    return result;
}

ChiSquare chi_square_two(const std::vector<double>& a, const std::vector<double>& b, double least_expected) {
    if (a.size() != b.size()) throw std::invalid_argument("chi_square_two: sizes differ");
    double total_a = 0, total_b = 0;
    for (std::size_t i = 0; i < a.size(); ++i) total_a += a[i], total_b += b[i];
    ChiSquare result;
    if (!(total_a > 0 && total_b > 0)) return result;
    const double smaller = std::min(total_a, total_b) / (total_a + total_b);
    int bins = 0;
    double x = 0, y = 0, rest_a = total_a, rest_b = total_b;
    for (std::size_t i = 0; i < a.size(); ++i) {
        x += a[i], y += b[i], rest_a -= a[i], rest_b -= b[i];
        const bool last = (rest_a + rest_b) * smaller < least_expected;
        if (last) x += rest_a, y += rest_b;
        if ((x + y) * smaller < least_expected) continue;
        const double share = (x + y) / (total_a + total_b), da = x - share * total_a, db = y - share * total_b;
        result.statistic += da * da / (share * total_a) + db * db / (share * total_b);
        ++bins;
        x = y = 0;
        if (last) break;
    }
    result.degrees = bins - 1;
    result.p = chi_square_p(result.statistic, result.degrees);
    return result;
}

double z_test_p(double z) { return std::isnan(z) ? 0 : std::erfc(std::abs(z) * 0.70710678118654752); }

double sidak_threshold(double alpha, std::size_t count) {
    return -std::expm1(std::log1p(-alpha) / static_cast<double>(std::max<std::size_t>(count, 1)));
}

ImageTest compare_images(const std::vector<double>& mean_a, const std::vector<double>& variance_a,
                         const std::vector<double>& mean_b, const std::vector<double>& variance_b, int width, int height,
                         int block, double alpha, double least_samples) {
    const std::size_t values = 3 * static_cast<std::size_t>(width) * height;
    if (mean_a.size() != values || mean_b.size() != values || variance_a.size() != values || variance_b.size() != values)
        throw std::invalid_argument("compare_images: sizes differ");
    ImageTest result;
    const auto judge = [&](double z) {
        ++result.tests;
        result.min_p = std::min(result.min_p, z_test_p(z));
    };
    for (int channel = 0; channel < 3; ++channel) {
        Sums all, group;
        int first_x = 0, first_y = 0;
        bool fresh = true;
        const auto close_group = [&] {
            const double z = group.z();
            judge(z);
            if (std::isnan(z) || std::abs(z) > std::abs(result.worst_z))
                result.worst_z = z, result.worst_x = first_x, result.worst_y = first_y, result.worst_channel = channel;
            group = {};
            fresh = true;
        };
        for (int y0 = 0; y0 < height; y0 += block)
            for (int x0 = 0; x0 < width; x0 += block) {
                if (fresh) first_x = x0, first_y = y0;
                fresh = false;
                for (int y = y0; y < std::min(height, y0 + block); ++y)
                    for (int x = x0; x < std::min(width, x0 + block); ++x) {
                        const std::size_t i = 3 * (static_cast<std::size_t>(y) * width + x) + channel;
                        for (Sums* sums : {&all, &group}) {
                            sums->a += mean_a[i], sums->variance_a += variance_a[i];
                            sums->b += mean_b[i], sums->variance_b += variance_b[i];
                        }
                    }
                if (group.enough(least_samples)) close_group();
            }
        if (!fresh) close_group();
        result.global_z[channel] = all.z();
        result.global_ratio[channel] = all.a / all.b;
        judge(result.global_z[channel]);
    }
    result.threshold = sidak_threshold(alpha, result.tests);
    result.pass = result.min_p >= result.threshold;
    return result;
}

}  // namespace clume::reference
