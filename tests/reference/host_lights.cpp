// SPDX-License-Identifier: MIT
// Light geometry and radiometry as scene.md's table of lights has them.
#include "tests/reference/host_lights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace clume::reference {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;

double length(const glm::dvec3& v) { return std::sqrt(glm::dot(v, v)); }

/// Distance to the sphere's nearest point ahead; `outside`: the ray comes from outside it.
double hit_sphere(const Light& light, const HostRay& ray, bool& outside) {
    const glm::dvec3 m = ray.origin - light.center;
    const double along = glm::dot(m, ray.direction);
    const glm::dvec3 foot = m - along * ray.direction;
    const double square = light.radius * light.radius - glm::dot(foot, foot);
    if (square < 0) return infinity;
    const double half = std::sqrt(square), near = -along - half, far = -along + half;
    outside = near > 0;
    return near > 0 ? near : far > 0 ? far : infinity;
}

/// Distance to the parallelogram; `front`: on the side that emits.
double hit_rectangle(const Light& light, const HostRay& ray, bool& front) {
    const glm::dvec3 normal = glm::cross(light.edge_u, light.edge_v), m = ray.origin - light.corner;
    const double slope = glm::dot(normal, ray.direction);
    if (slope == 0) return infinity;
    const double t = -glm::dot(normal, m) / slope;
    if (!(t > 0)) return infinity;
    const glm::dvec3 p = m + t * ray.direction;
    const double square = glm::dot(normal, normal);
    const double u = glm::dot(glm::cross(p, light.edge_v), normal) / square;
    const double v = glm::dot(glm::cross(light.edge_u, p), normal) / square;
    if (u < 0 || u > 1 || v < 0 || v > 1) return infinity;
    front = slope < 0;
    return t;
}

/// Radiance of an image environment; piecewise constant.
glm::dvec3 look_up(const Light& light, const glm::dvec3& d) {
    const double c = std::cos(light.rotate_y_rad), s = std::sin(light.rotate_y_rad);
    const double x = d.x * c - d.z * s, z = d.x * s + d.z * c;
    const int w = light.image.width, h = light.image.height;
    const double lon = std::atan2(x, z), lat = std::asin(std::clamp(d.y, -1.0, 1.0));
    const int column = std::clamp(static_cast<int>(std::floor(w * (0.5 - lon / (2 * pi)))), 0, w - 1);
    const int row = std::clamp(static_cast<int>(std::floor(h * (0.5 - lat / pi))), 0, h - 1);
    const float* texel = light.image.rgb.data() + 3 * (static_cast<std::size_t>(row) * w + column);
    return light.scale * glm::dvec3(texel[0], texel[1], texel[2]);
}

}  // namespace

HostLights::HostLights(const Scene& scene) {
    for (const Light& light : scene.lights) {
        switch (light.kind) {
            case LightKind::constant:
                constant_ += light.radiance;
                if (light.visible_to_camera) constant_visible_ += light.radiance;
                break;
            case LightKind::envmap: images_.push_back(light); break;
            case LightKind::sphere:
            case LightKind::rectangle: surfaces_.push_back(light); break;
            default: sampled_.push_back(light);
        }
    }
}

SurfaceHit HostLights::nearest_surface(const HostRay& ray) const {
    SurfaceHit nearest{infinity, glm::dvec3(0)};
    for (const Light& light : surfaces_) {
        bool bright = false;
        const double t =
            light.kind == LightKind::sphere ? hit_sphere(light, ray, bright) : hit_rectangle(light, ray, bright);
        if (t < nearest.t) nearest = {t, bright ? light.radiance : glm::dvec3(0)};
    }
    return nearest;
}

LightSample HostLights::sample(std::size_t index, const glm::dvec3& x) const {
    const Light& light = sampled_[index];
    if (light.kind == LightKind::directional)
        return {-light.direction / length(light.direction), infinity, light.irradiance};
    const glm::dvec3 to_light = light.position - x;
    const double distance = length(to_light);
    if (!(distance > 0)) return {{0, 0, 1}, 0, glm::dvec3(0)};
    const glm::dvec3 direction = to_light / distance;
    double falloff = 1;
    if (light.kind == LightKind::spot) {
        const glm::dvec3 axis = light.target - light.position;
        const double angle = std::atan2(length(glm::cross(axis, -direction)), glm::dot(axis, -direction));
        if (angle > light.beam_rad)
            falloff = angle >= light.cutoff_rad ? 0 : (light.cutoff_rad - angle) / (light.cutoff_rad - light.beam_rad);
    }
    return {direction, distance, light.intensity * (falloff / (distance * distance))};
}

glm::dvec3 HostLights::background(const glm::dvec3& direction, bool from_camera) const {
    glm::dvec3 sum = from_camera ? constant_visible_ : constant_;
    for (const Light& light : images_)
        if (!from_camera || light.visible_to_camera) sum += look_up(light, direction);
    return sum;
}

}  // namespace clume::reference
