// SPDX-License-Identifier: MIT
#include "src/probe.h"

#include <map>

#include "runtime/buffer.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "runtime/queue.h"
#include "src/device_renderer.h"
#include "src/scene_buffers.h"

namespace clume {
namespace {

/// A queue and a program that probes with equal options share: code is generated once per program.
struct Compiled {
    Compiled(const DeviceInfo& info, const ProgramOptions& options) : queue(info), program(build_program(queue, "probe.cl", options)) {}
    Queue queue;
    cl::Program program;
    std::map<std::string, cl::Kernel> kernels;
};

Compiled& compiled(const DeviceInfo& info, const ProgramOptions& options) {
    // Never destroyed: an OpenCL implementation may be gone before the statics are.
    static auto& all = *new std::map<std::string, std::unique_ptr<Compiled>>;
    auto& entry = all[info.id + '|' + options.text()];
    if (!entry) entry = std::make_unique<Compiled>(info, options);
    return *entry;
}

std::size_t round_up(std::size_t n, std::size_t to) { return (n + to - 1) / to * to; }

}  // namespace

struct Probe::Impl {
    Impl(const DeviceInfo& info, const DeviceScene& device_scene, const ProgramOptions& options)
        : code(compiled(info, options)),
          queue(code.queue),
          scene(queue, device_scene),
          lanes(device_scene.lanes) {}

    /// Sets the arguments and launches `items` work-items. The first launch of a kernel is preceded by one of a single
    /// work-group, so that the time returned holds no code generation.
    template <class... Args>
    double run(const char* name, std::size_t items, const Args&... args) {
        return launch(name, items, [&](cl::Kernel& kernel) { set_args(queue, kernel, 0, args...); });
    }

    /// The same for a kernel whose first arguments are the scene.
    template <class... Args>
    double run_in_scene(const char* name, std::size_t items, const Args&... args) {
        return launch(name, items, [&](cl::Kernel& kernel) { bind(kernel, args...); });
    }

    template <class... Args>
    void bind(cl::Kernel& kernel, const Args&... args) {
        scene.bind(queue, kernel);
        set_args(queue, kernel, SceneBuffers::kArgs, args...);
    }

    template <class SetArgs>
    double launch(const char* name, std::size_t items, const SetArgs& set, std::size_t local = 0) {
        if (local == 0) local = queue.info().group_size();
        const bool first = code.kernels.find(name) == code.kernels.end();
        if (first) code.kernels.emplace(name, make_kernel(queue, code.program, name));
        cl::Kernel& kernel = code.kernels.at(name);
        set(kernel);
        if (first) queue.launch(kernel, local, local);
        return queue.launch(kernel, items, local);
    }

    Compiled& code;
    Queue& queue;
    SceneBuffers scene;
    bool lanes;  ///< flights go side by side
};

Probe::Probe(const DeviceInfo& info, const DeviceScene& scene, int width) : width_(vector_width_of(info, width)) {
    ProgramOptions options;
    for (const auto& [name, value] : scene.defines) options.define(name, value);
    options.define("CLUME_WIDTH", width_);
    impl_ = std::make_unique<Impl>(info, scene, options);
}
Probe::~Probe() = default;
Probe::Probe(Probe&&) noexcept = default;

ProbeRun<ProbeHit> Probe::rays(std::span<const ProbeRay> rays, std::uint32_t sample, std::uint32_t what) {
    Impl& s = *impl_;
    static_assert(sizeof(ProbeRay) == 32 && sizeof(ProbeHit) == 16);
    Buffer<ProbeRay> in(s.queue, rays);
    Buffer<ProbeHit> out(s.queue, rays.size());
    ProbeRun<ProbeHit> result;
    result.device_s = s.run_in_scene("probe_ray", rays.size(), in, out, cl_uint(rays.size()), cl_uint(sample), cl_uint(what));
    result.values = out.download();
    return result;
}

ProbeRun<ProbeHit> Probe::flights(std::span<const ProbeRay> r, std::uint32_t sample) {
    if (!impl_->lanes) return single_flights(r, sample);
    Impl& s = *impl_;
    // As the renderer's work-items: lanes idle at the end of each. All the units of a GPU have some.
    const DeviceInfo& info = s.queue.info();
    const bool gpu = info.type == "gpu";
    const std::size_t each = gpu ? std::clamp<std::size_t>(r.size() / (std::size_t{1024} * info.compute_units), 1, 64) : 64 * static_cast<std::size_t>(width_);
    Buffer<ProbeRay> in(s.queue, r);
    Buffer<ProbeHit> out(s.queue, r.size());
    ProbeRun<ProbeHit> result;
    result.device_s = s.launch("probe_flights", (r.size() + each - 1) / each, [&](cl::Kernel& kernel) { s.bind(kernel, in, out, cl_uint(r.size()), cl_uint(sample), cl_uint(each)); }, gpu ? info.group_size() : 1);
    result.values = out.download();
    return result;
}
ProbeRun<ProbeHit> Probe::single_flights(std::span<const ProbeRay> r, std::uint32_t sample) { return rays(r, sample, 1); }
ProbeRun<ProbeHit> Probe::transmittances(std::span<const ProbeRay> r) { return rays(r, 0, 2); }
ProbeRun<ProbeHit> Probe::roulette_transmittances(std::span<const ProbeRay> r, std::uint32_t sample) { return rays(r, sample, 4); }

ProbeRun<ProbeGrid> Probe::grid(std::span<const ProbeRay> rays, std::uint32_t g) {
    Impl& s = *impl_;
    static_assert(sizeof(ProbeGrid) == 16);
    Buffer<ProbeRay> in(s.queue, rays);
    Buffer<ProbeGrid> out(s.queue, rays.size());
    ProbeRun<ProbeGrid> result;
    result.device_s = s.run_in_scene("probe_grid", rays.size(), in, out, cl_uint(rays.size()), cl_uint(g));
    result.values = out.download();
    return result;
}

ProbeRun<ProbeHit> Probe::estimated_transmittances(std::span<const ProbeRay> r, std::uint32_t sample) { return rays(r, sample, 8); }

std::vector<ProbeRay> Probe::camera_rays(std::span<const std::uint32_t> pixels, std::uint32_t sample) {
    Impl& s = *impl_;
    Buffer<device::uint> in(s.queue, pixels);
    Buffer<ProbeRay> out(s.queue, pixels.size());
    s.run_in_scene("probe_camera", pixels.size(), in, out, cl_uint(pixels.size()), cl_uint(sample));
    return out.download();
}

std::vector<ProbeChord> Probe::groups(std::span<const ProbeGroupRay> rays, std::span<const float> groups, device::uint family, float e2, bool quadratic) {
    Impl& s = *impl_;
    static_assert(sizeof(ProbeGroupRay) == 48 && sizeof(ProbeChord) == 6 * 16 * 4);
    Buffer<float> in(s.queue, groups);
    Buffer<ProbeGroupRay> by(s.queue, rays);
    Buffer<ProbeChord> out(s.queue, rays.size());
    s.run("probe_group", rays.size(), in, by, out, cl_uint(rays.size()), cl_uint(family), e2, cl_uint(quadratic));
    return out.download();
}

ProbeRun<float> Probe::group_work(GroupWork what, std::span<const ProbeGroupRay> rays, std::span<const float> groups, device::uint family, float e2) {
    Impl& s = *impl_;
    Buffer<float> in(s.queue, groups), out(s.queue, rays.size());
    Buffer<ProbeGroupRay> by(s.queue, rays);
    ProbeRun<float> result;
    result.device_s = s.run("probe_group_work", rays.size(), in, by, out, cl_uint(rays.size()), cl_uint(groups.size() / CLUME_GROUP_FLOATS), cl_uint(family), e2, cl_uint(what));
    result.values = out.download();
    return result;
}

std::vector<float> Probe::math(MathFunction f, std::span<const float> x, std::span<const float> y) {
    Impl& s = *impl_;
    const std::size_t n = round_up(x.size(), static_cast<std::size_t>(width_));
    // Padding repeats the last input, so that it is in the function's domain.
    const auto padded = [&](std::span<const float> v) {
        std::vector<float> p(v.begin(), v.end());
        p.resize(n, v.empty() ? 1.0f : v.back());
        return p;
    };
    Buffer<float> bx(s.queue, padded(x)), by(s.queue, padded(y)), out(s.queue, n);
    s.run("probe_math", n / static_cast<std::size_t>(width_), bx, by, out, cl_uint(n), cl_uint(f));
    std::vector<float> values = out.download();
    values.resize(x.size());
    return values;
}

std::vector<Probe::Words> Probe::draws(std::span<const Words> counters, std::uint32_t seed_lo, std::uint32_t seed_hi) {
    Impl& s = *impl_;
    Buffer<Words> c(s.queue, counters), out(s.queue, counters.size());
    s.run("probe_draw", counters.size(), c, cl_uint2{{seed_lo, seed_hi}}, out, cl_uint(counters.size()));
    return out.download();
}

std::vector<Probe::Words> Probe::philox(std::span<const Words> counters, std::span<const Words> keys) {
    Impl& s = *impl_;
    Buffer<Words> c(s.queue, counters), k(s.queue, keys), out(s.queue, counters.size());
    s.run("probe_philox", counters.size(), c, k, out, cl_uint(counters.size()));
    return out.download();
}

std::vector<std::uint32_t> Probe::primitive_bits(std::uint32_t first, std::uint32_t key_lo, std::uint32_t key_hi, std::size_t count) {
    Impl& s = *impl_;
    const std::size_t n = round_up(count, static_cast<std::size_t>(width_));
    Buffer<device::uint> out(s.queue, n);
    s.run("probe_primitive_bits", n / static_cast<std::size_t>(width_), cl_uint(first), cl_uint2{{key_lo, key_hi}}, out, cl_uint(n));
    std::vector<std::uint32_t> bits = out.download();
    bits.resize(count);
    return bits;
}

std::vector<device::float4> Probe::phases(device::uint kind, float g, const float (&d)[3], std::uint32_t seed, std::size_t count) {
    Impl& s = *impl_;
    Buffer<device::float4> out(s.queue, count);
    s.run("probe_phase", count, cl_uint(kind), g, cl_float4{{d[0], d[1], d[2], 0}}, cl_uint(seed), out, cl_uint(count));
    return out.download();
}

std::vector<Probe::LampPlace> Probe::lamp_places(std::span<const LampView> views, std::span<const float> u) {
    Impl& s = *impl_;
    Buffer<LampView> in(s.queue, views);
    Buffer<float> by(s.queue, u);
    Buffer<LampPlace> out(s.queue, views.size());
    s.run("probe_lamp", views.size(), in, by, out, cl_uint(views.size()));
    return out.download();
}

}  // namespace clume
