// SPDX-License-Identifier: MIT
// A few kernels run on a device before the first render with it, against what they must give: a device that computes wrongly
// is refused, one whose arithmetic is merely different is named.
#pragma once

#include <string>

#include "runtime/device.h"

namespace clume {

struct SelfTestResult {
    std::string error;              ///< why the device can't be used; empty: it can
    std::string outside_exact_set;  ///< which arithmetic differs; empty: bits are those of every other device
};

/// Throws DeviceError if the device fails outright.
SelfTestResult self_test(const DeviceInfo& info, int vector_width);

}  // namespace clume
