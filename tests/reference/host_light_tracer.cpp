// SPDX-License-Identifier: MIT
// A photon of a light of intensity I has the power 4π I / n (of a spot: its cone's share, times the falloff). A scattering of
// power W, albedo a and phase function p towards the camera adds W a p T / A to the mean radiance of the pixel of area A that
// it projects to, T being 1 if a flight from there to the camera meets nothing, else 0.
#include "tests/reference/host_light_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "tests/reference/host_phase.h"

namespace clume::reference {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity(), pi = std::numbers::pi;

glm::dvec3 unit(const glm::dvec3& v) { return v / std::sqrt(glm::dot(v, v)); }

/// One image of `photons` photons of each light, added to rgb.
void trace_batch(const Scene& scene, const HostMedium& medium, std::uint64_t photons, HostRandom random, std::vector<double>& rgb) {
    const Camera& c = scene.camera;
    const glm::dvec3 f = unit(c.target - c.origin), r = unit(glm::cross(f, c.up)), u = glm::cross(r, f);
    const double edge = c.width / scene.film.width;
    for (const Light& light : scene.lights)
        for (std::uint64_t n = 0; n < photons; ++n) {
            glm::dvec3 d = sample_sphere(random), power = light.intensity * (4 * pi / static_cast<double>(photons));
            if (light.kind == LightKind::spot) {
                // Uniform in the cone, by its share of the sphere.
                const double least = std::cos(light.cutoff_rad), cosine = least + (1 - least) * random.uniform(), turn = 2 * pi * random.uniform();
                const glm::dvec3 axis = unit(light.target - light.position);
                const glm::dvec3 a = unit(glm::cross(axis, std::abs(axis.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0))), b = glm::cross(axis, a);
                d = axis * cosine + (a * std::cos(turn) + b * std::sin(turn)) * std::sqrt(1 - cosine * cosine);
                const double angle = std::acos(cosine), falloff = angle > light.beam_rad ? (light.cutoff_rad - angle) / (light.cutoff_rad - light.beam_rad) : 1;
                power *= 0.5 * (1 - least) * falloff;
            }
            HostRay ray{light.position, d};
            for (int depth = 0; depth != scene.render.max_depth; ++depth) {
                const HostCollision collision = medium.fly(ray, infinity, random);
                if (collision.primitive < 0) break;
                const HostMaterial& material = medium.material(collision.primitive);
                ray.origin += collision.t * ray.direction;
                power *= material.albedo;
                const glm::dvec3 at = ray.origin - c.origin;
                const double x = 0.5 * scene.film.width + glm::dot(at, r) / edge, y = 0.5 * scene.film.height - glm::dot(at, u) / edge;
                if (x >= 0 && x < scene.film.width && y >= 0 && y < scene.film.height && medium.fly({ray.origin, -f}, infinity, random).primitive < 0) {
                    const glm::dvec3 value = power * (phase_value(material.phase, -glm::dot(ray.direction, f)) / (edge * edge));
                    const std::size_t pixel = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(scene.film.width) + static_cast<std::size_t>(x));
                    for (int k = 0; k < 3; ++k) rgb[pixel + static_cast<std::size_t>(k)] += value[k];
                }
                ray.direction = sample_phase(material.phase, ray.direction, random);
                // Roulette by the largest channel.
                const double most = std::max({power.x, power.y, power.z}) * static_cast<double>(photons), start = 4 * pi * std::max({light.intensity.x, light.intensity.y, light.intensity.z});
                if (most < 0.1 * start) {
                    if (!(random.uniform() * 0.1 * start < most)) break;
                    power *= 0.1 * start / most;
                }
            }
        }
}

}  // namespace

HostImage trace_from_lights(const Scene& scene, std::uint64_t photons, std::uint64_t seed, int threads, int batches, int cells) {
    if (scene.camera.kind != CameraKind::orthographic) throw std::invalid_argument("light tracer: the camera must be orthographic");
    for (const Light& light : scene.lights)
        if (light.kind != LightKind::point && light.kind != LightKind::spot) throw std::invalid_argument("light tracer: point and spot lights only");
    const HostMedium medium(scene, cells);
    HostImage image;
    image.width = scene.film.width;
    image.height = scene.film.height;
    const std::size_t values = 3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
    std::vector<std::vector<double>> parts(static_cast<std::size_t>(batches), std::vector<double>(values, 0));
    const auto run = [&](int first) {
        for (int b = first; b < batches; b += threads)
            trace_batch(scene, medium, photons / static_cast<std::uint64_t>(batches), HostRandom(seed, static_cast<std::uint64_t>(b)), parts[static_cast<std::size_t>(b)]);
    };
    std::vector<std::thread> helpers;
    for (int i = 1; i < threads; ++i) helpers.emplace_back(run, i);
    run(0);
    for (auto& helper : helpers) helper.join();
    const double n = batches;
    image.alpha.assign(values / 3, 0);
    for (std::size_t i = 0; i < values; ++i) {
        double sum = 0, squares = 0;
        for (const auto& part : parts) sum += part[i], squares += part[i] * part[i];
        image.rgb.push_back(sum / n);
        image.variance.push_back(std::max(0.0, squares - sum * sum / n) / (n * (n - 1)));
    }
    return image;
}

}  // namespace clume::reference
