// SPDX-License-Identifier: MIT
// How depths and flights along a line are judged, when the line may be moved, and what is shared by those who do.
#pragma once

#include "src/stress.h"
#include "src/stress_oracle.h"

namespace clume {

constexpr float kStressNever = 1e30f;
constexpr double kStressFloor = 0x1p-98;  ///< what is below 2^-100 counts as 0

const char* kernel_name(KernelFamily kernel);

/// Groups whose lanes all hold one primitive each, of CLUME_GROUP_ROWS floats.
std::vector<float> pack_groups(const std::vector<std::vector<float>>& lanes);

/// How far `got` lies outside what lines nearby have, as a share; below `floor` all is 0.
double beyond_range(const oracle::Range& range, double got, double floor);

/// A flight from t0 for depth tau that ended at `got`, t and the line being known to `shift`, and the chord's ends to `blur` by
/// themselves; relative: with nothing forgiven.
StressError flight_error(const oracle::Line256& line, const oracle::Real& t0, const oracle::Real& tau, double got, double shift, double& relative, double blur = 0);

}  // namespace clume
