// SPDX-License-Identifier: MIT
// What stands behind Renderer and Accumulation: renderer.cpp sets it up and develops images, render_passes.cpp renders.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "src/adaptive.h"
#include "src/device_renderer.h"
#include "src/film.h"
#include "src/renderer.h"

namespace clume {

struct Accumulation::State {
    std::uint64_t seed;
    std::uint32_t begin, end;
    FilmSums film;
    std::vector<DeviceShare> devices{};
    double render_s = 0, cpu_s = 0;
    bool interrupted = false, time_limited = false, device_lost = false;
    std::vector<float> learned{};            ///< bounds of `progressive`; empty before the first pass
    std::vector<float> raised{};             ///< the highest densities found above them by any device
    std::vector<std::uint32_t> counts{};     ///< samples of each noise tile; empty: all that are asked for
    std::uint64_t noise_pilot_paths = 0;     ///< outside the image, by which those were chosen

    bool stopped() const { return interrupted || time_limited || device_lost; }
};

/// What a pass is to render: samples [begin, ends[i]) of tiles[i], ranges of `order`, which lists active pixels.
struct PassWork {
    std::vector<std::uint32_t> order;
    std::vector<Tile> tiles;
    std::vector<std::uint32_t> ends;
};

/// How all passes of a run are watched and ended.
struct PassControl {
    const RunControl& run;
    std::chrono::steady_clock::time_point start;
    const char* what = "";  ///< the pass, to those who watch

    bool stop_asked() const { return run.stop && run.stop->load(); }
    double elapsed_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); }
    bool time_up() const { return run.time_limit_s && elapsed_s() >= *run.time_limit_s; }
};

struct Renderer::Impl {
    Film film;
    glm::dvec3 background{0};
    RenderOptions options;
    CropWindow window;
    RenderStats setup;
    std::vector<device::uint> pixels;
    std::vector<Tile> tiles;
    std::vector<NoiseTile> noise;
    int channels = 3;
    double film_scale = 1;
    std::vector<float> first_bounds;               ///< of `progressive`; empty for other strategies
    std::set<std::string> told_short_of_memory;
    Workers workers;                               ///< DeviceRenderers; a device that fails is dropped for good

    std::uint64_t all_pixels() const {
        return static_cast<std::uint64_t>(window.x1 - window.x0) * static_cast<std::uint64_t>(window.y1 - window.y0);
    }
    void make_workers(const std::vector<DeviceInfo>& devices, const std::shared_ptr<const DeviceScene>& device);

    /// All pixels, or the noise tiles with more than `begin` samples to come, those alike together; `end` at most.
    PassWork work(const std::vector<std::uint32_t>& counts, std::uint32_t begin, std::uint32_t end) const;
    /// Renders `work` from `begin` on into `film`, by all devices; the rest of `a` keeps account.
    void run_pass(Accumulation::State& a, FilmSums& film, PassWork work, std::uint32_t begin, const PassControl& control);
    /// Samples [a.end, end) of all tiles, as far as a.counts lets them.
    void run_to(Accumulation::State& a, std::uint32_t end, const PassControl& control);
    /// The same for `progressive`: passes under bounds that are frozen in each and raised after it.
    void run_learning(Accumulation::State& a, std::uint32_t end, const PassControl& control);
    /// Fills a.counts by a pilot, for an image of at most `most` samples per pixel.
    void choose_counts(Accumulation::State& a, std::uint32_t most, PassControl control);
    /// What became of the threshold, by the image's own variance.
    NoiseStats noise_of(const Accumulation::State& a) const;
    /// Everything that extend() does.
    void run(Accumulation::State& a, std::uint32_t end, const RunControl& control);
};

}  // namespace clume
