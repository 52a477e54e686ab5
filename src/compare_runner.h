// SPDX-License-Identifier: MIT
// What the parts of `clume compare` that render share: a pair made ready, its pilot, and progress over the whole of it.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "src/compare.h"

namespace clume {

/// A pair whose program is built, and what its pilot found out.
struct ReadyPair {
    MethodPair pair;
    std::unique_ptr<Renderer> renderer;
    double sample_variance = 0;  ///< mean over pixels and channels, of one sample
    double sample_s = 0;         ///< seconds for one sample of every pixel
};

/// Progress in planned seconds over everything that is to be run.
class ComparePlan {
public:
    ComparePlan(const std::function<void(const Progress&)>& progress, const std::atomic<bool>& stop);

    void add(double seconds) { total_s_ += seconds; }
    bool stopped() const { return stop_.load(); }
    /// Runs `film` up to `end` samples, which were planned to take `seconds`; false if it was stopped. Throws RenderError if
    /// the devices were lost on the way.
    bool extend(Renderer& renderer, Accumulation& film, std::uint32_t end, double seconds, const std::string& what);

private:
    const std::function<void(const Progress&)>& progress_;
    const std::atomic<bool>& stop_;
    std::chrono::steady_clock::time_point start_;
    double total_s_ = 0, done_s_ = 0;
    std::uint64_t paths_ = 0;
};

/// Builds the pair's program. Throws what Renderer throws.
ReadyPair make_ready(const Scene& scene, const MethodPair& pair, const RenderOptions& options);

/// Renders `spp` samples and takes variance and speed from them; with a `run`, counts operations into it (by a program of
/// its own: counting costs some speed).
void run_pilot(ReadyPair& ready, const Scene& scene, const CompareOptions& options, std::uint32_t spp, ComparePlan& plan, PairRun* run);

/// Reads the reference into `out`. Throws UsageError if it does not have the film's size, RenderError.
void read_reference(const Scene& scene, const std::filesystem::path& file, Comparison& out);

/// Makes it with two unbiased pairs, those of `ready` (pilots run) where it can, and tests that they agree. Its variance is to
/// be a sixteenth of the smallest mse to be expected, but it takes no more samples than all that is compared. Leaves
/// out.reference empty if stopped.
void make_reference(const Scene& scene, const CompareOptions& options, std::vector<ReadyPair>& ready, std::uint32_t pilot_spp,
                    ComparePlan& plan, Comparison& out);

/// Rising sample counts, the last being `most`: powers of two below it.
std::vector<std::uint32_t> doubling_counts(std::uint32_t most);

}  // namespace clume
