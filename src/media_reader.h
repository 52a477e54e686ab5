// SPDX-License-Identifier: MIT
// One entry of a scene's `media`, read and brought to world coordinates. Part of scene_reader.
#pragma once

#include <filesystem>

#include "src/scene.h"
#include "src/scene_schema.h"

namespace clume {

/// `folder` is what relative paths start from. Throws as read_scene does.
EllipsoidMedium read_medium(const SceneSource& source, const JsonValue& value, const std::filesystem::path& folder);

/// `name` found from `folder`; a SceneError at `at` if it isn't a file.
std::filesystem::path find_asset(const SectionReader& section, std::string_view key, const std::filesystem::path& folder);

/// Largest count of primitives: they are named by 32-bit numbers.
constexpr std::size_t most_primitives = 0xFFFFFFFE;

}  // namespace clume
