// SPDX-License-Identifier: MIT
// The parts of `clume stress`: each adds the rows of its building blocks.
#pragma once

#include "src/stress.h"
#include "src/stress_device.h"

namespace clume {

/// Told the share of the part that is done.
using PartProgress = std::function<void(double)>;

void stress_math(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress);      ///< elementary functions, random numbers
void stress_chords(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress);    ///< intersections, density, depth, flight
void stress_given(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress);     ///< depth and flight in the geometry that the device found
void stress_sums(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress);      ///< transmittances
void stress_sampling(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress);  ///< phase functions, camera
void stress_lights(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress);
void stress_environment(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress);  ///< images

/// Leaves one point per half decade of x: what `share` of the values there stay below.
void bin_plot(StressPlot& plot, double share);

}  // namespace clume
