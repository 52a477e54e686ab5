// SPDX-License-Identifier: MIT
// Voxel grids on the device, one building block at a time, against double precision: density, exact depth and its inverse,
// emission, bounds, layouts.
#include <fmt/format.h>

#include "tests/grid_scenes.h"

namespace {

using namespace clume;
using namespace clume::probing;
using reference::HostGrid;

struct Case {
    std::string name;
    Scene scene;
};

constexpr auto kTrilinear = Interpolation::trilinear;
constexpr auto kNearest = Interpolation::nearest;

/// Dense and sparse, both interpolations, odd sizes, far and negative lattice positions, turned and mirrored.
std::vector<Case> grid_cases() {
    std::vector<Case> all;
    const auto axes = turned_axes(0.1);
    for (const Interpolation i : {kTrilinear, kNearest}) {
        const std::string how = i == kTrilinear ? "trilinear" : "nearest";
        all.push_back({"dense " + how, grid_scene(grid_medium(voxel_grid({0, 0, 0}, {21, 17, 26}, random_samples(1)), 0.7, i))});
        all.push_back({"dense turned " + how, grid_scene(grid_medium(voxel_grid({-5, 3, 100}, {19, 30, 117}, random_samples(2), false, axes, {3, 40, -70}), 9, i))});
        all.push_back({"sparse " + how, grid_scene(grid_medium(voxel_grid({-9, -20, 5}, {30, 25, 47}, smooth_samples(20), true, axes, {500, -3000, 2}), 5, i))});
        VoxelGrid far = voxel_grid({-3, 2, 1}, {14, 13, 15}, random_samples(4), true, glm::dmat3(0.3));
        far.background = 0.25f;
        all.push_back({"sparse with a background " + how, grid_scene(grid_medium(far, 2, i))});
        all.push_back({"one voxel " + how, grid_scene(grid_medium(voxel_grid({4, 4, 4}, {5, 5, 5}, [](auto) { return 2.0; }), 3, i))});
        Scene two = grid_scene(grid_medium(voxel_grid({0, 0, 0}, {1, 1, 1}, [](auto) { return 1.0; }), 1, i));
        // Clusters far apart: empty space is leapt over.
        two.grids[0].density = voxel_grid({0, 0, 0}, {200, 190, 180}, [](const glm::ivec3& p) { return glm::ivec3(p.x % 64 / 8, p.y % 80 / 8, p.z % 72 / 8) == glm::ivec3(0) ? 1.0 + 0.1 * (p.x % 3) : 0.0; }, true, glm::dmat3(0.02));
        all.push_back({"clusters " + how, two});
    }
    return all;
}

/// Rays through the grid's support from outside and inside, some along its lattice's axes, some ending within.
std::vector<ProbeRay> rays_through(const Scene& scene, const DeviceScene& device, std::size_t count, std::uint64_t seed) {
    const HostGrid host = host_density(scene.grids[0]);
    const Normalization& n = device.normalization;
    TestRandom random(seed);
    const auto point = [&](double grow) {
        const glm::dvec3 u(random.uniform(), random.uniform(), random.uniform()), half = 0.5 * (host.upper() - host.lower());
        return (host.to_world(0.5 * (host.lower() + host.upper()) + grow * half * (2.0 * u - 1.0)) - n.center) * n.scale;
    };
    std::vector<ProbeRay> rays;
    for (std::size_t i = 0; i < count; ++i) {
        // Towards a brick that holds something, from inside one or from outside.
        const VoxelGrid& g = scene.grids[0].density;
        const auto held = [&] {
            const glm::dvec3 u(random.uniform(), random.uniform(), random.uniform());
            glm::dvec3 p = glm::dvec3(g.brick_origins[static_cast<std::size_t>(random.below(static_cast<int>(g.brick_origins.size())))]) + 8.0 * u;
            for (int k = 0; k < 3; ++k)
                if (p[k] < host.lower()[k] || p[k] > host.upper()[k]) p[k] = host.lower()[k] + (host.upper()[k] - host.lower()[k]) * u[k];
            return (host.to_world(p) - n.center) * n.scale;
        };
        const glm::dvec3 o = i % 2 ? held() : point(3), to = held();
        glm::dvec3 d = to - o;
        if (i % 8 == 3) d = scene.grids[0].density.axes[static_cast<int>(i / 8 % 3)] * (i % 16 == 3 ? 1.0 : -1.0);
        if (i % 8 == 5) d = {i % 16 == 5 ? 1 : -1, -0.0, 0.0};
        rays.push_back(ray(o, d, i % 4 == 1 ? random.spread(0.02, 1) : 1e30));
        rays.back().unused = static_cast<float>(random.spread(0.01, 3));
    }
    return rays;
}

/// How far depths may be off: 1e-6 of the depth, and what rounding of positions (2^-20 of the table's cells) makes of them. It
/// moves a density that has slopes sideways, and a crossing between two voxels by its size over the ray's speed across.
double allowed(const HostGrid& host, const WorldRay& r, double depth, Interpolation interpolation) {
    const glm::dvec3 cells = host.upper() - host.lower(), speed = glm::abs(host.to_lattice(r.origin + r.direction) - host.to_lattice(r.origin));
    const double most = std::max({cells.x, cells.y, cells.z}), shift = 0x1p-20 * (most + 8);
    if (interpolation == kTrilinear) return 1e-6 * depth + shift * host.largest() / glm::length(speed) * std::sqrt(cells.x + cells.y + cells.z);
    return 1e-6 * depth + shift * host.largest() * (3 * most / glm::length(speed) + 1 / speed.x + 1 / speed.y + 1 / speed.z);
}

}  // namespace

TEST_CASE("Grids.DensityIsTheInterpolation", "[kernels]") {
    for (const Case& c : grid_cases()) {
        const DeviceScene device = make_device_scene(c.scene, {});
        const HostGrid host = host_density(c.scene.grids[0]);
        Probe probe(test_device(), device);
        // Points: the ends of short rays.
        auto rays = rays_through(c.scene, device, 4000, 3);
        TestRandom random(4);
        for (ProbeRay& r : rays)
            if (r.t_end > 1e3f) r.t_end = static_cast<float>(random.spread(0.01, 3));
        for (std::size_t i = 1; i < rays.size(); i += 2) rays[i].t_end = 1e-3f;
        const auto got = probe.grid(rays).values;
        std::size_t inside = 0, jumps = 0;
        double worst = 0;
        const double cells = std::max({host.upper().x - host.lower().x, host.upper().y - host.lower().y, host.upper().z - host.lower().z});
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const WorldRay w(rays[i], device.normalization);
            const double expected = host.at(w.origin + w.t_end * w.direction) / w.scale, value = static_cast<double>(got[i].density);
            inside += expected > 0;
            const double error = std::abs(value - expected) * w.scale / host.largest();
            // Where the density jumps (between voxels, at the support's faces), either side's will do: but that is rare.
            if (error > 2e-6 * (cells + 8)) ++jumps;
            else worst = std::max(worst, error);
        }
        INFO(c.name << ": " << jumps << " jumps, " << inside << " inside");
        CHECK(inside > 200);
        CHECK(jumps < 3 + (c.scene.grids[0].interpolation == kNearest ? rays.size() / 200 : 0));
        report(fmt::format("{}: density off by {:.2g} of the largest", c.name, worst));
    }
}

TEST_CASE("Grids.DepthEqualsQuadrature", "[kernels]") {
    for (const Case& c : grid_cases()) {
        const DeviceScene device = make_device_scene(c.scene, {});
        const HostGrid host = host_density(c.scene.grids[0]);
        const auto rays = rays_through(c.scene, device, 1600, 5);
        const auto got = Probe(test_device(), device).grid(rays).values;
        double worst = 0;
        std::size_t hit = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const WorldRay w(rays[i], device.normalization);
            const double expected = host.integral(w.origin, w.direction, 0, w.t_end), depth = static_cast<double>(got[i].depth);
            hit += expected > 0;
            INFO(c.name << ", ray " << i << ": depth " << depth << ", expected " << expected);
            if (expected > 0.01) worst = std::max(worst, std::abs(depth - expected) / expected);
            // A ray along an axis of the lattice may run within rounding of a face between voxels, or of the support.
            const bool along = i % 8 == 3 || i % 8 == 5;
            if (along && c.scene.grids[0].interpolation == kNearest) continue;
            CHECK(std::abs(depth - expected) <= allowed(host, w, expected, c.scene.grids[0].interpolation));
        }
        CHECK(hit > rays.size() / 4);
        report(fmt::format("{}: depth off by {:.2g} of itself, {} rays hit", c.name, worst, hit));
    }
}

TEST_CASE("Grids.DepthIsAdditive", "[kernels]") {
    for (const Case& c : grid_cases()) {
        const DeviceScene device = make_device_scene(c.scene, {});
        const HostGrid host = host_density(c.scene.grids[0]);
        Probe probe(test_device(), device);
        auto whole = rays_through(c.scene, device, 800, 6), first = whole, second = whole;
        TestRandom random(7);
        for (std::size_t i = 0; i < whole.size(); ++i) {
            whole[i].t_end = 6;
            first[i].t_end = static_cast<float>(random.spread(0.05, 3));
            second[i].t_end = 6 - first[i].t_end;
            for (int k = 0; k < 3; ++k) second[i].origin[k] = whole[i].origin[k] + first[i].t_end * whole[i].direction[k];
        }
        const auto a = probe.grid(whole).values, b = probe.grid(first).values, d = probe.grid(second).values;
        for (std::size_t i = 0; i < whole.size(); ++i) {
            if (c.scene.grids[0].interpolation == kNearest && (i % 8 == 3 || i % 8 == 5)) continue;
            const double sum = static_cast<double>(b[i].depth) + static_cast<double>(d[i].depth), all = static_cast<double>(a[i].depth);
            INFO(c.name << ", ray " << i << ": " << all << " whole, " << sum << " in two");
            CHECK(std::abs(sum - all) <= 2 * allowed(host, WorldRay(whole[i], device.normalization), all, c.scene.grids[0].interpolation));
        }
    }
}

TEST_CASE("Grids.InverseComesBack", "[kernels]") {
    for (const Case& c : grid_cases())
        for (const char* how : {"newton", "bisection"}) {
            Scene scene = c.scene;
            DeviceScene device = make_device_scene(scene, {});
            if (std::string(how) == "bisection") device.defines.emplace_back("CLUME_BISECTION", "1");
            const HostGrid host = host_density(scene.grids[0]);
            Probe probe(test_device(), device);
            auto rays = rays_through(scene, device, 1600, 8);
            const auto found = probe.grid(rays).values;
            std::size_t reached = 0;
            double worst = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const WorldRay w(rays[i], device.normalization);
                const double tau = static_cast<double>(rays[i].unused), all = host.integral(w.origin, w.direction, 0, w.t_end);
                const double slack = allowed(host, w, std::max(all, tau), scene.grids[0].interpolation);
                if (scene.grids[0].interpolation == kNearest && (i % 8 == 3 || i % 8 == 5)) continue;
                INFO(c.name << ", ray " << i << ": depth " << all << ", looked for " << tau << ", found at " << found[i].t);
                if (found[i].t > 1e29f) {
                    CHECK(all <= tau + slack);
                    continue;
                }
                ++reached;
                CHECK(found[i].t <= rays[i].t_end);
                const double back = host.integral(w.origin, w.direction, 0, static_cast<double>(found[i].t) / w.scale);
                worst = std::max(worst, std::abs(back - tau) / tau);
                CHECK(std::abs(back - tau) <= slack);
            }
            INFO(c.name);
            CHECK(reached > 30);
            report(fmt::format("{} by {}: depth at the inverse off by {:.2g} of it, {} reached", c.name, how, worst, reached));
        }
}

TEST_CASE("Grids.BoundsHold", "[kernels]") {
    // Over every brick and every cell of a table of bounds: the density at many points, the corners' among them, lies between
    // the two; and an upper bound is no higher than it must be.
    for (const Case& c : grid_cases()) {
        Scene scene = c.scene;
        const GridMedium& m = scene.grids[0];
        const HostGrid host = host_density(m);
        scene.render.bound = "grid";
        scene.render.majorant_grid = 7;
        const DeviceScene device = make_device_scene(scene, {});
        const device::GridInfo& info = device.grids[0];
        const double scale = device.normalization.scale, per_root = 8;
        CHECK(static_cast<double>(info.bound) * scale >= host.largest());
        CHECK(static_cast<double>(info.bound) * scale < host.largest() * (1 + 1e-5));
        TestRandom random(9);
        // Table to lattice: the support's lower corner is at `lower` in both.
        const glm::dvec3 corner(info.lower.x, info.lower.y, info.lower.z);
        const auto check = [&](const device::CellEntry& entry, const glm::dvec3& lo, double size) {
            const bool empty = entry.link < CELL_EMPTY_MAX;
            const double most = empty ? 0 : static_cast<double>(entry.majorant) * scale, least = empty ? 0 : static_cast<double>(from_bits(entry.reference)) * scale;
            for (int k = 0; k < 40; ++k) {
                glm::dvec3 u(random.uniform(), random.uniform(), random.uniform());
                if (k % 2 && m.interpolation == kTrilinear) u = glm::round(u * 8.0) / 8.0;
                const glm::dvec3 p = host.lower() + ((lo + size * u) - corner) * per_root;
                const double v = host.at_lattice(p);
                const bool inside = glm::all(glm::greaterThan(p, host.lower())) && glm::all(glm::lessThan(p, host.upper()));
                if (!(v <= most * (1 + 1e-6)) || (inside && v < least * (1 - 1e-6))) FAIL(c.name << ": " << v << " outside " << least << " to " << most);
            }
        };
        std::size_t full = 0;
        for (std::uint32_t z = 0; z < info.roots_z; ++z)
            for (std::uint32_t y = 0; y < info.roots_y; ++y)
                for (std::uint32_t x = 0; x < info.roots_x; ++x) {
                    const device::CellEntry& e = device.grid_cells[info.first_entry + x + info.roots_x * (y + static_cast<std::size_t>(info.roots_y) * z)];
                    full += e.link >= CELL_EMPTY_MAX;
                    check(e, glm::dvec3(x, y, z), 1);
                    if (e.link < CELL_EMPTY_MAX) continue;
                    // The least and the largest of the brick's own samples, which the density takes on at lattice points.
                    const int n = m.interpolation == kNearest ? 8 : 9;
                    float lowest = 1e30f, highest = 0;
                    for (int i = 0; i < n * n * n; ++i) {
                        const float v = device.grid_values[729 * (info.first_brick + e.link - CELL_EMPTY_MAX) + static_cast<std::size_t>(i % n + 9 * (i / n % n) + 81 * (i / n / n))];
                        lowest = std::min(lowest, v);
                        highest = std::max(highest, v);
                    }
                    CHECK(from_bits(e.reference) == lowest);
                    CHECK(e.majorant >= highest);
                    CHECK(e.majorant <= highest * 1.000002f);
                    CHECK((e.count == 1) == (lowest == highest));
                }
        CHECK(full > 0);
        const double size = 1 / static_cast<double>(info.bounds_scale);
        for (std::uint32_t i = 0; i < info.bounds_x * info.bounds_y * info.bounds_z; ++i)
            check(device.grid_cells[info.first_bound + i], corner + size * glm::dvec3(i % info.bounds_x, i / info.bounds_x % info.bounds_y, i / info.bounds_x / info.bounds_y), size);
    }
}

TEST_CASE("Grids.DenseAndSparseAgree", "[kernels]") {
    // The same samples, the outermost 0, in tables that begin at the same lattice point: nearest, the same bits; trilinear, and
    // with more zeros about the sparse one, which moves its table: the same but for rounding.
    const auto f = [](const glm::ivec3& p) { return p.x <= 1 || p.y <= 1 || p.z <= 1 || p.x >= 24 || p.y >= 22 || p.z >= 27 ? 0.0 : random_samples(6)(p); };
    for (const Interpolation i : {kTrilinear, kNearest}) {
        const glm::ivec3 lo(i == kNearest ? 0 : 1);
        Scene dense = grid_scene(grid_medium(voxel_grid(lo, {26, 24, 29}, f, false, glm::dmat3(0.1)), 2, i)), sparse = dense, moved = dense;
        // A light keeps the scenes' sizes, and so their normalisation, alike.
        Light ball;
        ball.kind = LightKind::sphere;
        ball.center = {1.3, 1.2, 1.4};
        ball.radius = 40;
        for (Scene* s : {&dense, &sparse, &moved}) s->lights = {ball};
        sparse.grids[0].density = voxel_grid(lo, {26, 24, 29}, f, true, glm::dmat3(0.1));
        moved.grids[0].density = voxel_grid({-5, -4, -3}, {30, 30, 31}, f, true, glm::dmat3(0.1));
        const DeviceScene device = make_device_scene(dense, {});
        auto rays = rays_through(dense, device, 1000, 10);
        for (ProbeRay& r : rays) r.t_end = 4;
        const auto a = Probe(test_device(), device).grid(rays).values, b = Probe(test_device(), make_device_scene(sparse, {})).grid(rays).values, c = Probe(test_device(), make_device_scene(moved, {})).grid(rays).values;
        const HostGrid host = host_density(dense.grids[0]);
        std::size_t differing = 0;
        for (std::size_t k = 0; k < rays.size(); ++k) {
            differing += bits(a[k].depth) != bits(b[k].depth) || bits(a[k].t) != bits(b[k].t);
            if (i == kNearest && (k % 8 == 3 || k % 8 == 5)) continue;
            const double slack = 2 * allowed(host, WorldRay(rays[k], device.normalization), static_cast<double>(a[k].depth), i);
            CHECK(std::abs(static_cast<double>(a[k].depth - b[k].depth)) <= slack);
            CHECK(std::abs(static_cast<double>(a[k].depth - c[k].depth)) <= slack);
        }
        // Supports of trilinear grids differ by half a voxel, and with them the point that positions are relative to.
        if (i == kNearest) CHECK(differing == 0);
    }
}

TEST_CASE("Grids.LevelsChangeNothing", "[kernels]") {
    // A table too large for roots alone is an octree: the same density, depth and inverse along every ray.
    const auto f = [](const glm::ivec3& p) { return (p.x / 40 + p.y / 40 + p.z / 40) % 5 == 0 && p.x % 40 < 9 && p.y % 40 < 9 && p.z % 40 < 9 ? 0.2 + random_samples(3)(p) : 0.0; };
    Scene scene = grid_scene(grid_medium(voxel_grid({0, 0, 0}, {160, 120, 120}, f, true, glm::dmat3(0.01)), 20));
    const HostGrid host = host_density(scene.grids[0]);
    // Far corners make the lattice 1,400 samples wide: 176³ bricks.
    VoxelGrid wide = scene.grids[0].density;
    wide.hi = {1400, 1400, 1400};
    Scene deep = scene;
    deep.grids[0].density = wide;
    const DeviceScene device = make_device_scene(deep, {});
    const std::string levels = [&] {
        for (const auto& [name, value] : device.defines)
            if (name == "CLUME_GRID_LEVELS") return value;
        return std::string();
    }();
    CHECK(levels == "1");
    Probe probe(test_device(), device);
    const auto rays = rays_through(scene, device, 1000, 11);
    const auto got = probe.grid(rays).values;
    std::size_t hit = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const WorldRay w(rays[i], device.normalization);
        const double expected = host.integral(w.origin, w.direction, 0, w.t_end);
        hit += expected > 0;
        INFO("ray " << i << ": " << got[i].depth << " of " << expected);
        // Positions are rounded to 2^-20 of the wide table.
        CHECK(std::abs(static_cast<double>(got[i].depth) - expected) <= 12 * allowed(host, w, expected, kTrilinear));
    }
    CHECK(hit > 300);
}
