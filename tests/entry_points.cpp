// SPDX-License-Identifier: MIT
#include "tests/entry_points.h"

#include <bit>

#include "bench/scene_program.h"
#include "src/self_test.h"
#include "src/stress_device.h"
#include "tests/cases.h"
#include "tests/device_image.h"

namespace clume::test {
namespace {

using namespace probing;

template <class Value>
void keep(Outputs& outputs, const std::string& name, const std::vector<Value>& values) {
    static_assert(sizeof(Value) % 4 == 0);
    std::vector<std::uint32_t>& words = outputs[name];
    for (const Value& v : values) {
        const auto all = std::bit_cast<std::array<std::uint32_t, sizeof(Value) / 4>>(v);
        words.insert(words.end(), all.begin(), all.end());
    }
}

std::vector<float> arguments(const cases::MathCase& d, std::size_t count) {
    TestRandom random(7);
    std::vector<float> x{d.lo, d.hi};
    while (x.size() < count) {
        const double lo = static_cast<double>(d.lo), hi = static_cast<double>(d.hi);
        x.push_back(std::clamp(static_cast<float>(d.log_spaced ? random.spread(lo, hi) : random.uniform(lo, hi)), d.lo, d.hi));
    }
    return x;
}

/// Lights of every kind; with those of `mixed_scene` all seven.
void add_lights(Scene& scene) {
    for (const LightKind kind : {LightKind::point, LightKind::spot, LightKind::sphere, LightKind::rectangle, LightKind::constant}) {
        scene.lights.push_back(cases::light(kind));
        if (kind == LightKind::point) scene.lights.back().position = {0.2, 0.1, -0.15};  // amid medium
    }
}

}  // namespace

std::span<const MethodCase> method_cases() {
    static const MethodCase cases[] = {
        {{"delta", "analytic", "tree", "newton", "bvh", "sobol"}, true},
        {{"delta", "ratio", "grid"}, true},
        {{"delta", "residual-ratio", "scene"}, true},
        {{"decomposition", "analytic", "auto", "newton", "cells"}, false},
        {{"decomposition", "binary", "auto", "newton", "bvh", "sobol"}, false},
        {{"regular", "residual-ratio", "tree"}, true},
        {{"regular", "analytic", "auto", "bisection", "cells"}, true},
        {{"regular-linear", "march"}, true},
        {{"march-analytic", "ratio", "tree"}, true},
        {{"march", "march", "auto", "newton", "bvh"}, true},
        {{"progressive", "binary", "tree"}, true},
        {{"progressive", "analytic", "scene"}, true},
    };
    return cases;
}

Scene everything(bool grids) {
    Scene scene = grids ? mixed_grid_scene() : mixed_scene();
    scene.film = {16, 16};
    scene.render.rr_depth = 2;
    scene.media[2].phase = {PhaseKind::rayleigh, 0};
    add_lights(scene);
    if (!grids) return scene;
    GridMedium fire = grid_medium(voxel_grid({0, 0, 0}, {9, 11, 10}, random_samples(5), false, glm::dmat3(0.1), {-0.2, -0.9, -0.6}), 4, Interpolation::nearest);
    fire.emission_grid = voxel_grid({0, 0, 0}, {9, 11, 10}, random_samples(6), false, glm::dmat3(0.1), {-0.2, -0.9, -0.6});
    fire.emission = {2, 1, 0.5};
    scene.grids.push_back(fire);
    return scene;
}

Scene hardly_anything() {
    Scene scene = reference::random_mixture(KernelFamily::gaussian, 40, 12, 12, 3);
    scene.film = {16, 16};
    scene.camera.kind = CameraKind::orthographic;
    scene.camera.width = 2.2;
    for (Primitive& p : scene.media[0].primitives) p.albedo = glm::dvec3(0.8);
    return scene;
}

Scene scene_of(const MethodCase& c) { return everything(c.grids); }

DeviceScene packed(const Scene& scene, const Pair& pair) {
    Scene s = scene;
    s.render.strategy = pair.strategy;
    s.render.transmittance = pair.estimator;
    s.render.bound = pair.bound;
    s.render.root_finding = pair.root;
    s.render.sobol = pair.sobol();
    RenderOptions options;
    options.accelerator = pair.accelerator;
    return make_device_scene(s, options);
}

Outputs run_building_blocks(const DeviceInfo& device, int width, std::size_t count) {
    Outputs out;
    Probe probe(device, width);
    const SelfTestResult arithmetic = self_test(device, width);
    out["probe_arithmetic"] = {arithmetic.error.empty() ? 0u : 1u, arithmetic.outside_exact_set.empty() ? 0u : 1u};
    out["probe_words"] = {arithmetic.error.empty() ? 0u : 1u};
    for (const cases::MathCase& d : cases::math_functions) {
        const std::vector<float> x = arguments(d, count);
        std::vector<float> y;
        TestRandom random(8);
        for (const float v : x) y.push_back(d.f == MathFunction::erf_between ? v + 2 : static_cast<float>(random.spread(1e-3, 1e3)));
        keep(out, std::string("probe_math ") + d.name, probe.math(d.f, x, y));
    }

    TestRandom random(11), depths(12), lamps(13);
    std::vector<Probe::Words> counters(count), keys(count);
    for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < 4; ++k) counters[i].v[k] = random.word(), keys[i].v[k] = random.word();
    keep(out, "probe_draw", sobol_probe(device, width).draws(counters, 17, 19));
    keep(out, "probe_philox", probe.philox(counters, keys));
    keep(out, "probe_primitive_bits", probe.primitive_bits(3, 17, 19, count));
    for (const cases::PhaseCase& phase : cases::phases)
        for (const float g : {0.0f, 0.9f, -0.4f}) keep(out, fmt::format("probe_phase {} {}", phase.kind, g), probe.phases(phase.kind, g, {0.48f, 0.6f, 0.64f}, 5, count));

    std::vector<Probe::LampView> views;
    std::vector<float> places;
    for (std::size_t i = 0; i < count; ++i) {
        const auto t0 = static_cast<float>(lamps.uniform(0, 2));
        views.push_back({static_cast<float>(lamps.uniform(-1, 3)), static_cast<float>(lamps.spread(1e-6, 2)), t0, t0 + static_cast<float>(lamps.spread(1e-3, 3))});
        places.push_back(static_cast<float>(lamps.uniform(0, 1)));
    }
    keep(out, "probe_lamp", probe.lamp_places(views, places));

    // A group of overlapping ellipsoids for each ray.
    const SharedArray<float> groups = packed(everything(false), {"decomposition", "analytic", "auto", "newton", "bvh"}).groups;
    std::vector<float> in;
    std::vector<ProbeGroupRay> rays;
    for (const ProbeRay& r : random_rays(count, 9, 0.5)) {
        ProbeGroupRay g;
        std::copy_n(r.origin, 3, g.origin);
        std::copy_n(r.direction, 3, g.direction);
        g.t1 = r.t_end;
        g.tau = static_cast<float>(depths.spread(1e-3, 10));
        rays.push_back(g);
        const std::size_t at = in.size() % groups.size();
        in.insert(in.end(), groups.begin() + static_cast<std::ptrdiff_t>(at), groups.begin() + static_cast<std::ptrdiff_t>(at + CLUME_GROUP_FLOATS));
    }
    for (const cases::FamilyCase& family : cases::families)
        for (const bool quadratic : {false, true}) keep(out, fmt::format("probe_group {} {}", family.bit, quadratic), probe.groups(rays, in, family.bit, 6.25f, quadratic));
    // Its sums over lanes are for timing alone: their order is the width's.
    if (probe.width() == 16) keep(out, "probe_group_work", probe.group_work(GroupWork::flight, rays, groups, FAMILY_GAUSSIAN, 6.25f).values);
    return out;
}

Outputs run_stress_kernels(const DeviceInfo& device, std::size_t count) {
    Outputs out;
    StressDevice stress(device);
    const DeviceScene scene = packed(everything(false), {"decomposition", "analytic", "auto", "newton", "bvh"});
    TestRandom random(31);
    const auto unit = [&] { return static_cast<float>(random.uniform(0, 1)); };
    std::vector<ProbeGroupRay> group_rays;
    std::vector<float> groups, versines;
    std::vector<device::float4> directions, points;
    std::vector<StressBits> bits;
    std::vector<StressDevice::FilmPoint> film;
    const std::vector<ProbeRay> rays = random_rays(count, 33, 0.5);
    for (std::size_t i = 0; i < count; ++i) {
        ProbeGroupRay& g = group_rays.emplace_back();
        std::copy_n(rays[i].origin, 3, g.origin);
        std::copy_n(rays[i].direction, 3, g.direction);
        g.t1 = rays[i].t_end;
        const std::size_t at = i * CLUME_GROUP_FLOATS % scene.groups.size();
        groups.insert(groups.end(), scene.groups.begin() + static_cast<std::ptrdiff_t>(at), scene.groups.begin() + static_cast<std::ptrdiff_t>(at + CLUME_GROUP_FLOATS));
        directions.push_back({rays[i].direction[0], rays[i].direction[1], rays[i].direction[2], 0.5f});
        points.push_back({unit(), unit(), unit(), 0});
        versines.push_back(2 * unit());
        film.push_back({static_cast<std::uint32_t>(i % 16), 3, unit(), unit()});
        for (int block = 0; block < 2; ++block) bits.push_back({{random.word(), random.word(), random.word(), random.word()}});
    }
    for (const cases::FamilyCase& family : cases::families) {
        keep(out, fmt::format("stress_naive {}", family.bit), stress.naive(group_rays, groups, family.bit, 6.25f));
        keep(out, fmt::format("stress_given {}", family.bit), stress.given(group_rays, groups, family.bit, 6.25f));
    }
    for (const cases::PhaseCase& phase : cases::phases) keep(out, fmt::format("stress_phase {}", phase.kind), stress.phase(phase.kind, directions, versines, bits).directions);
    keep(out, "stress_camera", stress.camera(scene, film));
    for (const cases::LightCase& light : cases::lights) {
        Scene lit = hardly_anything();
        lit.lights = {cases::light(light.kind)};
        const DeviceScene one = packed(lit, {"decomposition", "analytic", "auto", "newton", "bvh"});
        keep(out, std::string("stress_light ") + light.name, stress.lights(one, points, bits));
        if (light.kind == LightKind::envmap) keep(out, "stress_environment", stress.environment(one, bits, directions).directions);
    }
    keep(out, "stress_transmittance", stress.transmittances(scene, rays));
    return out;
}

Outputs run_bench_kernels(const DeviceInfo& device, int width) {
    constexpr std::size_t kItems = 8, kRounds = 2;
    const cl_uint count = kItems, rounds = kRounds;
    Outputs out;
    Queue queue(device);
    TestRandom random(41);
    std::vector<float> numbers;
    while (numbers.size() < 4096) numbers.push_back(static_cast<float>(random.uniform(0.05, 0.95)));
    const Buffer<float> in(queue, numbers), result(queue, kItems);
    const std::vector<ProbeRay> from = random_rays(kItems, 43, 0.5);
    const Buffer<ProbeRay> rays(queue, from);
    std::vector<device::float4> way;
    for (const ProbeRay& r : from) way.push_back({r.direction[0], r.direction[1], r.direction[2], 0});
    const Buffer<device::float4> directions(queue, way), sums(queue, kItems);
    const Buffer<std::uint32_t> faces(queue, std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0, 3, 6, 1, 4, 7, 2, 5, 8, 9, 0, 4, 10, 1, 5, 11, 2, 6, 3, 7,
                                                                        0, 8, 4, 1, 9, 5, 2, 10, 6, 3, 11, 7, 0, 1, 4, 5, 2, 3, 6, 7, 8, 9, 10, 11, 0, 2, 4, 6});

    ProgramOptions general;
    general.define("CLUME_WIDTH", width);

    const cl::Program peaks = build_program(queue, "peaks.cl", general);
    const auto run = [&](const cl::Program& program, const char* name, const auto& output, const auto&... args) {
        cl::Kernel kernel = make_kernel(queue, program, name);
        set_args(queue, kernel, 0, args...);
        queue.launch(kernel, kItems, kItems);
        keep(out, fmt::format("{} w{}", name, width), output.download());
    };
    run(peaks, "peak_fma", result, result, count, rounds, 0.9f, 0.1f);
    run(peaks, "peak_fma_add", result, result, count, rounds, 0.9f, 0.1f);
    run(peaks, "peak_read", result, in, result, count, cl_uint(15), rounds, cl_uint(1));
    run(peaks, "peak_gather", result, in, result, count, cl_uint(127), rounds, cl_uint(1));
    run(peaks, "peak_nothing", result, result, count);

    const SharedArray<float> groups = packed(everything(false), {"decomposition", "analytic", "auto", "newton", "bvh"}).groups;
    const Buffer<float> group(queue, groups);
    const cl::Program proxy = build_program(queue, "proxy.cl", general);
    for (cl_uint what = 0; what < 4; ++what) run(proxy, "proxy_lines", sums, group, in, faces, in, rays, sums, 2.5f, count, cl_uint(1), 6.25f, what);

    const cl::Program sorts = build_program(queue, "sorts.cl", ProgramOptions().define("CLUME_WIDTH", width).define("SORT_COUNT", 16));
    const Buffer<float> keys(queue, kItems * 16);
    const Buffer<std::uint32_t> ids(queue, kItems * 16);
    for (const char* name : {"bitonic", "odd_even", "insertion"}) run(sorts, name, keys, in, keys, ids, count, count);

    const cl::Program roofline = build_program(queue, "roofline.cl", general);
    const DeviceScene with_bvh = packed(everything(false), {"regular", "analytic", "auto", "newton", "bvh"}), with_cells = packed(everything(false), {"regular", "analytic", "auto", "newton", "cells"});
    const SceneBuffers bvh(queue, with_bvh), cells(queue, with_cells);
    const auto run_scene = [&](const cl::Program& program, const SceneBuffers& scene, const std::string& name, const auto& output, const auto&... args) {
        cl::Kernel kernel = make_kernel(queue, program, name.c_str());
        scene.bind(queue, kernel);
        set_args(queue, kernel, SceneBuffers::kArgs, args...);
        queue.launch(kernel, kItems, kItems);
        keep(out, fmt::format("{} w{}", name, width), output.download());
    };
    std::string names = roofline.getInfo<CL_PROGRAM_KERNEL_NAMES>();
    std::replace(names.begin(), names.end(), ';', ' ');
    std::istringstream all(names);
    for (std::string name; all >> name;) {
        const char* n = name.c_str();
        if (name.starts_with("own_") || name.starts_with("built_in_")) run(roofline, n, result, in, result, count, rounds);
        else if (name.starts_with("random_")) run(roofline, n, result, result, count, rounds);
        else if (name.starts_with("phase_")) run(roofline, n, result, directions, result, count, rounds, 0.5f);
        else if (name == "film_samples") run(roofline, n, result, directions, result, count, rounds);
        else if (name == "light_samples" || name == "environment_lookups") run_scene(roofline, bvh, name, result, directions, result, count, rounds);
        else if (name == "node_tests" || name.starts_with("leaf_")) run_scene(roofline, bvh, name, result, rays, result, count, rounds, count);
        else if (name == "walk_bvh") run_scene(roofline, bvh, name, result, rays, result, count);
        else if (name == "walk_cells") run_scene(roofline, cells, name, result, rays, result, count);
        else if (name == "walk_segments") run_scene(roofline, bvh, name, sums, rays, sums, count, rounds);
        else throw std::logic_error(name + ": how is it called?");
    }
    ProgramOptions counting = bench::defines_of(with_bvh, width);
    std::erase_if(counting.defines, [](const auto& define) { return define.first == "CLUME_COUNT"; });
    counting.define("CLUME_COUNT", 1);
    const Buffer<std::uint64_t> work(queue, kItems * (WORK_KINDS + 1));
    run_scene(build_program(queue, "roofline.cl", counting), bvh, "count_ray", work, rays, work, count, cl_uint(9));
    return out;
}

Outputs run_method(const DeviceInfo& device, int width, const Scene& scene, const Pair& pair, std::size_t count, std::uint32_t spp) {
    Outputs out;
    const DeviceScene s = packed(scene, pair);
    const std::string name = pair.name();
    if (count > 0) {
        Probe probe(device, s, width);
        const std::vector<ProbeRay> rays = random_rays(count, 21);
        const auto flights = probe.flights(rays, 1).values;
        keep(out, "probe_ray flight " + name, flights);
        if (s.lanes) keep(out, "probe_flights " + name, flights);  // that kernel made them
        keep(out, "probe_ray transmittance " + name, probe.transmittances(rays).values);
        keep(out, "probe_ray estimate " + name, probe.estimated_transmittances(rays, 2).values);
        keep(out, "probe_ray roulette " + name, probe.roulette_transmittances(rays, 3).values);
        for (device::uint g = 0; g < scene.grids.size(); ++g) keep(out, fmt::format("probe_grid {} {}", g, name), probe.grid(rays, g).values);
        std::vector<std::uint32_t> pixels(16 * 16);
        for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint32_t>(i);
        keep(out, "probe_camera " + name, probe.camera_rays(pixels, 1));
    }
    const DeviceImage image = render_device(scene, s, spp, device, width);
    std::vector<std::uint32_t>& words = out[fmt::format("render {} spp {}", spp, name)];
    for (const FilmSums::Pixel& p : image.values)
        for (const double v : {p.mean[0], p.mean[1], p.mean[2], p.alpha}) {
            const auto b = std::bit_cast<std::uint64_t>(v);
            words.push_back(static_cast<std::uint32_t>(b));
            words.push_back(static_cast<std::uint32_t>(b >> 32));
        }
    return out;
}

}  // namespace clume::test
