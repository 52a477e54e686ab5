// SPDX-License-Identifier: MIT
// Environment images from OpenEXR (R, G, B or Y; half, float or uint; scan lines or tiles) and Radiance HDR files.
// The format is told by the first bytes, sizes are checked against memory and the file before anything is
// allocated; what is held stays within `image_memory` (memory_bound.h).
#pragma once

#include <filesystem>

#include "src/scene.h"

namespace clume {

/// The most columns or rows of an image.
constexpr int largest_image_side = 65536;

/// The image over the file's display window, black where an EXR's data window leaves it open.
/// Throws SceneError "file: why" for anything else, NaN, infinite and negative texels among it.
EnvironmentImage read_environment(const std::filesystem::path& path);

}  // namespace clume
