// SPDX-License-Identifier: MIT
// The ellipsoids as the device gets them: groups of 16, cells with references or groups, the wide bvh, bounds.
#pragma once

#include <cstddef>
#include <cstdint>

#include "src/bvh.h"
#include "src/cells.h"
#include "src/device_scene.h"

namespace clume {

/// FAMILY_* of layout.h.
device::uint family_bit(KernelFamily kernel);

/// One primitive into its lane of a group: row r goes to lane[r · stride].
void pack_lane(const Ellipsoid& e, std::uint32_t id, float* lane, std::size_t stride);

/// One by one, in the order of out.ellipsoids.
void pack_primitives(DeviceScene& out);

/// Cells into the device scene. `with_groups`: for what visits chords or looks densities up by cell; `with_references`: for
/// null collisions under the cells' bounds. Throws RenderError if there are too many.
void pack_cells(const Cells& cells, bool with_groups, bool with_references, DeviceScene& out);

/// The bvh and its groups, after the groups that are there; the entries that a traversal's stack needs.
std::uint32_t pack_bvh(const BvhTree& tree, DeviceScene& out);

}  // namespace clume
