// SPDX-License-Identifier: MIT
// See the header; random numbers come from the host tracer's generator, so a scene is a pure function of its arguments.
#include "tests/reference/analytic_scenes.h"

#include "tests/reference/host_camera.h"
#include "tests/reference/host_phase.h"
#include "tests/reference/host_random.h"

#include <cmath>
#include <numbers>

namespace clume::reference {

namespace {

constexpr double pi = std::numbers::pi;

glm::dvec3 three(HostRandom& random) {
    const double a = random.uniform(), b = random.uniform();
    return {a, b, random.uniform()};
}

glm::dvec3 in_unit_ball(HostRandom& random) {
    const double r = std::cbrt(random.uniform());
    return sample_sphere(random) * r;
}

/// exp(factor U(−1, 1)) per axis.
glm::dvec3 random_scale(HostRandom& random, double factor) {
    const glm::dvec3 u = three(random) * 2.0 - 1.0;
    return {std::exp(factor * u.x), std::exp(factor * u.y), std::exp(factor * u.z)};
}

Light constant_light(bool visible) {
    Light light;
    light.radiance = glm::dvec3(1);
    light.visible_to_camera = visible;
    return light;
}

Scene furnace(KernelFamily kernel, double density, bool camera_inside) {
    Scene scene;
    scene.path = "furnace";
    scene.film = {16, 16};
    scene.camera.origin = camera_inside ? glm::dvec3(0.05, 0.02, -0.1) : glm::dvec3(0, 0, -4);
    scene.lights.push_back(constant_light(true));
    EllipsoidMedium medium;
    medium.kernel = kernel;
    medium.extent = default_extent(kernel);
    medium.density_scale = density;
    const double s = 1 / medium.extent;
    medium.primitives = {make_primitive({0, 0, 0}, glm::dvec3(s), 1),
                         make_primitive({0.3, 0.1, 0}, glm::dvec3(0.9, 0.5, 0.7) * s, 1, {0.2, 0.3, 0.9}),
                         make_primitive({-0.3, 0.2, 0.2}, glm::dvec3(0.4, 0.9, 0.5) * s, 0.5, {0.6, 0.1, 0.3}),
                         make_primitive({0, -0.4, -0.2}, glm::dvec3(0.8, 0.3, 0.6) * s, 0.75, {0.8, 0.7, 0.1}),
                         make_primitive({0.1, 0.4, -0.3}, glm::dvec3(0.5, 0.4, 0.2) * s, 1, {0.4, 0.9, 0.6})};
    for (Primitive& p : medium.primitives) p.albedo = glm::dvec3(1);
    scene.media.push_back(medium);
    return scene;
}

}  // namespace

double default_extent(KernelFamily kernel) {
    return kernel == KernelFamily::gaussian ? 3 : std::sqrt(kernel == KernelFamily::epanechnikov ? 7.0 : 5.0);
}

Primitive make_primitive(const glm::dvec3& center, const glm::dvec3& scale, double sigma_t, const glm::dvec3& rotation) {
    // Shoemake's uniform quaternion, from a permutation in which (0, 0, 0) is no rotation.
    const double a = std::sqrt(rotation.x), b = std::sqrt(1 - rotation.x);
    const double w = b * std::cos(2 * pi * rotation.y), x = b * std::sin(2 * pi * rotation.y);
    const double y = a * std::sin(2 * pi * rotation.z), z = a * std::cos(2 * pi * rotation.z);
    Primitive p;
    p.center = center;
    p.axes[0] = scale.x * glm::dvec3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y));
    p.axes[1] = scale.y * glm::dvec3(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x));
    p.axes[2] = scale.z * glm::dvec3(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
    p.sigma_t = sigma_t;
    return p;
}

Scene white_furnace(KernelFamily kernel, double density, bool camera_inside) {
    return furnace(kernel, density, camera_inside);
}

Scene emissive_furnace(KernelFamily kernel, double density, bool camera_inside) {
    Scene scene = furnace(kernel, density, camera_inside);
    double albedo = 0;
    for (Primitive& p : scene.media[0].primitives) {
        p.albedo = {albedo, 0.8 - albedo, 0.5};
        p.emission = glm::dvec3(1);
        albedo += 0.2;
    }
    return scene;
}

Scene absorbing_gaussian(double peak) {
    Scene scene;
    scene.path = "absorbing_gaussian";
    scene.film = {32, 32};
    scene.camera.origin = {0.4, 0.3, -4};
    EllipsoidMedium medium;
    medium.extent = 4;
    medium.primitives = {make_primitive({0.1, -0.05, 0.2}, {0.35, 0.15, 0.25}, peak, {0.3, 0.6, 0.2})};
    medium.primitives[0].albedo = glm::dvec3(0);
    scene.media.push_back(medium);
    scene.lights.push_back(constant_light(true));
    return scene;
}

double absorbing_gaussian_transmittance(const Scene& scene, double x, double y) {
    const EllipsoidMedium& medium = scene.media[0];
    const Primitive& p = medium.primitives[0];
    const HostRay ray = HostCamera(scene).ray(x, y);
    const glm::dmat3 w = glm::inverse(p.axes);
    const glm::dvec3 a = w * (ray.origin - p.center), b = w * ray.direction;
    const double speed = std::sqrt(glm::dot(b, b));
    const glm::dvec3 foot = a - b * (glm::dot(a, b) / (speed * speed));
    const double square = medium.extent * medium.extent - glm::dot(foot, foot);
    if (square <= 0) return 1;
    const double depth = medium.density_scale * p.sigma_t * std::sqrt(2 * pi) / speed *
                         std::exp(-0.5 * glm::dot(foot, foot)) * std::erf(std::sqrt(square / 2));
    return std::exp(-depth);
}

Scene homogeneous_sphere(double sigma_t, double albedo) {
    Scene scene;
    scene.path = "homogeneous_sphere";
    scene.film = {32, 32};
    scene.camera.kind = CameraKind::orthographic;
    scene.camera.origin = {0, 0, -3};
    scene.camera.width = 2.5;
    EllipsoidMedium medium;
    medium.kernel = KernelFamily::uniform;
    medium.extent = default_extent(medium.kernel);
    medium.primitives = {make_primitive({0, 0, 0}, glm::dvec3(1 / medium.extent), sigma_t)};
    medium.primitives[0].albedo = glm::dvec3(albedo);
    scene.media.push_back(medium);
    return scene;
}

double homogeneous_sphere_transmittance(const Scene& scene, double x, double y) {
    const EllipsoidMedium& medium = scene.media[0];
    const HostRay ray = HostCamera(scene).ray(x, y);
    const glm::dvec3 foot = ray.origin - glm::dot(ray.origin, ray.direction) * ray.direction;
    const double square = 1 - glm::dot(foot, foot);
    const double sigma_t = medium.density_scale * medium.primitives[0].sigma_t;
    return square > 0 ? std::exp(-sigma_t * 2 * std::sqrt(square)) : 1;
}

Scene random_mixture(KernelFamily kernel, int n, std::uint64_t seed, double overlap, double peak) {
    Scene scene;
    scene.path = "random_mixture";
    scene.film = {32, 32};
    scene.camera.origin = {0, 0.5, -4};
    scene.lights.push_back(constant_light(false));
    HostRandom random(seed, 0);
    EllipsoidMedium medium;
    medium.kernel = kernel;
    medium.extent = default_extent(kernel);
    // n supports of volume 4π/3 (s E)³ e^(mean of the axes' logs = 0), spread over the unit ball's 4π/3.
    const double scale = std::cbrt(overlap / n) / medium.extent;
    for (int i = 0; i < n; ++i) {
        const glm::dvec3 center = in_unit_ball(random), size = random_scale(random, 0.7) * scale, turn = three(random);
        Primitive p = make_primitive(center, size, peak * (0.25 + 1.5 * random.uniform()), turn);
        p.albedo = 0.5 + 0.5 * three(random);
        medium.primitives.push_back(p);
    }
    scene.media.push_back(medium);
    return scene;
}

Scene ball_scene() { return ball_scene_n(16384); }

Scene ball_scene_n(std::uint32_t n, std::uint64_t seed) {
    Scene scene;
    scene.path = "ball";
    scene.film = {256, 256};
    scene.camera.origin = {0, 0, -3};
    scene.camera.fov_rad = 38 * pi / 180;
    scene.lights.push_back(constant_light(false));
    HostRandom random(seed, 1);
    const double scale = 0.03 * std::cbrt(16384.0 / n);
    EllipsoidMedium medium;
    medium.primitives.reserve(n);
    for (std::uint32_t i = 0; i < n; ++i) {
        const glm::dvec3 center = in_unit_ball(random), size = random_scale(random, 0.4) * scale;
        medium.primitives.push_back(make_primitive(center, size, 10, three(random)));
    }
    scene.media.push_back(medium);
    return scene;
}

}  // namespace clume::reference
