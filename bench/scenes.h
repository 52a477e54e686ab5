// SPDX-License-Identifier: MIT
// The benchmark scenes, shared by `clume bench` and the docs.
#pragma once

#include <string>
#include <vector>

#include "src/scene.h"

namespace clume {

struct BenchScene {
    std::string name;
    Scene scene;
    std::uint32_t spp;  ///< samples for about a second of one run
};

/// wide, close, dense, point (smoke.ply) and ball. Throws SceneError if the bundled volume is not found.
std::vector<BenchScene> bench_scenes();

}  // namespace clume
