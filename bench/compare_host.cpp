// SPDX-License-Identifier: MIT
#include "bench/compare_host.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <memory>

#include "bench/scenes.h"
#include "src/renderer.h"
#include "tests/reference/host_tracer.h"

namespace clume {
namespace {

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    const std::size_t n = v.size();
    return n % 2 ? v[n / 2] : 0.5 * (v[n / 2 - 1] + v[n / 2]);
}

/// Mean over pixels and channels of the variance of one sample.
template <class T>
double sample_variance(const std::vector<T>& variance_of_mean, double spp) {
    double sum = 0;
    for (const T v : variance_of_mean) sum += static_cast<double>(v);
    return sum / static_cast<double>(variance_of_mean.size()) * spp;
}

struct Measured {
    std::vector<double> mpaths_s, variance, cost;  ///< cost: variance of a sample × seconds per path of the film [1e-6]
    void add(double paths, double seconds, double v) {
        mpaths_s.push_back(paths / seconds / 1e6);
        variance.push_back(v);
        cost.push_back(v * seconds / paths * 1e6);
    }
};

}  // namespace

void compare_with_host(const HostComparison& options) {
    fmt::print("{:8} {:>5} {:>12} {:>12} {:>7} {:>12} {:>12} {:>12}\n", "scene", "cells", "host Mp/s", "clume Mp/s", "ratio", "host var", "clume var", "efficiency");
    for (auto& [name, scene, spp] : bench_scenes()) {
        if (name.find(options.filter) == std::string::npos) continue;
        if (!options.strategy.empty()) scene.render.strategy = options.strategy;
        const int cells = reference::best_cell_resolution(scene);
        const reference::HostTracer host(scene, cells);
        RenderOptions o;
        if (!options.device.empty()) o.devices = {options.device};
        o.vector_width = options.vector_width;
        o.accelerator = options.accelerator;
        const std::atomic<bool> stop{false};
        Measured theirs, ours;
        // Variance of rare bright paths settles slowly: it is taken over all rounds.
        for (int round = 0; round <= options.rounds; ++round) {
            const auto image = host.trace(spp, static_cast<std::uint64_t>(round));
            scene.render.seed = static_cast<std::uint64_t>(round) + 1000;
            scene.render.spp = 4 * spp;
            const RenderResult r = render(scene, o, {}, stop);
            if (round == 0) continue;  // warm-up
            theirs.add(static_cast<double>(image.paths), image.seconds, sample_variance(image.variance, spp));
            ours.add(static_cast<double>(r.stats.paths), r.stats.render_s, sample_variance(r.image.variance, 4 * spp));
        }
        fmt::print("{:8} {:5} {:12.3f} {:12.3f} {:7.2f} {:12.5g} {:12.5g} {:12.2f}\n", name, cells, median(theirs.mpaths_s), median(ours.mpaths_s),
                   median(ours.mpaths_s) / median(theirs.mpaths_s), median(theirs.variance), median(ours.variance), median(theirs.cost) / median(ours.cost));
        std::fflush(stdout);
    }
}

}  // namespace clume
