// SPDX-License-Identifier: MIT
// What a stress run leaves: the table on a terminal, JSON with every figure, and a report folder (index.html with its plots; or,
// where the folder holds stability.md, that page's tables and images/stability/).
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "src/stress.h"

namespace clume {

/// One line per quantity and family, columns aligned.
std::string stress_table(const StressResult& result);

/// Numbers that are not finite are null. "-": stdout. Throws RenderError.
void write_stress_json(const std::filesystem::path& path, std::span<const StressResult> results);

/// Makes sure of the folder, before a long run. Throws RenderError.
void check_stress_report(const std::filesystem::path& folder);

/// Returns the page written. Throws RenderError.
std::filesystem::path write_stress_report(const std::filesystem::path& folder, std::span<const StressResult> results);

}  // namespace clume
