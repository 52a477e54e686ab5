// SPDX-License-Identifier: MIT
// The film on the host: exact 128-bit sums per active pixel, to which batches add in any order with the same result.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "kernels/layout.h"
#include "src/renderer.h"

namespace clume {

class FilmSums {
public:
    /// `scale` is params.film_scale; `channels` 1 or 3.
    FilmSums(std::size_t active_pixels, int channels, double scale);

    /// Adds one batch: `sums` holds FILM_WORDS words for each of pixels × splits work-items (item = split · count + pixel),
    /// for the active pixels that are listed, `samples` more samples each. Thread-safe.
    void add(std::span<const std::uint32_t> active, std::size_t splits, std::uint32_t samples, std::span<const std::uint64_t> sums);

    static std::uint64_t bytes_per_pixel();

    struct Pixel {
        double mean[3], variance[3], alpha;  ///< variance: of the mean
        std::uint32_t samples;
        std::uint64_t tests;                 ///< primitives tested or evaluated, if counted
    };
    Pixel pixel(std::size_t active) const;

    std::size_t size() const { return pixels_.size(); }
    std::uint64_t paths() const { return paths_; }  ///< samples of all active pixels
    std::uint64_t nonfinite() const { return nonfinite_; }
    std::uint64_t violations() const { return violations_; }
    double excess() const { return static_cast<double>(excess_) * 0x1p-20; }  ///< Σ over densities above their bound of (density − bound) / bound
    const WorkCounts& work() const { return work_; }

private:
    using Sum = unsigned __int128;
    struct Sums {
        Sum x[3]{}, xx[3]{};
        std::uint64_t alpha = 0, tests = 0;
        std::uint32_t samples = 0;
    };
    std::mutex mutex_;
    std::vector<Sums> pixels_;
    int channels_;
    double scale_;
    std::atomic<std::uint64_t> paths_ = 0;
    std::uint64_t nonfinite_ = 0, violations_ = 0, excess_ = 0;
    WorkCounts work_{};
};

}  // namespace clume
