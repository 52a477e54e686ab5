// SPDX-License-Identifier: MIT
// Files of voxel grids: which grids one holds, and each of them on demand. The format follows from the extension.
// What a file makes the reader hold is bounded by its size: `dense_memory` and `sparse_memory` of memory_bound.h.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "src/scene.h"

namespace clume {

/// One grid as the file lists it.
struct VoxelFileEntry {
    std::string name;     ///< empty where files have one grid without a name
    std::string type;     ///< as the format names it, such as "float"
    std::string refusal;  ///< why it can't be a medium, such as "a level set"; empty: it can
};

class VoxelFile {
  public:
    virtual ~VoxelFile() = default;
    virtual const std::vector<VoxelFileEntry>& entries() const = 0;
    /// The grid, in the file's own placement. Throws SceneError "path: why"; `index` is of a grid that can be read.
    virtual VoxelGrid read(std::size_t index) const = 0;
};

/// Opens .vol, .vdb and .nvdb. Throws SceneError "path: why" for other extensions and for what can't be read.
std::unique_ptr<VoxelFile> open_voxel_file(const std::filesystem::path& path);

/// The extension in lower case is one that open_voxel_file knows.
bool is_voxel_file(const std::filesystem::path& path);

/// The grid called `name`, or without a name `density`, else the only one that can be read. Throws SceneError "path: why" with
/// the grids there are.
std::size_t find_grid(const std::filesystem::path& path, std::span<const VoxelFileEntry> entries,
                      const std::optional<std::string>& name);

/// float32, x fastest, exactly as many bytes as `size` says; placed at the lattice itself. Throws SceneError "path: why".
VoxelGrid read_raw(const std::filesystem::path& path, const glm::ivec3& size);

/// Parts of open_voxel_file.
std::unique_ptr<VoxelFile> open_vol(const std::filesystem::path& path);
std::unique_ptr<VoxelFile> open_vdb(const std::filesystem::path& path);
std::unique_ptr<VoxelFile> open_nvdb(const std::filesystem::path& path);

}  // namespace clume
