// SPDX-License-Identifier: MIT
// Several ways of rendering one scene, measured in turns: processor time per path (which a busy machine disturbs less than
// the clock on the wall), variance of a sample, and, by programs of their own, operations.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "bench/session.h"
#include "src/scene.h"
#include "src/strategies.h"

namespace clume::bench {

/// Seconds that a render has taken so far: of processor time, which a busy machine disturbs less, if CPUs render; else of the clock.
inline double seconds_of(const RenderStats& stats, bool on_cpu) { return on_cpu ? stats.cpu_s : stats.render_s; }

struct Measured {
    MethodPair pair;
    std::string missing;           ///< why there is nothing more here; empty if there is
    double cpu_us = 0;             ///< per path of a pixel that sees a medium, all threads (of a GPU: by the clock); median over the rounds
    double variance = 0;           ///< of one sample, mean over pixels and channels
    double device_bytes = 0, build_s = 0;
    std::array<double, WORK_KINDS> work{};  ///< operations per path, if counted
    std::vector<float> rgb, variance_of_mean;

    bool ok() const { return missing.empty(); }
    /// Variance × processor seconds of a path: the time for a given error.
    double inverse_efficiency() const { return variance * cpu_us * 1e-6; }
};

struct MeasureOptions {
    double round_s = 0.15;   ///< wall clock that a round of one pair is to take
    int rounds = 3;
    bool count = false;      ///< fill `work`
    double most_s = 5;       ///< a pair whose first sample of every pixel takes longer is left out
    std::uint64_t seed = 1;  ///< of the first pair; the next has the next one
};

/// In the order of `pairs`. Pairs that cannot be built or take too long say so in `missing`.
std::vector<Measured> measure(Session& session, const Scene& scene, std::span<const MethodPair> pairs, const MeasureOptions& options);

/// As typed: "delta:tree", "decomposition", "delta:tree/ratio"; the estimator is analytic unless named.
MethodPair method(const std::string& text);

/// An image's error against unbiased ones: over pixels and channels, the noise of both taken off.
struct Bias {
    double mean = 0, mean_error = 0;  ///< difference of the mean image, and its standard error; of the reference's mean
    double rms = 0;                   ///< root of the mean squared difference beyond noise, 0 if noise explains all; likewise
};
/// Both images with their variances; noise independent.
Bias bias_of(const Measured& image, const Measured& truth);
/// Images weighted by their inverse mean variance, as one.
Measured pooled(std::span<const Measured> images);

}  // namespace clume::bench
