// SPDX-License-Identifier: MIT
// RenderStats as one JSON object, for scripts: the names are those of the struct.
#pragma once

#include <filesystem>
#include <string>

#include "src/renderer.h"

namespace clume {

/// Indented JSON with a line end; a number that isn't finite becomes null.
std::string stats_to_json(const RenderStats& stats);

/// Writes it whole or not at all; `-` is stdout. Throws RenderError.
void write_stats_json(const std::filesystem::path& path, const RenderStats& stats);

}  // namespace clume
