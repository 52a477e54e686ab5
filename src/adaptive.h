// SPDX-License-Identifier: MIT
// How many samples each tile of the film needs for the error that was asked for, and how far off that an image is. The
// estimate comes from pilot samples that the image does not hold: a count decided by the samples that are kept would be
// correlated with their mean, which biases it [KirkArvo91, doi:10.1145/122718.122735]. So the counts are a function of scene,
// seed and threshold, the same on any device, and every pixel's mean is unbiased.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/layout.h"
#include "src/film.h"
#include "src/renderer.h"

namespace clume {

/// A square of the film, by those of its pixels that paths are traced for: a range of the list of active pixels.
struct NoiseTile {
    int column = 0, row = 0;
    std::uint32_t first = 0, count = 0;
};

/// Tiles that hold any, in the order of active_pixels().
std::vector<NoiseTile> noise_tiles(std::span<const device::uint> pixels, int film_width, const CropWindow& window);

/// Of a tile, over its active pixels and the channels.
struct TileNoise {
    double mean = 0;
    double variance = 0;         ///< of one sample
    double variance_error = 0;   ///< standard error of `variance`, as far as its spread over the pixels tells
    std::uint32_t samples = 0;   ///< of each pixel, that this was measured with
};

std::vector<TileNoise> measure_noise(std::span<const NoiseTile> tiles, const FilmSums& film);

/// The noise of each tile: root mean square standard error of its pixels over their mean, or over 1/16 of the image's mean
/// where the tile is darker than that. 0 for a tile without variance, infinite for one with fewer than 2 samples.
std::vector<double> relative_errors(std::span<const NoiseTile> tiles, std::span<const TileNoise> noise);

/// Samples of each tile's pixels for a relative error of `threshold` > 0, as a pilot sees it: for the upper end of what it
/// leaves open about the variance (two standard errors), and at least half of what any of the eight tiles around needs, since
/// a pilot may have missed what is rare but shows next door.
std::vector<double> samples_needed(std::span<const NoiseTile> tiles, std::span<const TileNoise> pilot, double threshold);

/// `needed` within [least, most], rounded up to five binary digits, so that tiles that differ little are rendered together.
std::uint32_t sample_count(double needed, std::uint32_t least, std::uint32_t most);

}  // namespace clume
