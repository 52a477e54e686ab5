// SPDX-License-Identifier: MIT
#include "bench/scenes.h"

#include <filesystem>

#include "src/scene_reader.h"
#include "tests/reference/analytic_scenes.h"

namespace clume {

std::vector<BenchScene> bench_scenes() {
    const std::filesystem::path folder = CLUME_SCENES_DIR;
    std::vector<BenchScene> scenes;
    scenes.push_back({"wide", read_scene(folder / "smoke_wide.json"), 64});
    scenes.push_back({"close", read_scene(folder / "smoke_close.json"), 32});
    scenes.push_back({"dense", read_scene(folder / "smoke_dense.json"), 8});
    scenes.push_back({"point", read_scene(folder / "smoke_point.json"), 32});
    scenes.push_back({"ball", reference::ball_scene(), 3});
    return scenes;
}

}  // namespace clume
