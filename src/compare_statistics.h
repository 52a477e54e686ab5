// SPDX-License-Identifier: MIT
// What `clume compare` says about images, as numbers: errors against a reference, intervals over seeds, a test for bias, and a
// test that two unbiased images agree. Images are RGB, 3 values per pixel, row by row; variances are those of the means.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace clume {

/// What is taken for the truth, and how sure of it one is: variance 0 where it is exact.
struct Reference {
    int width = 0, height = 0;
    std::vector<double> rgb, variance;
    std::vector<double> sample_variance;  ///< of one sample of an unbiased pair; empty if not known

    double mean() const;           ///< over pixels and channels
    double mean_variance() const;  ///< likewise
    /// An upper bound of the variance of `mean()`: pixels independent, the channels of a pixel fully correlated.
    double variance_of_mean() const;
};

/// Over pixels and channels, x being the image and r the reference.
struct ImageErrors {
    double mse = 0;     ///< mean (x − r)² less the reference's own mean variance; noise can make it negative
    double relmse = 0;  ///< mean (x − r)² / (r² + 0.01 · mean(r)²); 0/0 counts as 0
    double bias = 0;    ///< mean (x − r)
};
ImageErrors image_errors(std::span<const float> rgb, const Reference& reference);

/// mean ± half_width holds the true mean with 95 % confidence.
struct Interval {
    double mean = 0;
    double half_width = 0;  ///< infinite with fewer than two values
};

/// Student's interval for the mean of independent values. `shared_variance` is that of an error common to all of them (the
/// reference's); it adds to the variance of the mean, with Welch's degrees of freedom.
Interval mean_interval(std::span<const double> values, double shared_variance = 0);

/// P(|T| ≥ |t|) for Student's t; `degrees` may be infinite.
double student_p(double t, double degrees);

/// Probability that the least of `count` independent p-values is at most `least`.
double sidak(double least, double count);

/// Square tiles of the image, at least 8 × 8 pixels and at most 16 along an edge of the image.
struct Tiles {
    Tiles(int width, int height);
    int width, height, side, columns, rows;
    std::size_t count() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
    /// Mean of (x − r) per tile and channel, channel by channel: 3 · count() values.
    std::vector<double> differences(std::span<const float> rgb, const Reference& reference) const;
    /// In the same order, the mean of given values per pixel and channel, and the variance of a mean of such variances.
    std::vector<double> means(std::span<const double> values) const;
    std::vector<double> variances(std::span<const double> variances) const;
};

/// Is the mean image another than the reference? Three questions per channel, each a Welch-Student test over the seeds with
/// the reference's variance added: the mean of the image; the worst tile (Šidák over tiles); all tiles together (Fisher's
/// sum of −2 ln p against χ²), which finds a bias that changes its sign over the image. `p` is Šidák over all nine.
/// The scatter over the seeds may miss what is rare (a tile where nothing happened in any seed): the variance of their mean is
/// taken for no less than the reference's samples say, reference.sample_variance over `samples`.
struct BiasTest {
    double p = 1;
    double p_mean = 1, p_worst_tile = 1, p_all_tiles = 1;  ///< least over the channels
    double rms = 0;      ///< root of the mean squared bias of tiles, noise taken off: a lower bound of the error's floor
    bool tested = false; ///< false with fewer than two seeds
};
/// `seeds`: Tiles::differences of each seed's image; `samples`: per pixel, in all seeds together.
BiasTest test_bias(const std::vector<std::vector<double>>& seeds, double samples, const Reference& reference, const Tiles& tiles);

/// Do two images of independent noise have one mean? z per pixel and channel (pixels join their followers until both sides
/// hold 100 effective contributions, mean²/variance, which keeps sums near normal), Šidák over all; χ² of the z² of tiles of
/// 8 × 8 pixels, per channel; z of the whole image, per channel. `p` is Šidák over these seven.
struct Agreement {
    double p = 1;
    double p_pixels = 1, p_tiles = 1, p_mean = 1;
    std::size_t tests = 0;  ///< pixels, or groups of them, times channels
    static constexpr double threshold = 1e-3;
    bool accepted() const { return p >= threshold; }
};
Agreement test_agreement(const Reference& a, const Reference& b);

}  // namespace clume
