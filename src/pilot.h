// SPDX-License-Identifier: MIT
// What `auto` becomes: a short pilot renders some pixels of the scene itself with each candidate (strategy, estimator, bound),
// all unbiased, and takes the one of least variance × work. Work is counted operations times fixed weights
// (src/work_weights.h), not time, and variances come from exact sums: the choice, and so the image, is the same on every run
// and on every device, but that GPUs by themselves have weights of their own.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/renderer.h"
#include "src/strategies.h"

namespace clume {

/// By how much another estimator must be ahead of the winner's own to replace it: more than the weights are off by.
inline constexpr double pilot_margin = 1.3;
/// An estimator is given up once it has taken that many times the work of the winner's own: variances differ by less.
inline constexpr double pilot_patience = 16;
/// A strategy, once it has taken that many times the work of the best so far: unbiased ones have one variance.
inline constexpr double strategy_patience = 2;

struct PilotRow {
    MethodPair pair;
    double variance = 0;   ///< of one sample, mean over the pilot's pixels and channels
    double work_ns = 0;    ///< of one path
    bool too_slow = false; ///< given up: the work is what it takes at least
    std::string error;     ///< why it could not be tried
    bool measured() const { return error.empty() && !too_slow; }
    double inverse_efficiency() const { return variance * work_ns; }
};

struct Pilot {
    std::vector<PilotRow> rows;  ///< in the order measured
    std::size_t chosen = 0;
    std::uint32_t pixels = 0, spp = 0;
    std::shared_ptr<SharedStructures> structures;  ///< that it has built, for the render that follows; none if it was kept
    bool cut_short = false;  ///< it took as long as the whole render may: chosen is the best so far, or delta

    const MethodPair& pair() const { return rows[chosen].pair; }

    /// "auto chose delta:tree/ratio: …", one line.
    std::string summary() const;
    /// Feature and text per row, for `--explain`.
    std::vector<std::pair<std::string, std::string>> table() const;
};

/// The pilot for a scene whose strategy is `auto`; nothing if it is pinned, or if there is nothing to choose (no media, no
/// pixel that meets them), or if `stop` became true. A result is kept in `folder` (unless that is empty, or it was cut short),
/// keyed by all that it depends on. Throws what Renderer throws.
std::optional<Pilot> run_pilot(const Scene& scene, const RenderOptions& options, const std::filesystem::path& folder, const std::atomic<bool>& stop);

/// Beside the programs' cache; empty if there is none.
std::filesystem::path pilot_folder();

}  // namespace clume
