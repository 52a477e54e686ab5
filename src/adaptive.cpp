// SPDX-License-Identifier: MIT
#include "src/adaptive.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "src/device_camera.h"

namespace clume {
namespace {

constexpr double least_brightness = 1.0 / 16;  ///< of the image's mean: a darker tile's error is held to this
constexpr double confidence = 2;               ///< standard errors of a pilot's variance that its need allows for
constexpr double neighbours_share = 0.5;       ///< of a neighbour's need

/// What a tile's error is relative to.
std::vector<double> brightness(std::span<const NoiseTile> tiles, std::span<const TileNoise> noise) {
    double sum = 0, pixels = 0;
    for (std::size_t t = 0; t < tiles.size(); ++t) sum += tiles[t].count * noise[t].mean, pixels += tiles[t].count;
    std::vector<double> out;
    for (const TileNoise& n : noise) out.push_back(std::max(n.mean, least_brightness * sum / pixels));
    return out;
}

}  // namespace

std::vector<NoiseTile> noise_tiles(std::span<const device::uint> pixels, int film_width, const CropWindow& window) {
    std::vector<NoiseTile> tiles;
    const auto width = static_cast<device::uint>(film_width);
    for (std::uint32_t k = 0; k < pixels.size(); ++k) {
        const int column = (static_cast<int>(pixels[k] % width) - window.x0) / film_tile, row = (static_cast<int>(pixels[k] / width) - window.y0) / film_tile;
        if (tiles.empty() || tiles.back().column != column || tiles.back().row != row) tiles.push_back({column, row, k, 0});
        ++tiles.back().count;
    }
    return tiles;
}

std::vector<TileNoise> measure_noise(std::span<const NoiseTile> tiles, const FilmSums& film) {
    std::vector<TileNoise> out;
    for (const NoiseTile& tile : tiles) {
        TileNoise n;
        double squares = 0;
        for (std::uint32_t k = tile.first; k < tile.first + tile.count; ++k) {
            const FilmSums::Pixel p = film.pixel(k);
            const double variance = p.samples * (p.variance[0] + p.variance[1] + p.variance[2]) / 3;
            n.mean += (p.mean[0] + p.mean[1] + p.mean[2]) / 3;
            n.variance += variance;
            squares += variance * variance;
            n.samples = p.samples;
        }
        const double count = tile.count;
        n.mean /= count;
        n.variance /= count;
        // One pixel says nothing of the spread: as if it were all.
        n.variance_error = tile.count > 1 ? std::sqrt(std::max(0.0, squares / count - n.variance * n.variance) / (count - 1)) : n.variance;
        out.push_back(n);
    }
    return out;
}

std::vector<double> relative_errors(std::span<const NoiseTile> tiles, std::span<const TileNoise> noise) {
    const std::vector<double> bright = brightness(tiles, noise);
    std::vector<double> out;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
        if (noise[t].samples < 2) out.push_back(std::numeric_limits<double>::infinity());
        else out.push_back(noise[t].variance > 0 ? std::sqrt(noise[t].variance / noise[t].samples) / bright[t] : 0);
    }
    return out;
}

std::vector<double> samples_needed(std::span<const NoiseTile> tiles, std::span<const TileNoise> pilot, double threshold) {
    const std::vector<double> bright = brightness(tiles, pilot);
    int columns = 1, rows = 1;
    for (const NoiseTile& t : tiles) columns = std::max(columns, t.column + 1), rows = std::max(rows, t.row + 1);
    const auto at = [&](int column, int row) { return static_cast<std::size_t>(column) + static_cast<std::size_t>(columns) * static_cast<std::size_t>(row); };
    std::vector<double> own(at(0, rows), 0.0);  // on the whole grid
    for (std::size_t t = 0; t < tiles.size(); ++t) {
        const double error = std::sqrt(pilot[t].variance + confidence * pilot[t].variance_error);
        if (error > 0) own[at(tiles[t].column, tiles[t].row)] = std::pow(error / bright[t] / threshold, 2);
    }
    std::vector<double> out;
    for (const NoiseTile& t : tiles) {
        double around = 0;
        for (int row = std::max(0, t.row - 1); row < std::min(rows, t.row + 2); ++row)
            for (int column = std::max(0, t.column - 1); column < std::min(columns, t.column + 2); ++column) around = std::max(around, own[at(column, row)]);
        out.push_back(std::max(own[at(t.column, t.row)], neighbours_share * around));
    }
    return out;
}

std::uint32_t sample_count(double needed, std::uint32_t least, std::uint32_t most) {
    if (!(needed < most)) return most;
    const auto whole = static_cast<std::uint64_t>(std::ceil(std::max<double>(needed, std::min(least, most))));
    const int beyond = std::max(0, static_cast<int>(std::bit_width(whole)) - 5);
    const std::uint64_t step = std::uint64_t{1} << beyond;
    return static_cast<std::uint32_t>(std::min<std::uint64_t>((whole + step - 1) / step * step, most));
}

}  // namespace clume
