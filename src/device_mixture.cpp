// SPDX-License-Identifier: MIT
#include "src/device_mixture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "src/alias_table.h"
#include "src/device_values.h"
#include "src/error.h"
#include "src/memory_budget.h"
#include "src/parallel.h"

namespace clume {
namespace {

/// Device groups out of lists of primitives: each list is cut by medium, then into sixteens.
class GroupWriter {
public:
    GroupWriter(std::span<const Ellipsoid> ellipsoids, Groups& out) : ellipsoids_(ellipsoids), out_(out) {}

    /// Number of groups that a list (ascending, so by medium) takes.
    std::size_t count(const std::vector<std::uint32_t>& list) const {
        std::size_t groups = 0;
        for (std::size_t i = 0; i < list.size(); i += length(list, i)) ++groups;
        return groups;
    }

    /// Makes room for more groups; the index of the first.
    std::size_t extend(std::size_t groups) {
        const std::size_t first = out_.medium.size();
        require_memory("groups of primitives", {{"groups for the device", (first + groups) * (4 * CLUME_GROUP_FLOATS + sizeof(device::uint))}});
        out_.medium.resize(first + groups);
        out_.rows.resize((first + groups) * CLUME_GROUP_FLOATS);
        return first;
    }

    void write(std::size_t group, const std::vector<std::uint32_t>& list) {
        for (std::size_t i = 0; i < list.size(); ++group) {
            const std::size_t n = length(list, i);
            float* row = out_.rows.data() + group * CLUME_GROUP_FLOATS;
            out_.medium[group] = ellipsoids_[list[i]].medium;
            for (std::size_t lane = 0; lane < CLUME_GROUP_SIZE; ++lane) {
                const auto put = [&](int r, float v) { row[static_cast<std::size_t>(r) * CLUME_GROUP_SIZE + lane] = v; };
                if (lane >= n) {
                    // Nothing there: far away, unlike in each axis, without extinction.
                    const float pad[] = {1e6f, 2.7e6f, -3.1e6f, 1, 0, 0, 1, 0, 1, 0, as_float(CLUME_NO_PRIMITIVE)};
                    for (int r = 0; r < CLUME_GROUP_ROWS; ++r) put(r, pad[r]);
                    continue;
                }
                pack_lane(ellipsoids_[list[i + lane]], list[i + lane], row + lane, CLUME_GROUP_SIZE);
            }
            i += n;
        }
    }

private:
    std::size_t length(const std::vector<std::uint32_t>& list, std::size_t i) const {
        std::size_t n = 1;
        while (n < CLUME_GROUP_SIZE && i + n < list.size() && ellipsoids_[list[i + n]].medium == ellipsoids_[list[i]].medium) ++n;
        return n;
    }
    std::span<const Ellipsoid> ellipsoids_;
    Groups& out_;
};

/// Alias table over the bounds of a cell, into references[first, first + n).
void pack_references(const Cells::Leaf& leaf, std::span<const Ellipsoid> ellipsoids, device::Reference* out) {
    const std::size_t n = leaf.primitives.size();
    // Upper half of peak / bound: exact but for the rounding of the quotient, since the bound was chosen for it.
    const auto scale = [&](std::size_t i) {
        const auto quotient = static_cast<float>(ellipsoids[leaf.primitives[i]].sigma / static_cast<double>(leaf.bounds[i]));
        return (std::bit_cast<std::uint32_t>(quotient) + 0x8000u) >> 16;
    };
    std::vector<double> weight(n);
    for (std::size_t i = 0; i < n; ++i) weight[i] = static_cast<double>(leaf.bounds[i]) * static_cast<double>(n) / leaf.majorant;
    const std::vector<AliasSlot> slots = alias_table(std::move(weight));
    for (std::size_t i = 0; i < n; ++i)
        out[i] = {slots[i].threshold, leaf.primitives[i], leaf.primitives[slots[i].other], scale(i) | scale(slots[i].other) << 16};
}

}  // namespace

device::uint family_bit(KernelFamily k) {
    return k == KernelFamily::gaussian ? FAMILY_GAUSSIAN : k == KernelFamily::epanechnikov ? FAMILY_EPANECHNIKOV : FAMILY_UNIFORM;
}

HostArray<device::Primitive> pack_primitives(std::span<const Ellipsoid> ellipsoids) {
    HostArray<device::Primitive> primitives(ellipsoids.size());
    parallel_chunks(ellipsoids.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Ellipsoid& e = ellipsoids[i];
            device::Primitive& p = primitives[i];
            p = {};
            for (int k = 0; k < 3; ++k) p.mu[k] = static_cast<float>(e.center[k]);
            for (int k = 0; k < 6; ++k) p.w[k] = static_cast<float>(e.w[k]);
            p.sigma = static_cast<float>(e.sigma);
            p.extent_squared = static_cast<float>(e.extent * e.extent);
            p.family = family_bit(e.family);
            p.medium = e.medium;
        }
    });
    return primitives;
}

void pack_lane(const Ellipsoid& e, std::uint32_t id, float* lane, std::size_t stride) {
    const auto put = [&](int row, float v) { lane[static_cast<std::size_t>(row) * stride] = v; };
    for (int k = 0; k < 3; ++k) put(CLUME_ROW_MU + k, static_cast<float>(e.center[k]));
    for (int k = 0; k < 6; ++k) put(CLUME_ROW_W + k, static_cast<float>(e.w[k]));
    put(CLUME_ROW_SIGMA, static_cast<float>(e.sigma));
    put(CLUME_ROW_ID, as_float(id));
}

PackedCells pack_cells(const Cells& cells, std::span<const Ellipsoid> ellipsoids, bool with_groups, bool with_references, Groups& out_groups) {
    HostArray<device::CellLeaf> leaves(cells.leaves.size());
    GroupWriter writer(ellipsoids, out_groups);
    std::size_t groups = 0, references = 0;
    std::vector<device::uint> first_reference(with_references ? cells.leaves.size() : 0);
    for (std::size_t i = 0; i < cells.leaves.size(); ++i) {
        const Cells::Leaf& leaf = cells.leaves[i];
        device::CellLeaf& l = leaves[i];
        l = {};
        // Below the sum of the bounds also after both were rounded.
        l.control = static_cast<float>(std::min(leaf.control * (1 - 1e-5), leaf.majorant * 0.999));
        if (with_groups) {
            l.first_group = static_cast<device::uint>(groups);
            l.group_count = static_cast<device::uint>(writer.count(leaf.primitives));
            groups += l.group_count;
        }
        if (with_references) {
            first_reference[i] = static_cast<device::uint>(references);
            references += leaf.primitives.size();
        }
    }
    require_memory("cells", {{"table for the device", cells.table.size() * sizeof(device::CellEntry)}, {"references", references * sizeof(device::Reference)}, {"primitives", ellipsoids.size() * sizeof(device::Primitive)}});
    HostArray<device::CellEntry> table(cells.table.size());
    for (std::size_t i = 0; i < cells.table.size(); ++i) {
        const device::uint link = cells.table[i];
        table[i] = {link, 0, 0, 0};
        if ((link & CELL_INNER) || link < CELL_EMPTY_MAX || !with_references) continue;
        const std::size_t leaf = link - CELL_EMPTY_MAX;
        table[i] = {link, static_cast<float>(cells.leaves[leaf].majorant), first_reference[leaf], static_cast<device::uint>(cells.leaves[leaf].primitives.size())};
    }
    if (std::max(groups, references) > 0x7fffffffu) throw RenderError("the cells need more than 2^31 references");
    writer.extend(groups);
    HostArray<device::Reference> slots(references);
    parallel_chunks(cells.leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (with_groups) writer.write(leaves[i].first_group, cells.leaves[i].primitives);
            if (with_references) pack_references(cells.leaves[i], ellipsoids, slots.data() + first_reference[i]);
        }
    });
    const std::size_t n = ellipsoids.size();
    return {std::move(table), std::move(leaves), std::move(slots), pack(cells.origin, 1.0 / cells.root_size), cells.roots, cells.levels,
            fmt::format("{}x{}x{} cells, {} octree levels, {} leaves, {:.1f} references per primitive", cells.roots.x, cells.roots.y, cells.roots.z, cells.levels, cells.leaves.size(),
                        n ? static_cast<double>(cells.references) / static_cast<double>(n) : 0.0)};
}

PackedBvh pack_bvh(const BvhTree& tree, std::span<const Ellipsoid> ellipsoids, Groups&& groups) {
    WideBvh wide = widen(tree, ellipsoids);
    GroupWriter writer(ellipsoids, groups);
    const std::size_t first = writer.extend(wide.groups.size());
    for (std::size_t g = 0; g < wide.groups.size(); ++g) writer.write(first + g, wide.groups[g]);
    for (auto& node : wide.nodes)
        for (auto& child : node.child)
            if (child != BVH_NONE && (child & BVH_LEAF)) child += static_cast<device::uint>(first);
    if (wide.nodes.empty()) {
        device::BvhNode none{};
        for (auto& c : none.child) c = BVH_NONE;
        wide.nodes.push_back(none);
    }
    return {std::move(wide.nodes), std::move(groups.rows), std::move(groups.medium), wide.stack_entries};
}

}  // namespace clume
