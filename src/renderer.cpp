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

/// Whether what rendering takes fits: the scene's copies on CPU devices, film and image, batches, compilers.
void check_budget(const Scene& scene, const DeviceScene& device, const std::vector<DeviceInfo>& devices, const std::vector<Tile>& tiles, std::uint64_t active_pixels, std::uint64_t all_pixels) {
    constexpr std::uint64_t compiler_bytes = 200'000'000;  // of an OpenCL implementation that builds the programs inside this process
    std::uint64_t copies = 0, batches = 0;
    for (const DeviceInfo& d : devices) {
        if (d.type == "cpu") copies += device.byte_size() + 4 * active_pixels;
        batches += DeviceRenderer::batch_bytes(d, tiles);
    }
    const std::uint64_t films = device.strategy == "progressive" ? 2 : 1;  // one for what the image does not hold
    require_memory(scene.path, {{"compilers", compiler_bytes},
                                {"the scene on CPU devices", copies},
                                {"batches", batches},
                                {"film", active_pixels * (films * FilmSums::bytes_per_pixel() + 4)},
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
            if (test.error.empty()) renderer = std::make_shared<DeviceRenderer>(info, *scene, pixels, tiles, vector_width, optimised);
        });
    }
};

}  // namespace

std::vector<std::pair<std::string, std::string>> explain(const Scene& scene, const RenderOptions& options) {
    return make_device_scene(scene, options).explain;
}

struct Accumulation::State {
    std::uint64_t seed;
    std::uint32_t begin, end;
    FilmSums film;
    std::vector<DeviceShare> devices;
    double render_s = 0, cpu_s = 0;
    bool interrupted = false, time_limited = false, device_lost = false;
    std::vector<float> learned{};  ///< bounds of `progressive`; empty before the first pass
    std::vector<float> raised{};   ///< the highest densities found above them by any device

    bool stopped() const { return interrupted || time_limited || device_lost; }
};

Accumulation::Accumulation(std::unique_ptr<State> state) : state_(std::move(state)) {}
Accumulation::~Accumulation() = default;
Accumulation::Accumulation(Accumulation&&) noexcept = default;
Accumulation& Accumulation::operator=(Accumulation&&) noexcept = default;
std::uint64_t Accumulation::seed() const { return state_->seed; }
std::uint32_t Accumulation::begin() const { return state_->begin; }
std::uint32_t Accumulation::end() const { return state_->end; }
double Accumulation::render_s() const { return state_->render_s; }
bool Accumulation::complete() const { return !(state_->interrupted || state_->time_limited || state_->device_lost); }

struct Renderer::Impl {
    Film film;
    glm::dvec3 background{0};
    RenderOptions options;
    CropWindow window;
    RenderStats setup;
    std::vector<device::uint> pixels;
    std::vector<Tile> tiles;
    int channels = 3;
    double film_scale = 1;
    std::vector<float> first_bounds;               ///< of `progressive`; empty for other strategies
    std::set<std::string> told_short_of_memory;
    Workers workers;                               ///< DeviceRenderers; a device that fails is dropped for good

    std::uint64_t all_pixels() const {
        return static_cast<std::uint64_t>(window.x1 - window.x0) * static_cast<std::uint64_t>(window.y1 - window.y0);
    }
    void make_workers(const std::vector<DeviceInfo>& devices, const std::shared_ptr<const DeviceScene>& device);
    /// Samples [begin, end) of every tile, by all devices.
    void run_pass(Accumulation::State& a, std::uint32_t begin, std::uint32_t end, const RunControl& control);
    /// The same for `progressive`: passes under bounds that are frozen in each and raised after it.
    void run_learning(Accumulation::State& a, std::uint32_t end, const RunControl& control);
};

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

void Renderer::Impl::run_pass(Accumulation::State& a, std::uint32_t begin, std::uint32_t end, const RunControl& control) {
    for (const auto& w : workers) static_cast<DeviceRenderer&>(*w).aim(a.film, a.seed);
    const auto start = Clock::now();
    const std::clock_t cpu_start = std::clock();
    const auto stop_asked = [&] { return control.stop && control.stop->load(); };
    DispatchOptions o;
    o.items = static_cast<std::uint32_t>(tiles.size());
    o.begin = begin;
    o.end = end;
    o.fixed_chunk = options.batch_samples;
    o.hang_seconds = options.kernel_timeout_s;
    o.stop = [&] { return stop_asked() || (control.time_limit_s && seconds_since(start) >= *control.time_limit_s); };
    o.progress = [&](const DispatchProgress& p) {
        const double share = static_cast<double>(p.units_done) / static_cast<double>(std::max<std::uint64_t>(1, p.units_total));
        const auto total = all_pixels() * (end - begin);
        const auto done = static_cast<std::uint64_t>(share * static_cast<double>(total));
        if (control.progress) control.progress({done, total, p.elapsed_s, p.elapsed_s > 0 ? static_cast<double>(done) / p.elapsed_s / 1e6 : 0});
    };
    const DispatchReport report = dispatch(workers, o);
    a.render_s += seconds_since(start);
    a.cpu_s += static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
    setup.warnings.insert(setup.warnings.end(), report.warnings.begin(), report.warnings.end());
    for (std::size_t k = report.workers.size(); k-- > 0;) {
        const WorkerReport& w = report.workers[k];
        const auto share = std::find_if(a.devices.begin(), a.devices.end(), [&](const DeviceShare& d) { return d.name == w.name; });
        if (share != a.devices.end()) share->busy_s += w.busy_s;
        else a.devices.insert(a.devices.begin(), DeviceShare{w.name, 0, w.busy_s});
        const auto& renderer = static_cast<const DeviceRenderer&>(*workers[k]);
        if (const std::size_t items = renderer.short_of_memory(); items > 0 && told_short_of_memory.insert(w.name).second)
            setup.warnings.push_back(fmt::format("device {} is short of memory: batches of at most {} paths at a time", w.name, items));
        for (std::size_t i = 0; i < a.raised.size(); ++i) a.raised[i] = std::max(a.raised[i], renderer.raised()[i]);
        if (w.hung) note_hang(w.name);
        if (w.dropped) workers.erase(workers.begin() + static_cast<std::ptrdiff_t>(k));
    }
    if (report.failed && report.units_done == 0 && begin == a.begin)
        throw DeviceError("every device failed:\n  " + fmt::format("{}", fmt::join(report.warnings, "\n  ")));
    a.device_lost = a.device_lost || report.failed;
    a.interrupted = a.interrupted || (report.stopped && stop_asked());
    a.time_limited = a.time_limited || (report.stopped && !stop_asked());
}

// A first look at how high the density goes: passes that the image does not hold, until little exceeds its bound.
// Then passes that double, each under what all before it have found, so that the share of the image made under low bounds
// vanishes. Everything is a function of seed and sample numbers, and so are the bounds: a pass that ends early goes on under
// the same ones the next time.
void Renderer::Impl::run_learning(Accumulation::State& a, std::uint32_t end, const RunControl& control) {
    // Optical depth left out, of the bounds'. Not the share of look-ups above their bound: where bounds are far too low there
    // are hardly any look-ups, and those that are stand for much.
    constexpr double enough = 1e-3;
    constexpr float margin = 1.25f;      // over what was found: the highest density is seldom hit
    constexpr std::uint32_t first_warm_up_sample = 0x80000000u;
    const auto run = [&](Accumulation::State& film, std::uint32_t begin, std::uint32_t pass_end, bool explore) {
        film.raised.resize(first_bounds.size());
        for (const auto& w : workers) static_cast<DeviceRenderer&>(*w).set_learned(a.learned, explore);
        run_pass(film, begin, pass_end, control);
    };
    const auto learn = [&](const Accumulation::State& film) {
        for (std::size_t i = 0; i < a.learned.size(); ++i) a.learned[i] = std::max(a.learned[i], margin * film.raised[i]);
    };
    if (a.learned.empty()) {
        a.learned = first_bounds;
        const auto samples = static_cast<std::uint32_t>(std::max<std::size_t>(1, 16384 / pixels.size()));
        for (int k = 0; k < options.progressive_warm_up; ++k) {
            const std::uint32_t begin = first_warm_up_sample + static_cast<std::uint32_t>(k) * samples;
            Accumulation::State scratch{a.seed, begin, begin, FilmSums(pixels.size(), channels, film_scale), {}};
            run(scratch, begin, begin + samples, true);
            learn(scratch);
            a.render_s += scratch.render_s;
            a.cpu_s += scratch.cpu_s;
            a.interrupted = scratch.interrupted;
            a.time_limited = scratch.time_limited;
            a.device_lost = scratch.device_lost;
            if (a.stopped() || scratch.film.excess() <= enough * static_cast<double>(scratch.film.work()[WORK_DENSITIES])) break;
        }
    }
    while (a.end < end && !a.stopped()) {
        const std::uint32_t done = a.end - a.begin;
        const std::uint64_t pass_end = std::uint64_t{a.begin} + (done == 0 ? 1 : 2 * std::uint64_t{std::bit_floor(done)});
        const auto stop = static_cast<std::uint32_t>(std::min<std::uint64_t>(end, pass_end));
        run(a, a.end, stop, false);
        a.end = stop;
        if (stop == pass_end) learn(a);
    }
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

    const auto packed = std::make_shared<const DeviceScene>(make_device_scene(scene, o));
    const DeviceScene& device = *packed;
    RenderStats& stats = impl_->setup;
    stats.strategy = device.strategy;
    stats.transmittance = device.transmittance;
    stats.bound = device.bound;
    stats.primitives = device.ellipsoids.size();
    stats.device_bytes = device.byte_size();
    stats.layout_hash = device.hash();
    stats.explain = device.explain;
    stats.build_s = device.accelerator_s;
    check_memory(scene, device, devices);
    require_memory(scene.path, {{"image", impl_->all_pixels() * image_bytes}});

    impl_->pixels = active_pixels(scene, device, impl_->window);
    if (const std::size_t n = impl_->pixels.size(); o.most_pixels > 0 && n > o.most_pixels) {
        std::vector<device::uint> some;
        for (std::size_t i = 0; i < o.most_pixels; ++i) some.push_back(impl_->pixels[i * n / o.most_pixels]);
        impl_->pixels = std::move(some);
    }
    impl_->tiles = make_tiles(impl_->pixels.size(), devices);
    check_budget(scene, device, devices, impl_->tiles, impl_->pixels.size(), impl_->all_pixels());
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
        new Accumulation::State{seed, begin, begin, FilmSums(impl_->pixels.size(), impl_->channels, impl_->film_scale), {}}));
}

void Renderer::extend(Accumulation& accumulation, std::uint32_t end, const RunControl& control) {
    Accumulation::State& a = *accumulation.state_;
    if (end <= a.end) return;
    if (!impl_->tiles.empty()) impl_->first_bounds.empty() ? impl_->run_pass(a, a.end, end, control) : impl_->run_learning(a, end, control);
    a.end = end;
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
    if (impl_->tiles.empty()) stats.samples_max = empty_samples;
    else empty_samples = stats.samples_max;
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

RenderResult render(const Scene& scene, const RenderOptions& options, const std::function<void(const Progress&)>& progress,
                    const std::atomic<bool>& stop) {
    Renderer renderer(scene, options);
    Accumulation film = renderer.start(scene.render.seed, options.sample_begin);
    renderer.extend(film, options.sample_end ? options.sample_end : scene.render.spp, {progress, &stop, options.time_limit_s});
    return renderer.result(film);
}

}  // namespace clume
