// SPDX-License-Identifier: MIT
// Non-negative least squares by cyclic descent on the normal equations: eleven unknowns, so the simplest method will do.
#include "bench/work_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>

#include "bench/sections.h"
#include "bench/study_scenes.h"
#include "src/bake.h"

namespace clume::bench {
namespace {

constexpr std::size_t unknowns = WORK_KINDS + 1;  // the last is a path

/// min |A x − 1|², x ≥ 0.
std::array<double, unknowns> non_negative_fit(std::span<const std::array<double, unknowns>> rows) {
    std::array<std::array<double, unknowns>, unknowns> normal{};
    std::array<double, unknowns> right{}, x{};
    for (const auto& row : rows)
        for (std::size_t i = 0; i < unknowns; ++i) {
            right[i] += row[i];
            for (std::size_t j = 0; j < unknowns; ++j) normal[i][j] += row[i] * row[j];
        }
    for (int step = 0; step < 200000; ++step)
        for (std::size_t i = 0; i < unknowns; ++i) {
            if (normal[i][i] <= 0) continue;
            double residual = right[i];
            for (std::size_t j = 0; j < unknowns; ++j) residual -= normal[i][j] * x[j];
            x[i] = std::max(0.0, x[i] + residual / normal[i][i]);
        }
    return x;
}

}  // namespace

double predicted_ns(const WorkFit& fit, const std::array<double, WORK_KINDS>& work) {
    double ns = fit.path_ns;
    for (std::size_t k = 0; k < WORK_KINDS; ++k) ns += fit.ns[k] * work[k];
    return ns;
}

WorkFit fit_work(std::span<const Measured> measured) {
    std::vector<std::array<double, unknowns>> rows;
    for (const Measured& m : measured) {
        if (!m.ok()) continue;
        std::array<double, unknowns>& row = rows.emplace_back();
        for (std::size_t k = 0; k < WORK_KINDS; ++k) row[k] = m.work[k] / (1000 * m.cpu_us);
        row[WORK_KINDS] = 1 / (1000 * m.cpu_us);
    }
    WorkFit fit;
    const auto x = non_negative_fit(rows);
    std::copy(x.begin(), x.begin() + WORK_KINDS, fit.ns.begin());
    fit.path_ns = x[WORK_KINDS];
    fit.measurements = rows.size();
    std::vector<double> errors;
    for (const Measured& m : measured)
        if (m.ok()) errors.push_back(std::abs(predicted_ns(fit, m.work) / (1000 * m.cpu_us) - 1));
    if (errors.empty()) return fit;
    fit.typical_error = median(errors);
    fit.worst_error = *std::max_element(errors.begin(), errors.end());
    return fit;
}

void bench_work_section(Session& session) {
    session.section("work",
                    "Operations of each kind per path, and what they cost: ns is measured (processor time), fit what the weights make of the\n"
                    "counts. The weights are those of src/work_weights.h.\n" +
                        fmt::format("{:44} {:>9} {:>9}  {}", "", "ns", "fit", fmt::join(work_names, " ")));
    const auto ball = [](std::uint32_t n, double overlap, double depth, bool sun = false) {
        BallSpec spec;
        spec.n = n;
        spec.overlap = overlap;
        spec.depth = depth;
        spec.sun = sun;
        return study_ball(spec);
    };
    const auto voxels = [](int resolution) {
        Scene scene = study_ball({});
        const std::atomic<bool> stop{false};
        GridMedium grid;
        grid.density = *bake(scene, resolution, [](double) {}, stop);
        scene.media.clear();
        scene.grids.push_back(std::move(grid));
        return scene;
    };
    const std::vector<std::string> plain{"delta:tree", "delta:grid", "delta:scene", "decomposition", "regular", "march-analytic", "march", "progressive"};
    const std::vector<std::string> lit{"delta:tree/analytic", "delta:tree/ratio", "delta:tree/residual-ratio", "delta:tree/binary", "decomposition/binary"};
    const std::vector<std::string> grids{"delta:tree", "delta:grid", "regular", "march", "progressive"};
    struct Case {
        const char* name;
        std::function<Scene()> make;
        const std::vector<std::string>* methods;
    };
    const Case cases[] = {{"ball", [&] { return ball(10000, 8, 10); }, &plain},
                          {"overlap_1", [&] { return ball(10000, 1, 10); }, &plain},
                          {"overlap_64", [&] { return ball(10000, 64, 10); }, &plain},
                          {"thin", [&] { return ball(10000, 8, 0.3); }, &plain},
                          {"dense", [&] { return ball(10000, 8, 300); }, &plain},
                          {"few", [&] { return ball(300, 8, 10); }, &plain},
                          {"many", [&] { return ball(100000, 8, 10); }, &plain},
                          {"sun", [&] { return ball(10000, 8, 10, true); }, &lit},
                          {"sun_dense", [&] { return ball(10000, 8, 100, true); }, &lit},
                          {"plume", [&] { return study_file("plume"); }, &lit},
                          {"fire", [&] { return study_file("fire"); }, &plain},
                          {"smoke_close", [&] { return study_file("smoke_close"); }, &plain},
                          {"grid_64", [&] { return voxels(64); }, &grids}};
    std::vector<Measured> all;
    std::vector<std::string> names;
    for (const Case& c : cases) {
        if (!session.wants(c.name)) continue;
        std::vector<MethodPair> pairs;
        for (const std::string& text : *c.methods) pairs.push_back(method(text));
        MeasureOptions options;
        options.count = true;
        options.rounds = session.rounds(3);
        if (session.options().quick) options.round_s = 0.05;
        for (Measured& m : measure(session, c.make(), pairs, options)) {
            if (!m.ok()) {
                session.note(fmt::format("{}/{}: {}", c.name, m.pair.label(), m.missing));
                continue;
            }
            names.push_back(fmt::format("{}/{}", c.name, m.pair.label()));
            all.push_back(std::move(m));
            std::fputc('.', stderr);
        }
        std::fputc('\n', stderr);
    }
    if (all.empty()) return;
    const WorkFit fit = fit_work(all);
    for (std::size_t i = 0; i < all.size(); ++i) {
        Fields fields{{"cpu_ns", 1000 * all[i].cpu_us}, {"fit_ns", predicted_ns(fit, all[i].work)}};
        std::string counts;
        for (std::size_t k = 0; k < WORK_KINDS; ++k) {
            fields.emplace_back(work_names[k], all[i].work[k]);
            counts += fmt::format(" {:.1f}", all[i].work[k]);
        }
        session.record(names[i], fmt::format("{:44} {:9.0f} {:9.0f} {}", names[i], 1000 * all[i].cpu_us, predicted_ns(fit, all[i].work), counts), std::move(fields));
    }
    std::string weights;
    for (std::size_t k = 0; k < WORK_KINDS; ++k) weights += fmt::format("{}{} {:.1f}", k ? ", " : "", work_names[k], fit.ns[k]);
    session.note(fmt::format("ns per operation: {}; per path {:.0f}", weights, fit.path_ns));
    session.note(fmt::format("{} measurements; off by {:.0f} % (median), {:.0f} % at worst", fit.measurements, 100 * fit.typical_error, 100 * fit.worst_error));
}

}  // namespace clume::bench
