// SPDX-License-Identifier: MIT
// What a counted operation costs: processor nanoseconds, for telling beforehand which strategy will be faster. Ratios matter,
// not absolute values; they were fitted on PoCL 3.1 with vectors of 16 (`clume bench --filter ^work/`, which prints how far off
// they are).
#pragma once

#include <array>

#include "src/renderer.h"

namespace clume {

/// Per operation of each kind (WORK_* of layout.h, names in work_names).
inline constexpr std::array<double, WORK_KINDS> work_weights_ns = {18, 192, 10, 27, 6, 10, 96, 47, 44, 116};

}  // namespace clume
