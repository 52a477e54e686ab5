// SPDX-License-Identifier: MIT
// Environment images, EXR and HDR; the first bytes say which.
#include <cstdlib>

#include "src/environment_reader.h"
#include "tests/fuzz/targets.h"

namespace clume::fuzz {

namespace {

void run(std::string_view bytes) {
    read_as_file(bytes, [](const std::string& path) {
        const EnvironmentImage image = read_environment(path);
        if (image.rgb.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3) std::abort();
    });
}

}  // namespace

const Target environment{"environment", run, image_memory};

}  // namespace clume::fuzz
