// SPDX-License-Identifier: MIT
#include "bench/kernels.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>

#include "bench/rays.h"
#include "bench/scenes.h"
#include "bench/sections.h"

namespace clume::bench {
namespace {

std::vector<std::string> registered;  // names, in order

/// Hands the medians over the repetitions to the session: at once, or at the end in the order registered.
class Reporter : public benchmark::BenchmarkReporter {
public:
    Reporter(Session& session, bool at_once) : session_(session), at_once_(at_once) {}
    bool ReportContext(const Context&) override { return true; }
    void ReportRuns(const std::vector<Run>& runs) override {
        for (const Run& run : runs) {
            if (run.run_type != Run::RT_Iteration) continue;
            Rates& r = rates_[run.run_name.function_name];
            r.mega.push_back(run.counters.at("items_per_second") / 1e6);
            r.work = run.counters.at("work");
            if (at_once_ && r.mega.size() == static_cast<std::size_t>(run.repetitions)) record(run.run_name.function_name, r);
        }
    }
    void Finalize() override {
        if (at_once_) return;
        for (const std::string& name : registered)
            if (const auto r = rates_.find(name); r != rates_.end()) record(name, r->second);
    }

private:
    struct Rates {
        std::vector<double> mega;
        double work = 0;
    };
    Session& session_;
    bool at_once_;
    std::map<std::string, Rates> rates_;

    void record(const std::string& name, const Rates& r) {
        const auto [low, high] = std::minmax_element(r.mega.begin(), r.mega.end());
        const std::string work = r.work > 0 ? fmt::format("{:10.2f}", r.work) : "";
        session_.record(name, fmt::format("{:46} {:10.3f} {:9.3f} {:9.3f} {}", name, median(r.mega), *low, *high, work),
                        {{"mitems_s", median(r.mega)}, {"lowest", *low}, {"highest", *high}, {"work_per_item", r.work}});
    }
};

/// A scene as one strategy and accelerator see it, and its probe at one width. Only the last one asked for is kept.
struct Field {
    Scene scene;
    DeviceScene device;
    std::unique_ptr<Probe> probe;
    std::vector<ProbeRay> camera, inside;
    std::optional<double> work[2];  ///< per flight from the camera, from inside
};

/// Work per flight, by a program that counts: an untimed run of its own. Every width does the same work.
double work_per_flight(Session& session, Field& f, bool inside, const std::string& accelerator) {
    std::optional<double>& work = f.work[inside];
    if (!work) {
        RenderOptions options = session.render_options();
        options.accelerator = accelerator;
        options.count_work = true;
        const auto& rays = inside ? f.inside : f.camera;
        double sum = 0;
        for (const ProbeHit& hit : Probe(session.device(), make_device_scene(f.scene, options)).flights(rays).values) sum += hit.work;
        work = sum / static_cast<double>(rays.size());
    }
    return *work;
}

Field& field(Session& session, const std::string& scene, const std::string& strategy, const std::string& accelerator, int width) {
    static std::string scene_key, probe_key;
    static Field f;
    const std::string wanted = scene + ' ' + strategy + ' ' + accelerator;
    if (wanted != scene_key) {
        f = {};
        f.scene = bench_scene(scene);
        f.scene.render.strategy = strategy;
        RenderOptions options = session.render_options();
        options.accelerator = accelerator;
        f.device = make_device_scene(f.scene, options);
        scene_key = wanted;
        probe_key.clear();
    }
    if (const std::string key = wanted + ' ' + std::to_string(width); key != probe_key) {
        f.probe.reset();
        f.probe = std::make_unique<Probe>(session.device(), f.device, width);
        // One primitive at a time is slow: fewer rays do.
        f.camera = camera_rays(*f.probe, f.scene.film.width, f.scene.film.height, width == 1 ? 4 : 2, 0);
        f.inside = inside_rays(f.device, f.camera.size(), 1);
        probe_key = key;
    }
    return f;
}

void run(benchmark::State& state, const std::function<Launch(std::uint32_t)>& launch) {
    std::uint32_t number = 0;
    double items = 0, work = 0;
    for (auto _ : state) {
        const Launch l = launch(number++);
        state.SetIterationTime(l.device_s);
        items += l.items;
        work = l.work_per_item;
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(items));
    state.counters["work"] = work;
}

/// `shuffled`: repetitions of all benchmarks in random order, so that a disturbance does not hit one of them alone.
void run_registered(Session& session, bool shuffled) {
    if (!registered.empty()) {
        std::string name = "clume bench", flag = fmt::format("--benchmark_enable_random_interleaving={}", shuffled);
        char* arguments[] = {name.data(), flag.data(), nullptr};
        int count = 2;
        benchmark::Initialize(&count, arguments);
        Reporter reporter(session, !shuffled);
        benchmark::RunSpecifiedBenchmarks(&reporter, ".");
    }
    benchmark::ClearRegisteredBenchmarks();
    registered.clear();
}

}  // namespace

std::vector<int> kernel_widths(const Session& session) {
    if (session.options().width > 0) return {session.options().width};
    return {16, 8, 4, 1};
}

void add_kernel_benchmark(Session& session, const std::string& item, std::function<Launch(std::uint32_t)> launch) {
    if (!session.wants(item)) return;
    benchmark::RegisterBenchmark(item.c_str(), run, std::move(launch))
        ->UseManualTime()
        ->MinTime(session.options().quick ? 0.02 : 0.05)
        ->Repetitions(session.rounds(5));
    registered.push_back(item);
}

void add_ray_benchmarks(Session& session) {
    struct Method {
        const char *strategy, *accelerator, *flight, *transmittance;  ///< names; null: not measured
    };
    static constexpr Method methods[] = {{"delta", "cells", "delta", nullptr},
                                         {"decomposition", "cells", "decomposition_cells", "analytic_cells"},
                                         {"decomposition", "bvh", "decomposition_bvh", "analytic_bvh"}};
    for (const char* scene : {"ball", "close"})
        for (const Method& m : methods)
            for (const int width : kernel_widths(session)) {
                // Null collisions look at one primitive at a time: the width changes nothing.
                if (m.transmittance == nullptr && width != kernel_widths(session).front()) continue;
                for (const bool inside : {true, false}) {
                    const char* from = inside ? "inside" : "camera";
                    const std::string suffix = m.transmittance ? fmt::format("/w{}", width) : "";
                    add_kernel_benchmark(session, fmt::format("flight/{}/{}/{}{}", scene, m.flight, from, suffix), [=, &session](std::uint32_t number) {
                        Field& f = field(session, scene, m.strategy, m.accelerator, width);
                        const auto& rays = inside ? f.inside : f.camera;
                        const auto result = f.probe->flights(rays, number);
                        return Launch{static_cast<double>(rays.size()), result.device_s, work_per_flight(session, f, inside, m.accelerator)};
                    });
                    if (!m.transmittance) continue;
                    add_kernel_benchmark(session, fmt::format("transmittance/{}/{}/{}{}", scene, m.transmittance, from, suffix), [=, &session](std::uint32_t) {
                        Field& f = field(session, scene, m.strategy, m.accelerator, width);
                        const auto& rays = inside ? f.inside : f.camera;
                        return Launch{static_cast<double>(rays.size()), f.probe->transmittances(rays).device_s, 0};
                    });
                }
            }
}

void bench_kernels_section(Session& session) {
    session.section("kernels",
                    "flight, transmittance: an item is a ray, from inside (uniform in the inscribed ball, uniform directions) or from the\n"
                    "camera (every other pixel of the whole film, every fourth at w1: coherent); work: groups of 16 evaluated per flight,\n"
                    "for delta tentative collisions. group: an item is one ray against one primitive, all in the cache. wN: primitives per\n"
                    "vector. Device time, medians; `highest` is the least disturbed.\n" +
                        fmt::format("{:46} {:>10} {:>9} {:>9} {:>10}", "", "Mitems/s", "lowest", "highest", "work"));
    add_ray_benchmarks(session);
    run_registered(session, false);
    add_group_benchmarks(session);
    run_registered(session, true);
}

}  // namespace clume::bench
