// SPDX-License-Identifier: MIT
// The parts of the study (docs/strategies.md); each is an item "study/NAME", measured if the session wants it.
#pragma once

#include <string>
#include <vector>

#include "bench/measure.h"
#include "src/doc_report.h"

namespace clume::bench {

void study_sweeps(Session& session, const Report& report);      ///< study_sweeps.cpp: one property of the ball at a time; bundled scenes
void study_estimators(Session& session, const Report& report);  ///< study_questions.cpp, as those below
void study_homogeneous(Session& session, const Report& report);
void study_look(Session& session, const Report& report);
void study_baked(Session& session, const Report& report);       ///< study_baked.cpp
void study_proxy(Session& session, const Report& report);       ///< proxy.cpp

/// Rounds for timing; `weight` longer ones for variance and bias.
MeasureOptions study_options(const Session& session, double weight = 1);

std::vector<MethodPair> methods(std::initializer_list<const char*> names);
/// "delta:tree", with the estimator unless that is analytic.
std::string short_label(const MethodPair& pair);
/// Three significant digits; "–" if it is no finite number.
std::string figure(double value);

}  // namespace clume::bench
