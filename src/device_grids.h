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
    bool nulls = false;           ///< something samples by null collisions
    bool tables = false;          ///< under bounds of a table of the grid's own
};

/// Appends every grid medium of the scene to out.grids, grid_cells, grid_values, and its corners to out.grid_boxes.
/// Null collisions get bounds as `bound` says (one of render.bound): `scene` one for a grid, `tree` the bricks', `grid` a table of its own with
/// majorant_grid cells along the longest side, or as many as cost least; by default whichever of the latter two costs less.
/// out.strategy and out.transmittance must be set. Throws SceneError for a grid that can't be held.
GridTraits pack_grids(const Scene& scene, const std::string& bound, DeviceScene& out);

/// Adds the program's defines and the lines of `--explain`; none for a scene without grids.
void define_grids(const Scene& scene, const GridTraits& traits, DeviceScene& out);
void explain_grids(const Scene& scene, const GridTraits& traits, DeviceScene& out);

/// Corners, world units, of the box in which the grid's support lies (scene.h), in no particular order.
std::array<glm::dvec3, 8> grid_corners(const VoxelGrid& grid, Interpolation interpolation);

}  // namespace clume
