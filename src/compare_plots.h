// SPDX-License-Identifier: MIT
// The plots of a report: one gnuplot script that holds its data, so that they can be made again or changed, and running it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "src/compare_summary.h"

namespace clume {

/// Plots that plot.gp makes, each as .svg and .png: RMSE against time, inverse efficiency, bias.
inline constexpr const char* plot_names[] = {"rmse", "inverse_efficiency", "bias"};

/// The text of plot.gp; empty if there is nothing to draw.
std::string plot_script(const Comparison& comparison, const CompareSummary& summary);

/// Runs `gnuplot plot.gp` in the folder; the plots appear whole or not at all. Returns what went wrong, or nothing.
std::string run_gnuplot(const std::filesystem::path& folder);

}  // namespace clume
