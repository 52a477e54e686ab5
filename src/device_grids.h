// SPDX-License-Identifier: MIT
// Voxel media as the device gets them (layout.h: GridInfo): sparse bricks with an apron, a table of bricks that rays walk
// like the mixture's cells, bounds. Same bytes for any number of threads.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "src/device_scene.h"

namespace clume {

/// What the program is specialised to.
struct GridTraits {
    device::uint kinds = 0;       ///< GRID_* bits
    device::uint levels = 0;      ///< CLUME_GRID_LEVELS
    bool emission_grids = false;
    double brightest = 0;         ///< radiance that an emission grid adds along the longest line through it
    std::size_t bricks = 0;
    double voxel_edge = 1e300;    ///< shortest edge of a voxel, world units
};

/// Appends every grid medium of the scene to out.grids, grid_cells, grid_values, and its corners to out.grid_boxes.
/// `bounds`: > 0 for tables of bounds of their own, with this many cells along each grid's longest side.
/// Throws SceneError for a grid that can't be held.
GridTraits pack_grids(const Scene& scene, int bounds, DeviceScene& out);

/// Corners, world units, of the box in which the grid's support lies (scene.h), in no particular order.
std::array<glm::dvec3, 8> grid_corners(const VoxelGrid& grid, Interpolation interpolation);

}  // namespace clume
