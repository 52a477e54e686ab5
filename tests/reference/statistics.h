// SPDX-License-Identifier: MIT
// Hypothesis tests for samplers and images: χ² on histograms, z on means and images, Šidák's correction for many at once.
// p-values are the probability, if both sides agree, of a result at least as extreme; a test fails below its threshold.
#pragma once

#include <cstddef>
#include <vector>

namespace clume::reference {

struct ChiSquare {
    double statistic = 0;
    int degrees = 0;  ///< pooled bins − 1 − fitted parameters
    double p = 1;     ///< 1 when no degree of freedom is left; 0 when a count is where nothing is expected
};

/// Counts against expected counts (same total, any unit of both being one sample). Neighbouring bins are pooled until each
/// expects at least `least_expected`.
ChiSquare chi_square(const std::vector<double>& observed, const std::vector<double>& expected, int fitted = 0,
                     double least_expected = 5);

/// Two histograms that should share one distribution, whatever their totals.
ChiSquare chi_square_two(const std::vector<double>& a, const std::vector<double>& b, double least_expected = 5);

/// P(|Z| ≥ |z|) for a standard normal Z; 0 for NaN, so that a NaN fails.
double z_test_p(double z);

/// Threshold for each of `count` p-values so that a family of true hypotheses fails with probability ≤ alpha.
double sidak_threshold(double alpha, std::size_t count);

struct ImageTest {
    double min_p = 1;         ///< of the blocks' tests
    double threshold = 0;     ///< what min_p must reach
    std::size_t tests = 0;    ///< groups of blocks × channels, plus the global ones
    double worst_z = 0;       ///< of the blocks
    int worst_x = 0, worst_y = 0, worst_channel = 0;  ///< its first pixel
    double global_z[3] = {};  ///< whole image's mean per channel
    double global_ratio[3] = {};  ///< mean of A / mean of B
    bool pass = false;
};

/// Two RGB images (3 values per pixel, row by row) with the variances of their means, compared block by block and as a
/// whole. Blocks of `block`² pixels join in raster order until both sides hold `least_samples` effective contributions
/// (mean²/variance), which keeps their sums near normal. The variance is the score test's, at the pooled mean: an image that
/// happens to be low has a low variance estimate too, and dividing by it would cry wolf. Radiances must be ≥ 0. `alpha` is
/// for the whole family. An exact image has variance 0. NaN fails.
ImageTest compare_images(const std::vector<double>& mean_a, const std::vector<double>& variance_a,
                         const std::vector<double>& mean_b, const std::vector<double>& variance_b, int width, int height,
                         int block = 8, double alpha = 0.01, double least_samples = 100);

}  // namespace clume::reference
