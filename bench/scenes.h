// SPDX-License-Identifier: MIT
// The benchmark scenes, shared by `clume bench` and the docs.
#pragma once

#include <string>
#include <vector>

#include "src/scene.h"

namespace clume::bench {

/// Names of the benchmark scenes: wide, close, dense, point (smoke.ply) and ball.
const std::vector<std::string>& scene_names();

/// Throws SceneError if the bundled volume is not found.
Scene bench_scene(const std::string& name);

}  // namespace clume::bench
