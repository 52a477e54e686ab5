// SPDX-License-Identifier: MIT
// What a program is told about the scene's voxel media, and what `--explain` says of them.
#include <fmt/format.h>

#include "src/device_grids.h"
#include "src/strategies.h"

namespace clume {

void define_grids(const Scene& scene, const GridTraits& traits, DeviceScene& out) {
    if (scene.grids.empty()) return;
    const auto define = [&](const char* name, std::size_t value) { out.defines.emplace_back(name, std::to_string(value)); };
    define("CLUME_GRIDS", scene.grids.size());
    define("CLUME_GRID_STRATEGY", static_cast<std::size_t>(find_strategy(out.strategy)->in_grids));
    define("CLUME_GRID_LEVELS", traits.levels);
    define("CLUME_GRID_KINDS", traits.kinds);
    define("CLUME_GRID_BOUNDS", traits.tables);
    define("CLUME_GRID_EMISSION", traits.emission_grids);
}

void explain_grids(const Scene& scene, const GridTraits& traits, DeviceScene& out) {
    if (scene.grids.empty()) return;
    const char* bound = out.bound == "scene" ? "null collisions under one bound each" : traits.tables ? "null collisions under a table of bounds" : "null collisions under the bricks' bounds";
    const bool nulls = out.strategy == "delta" || out.strategy == "progressive";
    out.explain.emplace_back("voxel media", fmt::format("{}: {} bricks of 8x8x8, {} octree levels, flights by {}", scene.grids.size(), traits.bricks, traits.levels,
                                                        nulls ? bound : out.strategy == "march" ? "marching" : "exact walks from voxel to voxel"));
    out.explain.emplace_back("emission grids", traits.emission_grids ? "integrated along every flight" : "left out");
}

}  // namespace clume
