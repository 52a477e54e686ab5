// SPDX-License-Identifier: MIT
// The ellipsoids as the device gets them: groups of 16, cells with references or groups, the wide bvh; and what packings of one
// scene for several methods have in common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "src/bvh.h"
#include "src/cells.h"
#include "src/device_scene.h"

namespace clume {

/// FAMILY_* of layout.h.
device::uint family_bit(KernelFamily kernel);

/// One primitive into its lane of a group: row r goes to lane[r · stride].
void pack_lane(const Ellipsoid& e, std::uint32_t id, float* lane, std::size_t stride);

/// One by one, in order.
HostArray<device::Primitive> pack_primitives(std::span<const Ellipsoid> ellipsoids);

/// DeviceScene::groups and group_medium being written.
struct Groups {
    HostArray<float> rows;
    HostArray<device::uint> medium;
};

struct PackedCells {
    SharedArray<device::CellEntry> cells;
    SharedArray<device::CellLeaf> leaves;
    SharedArray<device::Reference> references;
    device::float4 origin{};      ///< as RenderParams has them
    glm::uvec3 roots{0};
    std::uint32_t levels = 0;
    std::string text;             ///< what they are
};

/// `with_groups`: for what visits chords or looks densities up by cell, into `groups`, which are empty; `with_references`: for
/// null collisions under the cells' bounds. Throws RenderError if there are too many.
PackedCells pack_cells(const Cells& cells, std::span<const Ellipsoid> ellipsoids, bool with_groups, bool with_references, Groups& groups);

struct PackedBvh {
    SharedArray<device::BvhNode> nodes;
    SharedArray<float> groups;
    SharedArray<device::uint> group_medium;
    std::uint32_t stack = 0;  ///< entries that a traversal needs
};

/// The bvh with its groups after those that are there.
PackedBvh pack_bvh(const BvhTree& tree, std::span<const Ellipsoid> ellipsoids, Groups&& groups);

/// What was built for one scene by the packings so far that were given this: the last of each kind.
struct SharedStructures {
    SharedArray<Ellipsoid> ellipsoids;
    std::optional<BvhTree> tree;
    SharedArray<device::Primitive> primitives;
    std::optional<CellOptions> cell_options;  ///< of `cells`, which are without groups
    PackedCells cells;
    std::optional<PackedBvh> bvh;             ///< with no other groups
};

}  // namespace clume
