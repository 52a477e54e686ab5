// SPDX-License-Identifier: MIT
// How much memory a file may make its reader take, by the file's own size: what a damaged or hostile file claims costs nothing
// until the file holds something for it. The fuzz targets (tests/fuzz) hold every reader to these bounds.
#pragma once

#include <cstdint>
#include <string>

namespace clume {

/// The most bytes of heap that a reader holds at any one time, file and result among them, for a file of n bytes.
struct MemoryBound {
    std::uint64_t factor, constant;
    constexpr std::uint64_t of(std::uint64_t file_bytes) const { return factor * file_bytes + constant; }
};

/// A scene file alone: "[0,0,0" is a value of the tree for every two bytes. The files that it names add their own bounds, as
/// often as it names them.
constexpr MemoryBound scene_memory{512, 1 << 20};
/// A primitive is 160 bytes and at least 7 of the file.
constexpr MemoryBound ply_memory{128, 1 << 20};
/// .vol and .raw: a column one voxel wide makes a brick of 512 floats of every 8 samples.
constexpr MemoryBound dense_memory{512, 1 << 20};
/// .vdb and .nvdb, for each grid that is read: deflate makes up to 1032 bytes of one, and an active tile, which is one number in
/// the file, fills all its bricks. The constant is a solid block of 500³ voxels.
constexpr MemoryBound sparse_memory{16384, 1 << 30};
/// EXR and HDR: flat images compress about as well.
constexpr MemoryBound image_memory{16384, 1 << 27};

/// Throws SceneError "name: ..." with both figures if `needed` bytes are more than half of the bound for a file of `file_bytes`;
/// the other half is for what comes and goes on the way. To be asked before they are taken.
void check_memory(const std::string& name, const MemoryBound& bound, double needed, std::uint64_t file_bytes);

}  // namespace clume
