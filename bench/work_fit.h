// SPDX-License-Identifier: MIT
// What an operation costs: processor nanoseconds per counted operation of each kind (WORK_*), fitted to measured times.
#pragma once

#include <array>
#include <span>

#include "bench/measure.h"

namespace clume::bench {

/// Weights, all ≥ 0, that minimise Σ ((path_ns + Σ ns · operations) / measured − 1)².
struct WorkFit {
    std::array<double, WORK_KINDS> ns{};
    double path_ns = 0;        ///< of a path, whatever it does
    double typical_error = 0;  ///< median of |predicted / measured − 1|
    double worst_error = 0;
    std::size_t measurements = 0;
};

/// Of those that were counted and are not missing.
WorkFit fit_work(std::span<const Measured> measured);

/// Processor nanoseconds of a path, predicted.
double predicted_ns(const WorkFit& fit, const std::array<double, WORK_KINDS>& work);

}  // namespace clume::bench
