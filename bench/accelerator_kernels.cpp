// SPDX-License-Identifier: MIT
// The accelerators piece by piece: a ray against a node's boxes (an item is a box), against a leaf's primitives (an item is a
// primitive), both from the cache, and whole walks that do nothing on the way (an item is a ray).
#include <fmt/format.h>

#include <map>
#include <memory>
#include <numeric>

#include "bench/kernels.h"
#include "bench/operations.h"
#include "bench/rays.h"
#include "bench/scene_program.h"
#include "bench/scenes.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {
namespace {

constexpr std::size_t kNodes = 64, kLeaves = 32;  // 14 and 22 kB
constexpr std::size_t kRays = 1024;

DeviceScene device_scene(Scene scene, const char* accelerator) {
    scene.render.strategy = "decomposition";
    RenderOptions options;
    options.accelerator = accelerator;
    return make_device_scene(scene, options);
}

/// A kernel that sends rays from inside a mixture of `primitives` of the given overlap against its first `rounds` nodes or leaves.
struct Tests {
    Tests(Session& session, const char* name, int width, int primitives, double overlap, std::size_t rounds) {
        const DeviceScene scene = device_scene(reference::random_mixture(KernelFamily::gaussian, primitives, 3, overlap, 2), "bvh");
        program = std::make_unique<SceneProgram>(session, "roofline.cl", scene, defines_of(scene, width));
        kernel = program->kernel(name);
        rays = Buffer<ProbeRay>(program->queue, inside_rays(scene, kRays, 4));
        launch = std::make_unique<SizedLaunch>(session, program->queue, kernel, [this, rounds](std::size_t count, Buffer<float>& out) {
            program->set(kernel, rays, out, cl_uint(count), cl_uint(rounds), cl_uint(kRays));
        });
    }
    std::unique_ptr<SceneProgram> program;
    cl::Kernel kernel;
    Buffer<ProbeRay> rays;
    std::unique_ptr<SizedLaunch> launch;
};

void add(Session& session, const std::string& item, const char* kernel, int width, int primitives, double overlap, std::size_t rounds, double items, Cost cost) {
    add_kernel_benchmark(session, item, [=, &session, tests = std::shared_ptr<Tests>()](std::uint32_t) mutable {
        if (!tests) tests = std::make_shared<Tests>(session, kernel, width, primitives, overlap, rounds);
        const double s = (*tests->launch)();
        return Launch{items * static_cast<double>(tests->launch->items()), s, cost};
    });
}

/// Rays through a scene's accelerator.
struct Walk {
    Walk(Session& session, const std::string& scene_name, const char* accelerator, const std::string& from) {
        const Scene scene = bench_scene(scene_name);
        const bool bvh = std::string(accelerator) == "bvh";
        const DeviceScene device = device_scene(scene, accelerator);
        const char* name = bvh ? "walk_bvh" : "walk_cells";
        std::vector<ProbeRay> list;
        {
            Probe probe(session.device(), device);
            list = camera_rays(probe, scene.film.width, scene.film.height, 2, 0);
        }
        if (from == "inside") list = inside_rays(device, list.size(), 1);
        if (from == "incoherent") list = crossing_rays(device, list.size(), 2);
        const auto make = [&](bool count) {
            ProgramOptions options = defines_of(device, 1);
            std::erase_if(options.defines, [](const auto& define) { return define.first == "CLUME_COUNT"; });
            options.define("CLUME_COUNT", count);
            program = std::make_unique<SceneProgram>(session, "roofline.cl", device, options);
            kernel = program->kernel(name);
            rays = Buffer<ProbeRay>(program->queue, list);
            out = Buffer<float>(program->queue, list.size());
            program->set(kernel, rays, out, cl_uint(list.size()));
            launch();
        };
        make(true);
        const std::vector<float> counts = out.download();
        const double steps = std::accumulate(counts.begin(), counts.end(), 0.0) / static_cast<double>(counts.size());
        cost = bvh ? Cost{(operations("node") + child_operations) * (steps * BVH_ARITY), steps * sizeof(device::BvhNode), steps, static_cast<double>(device.nodes.size() * sizeof(device::BvhNode))}
                   : Cost{cell_step_operations * steps, steps * sizeof(device::CellEntry), steps, static_cast<double>(device.cells.size() * sizeof(device::CellEntry))};
        make(false);
    }
    double launch() { return program->queue.launch(kernel, rays.size(), program->queue.info().group_size()); }
    std::unique_ptr<SceneProgram> program;
    cl::Kernel kernel;
    Buffer<ProbeRay> rays;
    Buffer<float> out;
    Cost cost;
};

}  // namespace

void add_accelerator_benchmarks(Session& session) {
    const double group_bytes = CLUME_GROUP_FLOATS * sizeof(float);
    add(session, "node", "node_tests", 1, 8192, 8, kNodes, static_cast<double>(kNodes * BVH_ARITY), {operations("node"), 24, 0, kNodes * sizeof(device::BvhNode)});
    // Half of the lanes are hit: so many at least are evaluated.
    const Operations tests = operations("intersect_whitened"), draw = operations("primitive_bits") + operations("exponential");
    for (const int width : kernel_widths(session)) {
        const auto leaf = [&](const char* item, const char* kernel, const Operations& evaluation) {
            add(session, with_width(item, width), kernel, width, static_cast<int>(kLeaves * CLUME_GROUP_SIZE), 60, kLeaves, static_cast<double>(kLeaves * CLUME_GROUP_SIZE),
                {tests + evaluation * 0.5, 44, 0, static_cast<double>(kLeaves) * group_bytes});
        };
        leaf("leaf/flight", "leaf_decompose", draw + operations("inverse/gaussian"));
        leaf("leaf/depth", "leaf_depth", operations("depth/gaussian"));
    }
    for (const char* scene : {"ball", "close"})
        for (const char* accelerator : {"cells", "bvh"})
            for (const char* from : ray_sets)
                add_kernel_benchmark(session, fmt::format("walk/{}/{}/{}", scene, accelerator, from), [=, &session, walk = std::shared_ptr<Walk>()](std::uint32_t) mutable {
                    if (!walk) walk = std::make_shared<Walk>(session, scene, accelerator, from);
                    const double s = walk->launch();
                    return Launch{static_cast<double>(walk->rays.size()), s, walk->cost};
                });
}

}  // namespace clume::bench
