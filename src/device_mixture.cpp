// SPDX-License-Identifier: MIT
#include "src/device_mixture.h"

#include <algorithm>
#include <bit>
#include <cmath>

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
    GroupWriter(const std::vector<Ellipsoid>& ellipsoids, DeviceScene& out) : ellipsoids_(ellipsoids), out_(out) {}

    /// Number of groups that a list (ascending, so by medium) takes.
    std::size_t count(const std::vector<std::uint32_t>& list) const {
        std::size_t groups = 0;
        for (std::size_t i = 0; i < list.size(); i += length(list, i)) ++groups;
        return groups;
    }

    /// Makes room for more groups; the index of the first.
    std::size_t extend(std::size_t groups) {
        const std::size_t first = out_.group_medium.size();
        require_memory("groups of primitives", {{"groups for the device", (first + groups) * (4 * CLUME_GROUP_FLOATS + sizeof(device::uint))}});
        out_.group_medium.resize(first + groups);
        out_.groups.resize((first + groups) * CLUME_GROUP_FLOATS);
        return first;
    }

    void write(std::size_t group, const std::vector<std::uint32_t>& list) {
        for (std::size_t i = 0; i < list.size(); ++group) {
            const std::size_t n = length(list, i);
            float* row = out_.groups.data() + group * CLUME_GROUP_FLOATS;
            out_.group_medium[group] = ellipsoids_[list[i]].medium;
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
    const std::vector<Ellipsoid>& ellipsoids_;
    DeviceScene& out_;
};

/// Alias table over the bounds of a cell, into references[first, first + n).
void pack_references(const Cells::Leaf& leaf, const std::vector<Ellipsoid>& ellipsoids, device::Reference* out) {
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

void pack_primitives(DeviceScene& out) {
    out.primitives.resize(out.ellipsoids.size());
    parallel_chunks(out.ellipsoids.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Ellipsoid& e = out.ellipsoids[i];
            device::Primitive& p = out.primitives[i];
            p = {};
            for (int k = 0; k < 3; ++k) p.mu[k] = static_cast<float>(e.center[k]);
            for (int k = 0; k < 6; ++k) p.w[k] = static_cast<float>(e.w[k]);
            p.sigma = static_cast<float>(e.sigma);
            p.extent_squared = static_cast<float>(e.extent * e.extent);
            p.family = family_bit(e.family);
            p.medium = e.medium;
        }
    });
}

void pack_lane(const Ellipsoid& e, std::uint32_t id, float* lane, std::size_t stride) {
    const auto put = [&](int row, float v) { lane[static_cast<std::size_t>(row) * stride] = v; };
    for (int k = 0; k < 3; ++k) put(CLUME_ROW_MU + k, static_cast<float>(e.center[k]));
    for (int k = 0; k < 6; ++k) put(CLUME_ROW_W + k, static_cast<float>(e.w[k]));
    put(CLUME_ROW_SIGMA, static_cast<float>(e.sigma));
    put(CLUME_ROW_ID, as_float(id));
}

void pack_cells(const Cells& cells, bool with_groups, bool with_references, DeviceScene& out) {
    out.leaves.resize(cells.leaves.size());
    GroupWriter writer(out.ellipsoids, out);
    std::size_t groups = 0, references = 0;
    std::vector<device::uint> first_reference(with_references ? cells.leaves.size() : 0);
    for (std::size_t i = 0; i < cells.leaves.size(); ++i) {
        const Cells::Leaf& leaf = cells.leaves[i];
        device::CellLeaf& l = out.leaves[i];
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
    require_memory("cells", {{"table for the device", cells.table.size() * sizeof(device::CellEntry)}, {"references", references * sizeof(device::Reference)}, {"primitives", out.ellipsoids.size() * sizeof(device::Primitive)}});
    out.cells.resize(cells.table.size());
    for (std::size_t i = 0; i < cells.table.size(); ++i) {
        const device::uint link = cells.table[i];
        out.cells[i] = {link, 0, 0, 0};
        if ((link & CELL_INNER) || link < CELL_EMPTY_MAX || !with_references) continue;
        const std::size_t leaf = link - CELL_EMPTY_MAX;
        out.cells[i] = {link, static_cast<float>(cells.leaves[leaf].majorant), first_reference[leaf], static_cast<device::uint>(cells.leaves[leaf].primitives.size())};
    }
    if (std::max(groups, references) > 0x7fffffffu) throw RenderError("the cells need more than 2^31 references");
    writer.extend(groups);
    out.references.resize(references);
    parallel_chunks(cells.leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (with_groups) writer.write(out.leaves[i].first_group, cells.leaves[i].primitives);
            if (with_references) pack_references(cells.leaves[i], out.ellipsoids, out.references.data() + first_reference[i]);
        }
    });
    if (with_references) pack_primitives(out);
    device::RenderParams& p = out.params;
    p.cells_origin = pack(cells.origin, 1.0 / cells.root_size);
    p.cells_x = cells.roots.x;
    p.cells_y = cells.roots.y;
    p.cells_z = cells.roots.z;
    p.cells_levels = cells.levels;
}

std::uint32_t pack_bvh(const BvhTree& tree, DeviceScene& out) {
    WideBvh wide = widen(tree, out.ellipsoids);
    out.nodes = std::move(wide.nodes);
    GroupWriter writer(out.ellipsoids, out);
    const std::size_t first = writer.extend(wide.groups.size());
    for (std::size_t g = 0; g < wide.groups.size(); ++g) writer.write(first + g, wide.groups[g]);
    for (auto& node : out.nodes)
        for (auto& child : node.child)
            if (child != BVH_NONE && (child & BVH_LEAF)) child += static_cast<device::uint>(first);
    if (out.nodes.empty()) {
        device::BvhNode none{};
        for (auto& c : none.child) c = BVH_NONE;
        out.nodes.push_back(none);
    }
    return wide.stack_entries;
}

}  // namespace clume
