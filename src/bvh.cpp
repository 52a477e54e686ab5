// SPDX-License-Identifier: MIT
#include "src/bvh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <future>

#include "src/parallel.h"

namespace clume {
namespace {

constexpr int kBins = 16;
constexpr std::uint32_t kLeaf = CLUME_GROUP_SIZE;
constexpr std::uint32_t leaves_of(std::uint32_t count) { return (count + kLeaf - 1) / kLeaf; }

Box empty_box() { return {glm::dvec3(1e300), glm::dvec3(-1e300)}; }

void grow(Box& b, const Box& other) {
    b.lo = glm::min(b.lo, other.lo);
    b.hi = glm::max(b.hi, other.hi);
}

double half_area(const Box& b) {
    const glm::dvec3 d = glm::max(b.hi - b.lo, glm::dvec3(0));
    return d.x * d.y + d.y * d.z + d.z * d.x;
}

/// What the builder moves about: a primitive's box, rounded outwards, and its index. Kept small and in order: the build is
/// bound by memory.
struct Item {
    glm::vec3 lo, hi;
    std::uint32_t index;

    float middle(int axis) const { return 0.5f * (lo[axis] + hi[axis]); }
};

struct ItemBox {
    glm::vec3 lo{1e30f}, hi{-1e30f};

    void grow(const glm::vec3& a, const glm::vec3& b) {
        lo = glm::min(lo, a);
        hi = glm::max(hi, b);
    }
    double half_area() const {
        const glm::dvec3 d = glm::max(glm::dvec3(hi) - glm::dvec3(lo), glm::dvec3(0));
        return d.x * d.y + d.y * d.z + d.z * d.x;
    }
};

/// A subtree over items[first, first + count), its nodes appended to `nodes`; big halves are built by another thread.
struct Builder {
    std::vector<Item>& items;

    std::vector<BvhTree::Node> build(std::uint32_t first, std::uint32_t count, int threads_log2) {
        std::vector<BvhTree::Node> nodes(1);
        ItemBox box, centers;
        for (std::uint32_t i = first; i < first + count; ++i) {
            const Item& item = items[i];
            box.grow(item.lo, item.hi);
            const glm::vec3 c = 0.5f * (item.lo + item.hi);
            centers.grow(c, c);
        }
        nodes[0].box = {glm::dvec3(box.lo), glm::dvec3(box.hi)};
        if (count <= kLeaf) {
            std::sort(items.begin() + first, items.begin() + first + count, [](const Item& a, const Item& b) { return a.index < b.index; });
            nodes[0].first = first;
            nodes[0].count = count;
            return nodes;
        }
        const std::uint32_t left = split(first, count, centers);
        std::vector<BvhTree::Node> a, b;
        if (threads_log2 > 0 && count > 4096) {
            auto other = std::async(std::launch::async, [&] { return build(first, left, threads_log2 - 1); });
            b = build(first + left, count - left, threads_log2 - 1);
            a = other.get();
        } else {
            a = build(first, left, 0);
            b = build(first + left, count - left, 0);
        }
        const auto append = [&](const std::vector<BvhTree::Node>& part) {
            const auto base = static_cast<std::uint32_t>(nodes.size());
            for (auto n : part) {
                if (n.count == 0) n.left += base, n.right += base;
                nodes.push_back(n);
            }
            return base;
        };
        nodes.reserve(1 + a.size() + b.size());
        nodes[0].left = append(a);
        nodes[0].right = append(b);
        return nodes;
    }

    /// Reorders the range and returns how many go left: binned surface area over the widest axis of the centres, or the
    /// median where all centres (nearly) coincide.
    std::uint32_t split(std::uint32_t first, std::uint32_t count, const ItemBox& centers) {
        const glm::vec3 extent = centers.hi - centers.lo;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        const auto begin = items.begin() + first;
        const float origin = centers.lo[axis], scale = kBins / extent[axis];
        if (extent[axis] > 0 && scale < 1e30f) {
            std::array<ItemBox, kBins> boxes;
            std::array<std::uint32_t, kBins> counts{};
            const auto bin = [&](const Item& item) { return std::min(kBins - 1, static_cast<int>((item.middle(axis) - origin) * scale)); };
            for (std::uint32_t k = 0; k < count; ++k) {
                const int b = bin(begin[k]);
                boxes[static_cast<std::size_t>(b)].grow(begin[k].lo, begin[k].hi);
                ++counts[static_cast<std::size_t>(b)];
            }
            std::array<double, kBins> right_cost{};
            ItemBox box;
            std::uint32_t n = 0;
            for (std::size_t b = kBins - 1; b > 0; --b) {
                box.grow(boxes[b].lo, boxes[b].hi);
                n += counts[b];
                right_cost[b] = box.half_area() * leaves_of(n);
            }
            box = {};
            n = 0;
            int best = -1;
            double best_cost = 0;
            for (std::size_t b = 0; b + 1 < kBins; ++b) {
                box.grow(boxes[b].lo, boxes[b].hi);
                n += counts[b];
                if (n == 0 || n == count) continue;
                const double cost = box.half_area() * leaves_of(n) + right_cost[b + 1];
                if (best < 0 || cost < best_cost) best = static_cast<int>(b), best_cost = cost;
            }
            if (best >= 0) {
                const auto middle = std::partition(begin, begin + count, [&](const Item& item) { return bin(item) <= best; });
                return static_cast<std::uint32_t>(middle - begin);
            }
        }
        return count / 2;
    }
};

}  // namespace

BvhTree build_bvh(std::span<const Ellipsoid> ellipsoids) {
    BvhTree tree;
    if (ellipsoids.empty()) return tree;
    std::vector<Item> items(ellipsoids.size());
    parallel_chunks(items.size(), 16384, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Ellipsoid& e = ellipsoids[i];
            for (int k = 0; k < 3; ++k) {
                items[i].lo[k] = std::nextafter(static_cast<float>(e.center[k] - e.half[k]), -1e30f);
                items[i].hi[k] = std::nextafter(static_cast<float>(e.center[k] + e.half[k]), 1e30f);
            }
            items[i].index = static_cast<std::uint32_t>(i);
        }
    });
    Builder builder{items};
    tree.nodes = builder.build(0, static_cast<std::uint32_t>(items.size()), 3);
    tree.order.resize(items.size());
    for (std::size_t i = 0; i < items.size(); ++i) tree.order[i] = items[i].index;
    return tree;
}

WideBvh widen(const BvhTree& tree, std::span<const Ellipsoid> ellipsoids) {
    WideBvh wide;
    if (tree.nodes.empty()) return wide;
    struct Item {
        std::uint32_t binary, wide, depth;
    };
    // A leaf that mixes media becomes several groups, so nodes may need a chain: children are collected with their boxes.
    const auto emit_groups = [&](const BvhTree::Node& leaf, std::vector<std::pair<std::uint32_t, Box>>& out) {
        std::uint32_t i = leaf.first;
        while (i < leaf.first + leaf.count) {
            std::vector<std::uint32_t> group;
            Box box = empty_box();
            const std::uint32_t medium = ellipsoids[tree.order[i]].medium;
            for (; i < leaf.first + leaf.count && ellipsoids[tree.order[i]].medium == medium; ++i) {
                const Ellipsoid& e = ellipsoids[tree.order[i]];
                group.push_back(tree.order[i]);
                grow(box, {e.center - e.half, e.center + e.half});
            }
            out.emplace_back(BVH_LEAF | static_cast<std::uint32_t>(wide.groups.size()), box);
            wide.groups.push_back(std::move(group));
        }
    };
    std::uint32_t deepest = 0;
    const auto new_node = [&] {
        device::BvhNode n{};
        for (int i = 0; i < BVH_ARITY; ++i) {
            n.child[i] = BVH_NONE;
            n.lo_x[i] = n.lo_y[i] = n.lo_z[i] = 1e30f;
            n.hi_x[i] = n.hi_y[i] = n.hi_z[i] = -1e30f;
        }
        wide.nodes.push_back(n);
        return static_cast<std::uint32_t>(wide.nodes.size() - 1);
    };
    const auto place = [&](std::uint32_t node, int slot, std::uint32_t child, const Box& b) {
        // Boxes are dilated by far more than a float's rounding already; round outwards all the same.
        device::BvhNode& n = wide.nodes[node];
        n.child[slot] = child;
        n.lo_x[slot] = std::nextafter(static_cast<float>(b.lo.x), -1e30f), n.hi_x[slot] = std::nextafter(static_cast<float>(b.hi.x), 1e30f);
        n.lo_y[slot] = std::nextafter(static_cast<float>(b.lo.y), -1e30f), n.hi_y[slot] = std::nextafter(static_cast<float>(b.hi.y), 1e30f);
        n.lo_z[slot] = std::nextafter(static_cast<float>(b.lo.z), -1e30f), n.hi_z[slot] = std::nextafter(static_cast<float>(b.hi.z), 1e30f);
    };
    std::vector<Item> todo{{0, new_node(), 1}};
    for (std::size_t at = 0; at < todo.size(); ++at) {
        const Item item = todo[at];
        deepest = std::max(deepest, item.depth);
        std::vector<std::uint32_t> open{item.binary};
        while (open.size() < BVH_ARITY) {
            // Open the inner node with the largest surface.
            int best = -1;
            for (std::size_t k = 0; k < open.size(); ++k)
                if (tree.nodes[open[k]].count == 0 && (best < 0 || half_area(tree.nodes[open[k]].box) > half_area(tree.nodes[open[static_cast<std::size_t>(best)]].box)))
                    best = static_cast<int>(k);
            if (best < 0) break;
            const auto& n = tree.nodes[open[static_cast<std::size_t>(best)]];
            open[static_cast<std::size_t>(best)] = n.left;
            open.push_back(n.right);
        }
        int slot = 0;
        for (std::uint32_t k : open) {
            const auto& n = tree.nodes[k];
            if (n.count == 0) {
                const std::uint32_t child = new_node();
                place(item.wide, slot++, child, n.box);
                todo.push_back({k, child, item.depth + 1});
                continue;
            }
            std::vector<std::pair<std::uint32_t, Box>> groups;
            emit_groups(n, groups);
            if (groups.size() == 1) {
                place(item.wide, slot++, groups[0].first, groups[0].second);
                continue;
            }
            // Up to 16 groups: a node of their own, or two levels of it.
            const std::uint32_t child = new_node();
            place(item.wide, slot++, child, n.box);
            std::uint32_t target = child;
            deepest = std::max(deepest, item.depth + 3);
            int used = 0;
            for (std::size_t g = 0; g < groups.size(); ++g) {
                if (used == BVH_ARITY - 1 && groups.size() - g > 1) {
                    const std::uint32_t next = new_node();
                    place(target, used, next, n.box);
                    target = next;
                    used = 0;
                }
                place(target, used++, groups[g].first, groups[g].second);
            }
        }
    }
    wide.stack_entries = deepest * (BVH_ARITY - 1) + BVH_ARITY;
    return wide;
}

}  // namespace clume
