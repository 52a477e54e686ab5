// SPDX-License-Identifier: MIT
// index.html of a report: one file that needs no other, no network and no script.
#pragma once

#include <string>
#include <vector>

#include "src/compare_tables.h"

namespace clume {

/// The images of one pair, as data URIs; empty where there is none.
struct PairPictures {
    std::string image, error, cost;
};

struct ReportPictures {
    std::string reference;             ///< data URI
    std::vector<PairPictures> pairs;   ///< as Comparison::pairs
    std::vector<std::string> plots;    ///< SVG data URIs in the order of plot_names; empty where there is none
};

/// Well-formed as XML, too.
std::string report_html(const Comparison& comparison, const CompareSummary& summary, const ReportFacts& facts, const ReportPictures& pictures);

}  // namespace clume
