// SPDX-License-Identifier: MIT
// Programs are built from what a scene uses: what is left out is said, nothing that is left out was needed, and pixels that
// are never sampled see nothing.
#include <bit>
#include <numbers>
#include <random>

#include "src/device_mixture.h"
#include "tests/device_image.h"
#include "tests/image_test.h"
#include "tests/pairs.h"
#include "tests/reference/analytic_scenes.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

std::string explained(const Scene& scene, const std::string& feature, const RenderOptions& options = {}) {
    for (const auto& [name, what] : explain(scene, options))
        if (name == feature) return what;
    return "not told: " + feature;
}

const Light lamp = point_light({-1.2, 1, -0.8}, glm::dvec3(4));

device::float4 row(const glm::dvec3& v, float w) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), w};
}

/// The same scene for a program that has everything in it: only the strategy, the accelerator, the sampled kinds of light
/// and those with medium around them stay, since these are the method, not a saving.
DeviceScene generalised(const Scene& scene, DeviceScene device) {
    std::vector<std::pair<std::string, std::string>> kept;
    for (const auto& define : device.defines)
        for (const char* name : {"CLUME_STRATEGY", "CLUME_ACCEL", "CLUME_BVH_STACK", "CLUME_NEE", "CLUME_HITS", "CLUME_LAMPS", "CLUME_LANES"})
            if (define.first == name) kept.push_back(define);
    device.defines = kept;
    device.shading.clear();
    for (std::size_t m = 0; m < scene.media.size(); ++m)
        for (const Primitive& p : scene.media[m].primitives) {
            device.shading.push_back(row(p.albedo, p.has_g ? p.g : static_cast<float>(scene.media[m].phase.g)));
            device.shading.push_back(row(p.emission, std::bit_cast<float>(static_cast<std::uint32_t>(m))));
        }
    return device;
}

/// Whether any support lies ahead on the ray.
bool meets_medium(const Scene& scene, const HostRay& ray) {
    for (const EllipsoidMedium& m : scene.media)
        for (const Primitive& p : m.primitives) {
            const glm::dmat3 w = glm::inverse(p.axes);
            const glm::dvec3 a = w * (ray.origin - p.center), b = w * ray.direction;
            const double bb = glm::dot(b, b), t = -glm::dot(a, b) / bb;
            const glm::dvec3 foot = a + t * b;
            const double square = m.extent * m.extent - glm::dot(foot, foot);
            if (square > 0 && t + std::sqrt(square / bb) > 0) return true;
        }
    return false;
}

/// Directions and places of random cameras: outside, inside, looking past or away, orthographic, up vectors askew.
Camera random_camera(std::mt19937_64& engine) {
    std::uniform_real_distribution<double> u(-1, 1);
    const auto vector = [&] { return glm::dvec3(u(engine), u(engine), u(engine)); };
    Camera c;
    c.kind = u(engine) < 0.3 ? CameraKind::orthographic : CameraKind::perspective;
    c.origin = vector() * std::exp2(2.5 * u(engine));
    c.target = vector() * 1.5;
    c.up = vector();
    c.fov_rad = 1.2 + 1.1 * u(engine);
    c.width = std::exp2(1.5 * u(engine));
    return c;
}

}  // namespace

TEST_CASE("Specialisation.SharedStructuresAreTheSame") {
    Scene scene = mixed_grid_scene();
    scene.lights.push_back(lamp);
    RenderOptions sharing;
    sharing.shared = std::make_shared<SharedStructures>();
    const float* groups = nullptr;
    for (const MethodPair& pair : {MethodPair{"decomposition", "analytic"}, {"delta", "analytic", "grid"}, {"delta", "analytic", "tree"}, {"delta", "residual-ratio", "tree"}, {"regular", "binary"},
                                   {"delta", "ratio", "scene"}, {"march", "march"}, {"progressive", "analytic"}, {"delta", "binary", "tree"}, {"decomposition", "ratio", "tree"}}) {
        INFO(pair.label());
        RenderOptions own;
        own.pair = sharing.pair = pair;
        const DeviceScene alone = make_device_scene(scene, own), shared = make_device_scene(scene, sharing);
        CHECK(shared.hash() == alone.hash());
        CHECK(shared.defines == alone.defines);
        CHECK(shared.explain == alone.explain);
        CHECK(shared.bvh_stack == alone.bvh_stack);
        CHECK(shared.learned == alone.learned);
        if (pair.strategy == "decomposition" && !groups) groups = shared.groups.data();
        if (pair.strategy == "regular" || pair.label() == "delta:tree/analytic") CHECK(shared.groups.data() == groups);
    }
}

TEST_CASE("Explain.SaysWhatIsLeftOut", "[quick]") {
    Scene scene = grey_mixture();
    CHECK(explained(scene, "next-event estimation") == "left out");
    CHECK_THAT(explained(scene, "transmittance"), Catch::StartsWith("left out"));
    CHECK(explained(scene, "kernel families") == "gaussian");
    CHECK(explained(scene, "phase functions") == "isotropic");
    CHECK_THAT(explained(scene, "g per primitive"), Catch::StartsWith("left out"));
    CHECK_THAT(explained(scene, "albedo per primitive"), Catch::StartsWith("left out"));
    CHECK_THAT(explained(scene, "emission"), Catch::StartsWith("left out"));
    CHECK_THAT(explained(scene, "opaque surfaces"), Catch::StartsWith("left out"));
    CHECK(explained(scene, "visible background") == "left out");
    CHECK(explained(scene, "depth limit") == "left out");
    CHECK_THAT(explained(scene, "colour"), Catch::StartsWith("one channel"));
    CHECK(explained(scene, "lights") == "constant");
    CHECK_THAT(explained(scene, "strategy"), Catch::EndsWith("(auto)"));

    // Each feature alone brings back what it needs.
    scene.lights.push_back(lamp);
    CHECK(explained(scene, "next-event estimation") == "point");
    CHECK_THAT(explained(scene, "transmittance"), Catch::StartsWith("analytic"));
    scene.media[0].primitives[3].albedo = glm::dvec3(0.5);
    CHECK(explained(scene, "albedo per primitive") == "looked up");
    scene.media[0].primitives[3].albedo = {0.8, 0.8, 0.7};
    CHECK(explained(scene, "colour") == "RGB");
    scene.media[0].primitives[4].emission = glm::dvec3(1);
    CHECK(explained(scene, "emission") == "looked up per primitive");
    scene.media[0].primitives[5].has_g = true;
    scene.media[0].primitives[5].g = 0.5f;
    CHECK(explained(scene, "g per primitive") == "looked up");
    CHECK(explained(scene, "phase functions") == "henyey-greenstein");
    Light sphere = light_of(LightKind::sphere);
    sphere.radius = 0.2;
    sphere.radiance = glm::dvec3(1);
    scene.lights.push_back(sphere);
    CHECK_THAT(explained(scene, "opaque surfaces"), Catch::StartsWith("tested"));
    scene.render.max_depth = 3;
    CHECK(explained(scene, "depth limit") == "3");
    scene.lights[0].visible_to_camera = true;
    CHECK(explained(scene, "visible background") == "yes");
    scene.media.push_back(random_mixture(KernelFamily::uniform, 3, 1).media[0]);
    CHECK(explained(scene, "kernel families") == "gaussian, uniform");
}

TEST_CASE("Specialisation.GivesTheImageOfTheGeneralProgram") {
    for (const char* strategy : {"delta", "decomposition"}) {
        Scene scene = grey_mixture();
        scene.render.strategy = strategy;
        std::vector<Scene> scenes{scene};
        scene.lights.push_back(lamp);
        scenes.push_back(scene);
        scene.media[0].phase = {PhaseKind::henyey_greenstein, 0.4};
        for (Primitive& p : scene.media[0].primitives) p.emission = glm::dvec3(0.2);
        scene.render.max_depth = 2;
        scenes.push_back(scene);
        if (std::string(strategy) == "decomposition") scenes.erase(scenes.begin(), scenes.begin() + 2);
        for (const Scene& s : scenes) {
            const DeviceScene device = make_device_scene(s, {});
            const DeviceImage special = render_device(s, device, 64);
            const DeviceImage general = render_device(s, generalised(s, device), 64);
            INFO(strategy << ", scene " << &s - scenes.data());
            CHECK(special.same_bits(general));
        }
    }
}

TEST_CASE("EmptyFrame.IsBlackAndCostsNothing", "[quick]") {
    Scene scene = grey_mixture();
    scene.camera.target = {0, 0, -9};  // away from everything
    scene.camera.origin = {0, 0, -4};
    for (const Way& way : unbiased_ways) {
        const RenderResult r = render_by(way, scene, 8);
        CHECK(r.stats.empty_pixels == 256);
        CHECK(r.stats.paths == 256 * 8);
        CHECK(r.stats.samples_min == 8);
        for (float v : r.image.rgb) REQUIRE(v == 0);
        for (float a : r.image.alpha) REQUIRE(a == 0);
        for (float v : r.image.variance) REQUIRE(v == 0);
    }
    scene.lights[0].visible_to_camera = true;
    for (float v : render_by(delta, scene, 8).image.rgb) REQUIRE(v == 1);
}

TEST_CASE("EmptyFrame.NoMediumAtAll", "[quick]") {
    Scene scene = grey_mixture();
    scene.media.clear();
    scene.lights[0].visible_to_camera = true;
    const RenderResult r = render_by(delta, scene, 4);
    for (float v : r.image.rgb) REQUIRE(v == 1);
    for (float a : r.image.alpha) REQUIRE(a == 0);
}

TEST_CASE("ActivePixels.LeaveOutNoneThatSeesSomething", "[quick]") {
    std::mt19937_64 engine(7);
    Scene scene = random_mixture(KernelFamily::uniform, 3, 2, 0.4, 1);  // few and small: much of the film is empty
    scene.media[0].primitives.push_back(make_primitive({0.8, 0.2, 0.1}, {0.4, 0.002, 0.01}, 1, {0.3, 0.2, 0.7}));
    scene.film = {40, 28};
    Light sphere = light_of(LightKind::sphere), rectangle = light_of(LightKind::rectangle);
    sphere.center = {-0.9, 0.7, 0.3};
    sphere.radius = 0.15;
    rectangle.corner = {0.1, -0.9, -0.3};
    rectangle.edge_u = {0.5, 0.05, 0};
    rectangle.edge_v = {0.1, 0.02, 0.6};
    scene.lights.insert(scene.lights.end(), {sphere, rectangle});
    std::size_t seen = 0, left_out = 0;
    for (int i = 0; i < 60; ++i) {
        scene.camera = random_camera(engine);
        const DeviceScene device = make_device_scene(scene, {});
        const auto pixels = active_pixels(scene, device, {0, 0, 40, 28});
        std::vector<bool> active(40 * 28, false);
        for (device::uint p : pixels) active[p] = true;
        const HostCamera camera(scene);
        const HostLights lights(scene);
        std::uniform_real_distribution<double> u(0, 1);
        std::size_t wrong = 0;
        for (std::size_t p = 0; p < active.size(); ++p) {
            bool something = false;
            const std::size_t column = p % 40, row = p / 40;
            for (int k = 0; k < 8 && !something; ++k) {
                const double x = static_cast<double>(column) + u(engine), y = static_cast<double>(row) + u(engine);
                const HostRay ray = camera.ray(x, y);
                something = meets_medium(scene, ray) || std::isfinite(lights.nearest_surface(ray).t);
            }
            seen += something;
            left_out += !active[p];
            wrong += something && !active[p];
        }
        INFO("camera " << i);
        CHECK(wrong == 0);
        // A window of the film leaves out the same.
        const auto window = active_pixels(scene, device, {7, 5, 33, 20});
        std::size_t inside = 0;
        for (device::uint p : pixels) inside += p % 40 >= 7 && p % 40 < 33 && p / 40 >= 5 && p / 40 < 20;
        CHECK(window.size() == inside);
    }
    CHECK(seen > 2000);
    CHECK(left_out > 10000);
}
