// SPDX-License-Identifier: MIT
// What the device can do at most, measured (peaks.cl), and which of it binds a kernel: the roofline [Williams09,
// doi 10.1145/1498765.1498785] with a second slope for places looked up at random.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bench/operations.h"
#include "bench/session.h"

namespace clume::bench {

/// What one item of a kernel takes. An operation is one lane's fma, addition, multiplication, comparison, selection,
/// conversion or integer instruction. A gather is a place that nothing before it tells.
struct Cost {
    Operations operations;
    double bytes = 0, gathers = 0;
    double footprint = 0;  ///< bytes among which those lie
};

/// Rates for reading within so many bytes.
struct PeakLevel {
    const char* name;
    std::size_t byte_size;
    double bytes_s = 0, gathers_s = 0;
};

struct Peaks {
    std::array<double, 4> fma_s{}, fma_add_s{};  ///< by vectors of kernel_widths: fma alone, as many additions among them
    std::vector<PeakLevel> levels;  ///< ascending
    double launch_s = 0;            ///< of nothing: from the call until its end is known
    double multiplications_s() const;  ///< the most of fma_s
    double operations_s() const;       ///< the most of all
    /// Between the sizes measured, a power of the footprint; the name is that of the larger one.
    PeakLevel level(double footprint) const;
};

/// Measured when first asked for.
const Peaks& peaks(Session& session);

/// Share of what the device could do of the kernel's items, and what it would run out of first.
struct Share {
    double value = 0;
    std::string limit;
};
/// Nothing if the cost is not known.
std::optional<Share> share_of(const Cost& cost, double items_s, const Peaks& peaks);

}  // namespace clume::bench
