// SPDX-License-Identifier: MIT
#include "src/stress_device.h"

#include <map>
#include <string>

#include "runtime/buffer.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "runtime/queue.h"
#include "src/device_renderer.h"
#include "src/scene_buffers.h"

namespace clume {
namespace {


}  // namespace

struct StressDevice::Impl {
    explicit Impl(const DeviceInfo& info) : queue(info), program(build_program(queue, "stress.cl", options(info))) {}

    static ProgramOptions options(const DeviceInfo& info) {
        ProgramOptions o;
        o.define("CLUME_WIDTH", vector_width_of(info, 0));
        o.define("CLUME_ACCEL", 2);  // the bvh: the same chords at less cost
        o.define("CLUME_NEE", 127);  // every kind of light
        o.optimised = true;
        return o;
    }

    template <class... Args>
    void run(const char* name, const SceneBuffers* scene, std::size_t items, const Args&... args) {
        auto found = kernels.find(name);
        if (found == kernels.end()) found = kernels.emplace(name, make_kernel(queue, program, name)).first;
        cl::Kernel& kernel = found->second;
        if (scene) scene->bind(queue, kernel);
        set_args(queue, kernel, scene ? SceneBuffers::kArgs : 0, args...);
        queue.launch(kernel, items, queue.info().group_size());
    }

    Queue queue;
    cl::Program program;
    std::map<std::string, cl::Kernel> kernels;
};

StressDevice::StressDevice(const DeviceInfo& info) : probe_(info), impl_(std::make_unique<Impl>(info)) {}
StressDevice::~StressDevice() = default;

std::vector<ProbeChord> StressDevice::naive(std::span<const ProbeGroupRay> rays, std::span<const float> groups, device::uint family, float e2) {
    Impl& s = *impl_;
    Buffer<float> in(s.queue, groups);
    Buffer<ProbeGroupRay> by(s.queue, rays);
    Buffer<ProbeChord> out(s.queue, rays.size());
    s.run("stress_naive", nullptr, rays.size(), in, by, out, cl_uint(rays.size()), cl_uint(family), e2);
    return out.download();
}

std::vector<StressDevice::Given> StressDevice::given(std::span<const ProbeGroupRay> rays, std::span<const float> groups, device::uint family, float e2) {
    Impl& s = *impl_;
    static_assert(sizeof(Given) == 48);
    Buffer<float> in(s.queue, groups);
    Buffer<ProbeGroupRay> by(s.queue, rays);
    Buffer<Given> out(s.queue, rays.size());
    s.run("stress_given", nullptr, rays.size(), in, by, out, cl_uint(rays.size()), cl_uint(family), e2);
    return out.download();
}

StressDevice::Phase StressDevice::phase(device::uint kind, std::span<const device::float4> directions, std::span<const float> versines, std::span<const StressBits> bits) {
    Impl& s = *impl_;
    Buffer<device::float4> d(s.queue, directions), out(s.queue, directions.size());
    Buffer<float> c(s.queue, versines), value(s.queue, directions.size());
    Buffer<StressBits> b(s.queue, bits);
    s.run("stress_phase", nullptr, directions.size(), d, c, b, out, value, cl_uint(directions.size()), cl_uint(kind));
    return {out.download(), value.download()};
}

std::vector<ProbeRay> StressDevice::camera(const DeviceScene& scene, std::span<const FilmPoint> points) {
    Impl& s = *impl_;
    static_assert(sizeof(FilmPoint) == 16);
    const SceneBuffers buffers(s.queue, scene);
    Buffer<FilmPoint> in(s.queue, points);
    Buffer<ProbeRay> out(s.queue, points.size());
    s.run("stress_camera", &buffers, points.size(), in, out, cl_uint(points.size()));
    return out.download();
}

std::vector<StressDevice::LightSample> StressDevice::lights(const DeviceScene& scene, std::span<const device::float4> points, std::span<const StressBits> bits) {
    Impl& s = *impl_;
    static_assert(sizeof(LightSample) == 32);
    const SceneBuffers buffers(s.queue, scene);
    Buffer<device::float4> in(s.queue, points);
    Buffer<StressBits> words(s.queue, bits);
    Buffer<LightSample> out(s.queue, points.size());
    s.run("stress_light", &buffers, points.size(), in, words, out, cl_uint(points.size()));
    return out.download();
}

StressDevice::EnvironmentSample StressDevice::environment(const DeviceScene& scene, std::span<const StressBits> bits, std::span<const device::float4> directions) {
    Impl& s = *impl_;
    const SceneBuffers buffers(s.queue, scene);
    const std::size_t n = directions.size();
    Buffer<StressBits> words(s.queue, bits), texels(s.queue, n);
    Buffer<device::float4> in(s.queue, directions), out(s.queue, n);
    Buffer<float> values(s.queue, n);
    s.run("stress_environment", &buffers, n, words, in, out, values, texels, cl_uint(n));
    return {out.download(), values.download(), texels.download()};
}

std::vector<float> StressDevice::transmittances(const DeviceScene& scene, std::span<const ProbeRay> rays) {
    Impl& s = *impl_;
    const SceneBuffers buffers(s.queue, scene);
    Buffer<ProbeRay> in(s.queue, rays);
    Buffer<float> out(s.queue, rays.size());
    s.run("stress_transmittance", &buffers, rays.size(), in, out, cl_uint(rays.size()));
    return out.download();
}

}  // namespace clume
