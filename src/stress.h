// SPDX-License-Identifier: MIT
// `clume stress`: every numeric building block of the kernels, run on a device over adversarial families, against 256-bit
// arithmetic on the host given the very floats that the device has. Limits are those that the kernels' comments state
// (src/stress_limits.h); where a place matters, it is in ulp of the scene's radius (2^-23).
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/device.h"
#include "src/stress_limits.h"

namespace clume {

struct StressOptions {
    bool quick = false;
    bool naive = false;       ///< judge the textbook formulas by the same limits, where there are any: a check of the check
    double strictness = 1;    ///< every limit is divided by this
};

/// What one case gave; NaN where there is nothing to say.
struct StressError {
    double error = 0;         ///< in the limit's unit, beyond what the limit's rule forgives
    double relative = NAN;    ///< |got − exact| / |exact|, nothing forgiven
    double ulp = NAN;         ///< |got − exact| in ulp of the exact result
    double rounding = NAN;    ///< what rounding the scene to floats does, in the limit's unit
    double naive = NAN;       ///< `error` of the textbook formula
    bool nonfinite = false;
    std::string at;           ///< the inputs, for the worst
};

/// Worst and 99.9 % of a figure.
struct StressSpread {
    double worst = NAN, most = NAN;
};

/// A kind of violation, counted against `of` trials; of = 0: it does not apply.
struct StressCount {
    std::size_t count = 0, of = 0;
    std::string at = {};  ///< inputs of the first
    void add(bool violated, const std::string& where) {
        ++of;
        if (violated && count++ == 0) at = where;
    }
};

struct StressRow {
    std::string quantity, function, family;
    Limit limit;
    std::size_t cases = 0, nonfinite = 0;
    StressSpread error, relative, ulp, rounding, naive;
    StressCount lost, invented;                          ///< hits against exact arithmetic, however near tangency
    StressCount lost_beyond, invented_beyond;            ///< of them farther from tangency than the limit
    StressCount additivity, monotonicity, round_trip;
    std::string worst_at;

    /// No error beyond the limit, nothing that is not finite, no violation.
    bool holds() const;
    std::string trouble() const;  ///< which part does not hold; empty if all does
};

/// Errors over one property of the cases: of the kernels' method and of the textbook's.
struct StressPlot {
    struct Point {
        double x, used, naive, other = NAN;
    };
    std::string name, title, naive_name, other_name, x_label, y_label;  ///< other_name is empty where there is no third method
    std::vector<Point> points;  ///< one per half decade of x
};

struct StressResult {
    std::string device, driver;
    std::vector<StressRow> rows;
    std::vector<StressPlot> plots;
    double seconds = 0;
    bool holds() const;
};

/// `progress` is told the share that is done. Throws DeviceError.
StressResult run_stress(const DeviceInfo& device, const StressOptions& options, const std::function<void(double)>& progress);

/// A row out of the errors of its cases.
StressRow stress_row(std::string quantity, std::string function, std::string family, Limit limit, const std::vector<StressError>& errors, const StressOptions& options);

/// |got − exact| in `unit` (relative, absolute or ulp), with relative and ulp filled in.
template <class Real>
StressError compare_to(double got, const Real& exact, LimitUnit unit) {
    StressError e;
    if (!std::isfinite(got)) {
        e.nonfinite = true;
        e.error = INFINITY;
        return e;
    }
    const double off = static_cast<double>(abs(Real(got) - exact)), size = std::abs(static_cast<double>(exact));
    e.relative = off == 0 ? 0 : off / size;
    e.ulp = off == 0 ? 0 : off / std::ldexp(1.0, std::max(size > 0 ? std::ilogb(size) : -126, -126) - 23);
    e.error = unit == LimitUnit::relative ? e.relative : unit == LimitUnit::ulp ? e.ulp : unit == LimitUnit::absolute ? off : off * 0x1p23;
    return e;
}

}  // namespace clume
