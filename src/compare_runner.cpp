// SPDX-License-Identifier: MIT
#include "src/compare_runner.h"

#include <algorithm>

#include "src/error.h"

namespace clume {

ComparePlan::ComparePlan(const std::function<void(const Progress&)>& progress, const std::atomic<bool>& stop)
    : progress_(progress), stop_(stop), start_(std::chrono::steady_clock::now()) {}

bool ComparePlan::extend(Renderer& renderer, Accumulation& film, std::uint32_t end, double seconds, const std::string& what) {
    RunControl control;
    control.stop = &stop_;
    std::uint64_t paths = 0;
    control.progress = [&](const Progress& p) {
        paths = p.paths_done;
        if (!progress_) return;
        const double share = static_cast<double>(p.paths_done) / static_cast<double>(std::max<std::uint64_t>(1, p.paths_total));
        const double part = total_s_ > 0 ? std::clamp((done_s_ + share * seconds) / total_s_, 0.0, 1.0) : 0;
        Progress all;
        all.what = what;
        all.elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
        all.paths_done = paths_ + paths;
        // As many as there will be at this rate, so that the time left comes out.
        all.paths_total = part > 0 ? static_cast<std::uint64_t>(static_cast<double>(all.paths_done) / part) : 0;
        all.mpaths_s = all.elapsed_s > 0 ? static_cast<double>(all.paths_done) / all.elapsed_s / 1e6 : 0;
        progress_(all);
    };
    renderer.extend(film, end, control);
    paths_ += paths;
    done_s_ += seconds;
    if (film.complete()) return true;
    if (!stopped()) throw RenderError("no device was left before the end");
    return false;
}

ReadyPair make_ready(const Scene& scene, const MethodPair& pair, const RenderOptions& options) {
    RenderOptions own = options;
    own.pair = pair;
    return {pair, std::make_unique<Renderer>(scene, own)};
}

void run_pilot(ReadyPair& ready, const Scene& scene, const CompareOptions& options, std::uint32_t spp, ComparePlan& plan, PairRun* run) {
    ReadyPair counting;
    RenderOptions with_counts = options.render;
    with_counts.count_work = true;
    if (run) counting = make_ready(scene, ready.pair, with_counts);
    Renderer& renderer = run ? *counting.renderer : *ready.renderer;
    Accumulation film = renderer.start(scene.render.seed - 1);
    const std::string what = "pilot of " + ready.pair.label();
    bool whole = plan.extend(renderer, film, spp, 0, what);
    // Equal time knows no sample counts: a quick pair gets a longer pilot.
    if (whole && options.time_s && film.render_s() < 0.5) whole = plan.extend(renderer, film, 4 * spp, 0, what);
    if (!whole) return;
    const RenderResult result = renderer.result(film);
    double variance = 0;
    for (const float v : result.image.variance) variance += static_cast<double>(v);
    ready.sample_variance = variance / static_cast<double>(result.image.variance.size()) * film.end();
    ready.sample_s = std::max(1e-6, film.render_s() / film.end());
    if (!run) return;
    const WorkCounts& work = result.stats.work;
    const auto paths = static_cast<double>(result.stats.paths);
    run->density_evals = static_cast<double>(work[WORK_DENSITIES] + work[WORK_PRIMITIVES]) / paths;
    run->primitive_tests = static_cast<double>(16 * work[WORK_GROUPS] + work[WORK_PRIMITIVES] + work[WORK_VOXELS]) / paths;
    for (const std::uint64_t tests : result.image.tests) run->cost.push_back(static_cast<float>(tests) / static_cast<float>(film.end()));
}

std::vector<std::uint32_t> doubling_counts(std::uint32_t most) {
    std::vector<std::uint32_t> counts;
    for (std::uint64_t n = 1; n < most; n *= 2) counts.push_back(static_cast<std::uint32_t>(n));
    counts.push_back(most);
    return counts;
}

}  // namespace clume
