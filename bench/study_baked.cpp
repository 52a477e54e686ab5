// SPDX-License-Identifier: MIT
// A mixture against its own voxel grid: how far the grid's image is off, how fast it is, how many bytes it takes.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "bench/study.h"
#include "bench/study_scenes.h"
#include "src/bake.h"

namespace clume::bench {
namespace {

/// The one with the least variance × time.
const Measured* best_of(const std::vector<Measured>& all) {
    const Measured* best = nullptr;
    for (const Measured& m : all)
        if (m.ok() && (!best || m.inverse_efficiency() < best->inverse_efficiency())) best = &m;
    return best;
}

}  // namespace

void study_baked(Session& session, const Report& report) {
    if (!session.wants("baked")) return;
    const std::atomic<bool> stop{false};
    Plot error{"A mixture's own grid: error that no number of samples removes", "voxels along the longest axis", "RMS over pixels (% of the mean)"};
    Table csv{{"scene", "medium", "pair", "cpu_us", "variance", "inverse_efficiency", "rms_bias_percent", "bias_percent", "bias_error_percent", "device_bytes"}},
        table{{"scene", "medium", "fastest", "µs per path", "variance × time", "RMS bias, %", "bias of the mean, %", "MB on the device", "the mixture is faster below RMS, %"}};
    for (const char* name : {"plume", "smoke_close"}) {
        Scene mixture = study_file(name);
        for (EllipsoidMedium& m : mixture.media)
            for (Primitive& p : m.primitives) p.albedo = glm::dvec3(0.9);  // a grid has one for all
        const auto pairs = methods({"delta:tree/analytic", "delta:tree/ratio", "delta:tree/residual-ratio"});
        MeasureOptions options = study_options(session, 24);
        double exact_efficiency = 0;
        // Squared error of a pixel after T processor seconds: the mixture's is E/T, the grid's bias² + e/T. They cross at E/T = bias² E/(E − e).
        const auto crossing = [&](double efficiency, double rms) {
            if (efficiency >= exact_efficiency) return std::string("any");
            return rms > 0 ? figure(100 * rms * std::sqrt(exact_efficiency / (exact_efficiency - efficiency))) : "below noise";
        };
        const auto put = [&](const std::string& medium, const Measured& m, const Bias* b) {
            const std::vector<std::string> row{name, medium, short_label(m.pair), figure(m.cpu_us)};
            csv.push_back(row);
            for (const double v : {m.variance, m.inverse_efficiency(), b ? 100 * b->rms : 0, b ? 100 * b->mean : 0, b ? 100 * b->mean_error : 0}) csv.back().push_back(figure(v));
            csv.back().push_back(fmt::format("{:.0f}", m.device_bytes));
            table.push_back(row);
            table.back().push_back(figure(m.inverse_efficiency()));
            table.back().push_back(b ? (b->rms > 0 ? figure(100 * b->rms) : "below noise") : "0");
            table.back().push_back(b ? fmt::format("{:+.2f} ± {:.2f}", 100 * b->mean, 100 * b->mean_error) : "0");
            table.back().push_back(fmt::format("{:.2f}", m.device_bytes / 1e6));
            table.back().push_back(b ? crossing(m.inverse_efficiency(), b->rms) : "–");
            session.record(fmt::format("baked/{}/{}", name, medium), fmt::format("baked {}", fmt::join(table.back(), "  ")),
                           {{"cpu_us", m.cpu_us}, {"inverse_efficiency", m.inverse_efficiency()}, {"bytes", m.device_bytes}, {"rms_bias", b ? b->rms : 0}});
        };
        const std::vector<Measured> exact = measure(session, mixture, pairs, options);
        const Measured truth = pooled(exact);
        if (!best_of(exact)) continue;
        exact_efficiency = best_of(exact)->inverse_efficiency();
        put("mixture", *best_of(exact), nullptr);
        error.series.push_back({name, {}});
        for (const int resolution : {16, 32, 64, 128, 256}) {
            if (session.options().quick && resolution > 64) break;
            Scene scene = mixture;
            GridMedium grid;
            grid.density = *bake(mixture, resolution, [](double) {}, stop);
            grid.phase = mixture.media[0].phase;
            grid.albedo = glm::dvec3(0.9);
            scene.media.clear();
            scene.grids.push_back(std::move(grid));
            options.seed += 10;
            const std::vector<Measured> all = measure(session, scene, pairs, options);
            const Measured* best = best_of(all);
            if (!best) continue;
            const Bias b = bias_of(pooled(all), truth);
            put(fmt::format("grid {}", resolution), *best, &b);
            error.series.back().points.emplace_back(resolution, 100 * b.rms);
        }
    }
    report.csv("baked", csv);
    report.plot("baked", error);
    report.table("baked", table);
}

}  // namespace clume::bench
