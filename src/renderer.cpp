// SPDX-License-Identifier: MIT
#include "src/renderer.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <ctime>
#include <fmt/format.h>
#include <memory>
#include <set>

#include "runtime/check.h"
#include "runtime/device.h"
#include "runtime/hang.h"
#include "src/device_camera.h"
#include "src/device_renderer.h"
#include "src/device_scene.h"
#include "src/error.h"
#include "src/film.h"
#include "src/memory_budget.h"
#include "src/renderer_impl.h"
#include "src/self_test.h"

namespace clume {
namespace {

using Clock = std::chrono::steady_clock;
/// Of a pixel of the image and of its preview.
constexpr std::uint64_t image_bytes = 8 * sizeof(float) + sizeof(std::uint64_t) + 3;

double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

/// Tiles of the active pixels, no larger than keeps all devices busy: small ones for CPUs, large ones for GPUs.
std::vector<Tile> make_tiles(std::size_t pixels, const std::vector<DeviceInfo>& devices) {
    const bool gpu = std::any_of(devices.begin(), devices.end(), [](const DeviceInfo& d) { return d.type == "gpu"; });
    const std::size_t size = std::size_t{1} << (gpu ? 14 : 13);
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

/// `b`: what inactive pixels hold.
RenderImage develop(const Film& size, const glm::dvec3& b, const CropWindow& w, const std::vector<device::uint>& pixels, const FilmSums& film, std::uint32_t samples, bool count_work) {
    RenderImage image;
    image.film_width = size.width;
    image.film_height = size.height;
    image.window = w;
    const auto width = static_cast<std::size_t>(w.x1 - w.x0), count = width * static_cast<std::size_t>(w.y1 - w.y0);
    image.rgb.resize(3 * count);
    image.alpha.assign(count, 0);
    image.variance.assign(3 * count, 0);
    image.samples.assign(count, samples);
    if (count_work) image.tests.assign(count, 0);
    for (std::size_t i = 0; i < count; ++i)
        for (int c = 0; c < 3; ++c) image.rgb[3 * i + static_cast<std::size_t>(c)] = static_cast<float>(b[c]);
    for (std::size_t k = 0; k < pixels.size(); ++k) {
        const auto x = static_cast<int>(pixels[k] % static_cast<device::uint>(size.width)), y = static_cast<int>(pixels[k] / static_cast<device::uint>(size.width));
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

/// Whether what rendering takes beside the scene fits: buffers of CPU devices, film and image, batches, compilers.
void check_budget(const Scene& scene, const DeviceScene& device, const std::vector<DeviceInfo>& devices, const std::vector<Tile>& tiles, std::uint64_t active_pixels, std::uint64_t all_pixels, bool noise_pilot) {
    constexpr std::uint64_t compiler_bytes = 200'000'000;  // of an OpenCL implementation that builds the programs inside this process
    std::uint64_t own = 0, batches = 0;
    for (const DeviceInfo& d : devices) {
        if (d.type == "cpu") own += 4 * active_pixels + 8 * device.learned.size();
        batches += DeviceRenderer::batch_bytes(d, tiles);
    }
    const std::uint64_t films = device.strategy == "progressive" || noise_pilot ? 2 : 1;  // one for what the image does not hold
    require_memory(scene.path, {{"compilers", compiler_bytes},
                                {"buffers of CPU devices", own},
                                {"batches", batches},
                                {"film", active_pixels * (films * FilmSums::bytes_per_pixel() + 4 + 8 * devices.size())},
                                {"image", all_pixels * image_bytes}});
}

void check_memory(const Scene& scene, const DeviceScene& device, const std::vector<DeviceInfo>& devices) {
    for (const auto& d : devices)
        if (device.byte_size() > d.global_memory || 4 * std::max(device.groups.size(), device.grid_values.size()) > d.max_allocation)
            throw RenderError(fmt::format("{}: the scene needs {:.1f} MB on the device, {} has {:.1f} MB ({:.1f} MB in one buffer)", scene.path,
                                          static_cast<double>(device.byte_size()) / 1e6, d.label(), static_cast<double>(d.global_memory) / 1e6,
                                          static_cast<double>(d.max_allocation) / 1e6));
}

/// What makes one device ready: shared with a thread that may have to be left behind inside a call.
struct DeviceSetup {
    DeviceInfo info;
    std::shared_ptr<const DeviceScene> scene;
    std::vector<device::uint> pixels;
    std::vector<Tile> tiles;
    int vector_width;
    bool optimised;
    SelfTestResult test{};
    std::shared_ptr<DeviceRenderer> renderer{};

    void run() {
        checked(info.label(), [&] {
            test = self_test(info, vector_width);
            if (test.error.empty()) renderer = std::make_shared<DeviceRenderer>(info, scene, pixels, tiles, vector_width, optimised);
        });
    }
};

}  // namespace

std::vector<std::pair<std::string, std::string>> explain(const Scene& scene, const RenderOptions& options) {
    return make_device_scene(scene, options).explain;
}

Accumulation::Accumulation(std::unique_ptr<State> state) : state_(std::move(state)) {}
Accumulation::~Accumulation() = default;
Accumulation::Accumulation(Accumulation&&) noexcept = default;
Accumulation& Accumulation::operator=(Accumulation&&) noexcept = default;
std::uint64_t Accumulation::seed() const { return state_->seed; }
std::uint32_t Accumulation::begin() const { return state_->begin; }
std::uint32_t Accumulation::end() const { return state_->end; }
double Accumulation::render_s() const { return state_->render_s; }
bool Accumulation::complete() const { return !(state_->interrupted || state_->time_limited || state_->device_lost); }

void Renderer::Impl::make_workers(const std::vector<DeviceInfo>& devices, const std::shared_ptr<const DeviceScene>& device) {
    // Compilers run here, which may take far longer than a kernel.
    const double most_s = 10 * options.kernel_timeout_s;
    const auto start = Clock::now();
    for (const auto& d : devices) {
        try {
            if (known_to_hang(d.label())) throw DeviceError(fmt::format("{} hangs in an earlier call", d.label()));
            const auto own = std::make_shared<DeviceSetup>(DeviceSetup{d, device, pixels, tiles, options.vector_width, options.most_pixels == 0});
            if (!ends_within(most_s, [own] { own->run(); })) {
                note_hang(d.label());
                throw DeviceError(fmt::format("{} hangs: self-test, compiling and warming up did not end within {:g} s", d.label(), most_s));
            }
            if (!own->test.error.empty()) throw DeviceError(fmt::format("{} fails its self-test: {}", d.label(), own->test.error));
            if (!own->test.outside_exact_set.empty())
                setup.warnings.push_back(fmt::format("{} is outside the bit-exact set: {}", d.label(), own->test.outside_exact_set));
            workers.push_back(std::move(own->renderer));
        } catch (const DeviceError& e) {
            if (devices.size() == 1) throw;
            setup.warnings.push_back(fmt::format("device left out: {}", e.what()));
        }
    }
    if (workers.empty()) throw DeviceError("no device is left:\n  " + fmt::format("{}", fmt::join(setup.warnings, "\n  ")));
    setup.compile_s = seconds_since(start);
}

Renderer::Renderer(const Scene& scene, RenderOptions options) : impl_(std::make_unique<Impl>()) {
    impl_->film = scene.film;
    impl_->background = background(scene);
    impl_->options = std::move(options);
    const RenderOptions& o = impl_->options;
    std::vector<DeviceInfo> devices = select_devices(o.devices);
    if (o.cpu_split > 1) {
        std::vector<DeviceInfo> split;
        for (const auto& d : devices) {
            if (d.type != "cpu") split.push_back(d);
            else for (auto& part : split_cpu(d, o.cpu_split)) split.push_back(std::move(part));
        }
        devices = std::move(split);
    }
    impl_->window = o.crop.value_or(CropWindow{0, 0, scene.film.width, scene.film.height});

    const auto packed = std::make_shared<DeviceScene>(make_device_scene(scene, o));
    impl_->options.shared.reset();
    const DeviceScene& device = *packed;
    RenderStats& stats = impl_->setup;
    stats.strategy = device.strategy;
    stats.transmittance = device.transmittance;
    stats.bound = device.bound;
    stats.primitives = device.ellipsoids.size();
    stats.device_bytes = device.byte_size();
    if (o.most_pixels == 0) stats.layout_hash = device.hash();
    stats.explain = device.explain;
    stats.build_s = device.accelerator_s;
    check_memory(scene, device, devices);
    require_memory(scene.path, {{"image", impl_->all_pixels() * image_bytes}});

    impl_->pixels = active_pixels(scene, device, impl_->window);
    packed->ellipsoids = {};  // 152 bytes a primitive that nobody needs from here on
    if (const std::size_t n = impl_->pixels.size(); o.most_pixels > 0 && n > o.most_pixels) {
        std::vector<device::uint> some;
        for (std::size_t i = 0; i < o.most_pixels; ++i) some.push_back(impl_->pixels[i * n / o.most_pixels]);
        impl_->pixels = std::move(some);
    }
    impl_->tiles = make_tiles(impl_->pixels.size(), devices);
    check_budget(scene, device, devices, impl_->tiles, impl_->pixels.size(), impl_->all_pixels(), o.noise_threshold.has_value());
    if (o.noise_threshold) impl_->noise = noise_tiles(impl_->pixels, scene.film.width, impl_->window);
    stats.empty_pixels = impl_->all_pixels() - impl_->pixels.size();
    const bool grey = std::find(device.defines.begin(), device.defines.end(), std::pair<std::string, std::string>("CLUME_CHANNELS", "1")) != device.defines.end();
    impl_->channels = grey ? 1 : 3;
    impl_->film_scale = static_cast<double>(device.params.film_scale);
    impl_->first_bounds = device.learned;
    for (float& bound : impl_->first_bounds) bound *= static_cast<float>(o.progressive_start);
    impl_->make_workers(devices, packed);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
const RenderStats& Renderer::setup() const { return impl_->setup; }
std::uint32_t Renderer::rendered_pixels() const { return static_cast<std::uint32_t>(impl_->pixels.size()); }

Accumulation Renderer::start(std::uint64_t seed, std::uint32_t begin) const {
    return Accumulation(std::unique_ptr<Accumulation::State>(
        new Accumulation::State{seed, begin, begin, FilmSums(impl_->pixels.size(), impl_->channels, impl_->film_scale)}));
}

void Renderer::extend(Accumulation& accumulation, std::uint32_t end, const RunControl& control) {
    Accumulation::State& a = *accumulation.state_;
    if (end > a.end) impl_->run(a, end, control);
}

NoiseStats Renderer::Impl::noise_of(const Accumulation::State& a) const {
    NoiseStats stats{*options.noise_threshold, static_cast<std::uint32_t>(noise.size()), 0, 0, 0, a.film.paths(), a.noise_pilot_paths};
    const std::vector<TileNoise> held = measure_noise(noise, a.film);
    const std::vector<double> errors = relative_errors(noise, held);
    for (std::size_t t = 0; t < errors.size(); ++t) {
        stats.worst = std::max(stats.worst, errors[t]);
        if (errors[t] <= stats.threshold) continue;
        ++stats.above;
        stats.capped += held[t].samples == a.end - a.begin;
    }
    return stats;
}

std::string NoiseStats::summary() const {
    std::string text = fmt::format("noise threshold {:g}: ", threshold);
    if (tiles == 0) return text + "nothing is noisy";
    text += above == 0 ? fmt::format("all {} tiles are within it", tiles) : fmt::format("{} of {} tiles are above it", above, tiles);
    if (capped > 0) text += fmt::format(", {} of them for want of samples (--spp)", capped);
    return text + fmt::format("; the noisiest has {:.3g}", worst);
}

RenderResult Renderer::result(const Accumulation& accumulation) const {
    const Accumulation::State& a = *accumulation.state_;
    RenderResult result{{}, impl_->setup};
    RenderStats& stats = result.stats;
    stats.devices = a.devices;
    stats.render_s = a.render_s;
    stats.cpu_s = a.cpu_s;
    stats.interrupted = a.interrupted;
    stats.time_limited = a.time_limited;
    stats.device_lost = a.device_lost;
    std::uint64_t active_paths = 0;
    std::uint32_t empty_samples = a.end - a.begin;
    stats.samples_min = impl_->tiles.empty() ? empty_samples : UINT32_MAX;
    for (std::size_t k = 0; k < impl_->pixels.size(); ++k) {
        const std::uint32_t n = a.film.pixel(k).samples;
        active_paths += n;
        stats.samples_min = std::min(stats.samples_min, n);
        stats.samples_max = std::max(stats.samples_max, n);
    }
    // A pixel that is known counts as one without noise.
    if (impl_->tiles.empty()) stats.samples_max = empty_samples;
    else empty_samples = impl_->options.noise_threshold ? stats.samples_min : stats.samples_max;
    if (!impl_->pixels.empty()) stats.samples_mean = static_cast<double>(active_paths) / static_cast<double>(impl_->pixels.size());
    if (impl_->options.noise_threshold) stats.noise = impl_->noise_of(a);
    stats.paths = active_paths + stats.empty_pixels * empty_samples;
    stats.nonfinite_samples = a.film.nonfinite();
    stats.work = a.film.work();
    stats.excess = a.film.excess();
    stats.bound_violations = a.film.violations();
    if (!impl_->first_bounds.empty())
        stats.notes.push_back(fmt::format("progressive: {} of {} look-ups found the density above its learned bound ({:.3g} %), which left out {:.3g} % of the bounds' optical depth", stats.bound_violations,
                                          stats.work[WORK_DENSITIES], 100.0 * static_cast<double>(stats.bound_violations) / std::max(1.0, static_cast<double>(stats.work[WORK_DENSITIES])),
                                          100.0 * stats.excess / std::max(1.0, static_cast<double>(stats.work[WORK_DENSITIES]))));
    else if (stats.bound_violations > 0)
        stats.warnings.push_back(fmt::format("the density exceeded its bound {} times: please report this scene", stats.bound_violations));
    result.image = develop(impl_->film, impl_->background, impl_->window, impl_->pixels, a.film, empty_samples, impl_->options.count_work);
    return result;
}

RenderResult render(const Scene& scene, RenderOptions options, const std::function<void(const Progress&)>& progress,
                    const std::atomic<bool>& stop) {
    const std::uint32_t begin = options.sample_begin, end = options.sample_end ? options.sample_end : scene.render.spp;
    const std::optional<double> limit_s = options.time_limit_s;
    Renderer renderer(scene, std::move(options));
    Accumulation film = renderer.start(scene.render.seed, begin);
    renderer.extend(film, end, {progress, &stop, limit_s});
    return renderer.result(film);
}

}  // namespace clume
