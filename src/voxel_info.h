// SPDX-License-Identifier: MIT
// What `clume info` says of voxel files and of voxel media.
#pragma once

#include <cstddef>
#include <filesystem>

#include "src/scene.h"

namespace clume {

/// Every grid of a .vol, .vdb or .nvdb file, on stdout. Throws as the readers do.
void print_voxel_info(const std::filesystem::path& file);

/// A medium of a scene, the `index`th in the order of printing.
void print_grid_medium(std::size_t index, const GridMedium& medium);

}  // namespace clume
