// SPDX-License-Identifier: MIT
// PLY files as an ellipsoid medium. The options follow from the number of bytes, so that an input alone says what happens.
#include <fmt/format.h>

#include "src/json_reader.h"
#include "src/scene_reader.h"
#include "tests/fuzz/targets.h"

namespace clume::fuzz {

namespace {

void run(std::string_view bytes) {
    constexpr const char* options[] = {
        R"("kernel": "gaussian")", R"("kernel": "uniform", "scale_encoding": "linear", "normalization": "mass")",
        R"("kernel": "epanechnikov", "density_encoding": "opacity")", R"("kernel": "gaussian", "albedo": 0.5, "emission": 1)"};
    read_as_file(bytes, [&](const std::string& path) {
        parse_scene(fmt::format(R"({{"camera": {{"origin": [0, 0, -4], "target": [0, 0, 0]}}, "lights": [{{"type": "constant", "radiance": 1}}],
                                     "media": [{{"type": "ellipsoids", {}, "file": {}}}]}})",
                                options[bytes.size() % std::size(options)], json_string(path)),
                    "scene.json");
    });
}

}  // namespace

const Target ply{"ply", run, ply_memory};

}  // namespace clume::fuzz
