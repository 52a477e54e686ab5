// SPDX-License-Identifier: MIT
// `clume info`: what a scene, a PLY file or a voxel file holds and what it will cost.
#pragma once

#include <filesystem>
#include <span>

#include "src/scene_reader.h"

namespace clume {

/// Prints to stdout; a .ply file is taken as a Gaussian medium. Throws as the readers do.
void print_info(const std::filesystem::path& file, std::span<const Override> overrides);

}  // namespace clume
