// SPDX-License-Identifier: MIT
#include "bench/scenes.h"

#include <filesystem>

#include "src/scene_reader.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {

const std::vector<std::string>& scene_names() {
    static const std::vector<std::string> names{"wide", "close", "dense", "point", "ball"};
    return names;
}

Scene bench_scene(const std::string& name) {
    if (name == "ball") return reference::ball_scene();
    return read_scene(std::filesystem::path(CLUME_SCENES_DIR) / ("smoke_" + name + ".json"));
}

}  // namespace clume::bench
