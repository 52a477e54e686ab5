// SPDX-License-Identifier: MIT
#include "src/film.h"

#include <algorithm>
#include <cmath>

namespace clume {

FilmSums::FilmSums(std::size_t active_pixels, int channels, double scale) : pixels_(active_pixels), channels_(channels), scale_(scale) {}

std::uint64_t FilmSums::bytes_per_pixel() { return sizeof(Sums); }

void FilmSums::add(std::span<const std::uint32_t> active, std::size_t splits, std::uint32_t samples, std::span<const std::uint64_t> sums) {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < active.size() * splits; ++i) {
        const std::uint64_t* w = sums.data() + i * FILM_WORDS;
        Sums& p = pixels_[active[i % active.size()]];
        for (int c = 0; c < channels_; ++c) {
            p.x[c] += Sum{w[4 * c]} | Sum{w[4 * c + 1]} << 64;
            p.xx[c] += Sum{w[4 * c + 2]} | Sum{w[4 * c + 3]} << 64;
        }
        p.alpha += w[FILM_ALPHA];
        nonfinite_ += w[FILM_NONFINITE];
        violations_ += w[FILM_VIOLATIONS];
        excess_ += w[FILM_EXCESS];
        for (int k = 0; k < WORK_KINDS; ++k) work_[static_cast<std::size_t>(k)] += w[FILM_WORK + k];
        p.tests += 16 * w[FILM_WORK + WORK_GROUPS] + w[FILM_WORK + WORK_PRIMITIVES] + w[FILM_WORK + WORK_VOXELS];
    }
    for (const std::uint32_t k : active) pixels_[k].samples += samples;
    paths_ += active.size() * std::uint64_t{samples};
}

FilmSums::Pixel FilmSums::pixel(std::size_t active) const {
    const Sums& s = pixels_[active];
    Pixel out{};
    out.samples = s.samples;
    out.tests = s.tests;
    if (s.samples == 0) return out;
    const long double n = s.samples, unit = 0x1p-64L;
    for (int c = 0; c < 3; ++c) {
        const int k = channels_ == 1 ? 0 : c;
        const long double mean = static_cast<long double>(s.x[k]) * unit / n;
        const long double square = static_cast<long double>(s.xx[k]) * unit / n;
        out.mean[c] = static_cast<double>(mean / scale_);
        if (s.samples > 1) out.variance[c] = static_cast<double>(std::max(0.0L, square - mean * mean) / (n - 1) / scale_ / scale_);
    }
    out.alpha = static_cast<double>(static_cast<long double>(s.alpha) / n);
    return out;
}

}  // namespace clume
