// SPDX-License-Identifier: MIT
// What the kernel benchmarks share: they are Google Benchmarks, timed by the device's own clock, and wait here to be
// registered until the section runs them all.
#pragma once

#include <functional>

#include "bench/session.h"

namespace clume::bench {

/// One launch: items done, seconds on the device, and work per item if that is known (else 0).
struct Launch {
    double items = 0, device_s = 0, work_per_item = 0;
};

/// Registers an item of the section: `launch` is called again and again with 0, 1, 2, … Nothing is done before the first call.
void add_kernel_benchmark(Session& session, const std::string& item, std::function<Launch(std::uint32_t)> launch);

void add_ray_benchmarks(Session& session);    ///< free flights and transmittances: rays through whole scenes
void add_group_benchmarks(Session& session);  ///< one ray against one vector of primitives

/// Widths asked for, or all.
std::vector<int> kernel_widths(const Session& session);

}  // namespace clume::bench
