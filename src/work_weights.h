// SPDX-License-Identifier: MIT
// What a counted operation costs: nanoseconds, for telling beforehand which strategy will be faster. Ratios matter, not absolute
// values.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "runtime/device.h"
#include "src/renderer.h"

namespace clume {

/// Per operation of each kind (WORK_* of layout.h, names in work_names), of a processor. Fitted on PoCL 3.1 with vectors of 16
/// (`clume bench --filter ^work/`, which prints how far off they are).
inline constexpr WorkWeights cpu_work_weights = {18, 192, 10, 27, 6, 10, 96, 47, 44, 116};

/// Of a GPU, whose work-items look at a node's boxes and a group's primitives one after the other while their neighbours wait: by eight
/// renders on an H100 (docs/performance.md), off by up to 1.7 times; those of densities, voxels and roots are the processor's beside cells.
inline constexpr WorkWeights gpu_work_weights = {0.006, 0.8, 0.8, 0.006, 0.002, 0.0035, 1.0, 0.016, 0.006, 0.6};

inline double work_ns(const WorkWeights& weights, std::span<const std::uint64_t, WORK_KINDS> counts) {
    double ns = 0;
    for (std::size_t k = 0; k < WORK_KINDS; ++k) ns += weights[k] * static_cast<double>(counts[k]);
    return ns;
}

inline bool all_gpus(std::span<const DeviceInfo> devices) {
    return std::ranges::all_of(devices, [](const DeviceInfo& d) { return d.type == "gpu"; });
}

/// Of the devices that share a render: a GPU's if all are.
inline const WorkWeights& work_weights(std::span<const DeviceInfo> devices) { return all_gpus(devices) ? gpu_work_weights : cpu_work_weights; }

}  // namespace clume
