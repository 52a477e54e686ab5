// SPDX-License-Identifier: MIT
// What leaving out unused features buys: `close` under the program made for it, under programs that carry one more feature
// each, and under the one that carries everything. All render the same image; rounds are interleaved.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>

#include "bench/scenes.h"
#include "bench/sections.h"
#include "src/device_camera.h"
#include "src/device_renderer.h"
#include "src/device_scene.h"

namespace clume::bench {
namespace {

using Defines = std::vector<std::pair<const char*, const char*>>;

struct Variant {
    const char* name;
    Defines defines;  ///< in place of the scene's own
};

const std::vector<Variant>& variants() {
    static const std::vector<Variant> all{
        {"as_specialised", {}},
        {"kernel_families", {{"CLUME_FAMILIES", "7"}, {"CLUME_ONE_MEDIUM", "0"}}},
        {"phase_functions", {{"CLUME_PHASES", "7"}, {"CLUME_ONE_MEDIUM", "0"}}},
        {"g_per_primitive", {{"CLUME_PHASES", "2"}, {"CLUME_UNIFORM_G", "0"}}},
        {"albedo_per_primitive", {{"CLUME_UNIFORM_ALBEDO", "0"}}},
        {"emission", {{"CLUME_EMISSION", "2"}}},
        {"light_kinds", {{"CLUME_LIGHTS", "127"}}},
        {"next_event", {{"CLUME_LIGHTS", "127"}, {"CLUME_NEE", "126"}}},
        {"rgb", {{"CLUME_CHANNELS", "3"}}},
        {"everything",
         {{"CLUME_FAMILIES", "7"}, {"CLUME_ONE_MEDIUM", "0"}, {"CLUME_PHASES", "7"}, {"CLUME_UNIFORM_G", "0"}, {"CLUME_UNIFORM_ALBEDO", "0"}, {"CLUME_EMISSION", "2"},
          {"CLUME_LIGHTS", "127"}, {"CLUME_NEE", "126"}, {"CLUME_LAMPS", "1"}, {"CLUME_CHANNELS", "3"}, {"CLUME_VISIBLE_BACKGROUND", "1"}, {"CLUME_DEPTH_LIMIT", "1"}}}};
    return all;
}

device::float4 row(const glm::dvec3& v, float w) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), w}; }

/// The scene with the variant's defines, and what a program that looks things up per primitive looks up.
DeviceScene with_defines(const Scene& scene, DeviceScene device, const Defines& defines) {
    for (const auto& [name, value] : defines)
        for (auto& [key, old] : device.defines)
            if (key == name) old = value;
    device.shading.clear();
    for (std::size_t m = 0; m < scene.media.size(); ++m)
        for (const Primitive& p : scene.media[m].primitives) {
            const auto medium = static_cast<std::uint32_t>(m);
            float bits;
            std::memcpy(&bits, &medium, sizeof bits);
            device.shading.push_back(row(p.albedo, p.has_g ? p.g : static_cast<float>(scene.media[m].phase.g)));
            device.shading.push_back(row(p.emission, bits));
        }
    return device;
}

struct Run {
    const Variant* variant;
    std::unique_ptr<FilmSums> film;
    std::unique_ptr<DeviceRenderer> renderer;
    double compile_s = 0;
    std::vector<double> mpaths_s;
};

double seconds_since(std::chrono::steady_clock::time_point t) { return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count(); }

}  // namespace

void bench_specialisation_section(Session& session) {
    session.section("specialisation",
                    "An item is a path of `close`. Each line adds one feature that the scene does not use to the program made for it.\n"
                    "compile: seconds until the program runs (the driver's cache may have it already).\n" +
                        fmt::format("{:22} {:>9} {:>9} {:>9}", "", "Mpaths/s", "relative", "compile"));
    std::vector<const Variant*> wanted;
    for (const Variant& v : variants())
        if (session.wants(v.name)) wanted.push_back(&v);
    if (wanted.empty()) return;
    if (wanted.front() != &variants().front()) wanted.insert(wanted.begin(), &variants().front());  // the yardstick

    const Scene scene = bench_scene("close");
    const DeviceScene device = make_device_scene(scene, session.render_options());
    const auto pixels = active_pixels(scene, device, {0, 0, scene.film.width, scene.film.height});
    const std::vector<Tile> tiles{{0, static_cast<std::uint32_t>(pixels.size())}};
    const double film_pixels = static_cast<double>(scene.film.width) * scene.film.height;
    std::vector<Run> runs;
    for (const Variant* v : wanted) {
        Run& run = runs.emplace_back();
        run.variant = v;
        DeviceScene changed = with_defines(scene, device, v->defines);
        const bool grey = std::find(changed.defines.begin(), changed.defines.end(), std::pair<std::string, std::string>("CLUME_CHANNELS", "1")) != changed.defines.end();
        run.film = std::make_unique<FilmSums>(pixels.size(), grey ? 1 : 3, static_cast<double>(changed.params.film_scale));
        const auto start = std::chrono::steady_clock::now();
        run.renderer = std::make_unique<DeviceRenderer>(session.device(), std::make_shared<const DeviceScene>(std::move(changed)), pixels, tiles, session.options().width);
        run.renderer->aim(*run.film, scene.render.seed);
        run.compile_s = seconds_since(start);
    }
    std::uint32_t spp = 4, next = 0;
    for (int round = -2; round < session.rounds(7); ++round) {
        double first_s = 0;
        for (Run& run : runs) {
            const auto start = std::chrono::steady_clock::now();
            run.renderer->run({0, next, next + spp});
            const double seconds = seconds_since(start);
            if (&run == &runs.front()) first_s = seconds;
            if (round >= 0) run.mpaths_s.push_back(film_pixels * spp / seconds / 1e6);
        }
        next += spp;
        if (round < 0) spp = static_cast<std::uint32_t>(std::clamp((session.options().quick ? 0.1 : 0.3) * spp / first_s, 1.0, 4096.0));
    }
    for (const Run& run : runs) {
        std::vector<double> relative;
        for (std::size_t i = 0; i < run.mpaths_s.size(); ++i) relative.push_back(run.mpaths_s[i] / runs.front().mpaths_s[i]);
        session.record(run.variant->name, fmt::format("{:22} {:9.3f} {:9.3f} {:9.2f}", run.variant->name, median(run.mpaths_s), median(relative), run.compile_s),
                       {{"mpaths_s", median(run.mpaths_s)}, {"relative", median(relative)}, {"compile_s", run.compile_s}});
    }
}

}  // namespace clume::bench
