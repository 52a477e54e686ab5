// SPDX-License-Identifier: MIT
// A mixture of ellipsoids as a dense voxel grid: its extinction, in double, at the centres of cubic voxels over its bounds.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "src/scene.h"

namespace clume {

constexpr int most_bake_resolution = 4096;

/// σ_t [1/world unit] of all ellipsoid media together, density_scale included, at the centres of `resolution` voxels along the
/// longest axis of the bounds of their supports. Bounds are numbers that a float can hold, so that every file format places the
/// samples alike; voxels are cubes up to that rounding. Point samples: the trilinear reconstruction of a smooth mixture is off by
/// O(voxel²). The result doesn't depend on the number of threads. `progress` gets the part done, from any thread. Empty if `stop`
/// became true. Throws SceneError if there is nothing to bake, RenderError if it doesn't fit in memory.
std::optional<VoxelGrid> bake(const Scene& scene, int resolution, const std::function<void(double)>& progress,
                              const std::atomic<bool>& stop);

/// One line of JSON: the medium that shows `file` in place of the scene's ellipsoids; and what that loses, in words.
struct BakedMedium {
    std::string json;
    std::vector<std::string> losses;
};
BakedMedium describe_baked(const Scene& scene, const std::string& file);

}  // namespace clume
