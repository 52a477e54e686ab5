// SPDX-License-Identifier: MIT
// Bounding volume hierarchy over ellipsoids: a binary tree by binned surface-area cost, leaves of at most 16 primitives, and
// its 8-wide form for the device. The binary tree also answers which primitives meet a box (the cell builder asks).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/layout.h"
#include "runtime/host_array.h"
#include "src/ellipsoid.h"

namespace clume {

struct BvhTree {
    struct Node {
        Box box;
        std::uint32_t first = 0, count = 0;  ///< leaf: primitives order[first, first + count); inner: count 0
        std::uint32_t left = 0, right = 0;
    };
    std::vector<Node> nodes;           ///< nodes[0] is the root, unless there are no primitives
    std::vector<std::uint32_t> order;  ///< primitive indices

    /// Calls visit(primitive) for each primitive whose box meets `box`.
    template <class Visit>
    void overlapping(std::span<const Ellipsoid> ellipsoids, const Box& box, const Visit& visit) const;
};

/// Same tree for any number of threads.
BvhTree build_bvh(std::span<const Ellipsoid> ellipsoids);

/// The 8-wide form: nodes and, per group, its at most 16 primitives (one family and medium each: a mixed leaf is split).
struct WideBvh {
    HostArray<device::BvhNode> nodes;
    std::vector<std::vector<std::uint32_t>> groups;
    std::uint32_t stack_entries = 0;  ///< most that a traversal can need
};
WideBvh widen(const BvhTree& tree, std::span<const Ellipsoid> ellipsoids);

template <class Visit>
void BvhTree::overlapping(std::span<const Ellipsoid> ellipsoids, const Box& box, const Visit& visit) const {
    if (nodes.empty()) return;
    const auto meets = [&](const glm::dvec3& lo, const glm::dvec3& hi) {
        return lo.x <= box.hi.x && lo.y <= box.hi.y && lo.z <= box.hi.z && hi.x >= box.lo.x && hi.y >= box.lo.y && hi.z >= box.lo.z;
    };
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
        const Node& n = nodes[stack.back()];
        stack.pop_back();
        if (!meets(n.box.lo, n.box.hi)) continue;
        if (n.count == 0) {
            stack.push_back(n.left);
            stack.push_back(n.right);
            continue;
        }
        for (std::uint32_t i = n.first; i < n.first + n.count; ++i) {
            const Ellipsoid& e = ellipsoids[order[i]];
            if (meets(e.center - e.half, e.center + e.half)) visit(order[i]);
        }
    }
}

}  // namespace clume
