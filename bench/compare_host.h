// SPDX-License-Identifier: MIT
// The renderer beside the plain host tracer, interleaved in one run: paths per second, variance, and the ratio of inverse
// efficiencies (variance × time).
#pragma once

#include <string>

namespace clume {

struct HostComparison {
    int rounds = 7;
    std::string filter;    ///< part of a scene's name; empty: all
    std::string device;    ///< as --device; empty: the best
    std::string strategy;  ///< empty: auto
    int vector_width = 0;  ///< 0: the device's own
    std::string accelerator = "auto";
};

/// Prints a table to stdout: medians over the rounds.
void compare_with_host(const HostComparison& options);

}  // namespace clume
