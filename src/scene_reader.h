// SPDX-License-Identifier: MIT
// From a scene file to the scene model: reads the JSON, applies the command line's overrides, checks everything against
// the schema and against itself, and loads the files it names. Degrees become radians, encodings, normalization and
// transforms are applied here, once. What the scene file alone makes it hold stays within `scene_memory` (memory_bound.h).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "src/scene.h"

namespace clume {

/// `-D render.spp=256`: a dotted path, list items by index, and JSON; a bare word that isn't JSON is a string.
/// Sections and keys that aren't in the file are made, as is the item that follows the last of a list.
struct Override {
    std::string key;
    std::string value;
};

/// Throws SceneError "file:line:column: what is wrong", or UsageError "-D key=value: what is wrong" for an override.
/// Overrides apply in order, so that the last one wins.
Scene read_scene(const std::filesystem::path& file, std::span<const Override> overrides = {});

/// The same from text; `name` is for messages and for the folder that relative paths start from.
Scene parse_scene(std::string_view text, const std::filesystem::path& name, std::span<const Override> overrides = {});

}  // namespace clume
