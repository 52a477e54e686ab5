// SPDX-License-Identifier: MIT
// Writes one density grid as .vol, .nvdb or .vdb; the extension decides. Written whole or not at all.
#pragma once

#include <filesystem>
#include <string>

#include "src/scene.h"

namespace clume {

/// Whether write_voxel_file knows the extension, in lower case.
bool can_write_voxels(const std::filesystem::path& path);

/// Samples of `grid` at the same world positions in every format. Sparse formats hold a grid called "density" whose active voxels
/// are those that aren't background; .vol takes grids whose axes are the world's, dense from lo to hi, and rounds their bounds to
/// float. Throws RenderError if the file can't be written.
void write_voxel_file(const std::filesystem::path& path, const VoxelGrid& grid);

/// The bytes of such files.
std::string vol_bytes(const VoxelGrid& grid);
std::string nvdb_bytes(const VoxelGrid& grid);
std::string vdb_bytes(const VoxelGrid& grid);

}  // namespace clume
