// SPDX-License-Identifier: MIT
// Walker's alias table by Vose's method [Vose91, doi 10.1109/32.92917]: constant-time draws from a discrete distribution.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace clume {

/// A slot stands for itself if 32 random bits are below `threshold`, else for `other`.
struct AliasSlot {
    std::uint32_t threshold, other;
};

/// Slots for weights of mean 1; probabilities are right to 2^-32.
inline std::vector<AliasSlot> alias_table(std::vector<double> weight) {
    std::vector<AliasSlot> slots(weight.size());
    std::vector<std::uint32_t> small, large;
    for (std::uint32_t i = 0; i < weight.size(); ++i) {
        slots[i] = {0xffffffffu, i};
        (weight[i] < 1 ? small : large).push_back(i);
    }
    while (!small.empty() && !large.empty()) {
        const std::uint32_t s = small.back(), l = large.back();
        small.pop_back();
        slots[s] = {static_cast<std::uint32_t>(std::min(weight[s] * 0x1p32, 4294967295.0)), l};
        weight[l] -= 1 - weight[s];
        if (weight[l] < 1) {
            large.pop_back();
            small.push_back(l);
        }
    }
    return slots;
}

}  // namespace clume
