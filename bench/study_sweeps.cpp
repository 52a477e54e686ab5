// SPDX-License-Identifier: MIT
// Sweeps: the ball with one property varied, and the bundled scenes; every strategy, one scene per point. Light is constant,
// so that what is timed is flights alone, and all unbiased strategies have one distribution, hence one variance.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "bench/study.h"
#include "bench/study_scenes.h"

namespace clume::bench {
namespace {

struct PointOf {
    std::string name;
    double x;
    std::function<Scene()> scene;
};

/// Times per path at every point, as CSV, table and (with an x label) plot.
void sweep(Session& session, const Report& report, const std::string& name, const std::string& title, const std::string& x_label, const std::vector<PointOf>& points,
           const std::vector<MethodPair>& pairs) {
    if (!session.wants(name)) return;
    Plot plot{title, x_label, "processor time per path (µs)"};
    for (const MethodPair& p : pairs) plot.series.push_back({short_label(p), {}});
    Table csv{{"point", "strategy", "cpu_us", "variance", "inverse_efficiency", "bias_percent", "bias_error_percent", "rms_bias_percent", "device_bytes", "build_s"}};
    Table table{{x_label.empty() ? "scene" : x_label}};
    for (const MethodPair& p : pairs) table[0].push_back("`" + short_label(p) + "`");
    std::set<std::string> cut;  // stays out for the rest of the sweep
    for (const PointOf& point : points) {
        std::vector<MethodPair> wanted;
        for (const MethodPair& p : pairs)
            if (!cut.contains(p.label())) wanted.push_back(p);
        const std::vector<Measured> all = measure(session, point.scene(), wanted, study_options(session));
        std::vector<Measured> unbiased;
        double best = std::numeric_limits<double>::infinity();
        for (const Measured& m : all) {
            if (!m.ok()) continue;
            best = std::min(best, m.cpu_us);
            if (m.pair.kind(false) == BiasKind::unbiased) unbiased.push_back(m);
        }
        Measured truth = pooled(unbiased);
        Fields fields;
        std::vector<std::string> row{point.name};
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            const auto m = std::find_if(all.begin(), all.end(), [&](const Measured& a) { return a.pair == pairs[i]; });
            const std::string label = short_label(pairs[i]);
            if (m == all.end() || !m->ok()) {
                row.push_back("–");
                if (m == all.end()) continue;
                session.note(fmt::format("  {} {}: {}", point.name, label, m->missing));
                if (!x_label.empty()) cut.insert(pairs[i].label());
                continue;
            }
            const bool biased = m->pair.kind(false) != BiasKind::unbiased;
            const Bias b = biased && !truth.rgb.empty() ? bias_of(*m, truth) : Bias{};
            plot.series[i].points.emplace_back(point.x, m->cpu_us);
            csv.push_back({point.name, label, figure(m->cpu_us), figure(m->variance), figure(m->inverse_efficiency()), biased ? figure(100 * b.mean) : "0",
                           biased ? figure(100 * b.mean_error) : "0", biased ? figure(100 * b.rms) : "0", fmt::format("{:.0f}", m->device_bytes), figure(m->build_s)});
            fields.emplace_back(label, m->cpu_us);
            row.push_back(m->cpu_us <= best ? "**" + figure(m->cpu_us) + "**" : figure(m->cpu_us));
        }
        table.push_back(row);
        session.record(name + "/" + point.name, fmt::format("{:10} {:>8}: {}", name, point.name, fmt::join(row.begin() + 1, row.end(), " ")), std::move(fields));
        report.csv(name, csv);
    }
    if (!x_label.empty()) report.plot(name, plot);
    report.table(name, table);
}

template <class Change>
PointOf ball_point(double x, const Change& change) {
    BallSpec spec;
    change(spec, x);
    return {fmt::format("{:g}", x), x, [spec] { return study_ball(spec); }};
}

}  // namespace

void study_sweeps(Session& session, const Report& report) {
    const auto all = methods({"delta:tree", "delta:grid", "delta:scene", "decomposition", "regular", "regular-linear", "march-analytic", "march", "progressive"});
    std::vector<PointOf> points;
    for (const double x : {1., 2., 4., 8., 16., 32., 64., 128.}) points.push_back(ball_point(x, [](BallSpec& s, double v) { s.overlap = v; }));
    sweep(session, report, "overlap", "More primitives over a point (10⁴ primitives, optical depth 10)", "supports over a point", points, all);
    points.clear();
    for (const double x : {0.1, 1., 10., 100., 1000.}) points.push_back(ball_point(x, [](BallSpec& s, double v) { s.depth = v; }));
    sweep(session, report, "density", "Denser (10⁴ primitives, overlap 8)", "optical depth along the diameter", points, all);
    points.clear();
    for (const bool needles : {false, true}) {
        for (const double x : {1., 10., 100., 1000.})
            points.push_back(ball_point(x, [needles](BallSpec& s, double v) {
                s.n = 30000;
                s.overlap = 4;
                s.anisotropy = v;
                s.needles = needles;
            }));
        const std::string body = needles ? "needles" : "discs";
        sweep(session, report, body, fmt::format("{} (3·10⁴ {}, overlap 4, optical depth 10)", needles ? "Longer" : "Flatter", body), "longest over shortest axis", points, all);
        points.clear();
    }
    for (const double x : {100., 1000., 1e4, 1e5, 1e6})
        points.push_back(ball_point(x, [](BallSpec& s, double v) { s.n = static_cast<std::uint32_t>(v); }));
    for (PointOf& p : points) p.name = fmt::format("{:.0f}", p.x);
    sweep(session, report, "count", "More and smaller primitives (overlap 8, optical depth 10)", "primitives", points, all);
    points.clear();
    for (const auto& [name, family] : {std::pair{"gaussian", KernelFamily::gaussian}, {"epanechnikov", KernelFamily::epanechnikov}, {"uniform", KernelFamily::uniform}}) {
        BallSpec spec;
        spec.family = family;
        points.push_back({name, 0, [spec] { return study_ball(spec); }});
    }
    sweep(session, report, "family", "", "", points, all);
    points.clear();
    for (const char* name : {"plume", "smoke_close", "smoke_dense", "fire"}) points.push_back({name, 0, [name] { return study_file(name); }});
    sweep(session, report, "scenes", "", "", points, all);
}

}  // namespace clume::bench
