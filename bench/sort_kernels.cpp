// SPDX-License-Identifier: MIT
// A ray's events put in order (sorts.cl), an item being an event, and segments between them walked, an item being a segment.
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include "bench/kernels.h"
#include "bench/operations.h"
#include "bench/rays.h"
#include "bench/scene_program.h"
#include "bench/study_scenes.h"

namespace clume::bench {
namespace {

constexpr std::size_t kLists = 64;

struct Sort {
    Sort(Session& session, std::size_t n, const char* name) : queue(session.device()) {
        ProgramOptions options;
        options.define("CLUME_WIDTH", 1);
        options.define("SORT_COUNT", static_cast<long long>(n));
        kernel = make_kernel(queue, build_program(queue, "sorts.cl", options), name);
        std::mt19937 engine(7);
        std::vector<float> t(kLists * n);
        for (float& v : t) v = static_cast<float>(engine() >> 8);
        in = Buffer<float>(queue, t);
        launch = std::make_unique<SizedLaunch>(session, queue, kernel, [this, n](std::size_t count, Buffer<float>&) {
            keys = Buffer<float>(queue, count * n);
            ids = Buffer<device::uint>(queue, count * n);
            set_args(queue, kernel, 0, in, keys, ids, cl_uint(count), cl_uint(kLists));
        }, 3e-3, (std::size_t{1} << 24) / n);
    }
    Queue queue;
    cl::Kernel kernel;
    Buffer<float> in, keys;
    Buffer<device::uint> ids;
    std::unique_ptr<SizedLaunch> launch;
};

/// Operations per event: of a network's comparisons; or of an insertion's, 5 for each place that it goes back, (n − 1) / 4 on average.
Operations sort_operations(const std::string& name, double n) {
    const double p = std::log2(n);
    if (name == "insertion") return {5 * (n - 1) / 4, 0};
    const double exchanges = name == "bitonic" ? n * p * (p + 1) / 4 : (p * p - p + 4) * n / 4 - 1;
    return operations("compare_exchange") * (exchanges / n);
}

/// The segments of one ball's rays.
struct Segments {
    Segments(Session& session, int width) {
        Scene scene = study_ball({});
        scene.render.strategy = "regular";
        const DeviceScene device = make_device_scene(scene, {});
        program = std::make_unique<SceneProgram>(session, "roofline.cl", device, defines_of(device, width));
        kernel = program->kernel("walk_segments");
        const std::vector<ProbeRay> from = inside_rays(device, width == 1 ? 256 : 1024, 1);
        rays = Buffer<ProbeRay>(program->queue, from);
        out = Buffer<device::float4>(program->queue, from.size());
        program->set(kernel, rays, out, cl_uint(from.size()), cl_uint(kRounds));
        launch();
        for (const device::float4& v : out.download()) {
            segments += static_cast<double>(v.x);
            sums += static_cast<double>(v.y);
            active += static_cast<double>(v.z);
        }
    }
    double launch() { return program->queue.launch(kernel, rays.size(), program->queue.info().group_size()); }
    /// Per segment: each sixteen of its chords summed, every chord looked at for the first end and for having ended.
    Cost cost() const { return {(operations("depth/gaussian") + Operations{1, 0}) * (16 * sums / segments) + Operations{3 * active / segments, 0}, (16 * sums * 32 + 4 * active) / segments, 0, sizeof(float) * 256 * 9.0}; }

    static constexpr std::size_t kRounds = 16;
    std::unique_ptr<SceneProgram> program;
    cl::Kernel kernel;
    Buffer<ProbeRay> rays;
    Buffer<device::float4> out;
    double segments = 0, sums = 0, active = 0;
};

}  // namespace

void add_sort_benchmarks(Session& session) {
    for (const char* name : {"bitonic", "odd_even", "insertion"})
        for (const std::size_t n : {8u, 16u, 32u, 64u, 128u, 256u})
            add_kernel_benchmark(session, fmt::format("sort/{}/{}", name, n), [=, &session, sort = std::shared_ptr<Sort>()](std::uint32_t) mutable {
                if (!sort) sort = std::make_shared<Sort>(session, n, name);
                const double s = (*sort->launch)();
                return Launch{static_cast<double>(sort->keys.size()), s, {sort_operations(name, static_cast<double>(n)), 12, 0, 12.0 * static_cast<double>(sort->keys.size())}};
            });
    for (const int width : kernel_widths(session))
        add_kernel_benchmark(session, with_width("segments", width), [=, &session, s = std::shared_ptr<Segments>()](std::uint32_t) mutable {
            if (!s) s = std::make_shared<Segments>(session, width);
            const double seconds = s->launch();
            return Launch{s->segments, seconds, s->cost()};
        });
}

}  // namespace clume::bench
