// SPDX-License-Identifier: MIT
// PLY files, by the reader alone and, one time in eight, as a medium of a scene, which is slower. The options follow from the
// number of bytes, so that an input alone says what happens.
#include <fmt/format.h>

#include <vector>

#include "src/json_reader.h"
#include "src/ply_reader.h"
#include "src/scene_reader.h"
#include "tests/fuzz/targets.h"

namespace clume::fuzz {

namespace {

void run_in_scene(const std::string& path, std::size_t option) {
    constexpr const char* options[] = {
        R"("kernel": "gaussian")", R"("kernel": "uniform", "scale_encoding": "linear", "normalization": "mass")",
        R"("kernel": "epanechnikov", "density_encoding": "opacity")", R"("kernel": "gaussian", "albedo": 0.5, "emission": 1)"};
    parse_scene(fmt::format(R"({{"camera": {{"origin": [0, 0, -4], "target": [0, 0, 0]}}, "lights": [{{"type": "constant", "radiance": 1}}],
                                 "media": [{{"type": "ellipsoids", {}, "file": {}}}]}})",
                            options[option % std::size(options)], json_string(path)),
                "scene.json");
}

void run_alone(const std::string& path, std::size_t option) {
    PlyOptions options;
    if (option % 2 == 1) options.scale = ScaleEncoding::linear;
    if (option % 3 == 1) options.density = DensityEncoding::opacity;
    options.read_albedo = options.read_emission = option % 5 != 1;
    std::vector<PlyEllipsoid> read;
    read_ply(path, options, [&](const PlyEllipsoid& e, std::size_t index, std::size_t count) {
        if (index == 0) read.reserve(count);
        read.push_back(e);
    });
}

void run(std::string_view bytes) {
    read_as_file(bytes, [&](const std::string& path) { (bytes.size() % 8 == 0 ? run_in_scene : run_alone)(path, bytes.size() / 8); });
}

}  // namespace

const Target ply{"ply", run, ply_memory};

}  // namespace clume::fuzz
