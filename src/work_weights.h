// SPDX-License-Identifier: MIT
// What one counted operation costs: nanoseconds of one core of a 16-wide CPU. Only ratios matter, and only for choosing
// between strategies: fixed numbers, so that the choice is the same on every run and device.
#pragma once

#include <array>

#include "kernels/layout.h"

namespace clume {

/// By WORK_* (layout.h): cells, nodes, groups, primitives, densities, voxels, segments, roots, draws.
inline constexpr std::array<double, WORK_KINDS> work_weights_ns = {28, 40, 45, 25, 10, 20, 40, 30, 10};

}  // namespace clume
