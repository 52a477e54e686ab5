// SPDX-License-Identifier: MIT
#include "src/stress_lines.h"

#include <algorithm>

#include "kernels/layout.h"

namespace clume {

using oracle::Real;

namespace {

double beyond(const Real& off, const Real& size) { return off > 0 ? (size > 0 ? static_cast<double>(off / size) : INFINITY) : 0; }

}  // namespace

const char* kernel_name(KernelFamily k) { return k == KernelFamily::gaussian ? "gaussian" : k == KernelFamily::epanechnikov ? "epanechnikov" : "uniform"; }

std::vector<float> pack_groups(const std::vector<std::vector<float>>& lanes) {
    std::vector<float> groups(lanes.size() * CLUME_GROUP_FLOATS);
    for (std::size_t i = 0; i < lanes.size(); ++i)
        for (std::size_t r = 0; r < CLUME_GROUP_ROWS; ++r)
            for (std::size_t k = 0; k < CLUME_GROUP_SIZE; ++k) groups[i * CLUME_GROUP_FLOATS + r * CLUME_GROUP_SIZE + k] = lanes[i][r];
    return groups;
}

double beyond_range(const oracle::Range& range, double got, double floor) {
    const Real least = range.lo < Real(floor) ? Real(0) : range.lo, value = got;
    return std::max(beyond(least - value, least), got > floor ? beyond(value - range.hi, range.hi) : 0);
}

StressError flight_error(const oracle::Line256& line, const Real& t0, const Real& tau, double got, double shift, double& relative, double blur) {
    StressError e;
    if (!std::isfinite(got)) {
        e.nonfinite = true;
        e.error = INFINITY;
        return e;
    }
    if (got >= static_cast<double>(kStressNever)) {
        e.error = beyond(line.depth_near(t0, Real(kStressNever), shift, blur).lo - tau, tau);
    } else {
        const Real after = line.depth_near(t0, Real(got + shift), shift, blur).hi, before = line.depth_near(t0, Real(got - shift), shift, blur).lo;
        e.error = std::max(beyond(tau - after, tau), beyond(before - tau, tau));
        relative = static_cast<double>(abs(line.depth(t0, Real(got)) - tau) / tau);
    }
    return e;
}

}  // namespace clume
