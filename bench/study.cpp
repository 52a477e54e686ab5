// SPDX-License-Identifier: MIT
// `clume bench --study DOCS`: everything in docs/strategies.md that is measured.
#include "bench/study.h"

#include <fmt/format.h>

#include <cmath>

#include "bench/sections.h"

namespace clume::bench {

MeasureOptions study_options(const Session& session, double weight) {
    MeasureOptions o;
    o.rounds = session.rounds(3);
    o.round_s = (session.options().quick ? 0.03 : 0.12) * weight;
    o.most_s = session.options().quick ? 2 : 5;
    return o;
}

std::vector<MethodPair> methods(std::initializer_list<const char*> names) {
    std::vector<MethodPair> pairs;
    for (const char* name : names) pairs.push_back(method(name));
    return pairs;
}

std::string short_label(const MethodPair& pair) {
    const std::string label = pair.label(), end = "/analytic";
    return label.ends_with(end) ? label.substr(0, label.size() - end.size()) : label;
}

std::string figure(double value) { return std::isfinite(value) ? fmt::format("{:.3g}", value) : "–"; }

void bench_study_section(Session& session) {
    session.section("study", "What docs/strategies.md shows; the numbers are in DOCS/images/strategies/*.csv.");
    const std::filesystem::path docs = session.options().study;
    const Report report(docs / "strategies.md", docs / "images" / "strategies", "clume bench --study");
    study_sweeps(session, report);
    study_estimators(session, report);
    study_homogeneous(session, report);
    study_look(session, report);
    study_baked(session, report);
    study_proxy(session, report);
}

}  // namespace clume::bench
