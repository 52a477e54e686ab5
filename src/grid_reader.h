// SPDX-License-Identifier: MIT
// One entry of type `grid` of a scene's `media`: its voxel file is read, placed and brought to world coordinates. Part of
// scene_reader.
#pragma once

#include <filesystem>

#include "src/scene.h"
#include "src/scene_schema.h"

namespace clume {

/// `section`: the medium; `folder` is what relative paths start from. Throws as read_scene does; what is wrong in the voxel file
/// is told at the place of `file`, as "scene:line:column: path: why".
GridMedium read_grid(const SectionReader& section, const std::filesystem::path& folder);

}  // namespace clume
