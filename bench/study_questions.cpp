// SPDX-License-Identifier: MIT
// Transmittance estimators; what the homogeneous last segment costs and buys; Epanechnikov against Gaussian at equal look.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/study.h"
#include "bench/study_scenes.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {

void study_estimators(Session& session, const Report& report) {
    if (!session.wants("estimators")) return;
    const auto pairs = methods({"delta:tree/analytic", "delta:tree/ratio", "delta:tree/residual-ratio", "delta:tree/binary", "decomposition/analytic", "decomposition/binary"});
    Plot plot{"Shadow rays: one distant light, 10⁴ primitives, overlap 8", "optical depth along the diameter", "variance × processor seconds per path"};
    for (const MethodPair& p : pairs) plot.series.push_back({p.label(), {}});
    Table csv{{"depth", "pair", "cpu_us", "variance", "inverse_efficiency"}}, table{{"optical depth"}};
    for (const MethodPair& p : pairs) table[0].push_back("`" + p.label() + "`");
    for (const double depth : {0.1, 1., 10., 100., 1000.}) {
        BallSpec spec;
        spec.depth = depth;
        spec.sun = true;
        const std::vector<Measured> all = measure(session, study_ball(spec), pairs, study_options(session, 2));
        double best = INFINITY;
        for (const Measured& m : all)
            if (m.ok()) best = std::min(best, m.inverse_efficiency());
        std::vector<std::string> row{fmt::format("{:g}", depth)};
        Fields fields;
        for (std::size_t i = 0; i < all.size(); ++i) {
            const Measured& m = all[i];
            if (!m.ok()) {
                row.push_back("–");
                continue;
            }
            plot.series[i].points.emplace_back(depth, m.inverse_efficiency());
            csv.push_back({row[0], m.pair.label(), figure(m.cpu_us), figure(m.variance), figure(m.inverse_efficiency())});
            const std::string cell = fmt::format("{} µs, {:.2f}×", figure(m.cpu_us), m.inverse_efficiency() / best);
            row.push_back(m.inverse_efficiency() <= best ? "**" + cell + "**" : cell);
            fields.emplace_back(m.pair.label(), m.inverse_efficiency());
        }
        table.push_back(row);
        session.record("estimators/" + row[0], fmt::format("estimators {}", fmt::join(row, "  ")), std::move(fields));
    }
    report.csv("estimators", csv);
    report.plot("estimators", plot);
    report.table("estimators", table);
}

void study_homogeneous(Session& session, const Report& report) {
    if (!session.wants("homogeneous")) return;
    const auto pairs = methods({"regular", "regular-linear", "delta:tree"});
    Plot plot{"Last segment taken as homogeneous (1000 primitives, distant light)", "supports over a point", "bias of the mean (%)"};
    Table csv{{"overlap", "depth", "regular_us", "linear_us", "bias_percent", "bias_error_percent", "rms_bias_percent"}},
        table{{"overlap", "optical depth", "`regular`, µs", "`regular-linear`, µs", "bias of the mean, %", "RMS bias, %"}};
    for (const double depth : {10., 100.}) {
        plot.series.push_back({fmt::format("optical depth {:g}", depth), {}});
        for (const double overlap : {1., 4., 16., 64.}) {
            BallSpec spec;
            spec.n = 1000;
            spec.overlap = overlap;
            spec.depth = depth;
            spec.sun = true;
            // The truth comes from the fastest as well.
            const std::vector<Measured> all = measure(session, study_ball(spec), pairs, study_options(session, 8));
            if (!all[0].ok() || !all[1].ok() || !all[2].ok()) continue;
            const Measured unbiased[] = {all[0], all[2]};
            const Bias b = bias_of(all[1], pooled(unbiased));
            plot.series.back().points.emplace_back(overlap, 100 * std::abs(b.mean));
            const std::vector<std::string> row{figure(overlap), figure(depth), figure(all[0].cpu_us), figure(all[1].cpu_us)};
            csv.push_back(row);
            for (const double v : {b.mean, b.mean_error, b.rms}) csv.back().push_back(figure(100 * v));
            table.push_back(row);
            table.back().push_back(fmt::format("{:+.2f} ± {:.2f}", 100 * b.mean, 100 * b.mean_error));
            table.back().push_back(b.rms > 0 ? figure(100 * b.rms) : "below noise");
            session.record(fmt::format("homogeneous/{:g}/{:g}", depth, overlap), fmt::format("homogeneous {}", fmt::join(table.back(), "  ")),
                           {{"regular_us", all[0].cpu_us}, {"linear_us", all[1].cpu_us}, {"bias", b.mean}, {"bias_error", b.mean_error}, {"rms_bias", b.rms}});
        }
    }
    report.csv("homogeneous", csv);
    report.plot("homogeneous", plot);
    report.table("homogeneous", table);
}

void study_look(Session& session, const Report& report) {
    if (!session.wants("look")) return;
    const auto pairs = methods({"delta:tree", "decomposition", "regular"});
    Table csv{{"scene", "strategy", "gaussian_us", "epanechnikov_us", "ratio", "rms_difference_percent", "mean_difference_percent"}},
        table{{"scene", "`delta:tree`, µs (G / E)", "`decomposition`, µs (G / E)", "`regular`, µs (G / E)", "RMS difference, %", "difference of the mean, %"}};
    for (const char* name : {"ball", "smoke_close", "smoke_dense", "fire"}) {
        Scene gaussian = std::string(name) == "ball" ? study_ball({}) : study_file(name);
        Scene other = gaussian;
        for (EllipsoidMedium& m : other.media) {
            const double mass = kernel_mass(m.kernel, m.extent);
            m.kernel = KernelFamily::epanechnikov;
            m.extent = reference::default_extent(m.kernel);
            m.density_scale *= mass / kernel_mass(m.kernel, m.extent);
        }
        MeasureOptions options = study_options(session, 6);
        const std::vector<Measured> a = measure(session, gaussian, pairs, options);
        options.seed = 100;
        const std::vector<Measured> b = measure(session, other, pairs, options);
        if (std::any_of(a.begin(), a.end(), [](const Measured& m) { return !m.ok(); }) || std::any_of(b.begin(), b.end(), [](const Measured& m) { return !m.ok(); })) continue;
        const Bias difference = bias_of(pooled(b), pooled(a));
        std::vector<std::string> row{name};
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            row.push_back(fmt::format("{} / {} = {:.2f}", figure(a[i].cpu_us), figure(b[i].cpu_us), a[i].cpu_us / b[i].cpu_us));
            csv.push_back({name, short_label(pairs[i]), figure(a[i].cpu_us), figure(b[i].cpu_us), figure(a[i].cpu_us / b[i].cpu_us), figure(100 * difference.rms), figure(100 * difference.mean)});
        }
        row.push_back(figure(100 * difference.rms));
        row.push_back(fmt::format("{:+.2f} ± {:.2f}", 100 * difference.mean, 100 * difference.mean_error));
        table.push_back(row);
        session.record(fmt::format("look/{}", name), fmt::format("look {}", fmt::join(row, "  ")), {{"rms", difference.rms}, {"mean", difference.mean}});
    }
    report.csv("look", csv);
    report.table("look", table);
}

}  // namespace clume::bench
