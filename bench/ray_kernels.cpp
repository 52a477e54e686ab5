// SPDX-License-Identifier: MIT
// Rays through whole scenes: free flights of every strategy and transmittances of every estimator; from the camera
// (coherent), from outside (incoherent) and from inside. An item is a ray. What it takes is counted by a program of its own.
#include <fmt/format.h>

#include <functional>
#include <map>
#include <memory>

#include "bench/kernels.h"
#include "bench/operations.h"
#include "bench/rays.h"
#include "bench/scene_program.h"
#include "bench/scenes.h"
#include "src/strategies.h"
#include "tests/cases.h"

namespace clume::bench {
namespace {

/// A scene as a method sees it.
struct View {
    std::string scene, strategy, estimator, accelerator;
    bool shadow_rays;  ///< the estimator is what is measured
    std::string key() const { return scene + ' ' + strategy + ' ' + estimator + ' ' + accelerator + (shadow_rays ? " lit" : ""); }
};

/// Rays of one set, and what one takes.
struct Rays {
    std::vector<ProbeRay> list;
    Cost cost;
};

/// The view, its probe at one width, and rays of the items measured so far. Only the last one asked for is kept.
struct Field {
    DeviceScene device;
    std::unique_ptr<Probe> probe;
    std::map<std::string, Rays> rays;
    std::string family;
    Film film;
    int width = 0;
};

Field& field(Session& session, const View& view, int width) {
    static std::string scene_key, probe_key;
    static Field f;
    if (view.key() != scene_key) {
        f = {};
        Scene scene = bench_scene(view.scene);
        scene.render.strategy = view.strategy;
        scene.render.transmittance = view.estimator;
        // Where no light is sampled, nothing is built for an estimator.
        if (view.shadow_rays) scene.lights.push_back(cases::light(LightKind::directional));
        for (const cases::FamilyCase& c : cases::families)
            if (c.kernel == scene.media[0].kernel) f.family = c.name;
        f.film = scene.film;
        RenderOptions options = session.render_options();
        options.accelerator = view.accelerator;
        f.device = make_device_scene(scene, options);
        scene_key = view.key();
        probe_key.clear();
    }
    if (const std::string key = view.key() + ' ' + std::to_string(width); key != probe_key) {
        f.probe.reset();
        f.rays.clear();
        f.width = width;
        f.probe = std::make_unique<Probe>(session.device(), f.device, width);
        probe_key = key;
    }
    return f;
}

double byte_size(const auto& vector) { return static_cast<double>(vector.size() * sizeof(vector[0])); }

/// Every n-th of them, so that about `count` are left: all parts of an image take part.
std::vector<ProbeRay> spread(const std::vector<ProbeRay>& rays, std::size_t count) {
    std::vector<ProbeRay> some;
    for (std::size_t i = 0; i < rays.size(); i += std::max<std::size_t>(1, rays.size() / count)) some.push_back(rays[i]);
    return some;
}

/// What a ray takes on average, `what` as in count_ray: operations counted by the engine (WORK_*) and evaluations of vectors, by
/// about a thousand rays. What is not among these (sorting chords, picking a primitive) is left out.
Cost count(Session& session, const Field& f, const std::vector<ProbeRay>& all, cl_uint what) {
    const std::vector<ProbeRay> rays = spread(all, 1024);
    ProgramOptions options = defines_of(f.device, f.width);
    std::erase_if(options.defines, [](const auto& define) { return define.first == "CLUME_COUNT"; });
    options.define("CLUME_COUNT", 1);
    options.define("CLUME_TALLY", static_cast<long long>(f.device.learned.size()));
    options.optimised = false;  // sooner built
    constexpr std::size_t tallies = 6, words = WORK_KINDS + 1;
    SceneProgram program(session, "roofline.cl", f.device, options);
    program.buffers.raised = Buffer<device::uint>(program.queue, std::vector<device::uint>(f.device.learned.size() + tallies), CL_MEM_READ_WRITE);
    const Buffer<ProbeRay> in(program.queue, rays);
    const Buffer<device::ulong> out(program.queue, rays.size() * words);
    cl::Kernel kernel = program.kernel("count_ray");
    program.set(kernel, in, out, cl_uint(rays.size()), what);
    program.queue.launch(kernel, rays.size(), program.queue.info().group_size());
    const auto per_ray = [&](auto n) { return static_cast<double>(n) / static_cast<double>(rays.size()); };
    std::array<double, WORK_KINDS> n{};
    const std::vector<device::ulong> counts = out.download();
    for (std::size_t i = 0; i < counts.size(); ++i)
        if (i % words < WORK_KINDS) n[i % words] += per_ray(counts[i]);
    std::vector<device::uint> tally(tallies);
    program.buffers.raised.download(std::span<device::uint>(tally), f.device.learned.size());
    std::array<double, tallies> evaluated{};
    for (std::size_t k = 0; k < tallies; ++k) evaluated[k] = per_ray(tally[k]) * (k < 4 ? f.width : 16);

    Cost cost;
    const DeviceScene& d = f.device;
    const Operations own[] = {operations("intersect_whitened"), operations("density/" + f.family), operations("depth/" + f.family), operations("inverse/" + f.family), operations("depth/" + f.family), operations("exp")};
    for (std::size_t k = 0; k < tallies; ++k) cost.operations = cost.operations + own[k] * evaluated[k];
    cost.operations = cost.operations + cell_step_operations * n[WORK_CELLS] + (operations("node") + child_operations) * (n[WORK_NODES] * BVH_ARITY) + operations("philox") * n[WORK_DRAWS] +
                      (operations("kernel/" + f.family) + operations("uniform") + operations("exponential") + tentative_operations) * n[WORK_PRIMITIVES];
    // Of a group 10 of its 11 rows are read, of a cell also the description of its leaf where densities are looked up.
    cost.bytes = n[WORK_CELLS] * sizeof(device::CellEntry) + n[WORK_NODES] * sizeof(device::BvhNode) + n[WORK_GROUPS] * 10 * CLUME_GROUP_SIZE * sizeof(float) +
                 n[WORK_DENSITIES] * sizeof(device::CellLeaf) + n[WORK_PRIMITIVES] * (sizeof(device::Reference) + sizeof(device::Primitive));
    cost.gathers = n[WORK_CELLS] + n[WORK_NODES] + n[WORK_GROUPS] + n[WORK_DENSITIES] + 2 * n[WORK_PRIMITIVES];
    cost.footprint = (n[WORK_CELLS] > 0 ? byte_size(d.cells) + byte_size(d.leaves) : 0) + (n[WORK_NODES] > 0 ? byte_size(d.nodes) : 0) + (n[WORK_GROUPS] > 0 ? byte_size(d.groups) : 0) +
                     (n[WORK_PRIMITIVES] > 0 ? byte_size(d.references) + byte_size(d.primitives) : 0);
    return cost;
}

/// Rays of the set, as many as a launch can do in a quarter of a second, but no more than 2^14 or so, on a GPU 2^20.
/// `run` gives seconds.
Rays make_rays(Session& session, Field& f, const std::string& from, cl_uint what, const std::function<double(const std::vector<ProbeRay>&)>& run) {
    const auto make = [&](int stride, std::uint32_t sample = 0) {
        std::vector<ProbeRay> list = camera_rays(*f.probe, f.film.width, f.film.height, stride, sample);
        return from == "coherent" ? list : from == "inside" ? inside_rays(f.device, list.size(), 2 * sample + 1) : crossing_rays(f.device, list.size(), 2 * sample + 2);
    };
    int stride = 2;
    std::vector<ProbeRay> list = make(stride);
    const std::vector<ProbeRay> some = spread(list, 64);
    const double s = run(some) / static_cast<double>(some.size()), most_s = session.options().quick ? 0.05 : 0.25;
    while (s * static_cast<double>(list.size()) > most_s && list.size() > 256) list = make(++stride);
    if (copies_to_fill(session) > 1) {
        const double copies = std::min(static_cast<double>(copies_to_fill(session)), most_s / run(list));
        for (std::uint32_t sample = 1; sample < copies; ++sample) {
            const std::vector<ProbeRay> more = make(stride, sample);
            list.insert(list.end(), more.begin(), more.end());
        }
    }
    return {list, count(session, f, list, what)};
}

/// "name", or "name_bvh" where the accelerator is a choice.
struct Choice {
    std::string name;
    View view;
    bool has_width;
};

/// Every strategy and estimator of the tables (src/strategies.h), on either accelerator where it visits chords by its own choice.
std::vector<Choice> choices(const std::string& scene, bool flights) {
    std::vector<Choice> all;
    for (const Method& m : flights ? strategies() : estimators()) {
        const bool either = m.name == std::string(flights ? "decomposition" : "analytic");
        // Estimates by null collisions look at one primitive at a time: the width changes nothing. Flights go side by side.
        const bool has_width = flights || (!m.null_collisions && m.program != TRANSMITTANCE_BINARY);
        for (const char* accelerator : either ? std::vector<const char*>{"cells", "bvh"} : std::vector<const char*>{"auto"})
            all.push_back({either ? fmt::format("{}_{}", m.name, accelerator) : m.name,
                           {scene, flights ? m.name : either ? "decomposition" : "delta", flights ? "analytic" : m.name, accelerator, !flights}, has_width});
    }
    return all;
}

}  // namespace

void add_ray_benchmarks(Session& session) {
    for (const char* scene : {"ball", "close"})
        for (const bool flights : {true, false})
            for (const Choice& c : choices(scene, flights))
                for (const int width : kernel_widths(session)) {
                    if (!c.has_width && width != kernel_widths(session).front()) continue;
                    for (const char* from : ray_sets) {
                        const std::string name = fmt::format("{}/{}/{}/{}", flights ? "flight" : "transmittance", scene, c.name, from);
                        add_kernel_benchmark(session, c.has_width ? with_width(name, width) : name, [=, &session](std::uint32_t number) {
                            Field& f = field(session, c.view, width);
                            const auto run = [&](const std::vector<ProbeRay>& rays) { return flights ? f.probe->flights(rays, number).device_s : f.probe->estimated_transmittances(rays, number).device_s; };
                            auto rays = f.rays.find(name);
                            if (rays == f.rays.end()) rays = f.rays.emplace(name, make_rays(session, f, from, flights ? 1 : 8, run)).first;
                            return Launch{static_cast<double>(rays->second.list.size()), run(rays->second.list), rays->second.cost};
                        });
                    }
                }
}

}  // namespace clume::bench
