// SPDX-License-Identifier: MIT
// One entry of type `ellipsoids` of a scene's `media`, read and brought to world coordinates. Part of scene_reader.
#pragma once

#include <filesystem>

#include "src/scene.h"
#include "src/scene_schema.h"

namespace clume {

/// `section`: the medium; `folder` is what relative paths start from. Throws as read_scene does.
EllipsoidMedium read_ellipsoids(const SectionReader& section, const std::filesystem::path& folder);

/// Largest count of primitives: they are named by 32-bit numbers.
constexpr std::size_t most_primitives = 0xFFFFFFFE;

}  // namespace clume
