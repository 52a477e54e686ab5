// SPDX-License-Identifier: MIT
// results.csv and results.json of a comparison (docs/compare.md says what each column is).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "src/compare_summary.h"

namespace clume {

/// What the report holds beside the comparison itself.
struct ReportFacts {
    std::string command;            ///< as typed
    double exposure_stops = 0;      ///< of all PNGs of images
    double error_scale = 0;         ///< colours of error maps end here [radiance]
    double cost_least = 0, cost_most = 0;  ///< those of cost maps [primitive tests per path]
};

/// One line per (pair, seed, sample count), the columns of docs/compare.md.
std::string comparison_to_csv(const Comparison& comparison);

/// Everything but the images, as one object; numbers that are not finite are null.
std::string comparison_to_json(const Comparison& comparison, const CompareSummary& summary, const ReportFacts& facts);

/// The first line of every results.json, by which a folder is known as one of ours.
inline constexpr const char* report_mark = "{\n  \"made_by\": \"clume compare\"";

}  // namespace clume
