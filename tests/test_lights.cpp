// SPDX-License-Identifier: MIT
// Every kind of light against the host path tracer, under every `light_sampling` that its kind allows: same mean image,
// same alpha. The host shares neither algorithm nor random numbers with the kernels.
#include <functional>
#include <numbers>

#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;
using std::numbers::pi;

namespace {

constexpr std::uint32_t spp = 256;

/// 40 Gaussians of random albedo in the unit ball, seen from outside, without a light.
Scene mixture() {
    Scene scene = random_mixture(KernelFamily::gaussian, 40, 11, 6, 3);
    scene.film = {24, 20};
    scene.camera.origin = {0.5, 0.8, -3.4};
    scene.lights.clear();
    return scene;
}

void check_against_host(const std::string& name, Scene scene, const std::vector<LightSampling>& samplings, const Way& way = delta,
                        std::uint32_t host_spp = spp) {
    const HostImage host = HostTracer(scene, 32).trace(host_spp, 77);
    REQUIRE(host.not_finite == 0);
    for (LightSampling sampling : samplings) {
        scene.render.light_sampling = sampling;
        const RenderResult r = render_by(way, scene, spp);
        check_clean(r);
        const std::string what = name + "_" + std::to_string(static_cast<int>(sampling)) + " by " + way.name();
        check_same(what, colour_of(r.image), colour_of(host));
        check_same(what + "_alpha", alpha_of(r.image), alpha_of(host, host_spp));
    }
}

const std::vector<LightSampling> all{LightSampling::mis, LightSampling::nee, LightSampling::phase};
const std::vector<LightSampling> sampled{LightSampling::mis, LightSampling::nee};
const std::vector<LightSampling> mis{LightSampling::mis};

Light sphere(const glm::dvec3& center, double radius, const glm::dvec3& radiance) {
    Light l = light_of(LightKind::sphere);
    l.center = center;
    l.radius = radius;
    l.radiance = radiance;
    return l;
}

Light rectangle(const glm::dvec3& corner, const glm::dvec3& u, const glm::dvec3& v, const glm::dvec3& radiance) {
    Light l = light_of(LightKind::rectangle);
    l.corner = corner;
    l.edge_u = u;
    l.edge_v = v;
    l.radiance = radiance;
    return l;
}

Light spot() {
    Light l = light_of(LightKind::spot);
    l.position = {1.5, 2, -1};
    l.target = {0.1, 0, 0.1};
    l.intensity = {9, 6, 3};
    l.beam_rad = 0.1;
    l.cutoff_rad = 0.4;
    return l;
}

Light sun() {
    Light l = light_of(LightKind::directional);
    l.direction = {-0.4, -1, 0.5};
    l.irradiance = {3, 2, 1};
    return l;
}

/// Eight separate balls around an empty middle.
Scene ring() {
    Scene scene = mixture();
    EllipsoidMedium& medium = scene.media[0];
    medium.primitives.clear();
    for (int i = 0; i < 8; ++i) {
        const double angle = 0.25 * pi * i;
        medium.primitives.push_back(make_primitive({std::cos(angle), std::sin(angle), 0.2 * std::sin(3 * angle)}, glm::dvec3(0.14, 0.1, 0.12), 5, {0.1 * i, 0.3, 0.5}));
        medium.primitives.back().albedo = {0.9, 0.7, 0.5};
    }
    return scene;
}

}  // namespace

TEST_CASE("Lights.ConstantEqualsHost") {
    Scene scene = mixture();
    scene.lights = {constant_light({1, 0.5, 0.2})};
    check_against_host("constant", scene, {LightSampling::mis, LightSampling::nee});
}

TEST_CASE("Lights.EnvironmentImageEqualsHost") {
    Scene scene = mixture();
    // The host finds the bright texel by chance alone: it takes more samples.
    scene.lights = {contrast_environment(false, 0.6)};
    check_against_host("environment", scene, all, delta, 4 * spp);
    check_against_host("environment", scene, mis, decomposition_bvh, 4 * spp);
    scene.lights[0].rotate_y_rad = -2.3;
    check_against_host("environment_turned", scene, mis, delta, 4 * spp);
}

TEST_CASE("Lights.EnvironmentImageQuick", "[quick]") {
    Scene scene = mixture();
    scene.lights = {contrast_environment(false, 0.6)};
    check_against_host("environment_quick", scene, mis, delta, 4 * spp);
}

TEST_CASE("Lights.PointEqualsHost") {
    Scene scene = mixture();
    scene.lights = {point_light({-1.2, 1, -0.8}, {4, 3, 2})};
    check_against_host("point", scene, sampled);
    // Amid the medium, where it is empty: inside its bounds, yet 1/r² stays bounded.
    scene = ring();
    scene.lights = {point_light({0.05, -0.03, 0}, glm::dvec3(2))};
    check_against_host("point_amid", scene, mis);
}

TEST_CASE("Lights.SpotEqualsHost") {
    Scene scene = mixture();
    scene.lights = {spot()};
    check_against_host("spot", scene, mis);
    scene.lights[0].beam_rad = scene.lights[0].cutoff_rad;  // a hard edge
    check_against_host("spot_hard", scene, mis);
}

TEST_CASE("Lights.DirectionalEqualsHost") {
    Scene scene = mixture();
    scene.lights = {sun()};
    check_against_host("directional", scene, mis);
    check_against_host("directional", scene, mis, decomposition);
}

TEST_CASE("Lights.SphereEqualsHost") {
    Scene scene = mixture();
    scene.lights = {sphere({1.3, 1.2, -1}, 0.4, {6, 4, 2})};
    check_against_host("sphere_outside", scene, all);
    // Amid the medium, seen by the camera, and hiding what is behind.
    scene.lights = {sphere({0.1, 0.1, -0.1}, 0.35, {1, 2, 3})};
    check_against_host("sphere_amid", scene, all);
    check_against_host("sphere_amid", scene, mis, decomposition_bvh);
}

TEST_CASE("Lights.CameraInsideASphereSeesBlack") {
    Scene scene = mixture();
    scene.lights = {sphere({0.5, 0.8, -3.4}, 1, {1, 2, 3})};
    const RenderResult r = render_by(delta, scene, 16);
    for (float v : r.image.rgb) REQUIRE(v == 0);
    for (float a : r.image.alpha) REQUIRE(a == 1);
}

TEST_CASE("Lights.RectangleEqualsHost") {
    Scene scene = mixture();
    // A skew parallelogram above, facing down; then one that cuts the medium, seen from its front and from its back.
    scene.lights = {rectangle({-0.8, 1.4, -0.6}, {1.5, 0.2, 0.1}, {0.4, 0, 1.2}, {5, 4, 3})};
    if (glm::cross(scene.lights[0].edge_u, scene.lights[0].edge_v).y > 0) std::swap(scene.lights[0].edge_u, scene.lights[0].edge_v);
    check_against_host("rectangle_above", scene, all);
    scene.lights = {rectangle({-0.5, -0.6, 0}, {0.9, 0.1, 0.3}, {-0.1, 0.8, 0.1}, {2, 1, 3})};
    check_against_host("rectangle_amid", scene, mis);
    std::swap(scene.lights[0].edge_u, scene.lights[0].edge_v);
    check_against_host("rectangle_amid_back", scene, all);
}

TEST_CASE("Lights.AllTogetherEqualHost") {
    Scene scene = mixture();
    scene.lights = {constant_light({0.3, 0.2, 0.1}, true),
                    constant_light({0.1, 0.2, 0.3}),
                    contrast_environment(true, 1.1),
                    contrast_environment(false, -0.4),
                    point_light({-1.4, 0.9, -0.9}, {1, 2, 1}),
                    spot(),
                    sun(),
                    sphere({-0.6, -0.9, -0.7}, 0.3, {3, 1, 2}),
                    rectangle({0.4, -0.8, -1}, {0.1, 1.4, 0}, {0.5, 0, 0.9}, {1, 1, 4})};
    check_against_host("all_lights", scene, sampled);
    check_against_host("all_lights", scene, mis, decomposition_bvh);
}
