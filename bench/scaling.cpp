// SPDX-License-Identifier: MIT
// How cost grows: the benchmark ball with more and more primitives at constant overlap (their size shrinks) and constant
// optical depth, then with a constant number at more and more overlap (their size grows, their density falls).
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include "bench/sections.h"
#include "src/device_camera.h"
#include "src/device_renderer.h"
#include "src/device_scene.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {
namespace {

double seconds_since(std::chrono::steady_clock::time_point t) { return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count(); }

struct Point {
    double primitives, us_per_path;
};

/// Supports over a point, mean over the unit ball that holds the centres, as if none reached out of it.
double overlap_of(const Scene& ball) {
    double volume = 0;
    for (const EllipsoidMedium& m : ball.media)
        for (const Primitive& p : m.primitives) volume += std::pow(m.extent, 3) * std::abs(glm::determinant(p.axes));
    return volume;
}

/// Measures one ball, prints its line; µs per path.
Point measure(Session& session, const std::string& item, Scene scene) {
    if (!session.options().strategy.empty()) scene.render.strategy = session.options().strategy;
    std::vector<double> build_s, cpu_s;
    DeviceScene device;
    const auto begin = std::chrono::steady_clock::now();
    do {
        device = {};  // one at a time in memory
        const std::clock_t cpu = std::clock();
        device = make_device_scene(scene, session.render_options());
        cpu_s.push_back(static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC);
        build_s.push_back(device.accelerator_s);
    } while (build_s.size() < 3 && seconds_since(begin) < 5 && !session.options().quick);
    const auto primitives = static_cast<double>(device.ellipsoids.size()), bytes = static_cast<double>(device.byte_size());
    const auto pixels = active_pixels(scene, device, {0, 0, scene.film.width, scene.film.height});
    const std::vector<Tile> tiles{{0, static_cast<std::uint32_t>(pixels.size())}};
    FilmSums film(pixels.size(), 1, static_cast<double>(device.params.film_scale));
    DeviceRenderer renderer(session.device(), std::make_shared<const DeviceScene>(std::move(device)), pixels, tiles, session.options().width);
    renderer.aim(film, scene.render.seed);
    std::uint32_t spp = 1, next = 0;
    std::vector<double> us;
    for (int round = -2; round < session.rounds(7); ++round) {
        const auto start = std::chrono::steady_clock::now();
        renderer.run({0, next, next + spp});
        const double seconds = seconds_since(start);
        next += spp;
        if (round < 0) spp = static_cast<std::uint32_t>(std::clamp((session.options().quick ? 0.1 : 0.4) * spp / seconds, 1.0, 4096.0));
        else us.push_back(1e6 * seconds / (static_cast<double>(pixels.size()) * spp));
    }
    session.record(item, fmt::format("{:12} {:10.0f} {:9.3f} {:9.3f} {:9.1f} {:9.0f} {:10.3f}", item, primitives, median(build_s), median(cpu_s), bytes / 1e6, bytes / primitives, median(us)),
                   {{"primitives", primitives}, {"build_s", median(build_s)}, {"prepare_cpu_s", median(cpu_s)}, {"device_bytes", bytes}, {"us_per_path", median(us)}});
    return {primitives, median(us)};
}

}  // namespace

void bench_scaling_section(Session& session) {
    session.section("scaling",
                    "An item is a path through the film's pixels that see the ball. count_*: more primitives at constant overlap and optical\n"
                    "depth; overlap_*: 16,384 primitives, so many supports over a point at constant optical depth. build: the accelerator,\n"
                    "wall clock; cpu: processor seconds of the whole preparation.\n" +
                        fmt::format("{:12} {:>10} {:>9} {:>9} {:>9} {:>9} {:>10}", "", "primitives", "build s", "cpu s", "MB", "bytes/pr.", "us/path"));
    std::vector<Point> points;
    for (const auto& [name, count] : {std::pair{"count_1k", 1000u}, {"count_10k", 10000u}, {"count_100k", 100000u}, {"count_1M", 1000000u}, {"count_10M", 10000000u}})
        if (session.wants(name)) points.push_back(measure(session, name, reference::ball_scene_n(count)));
    if (points.size() > 1) {
        const Point &a = points.front(), &b = points.back();
        session.note(fmt::format("cost of a path grows as primitives^{:.2f} from {:.0f} to {:.0f}", std::log(b.us_per_path / a.us_per_path) / std::log(b.primitives / a.primitives),
                                 a.primitives, b.primitives));
    }
    for (const auto& [name, overlap] : {std::pair{"overlap_1", 1.0}, {"overlap_4", 4.0}, {"overlap_16", 16.0}, {"overlap_64", 64.0}, {"overlap_256", 256.0}})
        if (session.wants(name)) {
            Scene scene = reference::ball_scene();
            const double factor = overlap / overlap_of(scene);
            for (EllipsoidMedium& m : scene.media)
                for (Primitive& p : m.primitives) {
                    p.axes *= std::cbrt(factor);
                    p.sigma_t /= factor;
                }
            measure(session, name, std::move(scene));
        }
}

}  // namespace clume::bench
