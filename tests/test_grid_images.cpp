// SPDX-License-Identifier: MIT
// Whole images of voxel media: against the host path tracer, against closed forms, and the furnaces.
#include "tests/device_image.h"
#include "tests/grid_scenes.h"
#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;
using probing::grid_medium;
using probing::smooth_samples;
using probing::turned_axes;
using probing::voxel_grid;

namespace {

constexpr std::uint32_t spp = 256;

struct GridWay {
    const char *strategy, *bound;
};
const GridWay kDelta{"delta", "tree"}, kWhole{"delta", "scene"}, kTable{"delta", "grid"}, kWalk{"decomposition", "auto"};

RenderResult render_grid(const GridWay& way, Scene scene, std::uint32_t samples, std::uint64_t seed = 0) {
    scene.render.bound = way.bound;
    return render_by({way.strategy, "auto"}, scene, samples, seed);
}

void check_against_host(const std::string& name, const Scene& scene, const std::vector<GridWay>& ways, std::uint32_t samples = spp) {
    const HostImage host = HostTracer(scene, 32).trace(samples, 79, 2);
    REQUIRE(host.not_finite == 0);
    for (const GridWay& way : ways) {
        const RenderResult r = render_grid(way, scene, samples);
        check_clean(r);
        const std::string what = name + " by " + way.strategy + " " + way.bound;
        check_same(what, colour_of(r.image), colour_of(host));
        check_same(what + ", alpha", alpha_of(r.image), alpha_of(host, samples));
    }
}

Light sun() {
    Light l = light_of(LightKind::directional);
    l.direction = {-0.4, -1, 0.5};
    l.irradiance = {4, 3, 2};
    return l;
}

Scene base() {
    Scene scene;
    scene.path = "grids";
    scene.film = {24, 20};
    scene.camera.origin = {0.5, 0.8, -3.4};
    return scene;
}

/// Sparse, turned, mirrored; about 2 across.
GridMedium cloud(double density, Interpolation interpolation = Interpolation::trilinear) {
    const auto axes = turned_axes(0.055);
    return grid_medium(voxel_grid({3, -7, 0}, {43, 40, 45}, smooth_samples(40), true, axes, axes * glm::dvec3(-21, -18, -21)), density, interpolation);
}

/// A box of constant density, corners (±0.9, ±0.7, ±0.8).
GridMedium box(double density, Interpolation interpolation) {
    return grid_medium(voxel_grid({0, 0, 0}, {18, 14, 16}, [](auto) { return 1.0; }, false, glm::dmat3(0.1), glm::dvec3(-0.85, -0.65, -0.75)), density, interpolation);
}

double worst_from_one(const RenderImage& image) {
    double worst = 0;
    for (float v : image.rgb) worst = std::max(worst, std::abs(static_cast<double>(v) - 1));
    return worst;
}

}  // namespace

TEST_CASE("GridImages.CloudEqualsHost") {
    for (const Interpolation i : {Interpolation::trilinear, Interpolation::nearest}) {
        Scene scene = base();
        scene.grids = {cloud(6, i)};
        scene.grids[0].albedo = {0.9, 0.8, 0.95};
        scene.grids[0].emission = {0.2, 0.4, 0};
        scene.grids[0].phase = {PhaseKind::henyey_greenstein, 0.4};
        scene.lights = {constant_light({0.4, 0.5, 0.6}), sun()};
        check_against_host(i == Interpolation::trilinear ? "cloud" : "cloud_nearest", scene, i == Interpolation::trilinear ? std::vector<GridWay>{kDelta, kWhole, kTable, kWalk} : std::vector<GridWay>{kDelta, kWalk});
    }
}

TEST_CASE("GridImages.CloudQuick", "[quick]") {
    Scene scene = base();
    scene.grids = {cloud(4)};
    scene.lights = {sun()};
    check_against_host("cloud_quick", scene, {kDelta, kWalk}, 64);
}

TEST_CASE("GridImages.MixedSceneEqualsHost") {
    // Two grids and two mixtures in each other, four phase functions, and a camera amid them.
    Scene scene = random_mixture(KernelFamily::gaussian, 30, 21, 6, 2);
    scene.film = {24, 20};
    scene.media.push_back(random_mixture(KernelFamily::uniform, 20, 22, 3, 1).media[0]);
    scene.media[1].phase = {PhaseKind::rayleigh, 0};
    scene.grids = {cloud(3), box(0.5, Interpolation::nearest)};
    scene.grids[0].phase = {PhaseKind::henyey_greenstein, -0.5};
    scene.grids[1].albedo = {0.2, 0.9, 0.5};
    scene.grids[1].emission = {0.1, 0, 0.3};
    scene.lights = {constant_light({0.4, 0.5, 0.6}, true), sun()};
    for (const bool inside : {false, true}) {
        scene.camera.origin = inside ? glm::dvec3(0.2, 0.1, -0.3) : glm::dvec3(0.5, 0.8, -3.4);
        scene.camera.target = inside ? glm::dvec3(1, 0.4, 0.3) : glm::dvec3(0.3, 0.1, 0);
        check_against_host(inside ? "mixed_inside" : "mixed", scene, {kDelta, kWalk});
    }
}

TEST_CASE("GridImages.EmissionGridEqualsHost") {
    // A flame beyond the smoke, in places where no density is, and a surface that hides part of it.
    Scene scene = base();
    scene.grids = {cloud(5)};
    scene.grids[0].emission_grid = voxel_grid({10, 0, 8}, {60, 41, 38}, smooth_samples(42, 5), true, turned_axes(0.05), turned_axes(0.05) * glm::dvec3(-25, -20, -21));
    scene.grids[0].emission = {2, 1, 0.3};
    scene.grids[0].albedo = glm::dvec3(0.8);
    check_against_host("flame", scene, {kDelta, kWalk}, 4 * spp);
    Light ball = light_of(LightKind::sphere);
    ball.center = {0.2, 0.1, -0.6};
    ball.radius = 0.4;
    ball.radiance = {0.1, 0.3, 0.2};
    scene.lights = {ball};
    for (const int depth : {0, 1}) {
        scene.render.max_depth = depth;
        check_against_host("flame_depth_" + std::to_string(depth), scene, {kDelta}, 4 * spp);
    }
}

TEST_CASE("GridImages.ConstantBoxIsBeerLambert") {
    // No scattering: what is left of the light behind a box is exp(−σ d), d in closed form.
    for (const Interpolation i : {Interpolation::trilinear, Interpolation::nearest}) {
        Scene scene = base();
        scene.grids = {box(1.5, i)};
        scene.grids[0].albedo = glm::dvec3(0);
        scene.lights = {constant_light(glm::dvec3(1), true)};
        scene.camera.kind = CameraKind::orthographic;
        scene.camera.origin = {1, 1.4, -3};
        scene.camera.width = 3;
        const glm::dvec3 half(0.9, 0.7, 0.8), f = glm::normalize(scene.camera.target - scene.camera.origin), r = glm::normalize(glm::cross(f, scene.camera.up)), u = glm::cross(r, f);
        std::vector<double> mean, none;
        for (int y = 0; y < 20; ++y)
            for (int x = 0; x < 24; ++x) {
                double sum = 0;
                constexpr int n = 24;
                for (int k = 0; k < n * n; ++k) {
                    const int column = k % n, row = k / n;
                    const double px = x + (column + 0.5) / n, py = y + (row + 0.5) / n, step = 3.0 / 24;
                    const glm::dvec3 o = scene.camera.origin + r * ((px - 12) * step) + u * ((10 - py) * step);
                    const glm::dvec3 a = (-half - o) / f, b = (half - o) / f, lo = glm::min(a, b), hi = glm::max(a, b);
                    sum += std::exp(-1.5 * std::max(0.0, std::min({hi.x, hi.y, hi.z}) - std::max({lo.x, lo.y, lo.z})));
                }
                mean.push_back(sum / (n * n));
            }
        for (const GridWay& way : i == Interpolation::trilinear ? std::vector<GridWay>{kDelta, kWhole, kWalk} : std::vector<GridWay>{kTable, kWalk}) {
            const RenderResult result = render_grid(way, scene, 1024, 3);
            check_clean(result);
            check_same(std::string("box by ") + way.strategy + " " + way.bound, colour_of(result.image), grey(24, 20, mean, {}));
            CHECK(result.stats.empty_pixels > 50);
        }
    }
}

TEST_CASE("GridImages.WhiteFurnace") {
    for (const double density : {0.3, 3.0, 30.0})
        for (const GridWay& way : {kDelta, kTable, kWalk}) {
            Scene scene = base();
            scene.film = {8, 8};
            scene.camera.origin = density > 1 ? glm::dvec3(0.5, 0.8, -3.4) : glm::dvec3(0.1, 0.1, -0.1);
            scene.grids = {cloud(density), box(0.1 * density, Interpolation::nearest)};
            for (auto& m : scene.grids) m.albedo = glm::dvec3(1);
            scene.grids[0].phase = {PhaseKind::henyey_greenstein, 0.6};
            scene.lights = {constant_light(glm::dvec3(1), true)};
            scene.render.light_sampling = LightSampling::phase;
            const RenderResult r = render_grid(way, scene, 4);
            check_clean(r);
            INFO(way.strategy << " " << way.bound << ", density " << density);
            CHECK(worst_from_one(r.image) < 2e-6);
            // With light sampling the mean is 1: transmittances and flights agree.
            scene.render.light_sampling = LightSampling::nee;
            const RenderResult n = render_grid(way, scene, 256, 4);
            const Estimate e = colour_of(n.image);
            check_same("grid_furnace_nee", e, grey(8, 8, std::vector<double>(64, 1), {}), 1e-4, 8);
        }
}

TEST_CASE("GridImages.EmissiveFurnace") {
    for (const double density : {0.3, 30.0}) {
        Scene scene = base();
        scene.film = {8, 8};
        scene.grids = {cloud(density), box(0.4 * density, Interpolation::trilinear)};
        scene.grids[0].albedo = {0.2, 0.5, 0.8};
        scene.grids[1].albedo = {0.6, 0, 0.1};
        for (auto& m : scene.grids) m.emission = glm::dvec3(1);
        scene.lights = {constant_light(glm::dvec3(1), true)};
        scene.render.rr_depth = 1 << 20;
        for (const GridWay& way : {kDelta, kWalk}) {
            const RenderResult r = render_grid(way, scene, 4);
            check_clean(r);
            CHECK(worst_from_one(r.image) < 4e-6);
        }
    }
}

TEST_CASE("GridImages.EmissionGridFurnace") {
    // An absorbing box that emits σ per unit length by its emission grid, in a constant light of 1: radiance 1 on average.
    Scene scene = base();
    scene.film = {12, 12};
    scene.camera.origin = {0.5, 0.8, -2.4};
    scene.grids = {cloud(2)};
    scene.grids[0].albedo = glm::dvec3(0);
    scene.grids[0].emission_grid = scene.grids[0].density;
    scene.grids[0].emission = glm::dvec3(2);
    scene.lights = {constant_light(glm::dvec3(1), true)};
    for (const GridWay& way : {kDelta, kWalk}) {
        const Estimate e = colour_of(render_grid(way, scene, 1024, 6).image);
        check_same("emission_grid_furnace", e, grey(12, 12, std::vector<double>(144, 1), {}), 1e-4, 4);
    }
}

TEST_CASE("GridImages.WidthsGiveTheSameBits") {
    const Scene mixture = random_mixture(KernelFamily::gaussian, 30, 21, 6, 2);
    Scene scene = mixture;
    scene.film = {12, 10};
    scene.grids = {cloud(3), box(0.5, Interpolation::nearest)};
    scene.grids[0].emission_grid = scene.grids[1].density;
    scene.lights = {sun()};
    for (const GridWay& way : {kDelta, kWalk}) {
        const bool mixed = way.strategy == kDelta.strategy;
        scene.media = mixed ? mixture.media : std::vector<EllipsoidMedium>();
        scene.render.strategy = way.strategy;
        scene.render.bound = way.bound;
        std::vector<float> first;
        for (const int width : {16, 8, 4, 1}) {
            if (!mixed && width != 16 && width != 1) continue;
            RenderOptions options;
            options.vector_width = width;
            options.batch_samples = width == 8 ? 3 : 8;
            scene.render.spp = 16;
            const RenderResult r = render_now(scene, options);
            if (first.empty()) first = r.image.rgb;
            INFO(way.strategy << ", width " << width);
            CHECK(r.image.rgb == first);
        }
    }
}

TEST_CASE("GridImages.PausedMixturesGiveTheSameBits") {
    // A mixture's flight that pauses after every few tentative collisions must leave the grids' numbers alone.
    Scene scene = random_mixture(KernelFamily::gaussian, 200, 21, 12, 20);
    scene.film = {12, 10};
    scene.grids = {cloud(3)};
    scene.lights = {sun()};
    scene.render.strategy = "delta";
    const DeviceScene whole = make_device_scene(scene, {});
    DeviceScene parts = whole;
    set_define(parts, "CLUME_FLIGHT_DRAWS", "2");
    set_define(parts, "CLUME_LAUNCH_EVENTS", "3");
    CHECK(render_device(scene, whole, 8).same_bits(render_device(scene, parts, 8)));
}
