// SPDX-License-Identifier: MIT
#include "src/renderer.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fmt/format.h>
#include <memory>
#include <thread>

#include "runtime/device.h"
#include "runtime/error.h"
#include "src/device_camera.h"
#include "src/device_renderer.h"
#include "src/device_scene.h"
#include "src/error.h"
#include "src/film.h"
#include "src/self_test.h"

namespace clume {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

/// Tiles of the active pixels, no larger than keeps all devices busy: small ones for CPUs, large ones for GPUs.
std::vector<Tile> make_tiles(std::size_t pixels, const std::vector<DeviceInfo>& devices) {
    const bool gpu = std::any_of(devices.begin(), devices.end(), [](const DeviceInfo& d) { return d.type == "gpu"; });
    const std::size_t size = gpu ? std::size_t{1} << 18 : std::size_t{1} << 12;
    std::vector<Tile> tiles;
    for (std::size_t first = 0; first < pixels; first += size)
        tiles.push_back({static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(std::min(size, pixels - first))});
    return tiles;
}

/// What a pixel that meets nothing holds: the constant lights that the camera sees.
glm::dvec3 background(const Scene& scene) {
    glm::dvec3 sum(0);
    for (const auto& l : scene.lights)
        if (l.kind == LightKind::constant && l.visible_to_camera) sum += l.radiance;
    return sum;
}

RenderImage develop(const Scene& scene, const CropWindow& w, const std::vector<device::uint>& pixels, const FilmSums& film, std::uint32_t samples, bool count_work) {
    RenderImage image;
    image.film_width = scene.film.width;
    image.film_height = scene.film.height;
    image.window = w;
    const auto width = static_cast<std::size_t>(w.x1 - w.x0), count = width * static_cast<std::size_t>(w.y1 - w.y0);
    image.rgb.resize(3 * count);
    image.alpha.assign(count, 0);
    image.variance.assign(3 * count, 0);
    image.samples.assign(count, samples);
    if (count_work) image.tests.assign(count, 0);
    const glm::dvec3 b = background(scene);
    for (std::size_t i = 0; i < count; ++i)
        for (int c = 0; c < 3; ++c) image.rgb[3 * i + static_cast<std::size_t>(c)] = static_cast<float>(b[c]);
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        const auto x = static_cast<int>(pixels[k] % static_cast<device::uint>(scene.film.width)), y = static_cast<int>(pixels[k] / static_cast<device::uint>(scene.film.width));
        const std::size_t i = static_cast<std::size_t>(x - w.x0) + width * static_cast<std::size_t>(y - w.y0);
        const FilmSums::Pixel p = film.pixel(k);
        for (std::size_t c = 0; c < 3; ++c) {
            image.rgb[3 * i + c] = static_cast<float>(p.mean[c]);
            image.variance[3 * i + c] = static_cast<float>(p.variance[c]);
        }
        image.alpha[i] = static_cast<float>(p.alpha);
        image.samples[i] = p.samples;
        if (count_work) image.tests[i] = p.tests;
    }
    return image;
}

void check_memory(const Scene& scene, const DeviceScene& device, const std::vector<DeviceInfo>& devices) {
    for (const auto& d : devices)
        if (device.byte_size() > d.global_memory || 4 * std::max(device.groups.size(), device.grid_values.size()) > d.max_allocation)
            throw RenderError(fmt::format("{}: the scene needs {:.1f} MB on the device, {} has {:.1f} MB ({:.1f} MB in one buffer)", scene.path,
                                          static_cast<double>(device.byte_size()) / 1e6, d.label(), static_cast<double>(d.global_memory) / 1e6,
                                          static_cast<double>(d.max_allocation) / 1e6));
}

}  // namespace

std::vector<std::pair<std::string, std::string>> explain(const Scene& scene, const RenderOptions& options) {
    return make_device_scene(scene, options).explain;
}

RenderResult render(const Scene& scene, const RenderOptions& options, const std::function<void(const Progress&)>& progress,
                    const std::atomic<bool>& stop) {
    RenderResult result;
    RenderStats& stats = result.stats;
    std::vector<DeviceInfo> devices = select_devices(options.devices);
    if (options.cpu_split > 1) {
        std::vector<DeviceInfo> split;
        for (const auto& d : devices) {
            if (d.type != "cpu") split.push_back(d);
            else for (auto& part : split_cpu(d, options.cpu_split)) split.push_back(std::move(part));
        }
        devices = std::move(split);
    }
    const CropWindow window = options.crop.value_or(CropWindow{0, 0, scene.film.width, scene.film.height});
    const std::uint32_t begin = options.sample_begin, end = options.sample_end ? options.sample_end : scene.render.spp;

    const DeviceScene device = make_device_scene(scene, options);
    stats.strategy = device.strategy;
    stats.transmittance = device.transmittance;
    stats.primitives = device.ellipsoids.size();
    stats.device_bytes = device.byte_size();
    stats.layout_hash = device.hash();
    stats.explain = device.explain;
    stats.build_s = device.accelerator_s;
    check_memory(scene, device, devices);

    const std::vector<device::uint> pixels = active_pixels(scene, device, window);
    const std::vector<Tile> tiles = make_tiles(pixels.size(), devices);
    const auto all_pixels = static_cast<std::uint64_t>(window.x1 - window.x0) * static_cast<std::uint64_t>(window.y1 - window.y0);
    stats.empty_pixels = all_pixels - pixels.size();
    const bool grey = std::find(device.defines.begin(), device.defines.end(), std::pair<std::string, std::string>("CLUME_CHANNELS", "1")) != device.defines.end();
    FilmSums film(pixels.size(), grey ? 1 : 3, static_cast<double>(device.params.film_scale));

    const auto compile_start = Clock::now();
    std::vector<std::unique_ptr<Worker>> workers;
    for (const auto& d : devices) {
        try {
            const SelfTestResult test = self_test(d, options.vector_width);
            if (!test.error.empty()) throw DeviceError(fmt::format("{} fails its self-test: {}", d.label(), test.error));
            if (!test.outside_exact_set.empty())
                stats.warnings.push_back(fmt::format("{} is outside the bit-exact set: {}", d.label(), test.outside_exact_set));
            workers.push_back(std::make_unique<DeviceRenderer>(d, device, pixels, tiles, options.vector_width, film));
        } catch (const DeviceError& e) {
            if (devices.size() == 1) throw;
            stats.warnings.push_back(fmt::format("device left out: {}", e.what()));
        }
    }
    if (workers.empty()) throw DeviceError("no device is left:\n  " + fmt::format("{}", fmt::join(stats.warnings, "\n  ")));
    stats.compile_s = seconds_since(compile_start);

    const auto start = Clock::now();
    const std::clock_t cpu_start = std::clock();
    std::uint32_t empty_samples = end - begin;
    if (!tiles.empty() && end > begin) {
        DispatchOptions o;
        o.items = static_cast<std::uint32_t>(tiles.size());
        o.begin = begin;
        o.end = end;
        o.fixed_chunk = options.batch_samples;
        o.stop = [&] { return stop.load() || (options.time_limit_s && seconds_since(start) >= *options.time_limit_s); };
        o.progress = [&](const DispatchProgress& p) {
            const double share = static_cast<double>(p.units_done) / static_cast<double>(std::max<std::uint64_t>(1, p.units_total));
            const auto total = all_pixels * (end - begin);
            const auto done = static_cast<std::uint64_t>(share * static_cast<double>(total));
            if (progress) progress({done, total, p.elapsed_s, p.elapsed_s > 0 ? static_cast<double>(done) / p.elapsed_s / 1e6 : 0});
        };
        const DispatchReport report = dispatch(workers, o);
        stats.warnings.insert(stats.warnings.end(), report.warnings.begin(), report.warnings.end());
        for (const auto& w : report.workers) stats.devices.push_back({w.name, 0, w.busy_s});
        if (report.failed && report.units_done == 0) throw DeviceError("every device failed:\n  " + fmt::format("{}", fmt::join(report.warnings, "\n  ")));
        stats.device_lost = report.failed;
        stats.interrupted = report.stopped && stop.load();
        stats.time_limited = report.stopped && !stop.load();
    }
    stats.render_s = seconds_since(start);
    stats.cpu_s = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
    std::uint64_t active_paths = 0;
    stats.samples_min = tiles.empty() ? empty_samples : UINT32_MAX;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        const std::uint32_t n = film.pixel(k).samples;
        active_paths += n;
        stats.samples_min = std::min(stats.samples_min, n);
        stats.samples_max = std::max(stats.samples_max, n);
    }
    if (tiles.empty()) stats.samples_max = empty_samples;
    else empty_samples = stats.samples_max;
    stats.paths = active_paths + stats.empty_pixels * empty_samples;
    stats.nonfinite_samples = film.nonfinite();
    stats.work = film.work();
    stats.excess = film.excess();
    stats.bound_violations = film.violations();
    if (stats.bound_violations > 0)
        stats.warnings.push_back(fmt::format("the density exceeded its bound {} times: please report this scene", stats.bound_violations));
    result.image = develop(scene, window, pixels, film, empty_samples, options.count_work);
    return result;
}

}  // namespace clume
