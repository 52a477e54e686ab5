// SPDX-License-Identifier: MIT
// The folder that a comparison leaves: tables, plots, images and index.html (docs/compare.md lists them). Each file is
// written whole or not at all. All functions throw RenderError with the file and the reason.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "src/compare_summary.h"

namespace clume {

/// Makes sure of the folder before a long run: creates it if need be, and marks an empty one by a results.json that says that
/// nothing was measured. One that holds a report stays as it is until write_report. Throws RenderError for any other folder.
/// Returns whether it left that mark: then discard_report_folder takes it back.
bool prepare_report_folder(const std::filesystem::path& folder, const std::string& command);

/// Removes the mark, and the folder if it is empty then.
void discard_report_folder(const std::filesystem::path& folder);

/// Writes everything, in place of what an earlier report left; returns warnings (no gnuplot).
std::vector<std::string> write_report(const std::filesystem::path& folder, const Comparison& comparison, const CompareSummary& summary,
                                      const std::string& command);

}  // namespace clume
