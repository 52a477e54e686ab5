// SPDX-License-Identifier: MIT
// Random numbers spread evenly over a pixel's samples (render.sampler) beside independent ones: images of as many samples by
// both, in turns, of a different seed each. Noise is how a pixel's value spreads over the seeds: what an image says of its own
// variance takes its samples for independent.
#include <fmt/format.h>

#include <vector>

#include "bench/measure.h"
#include "bench/scenes.h"
#include "bench/sections.h"

namespace clume::bench {
namespace {

struct Side {
    Renderer renderer;
    std::vector<double> seconds{}, sum{}, squares{};

    void round(std::uint64_t seed, std::uint32_t spp, bool on_cpu) {
        Accumulation film = renderer.start(seed);
        renderer.extend(film, spp);
        const RenderResult r = renderer.result(film);
        seconds.push_back(seconds_of(r.stats, on_cpu));
        sum.resize(r.image.rgb.size());
        squares.resize(r.image.rgb.size());
        for (std::size_t i = 0; i < sum.size(); ++i) {
            const auto v = static_cast<double>(r.image.rgb[i]);
            sum[i] += v;
            squares[i] += v * v;
        }
    }
    /// Of an image's pixel, on average.
    double variance() const {
        const auto n = static_cast<double>(seconds.size());
        double all = 0;
        for (std::size_t i = 0; i < sum.size(); ++i) all += (squares[i] - sum[i] * sum[i] / n) / (n - 1);
        return all / static_cast<double>(sum.size());
    }
};

void measure(Session& session, const std::string& scene_name, std::uint32_t spp) {
    const std::string name = fmt::format("{}/{}", scene_name, spp);
    if (!session.wants(name)) return;
    Scene scene = bench_scene(scene_name);
    scene.render.strategy = session.options().strategy.empty() ? "delta" : session.options().strategy;
    scene.render.transmittance = "binary";
    if (session.options().quick) scene.film = {64, 64};
    const Scene independent_scene = scene;
    scene.render.sobol = true;
    Side even{Renderer(scene, session.render_options())}, independent{Renderer(independent_scene, session.render_options())};
    const int rounds = std::max(2, session.rounds(15));
    const bool on_cpu = session.device().type == "cpu";
    for (int k = 0; k < rounds; ++k) {
        even.round(2 * static_cast<std::uint64_t>(k), spp, on_cpu);
        independent.round(2 * static_cast<std::uint64_t>(k) + 1, spp, on_cpu);
    }
    std::vector<double> times;
    for (std::size_t k = 0; k < even.seconds.size(); ++k) times.push_back(even.seconds[k] / independent.seconds[k]);
    const double time = median(times), noise = independent.variance() / even.variance();
    session.record(name, fmt::format("{:12} {:12.4g} {:12.4g} {:9.2f} {:7.2f} {:10.2f}", name, independent.variance() * spp, even.variance() * spp, noise, time, noise / time),
                   {{"spp", static_cast<double>(spp)}, {"independent_variance", independent.variance() * spp}, {"variance", even.variance() * spp}, {"noise", noise}, {"time", time}, {"efficiency", noise / time}});
}

}  // namespace

void bench_samplers_section(Session& session) {
    session.section("samplers",
                    "render.sampler: sobol against independent. Variance of a pixel over the seeds, times samples; noise: independent over sobol;\n"
                    "time: sobol over independent, of the processor on CPUs; efficiency: variance x time, independent over sobol.\n" +
                        fmt::format("{:12} {:>12} {:>12} {:>9} {:>7} {:>10}", "scene/spp", "independent", "sobol", "noise", "time", "efficiency"));
    for (const char* scene : {"wide", "close", "dense", "point"})
        for (const std::uint32_t spp : {16u, 256u}) measure(session, scene, spp);
}

}  // namespace clume::bench
