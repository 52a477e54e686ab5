// SPDX-License-Identifier: MIT
// What --noise-threshold saves: the bundled pictures at a third of their size, by a threshold and with as many samples for every
// pixel as that took on average, in turns. Time for equal error follows from variance falling as 1 / time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "bench/measure.h"
#include "bench/sections.h"
#include "src/adaptive.h"
#include "src/device_camera.h"
#include "src/device_scene.h"
#include "src/scene_reader.h"

namespace clume::bench {
namespace {

struct Errors {
    double worst = 0, rms = 0;
};

/// The film's squares, by the pixels that aren't empty.
struct Squares {
    std::vector<device::uint> pixels;
    std::vector<NoiseTile> tiles;
    int width;

    Squares(const Scene& scene, const RenderOptions& options) : width(scene.film.width) {
        const CropWindow window{0, 0, scene.film.width, scene.film.height};
        pixels = active_pixels(scene, make_device_scene(scene, options), window);
        tiles = noise_tiles(pixels, width, window);
    }

    /// Of the squares' errors, as --noise-threshold defines them, the largest and the root mean square.
    Errors errors(const RenderImage& image) const {
        std::vector<TileNoise> noise;
        for (const NoiseTile& t : tiles) {
            TileNoise n{0, 0, 0, 2};  // the variance is the mean's: as if of one of two samples
            for (std::uint32_t k = t.first; k < t.first + t.count; ++k)
                for (std::size_t c = 0; c < 3; ++c) {
                    n.mean += static_cast<double>(image.rgb[3 * pixels[k] + c]) / (3.0 * t.count);
                    n.variance += 2 * static_cast<double>(image.variance[3 * pixels[k] + c]) / (3.0 * t.count);
                }
            noise.push_back(n);
        }
        Errors e;
        for (const double error : relative_errors(tiles, noise)) {
            e.worst = std::max(e.worst, error);
            e.rms += error * error / static_cast<double>(tiles.size());
        }
        e.rms = std::sqrt(e.rms);
        return e;
    }
};

struct Side {
    std::vector<double> seconds, worst, rms;
    void add(const RenderResult& r, const Errors& e, bool on_cpu) {
        seconds.push_back(seconds_of(r.stats, on_cpu));
        worst.push_back(e.worst);
        rms.push_back(e.rms);
    }
};

void measure(Session& session, const std::string& name) {
    Scene scene = read_scene(std::filesystem::path(CLUME_SCENES_DIR) / (name + ".json"));
    scene.film.width /= 3;
    scene.film.height /= 3;
    const double threshold = session.options().quick ? 0.2 : 0.1;
    constexpr std::uint32_t most = 8192;
    RenderOptions options = session.render_options();
    const Squares squares(scene, options);
    Renderer uniform(scene, options);
    options.noise_threshold = threshold;
    Renderer adaptive(scene, options);
    const auto render = [](Renderer& renderer, std::uint64_t seed, std::uint32_t spp) {
        Accumulation film = renderer.start(seed);
        renderer.extend(film, spp);
        return renderer.result(film);
    };
    Side own, other;
    std::vector<double> mean, least, largest, pilot, by_worst, by_rms;
    const int rounds = session.rounds(7);
    const bool on_cpu = session.device().type == "cpu";
    for (int round = 0; round < rounds; ++round) {
        const auto seed = 2 * static_cast<std::uint64_t>(round);
        const RenderResult r = render(adaptive, seed, most);
        const NoiseStats& noise = r.stats.noise.value();
        const double all = static_cast<double>(noise.paths + noise.pilot_paths) / adaptive.rendered_pixels();
        own.add(r, squares.errors(r.image), on_cpu);
        const RenderResult u = render(uniform, seed + 1, std::max(2u, static_cast<std::uint32_t>(std::lround(all))));
        other.add(u, squares.errors(u.image), on_cpu);
        mean.push_back(r.stats.samples_mean);
        least.push_back(r.stats.samples_min);
        largest.push_back(r.stats.samples_max);
        pilot.push_back(100 * static_cast<double>(noise.pilot_paths) / static_cast<double>(noise.paths + noise.pilot_paths));
        const double time = other.seconds.back() / own.seconds.back();
        by_worst.push_back(time * std::pow(other.worst.back() / own.worst.back(), 2));
        by_rms.push_back(time * std::pow(other.rms.back() / own.rms.back(), 2));
    }
    session.record(name,
                   fmt::format("{:6} {:6g} {:6.0f} {:6.0f} {:6.0f} {:5.1f} % {:8.2f} {:7.3f} {:7.3f} {:9.2f} {:7.3f} {:7.3f} {:8.2f} {:6.2f}", name, threshold, median(least), median(mean), median(largest),
                               median(pilot), median(own.seconds), median(own.worst), median(own.rms), median(other.seconds), median(other.worst), median(other.rms), median(by_worst), median(by_rms)),
                   {{"threshold", threshold},
                    {"samples_min", median(least)},
                    {"samples_mean", median(mean)},
                    {"samples_max", median(largest)},
                    {"pilot_percent", median(pilot)},
                    {"adaptive_s", median(own.seconds)},
                    {"adaptive_worst", median(own.worst)},
                    {"adaptive_rms", median(own.rms)},
                    {"uniform_s", median(other.seconds)},
                    {"uniform_worst", median(other.worst)},
                    {"uniform_rms", median(other.rms)},
                    {"time_ratio_by_worst", median(by_worst)},
                    {"time_ratio_by_rms", median(by_rms)},
                    {"time_ratio_by_worst_least", *std::min_element(by_worst.begin(), by_worst.end())},
                    {"time_ratio_by_worst_most", *std::max_element(by_worst.begin(), by_worst.end())}});
}

}  // namespace

void bench_adaptive_section(Session& session) {
    session.section("adaptive",
                    "--noise-threshold against as many samples for every pixel, a third of the film's size. Errors are standard errors over the mean,\n"
                    "of squares of 16 x 16 pixels: the largest, and the root mean square. s: processor seconds on CPUs. saved: uniform time over\nadaptive time, the pilot's included, at equal error.\n" +
                        fmt::format("{:6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>8} {:>7} {:>7} {:>9} {:>7} {:>7} {:>8} {:>6}", "", "thresh", "least", "mean", "most", "pilot", "adapt. s", "worst", "rms", "uniform s",
                                    "worst", "rms", "saved: w", "rms"));
    for (const char* name : {"plume", "fire", "cloud"})
        if (session.wants(name)) measure(session, name);
}

}  // namespace clume::bench
