// SPDX-License-Identifier: MIT
// Lights inside a medium: the program that samples what scatters near them on its own (kernels/lamp.cl) beside the same scene's
// program with light sampling at collisions alone. Rounds alternate. The variance of the latter has no limit: what is measured
// is what so many samples happened to meet, and its mean over the rounds is mostly that of the worst one.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>

#include "bench/scenes.h"
#include "bench/sections.h"
#include "src/device_camera.h"
#include "src/device_renderer.h"
#include "src/device_scene.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {
namespace {

Scene smoke(double density_scale, const Phase& phase, bool spot) {
    Scene scene = bench_scene("point");
    scene.film = {128, 128};
    scene.camera.fov_rad = 28 * std::numbers::pi / 180;
    scene.media[0].density_scale = density_scale;
    scene.media[0].phase = phase;
    Light light;
    light.kind = spot ? LightKind::spot : LightKind::point;
    light.position = {0, 0.1, 0};
    light.target = {0.2, 1, 0.3};
    light.intensity = glm::dvec3(1);
    light.beam_rad = 20 * std::numbers::pi / 180;
    light.cutoff_rad = 40 * std::numbers::pi / 180;
    scene.lights = {light};
    return scene;
}

Scene ball() {
    Scene scene = reference::homogeneous_sphere(3, 0.95);
    scene.film = {128, 128};
    Light light;
    light.kind = LightKind::point;
    light.position = {0.13, -0.21, 0.17};
    light.intensity = glm::dvec3(1);
    scene.lights = {light};
    return scene;
}

/// One of the two programs, with what was measured of it: per round.
struct Side {
    double film_scale = 0;
    std::unique_ptr<DeviceRenderer> renderer;
    std::vector<double> path_s, variance;

    Side(Session& session, const Scene& scene, const std::vector<device::uint>& pixels, const std::vector<Tile>& tiles, bool lamps) {
        DeviceScene device = make_device_scene(scene, session.render_options());
        film_scale = static_cast<double>(device.params.film_scale);
        for (auto& [name, value] : device.defines)
            if (name == "CLUME_LAMPS" && !lamps) value = "0";
        renderer = std::make_unique<DeviceRenderer>(session.device(), std::make_shared<const DeviceScene>(std::move(device)), pixels, tiles, session.options().width);
    }
    /// Seconds that it took.
    double round(const std::vector<device::uint>& pixels, std::uint64_t seed, std::uint32_t spp, bool keep) {
        FilmSums film(pixels.size(), 1, film_scale);
        renderer->aim(film, seed);
        const auto start = std::chrono::steady_clock::now();
        renderer->run({0, 0, spp});
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        renderer->commit({0, 0, spp});
        double sum = 0;
        for (std::size_t i = 0; i < pixels.size(); ++i) sum += film.pixel(i).variance[0];
        if (keep) {
            path_s.push_back(seconds / (static_cast<double>(pixels.size()) * spp));
            variance.push_back(sum / static_cast<double>(pixels.size()) * spp);
        }
        return seconds;
    }
};

void compare(Session& session, const std::string& name, Scene scene) {
    scene.render.strategy = session.options().strategy.empty() ? "delta" : session.options().strategy;
    const DeviceScene device = make_device_scene(scene, session.render_options());
    const auto pixels = active_pixels(scene, device, {0, 0, scene.film.width, scene.film.height});
    const std::vector<Tile> tiles{{0, static_cast<std::uint32_t>(pixels.size())}};
    Side with(session, scene, pixels, tiles, true), without(session, scene, pixels, tiles, false);
    std::uint32_t spp = 4;
    const int rounds = session.rounds(7);
    for (int round = -1; round < rounds; ++round) {
        const auto seed = static_cast<std::uint64_t>(round) + 1;
        const double seconds = with.round(pixels, seed, spp, round >= 0);
        without.round(pixels, seed, spp, round >= 0);
        if (round < 0) spp = static_cast<std::uint32_t>(std::clamp((session.options().quick ? 0.1 : 0.5) * spp / seconds, 2.0, 4096.0));
    }
    std::vector<double> time, efficiency;
    for (std::size_t i = 0; i < with.path_s.size(); ++i) {
        time.push_back(with.path_s[i] / without.path_s[i]);
        efficiency.push_back(without.variance[i] / with.variance[i] / time.back());
    }
    const double mean_efficiency = mean(without.variance) / mean(with.variance) / median(time);
    session.record(name,
                   fmt::format("{:14} {:7} {:9.2f} {:11.4g} {:11.4g} {:11.4g} {:11.4g} {:9.2f} {:9.2f}", name, spp, median(time), median(without.variance), mean(without.variance),
                               median(with.variance), mean(with.variance), median(efficiency), mean_efficiency),
                   {{"spp", static_cast<double>(spp)}, {"time", median(time)}, {"plain_variance", median(without.variance)}, {"plain_variance_mean", mean(without.variance)},
                    {"variance", median(with.variance)}, {"variance_mean", mean(with.variance)}, {"efficiency", median(efficiency)}, {"efficiency_mean", mean_efficiency}});
}

}  // namespace

void bench_lamps_section(Session& session) {
    session.section("lamps",
                    "A light inside a medium, sampled at collisions alone (plain), and by one more place near it as well. time: of a path, over\n"
                    "plain; variance of a sample, median and mean over the rounds; efficiency: variance x time of plain over ours, by either.\n" +
                        fmt::format("{:14} {:>7} {:>9} {:>11} {:>11} {:>11} {:>11} {:>9} {:>9}", "", "spp", "time", "plain med", "plain mean", "median", "mean", "eff med", "eff mean"));
    const Phase isotropic, forward{PhaseKind::henyey_greenstein, 0.6};
    if (session.wants("ball")) compare(session, "ball", ball());
    if (session.wants("smoke_thin")) compare(session, "smoke_thin", smoke(2, isotropic, false));
    if (session.wants("smoke")) compare(session, "smoke", smoke(10, isotropic, false));
    if (session.wants("smoke_dense")) compare(session, "smoke_dense", smoke(40, isotropic, false));
    if (session.wants("smoke_forward")) compare(session, "smoke_forward", smoke(10, forward, false));
    if (session.wants("smoke_spot")) compare(session, "smoke_spot", smoke(10, isotropic, true));
}

}  // namespace clume::bench
