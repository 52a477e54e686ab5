// SPDX-License-Identifier: MIT
#include "src/device_lights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/alias_table.h"
#include "src/device_values.h"

namespace clume {
namespace {

using std::numbers::pi;

device::uint kind_bit(LightKind kind) {
    switch (kind) {
        case LightKind::constant: return LIGHT_CONSTANT;
        case LightKind::envmap: return LIGHT_ENVMAP;
        case LightKind::point: return LIGHT_POINT;
        case LightKind::spot: return LIGHT_SPOT;
        case LightKind::directional: return LIGHT_DIRECTIONAL;
        case LightKind::sphere: return LIGHT_SPHERE;
        case LightKind::rectangle: break;
    }
    return LIGHT_RECTANGLE;
}

/// Texels and, if asked for, alias table (Vose) of one environment; returns π × mean radiance, the irradiance it gives.
double add_environment(const Light& light, bool with_table, DeviceScene& out, device::LightInfo& info, LightMasks& masks) {
    const auto w = static_cast<std::size_t>(light.image.width), h = static_cast<std::size_t>(light.image.height), n = w * h;
    info.width = static_cast<device::uint>(w);
    info.height = static_cast<device::uint>(h);
    info.texel_offset = static_cast<device::uint>(out.texels.size());
    out.texels.reserve(out.texels.size() + n);
    if (with_table) out.alias.reserve(out.alias.size() + n);
    std::vector<double> weight(with_table ? n : 0);
    double total = 0;
    for (std::size_t row = 0, i = 0; row < h; ++row) {
        // sin a − sin b = 2 cos((a + b)/2) sin((a − b)/2), which cancels nothing at the poles.
        const double solid_angle = 4 * pi / static_cast<double>(w) * std::cos(pi * (0.5 - (static_cast<double>(row) + 0.5) / static_cast<double>(h))) * std::sin(pi * 0.5 / static_cast<double>(h));
        for (std::size_t column = 0; column < w; ++column, ++i) {
            const glm::dvec3 rgb = glm::dvec3(light.image.rgb[3 * i], light.image.rgb[3 * i + 1], light.image.rgb[3 * i + 2]) * light.scale;
            masks.grey = masks.grey && is_grey(rgb);
            masks.brightest = std::max(masks.brightest, largest(rgb));
            const device::float4& texel = out.texels.emplace_back(pack(rgb));
            const double share = static_cast<double>(std::max({texel.x, texel.y, texel.z})) * solid_angle;  // of what the device has
            total += share;
            if (!with_table) continue;
            weight[i] = share;
            out.alias.push_back({0xffffffffu, static_cast<device::uint>(i), static_cast<float>(solid_angle), 0});
        }
    }
    if (!with_table) return total;
    device::AliasEntry* table = out.alias.data() + info.texel_offset;
    for (std::size_t i = 0; i < n; ++i) table[i].pdf_texel = total > 0 ? static_cast<float>(weight[i] / total / static_cast<double>(table[i].pdf_texel)) : 0.0f;
    if (!(total > 0)) return 0;
    for (double& v : weight) v *= static_cast<double>(n) / total;
    const std::vector<AliasSlot> slots = alias_table(std::move(weight));
    for (std::size_t i = 0; i < n; ++i) table[i].threshold = slots[i].threshold, table[i].other = slots[i].other;
    return total;
}

}  // namespace

LightMasks add_lights(const Scene& scene, DeviceScene& out, bool with_tables) {
    LightMasks masks;
    const Normalization& n = out.normalization;
    const auto place = [&](const glm::dvec3& p) { return (p - n.center) * n.scale; };
    std::vector<double> power;
    for (const Light& light : scene.lights) {
        device::LightInfo info{};
        info.kind = kind_bit(light.kind);
        glm::dvec3 color = light.radiance;
        double irradiance = 0;  // about what it gives at the scene's centre
        const auto falloff = [&](const glm::dvec3& p) { return 1 / std::max(glm::dot(p, p), 0.25); };
        switch (light.kind) {
            case LightKind::constant: irradiance = pi * largest(color); break;
            case LightKind::envmap:
                irradiance = add_environment(light, with_tables, out, info, masks);
                info.axis = pack({std::sin(light.rotate_y_rad), std::cos(light.rotate_y_rad), 0});
                color = glm::dvec3(0);
                break;
            case LightKind::point:
            case LightKind::spot:
                color = light.intensity * n.scale * n.scale;
                info.position = pack(place(light.position));
                irradiance = largest(color) * falloff(place(light.position));
                if (light.kind == LightKind::spot) {
                    info.axis = pack(glm::normalize(light.target - light.position), light.cutoff_rad);
                    info.edge_u = pack({std::min(1 / std::max(light.cutoff_rad - light.beam_rad, 1e-30), 1e12), 0, 0});
                }
                break;
            case LightKind::directional:
                color = light.irradiance;
                info.position = pack(glm::normalize(light.direction));
                irradiance = largest(color);
                break;
            case LightKind::sphere: {
                const glm::dvec3 c = place(light.center);
                const double r = light.radius * n.scale;
                info.position = pack(c, r);
                irradiance = largest(color) * pi * std::min(1.0, r * r * falloff(c));
                break;
            }
            case LightKind::rectangle: {
                const glm::dvec3 u = light.edge_u * n.scale, v = light.edge_v * n.scale, cross = glm::cross(u, v);
                const double area = glm::length(cross);
                info.position = pack(place(light.corner), area);
                info.axis = pack(cross / area);
                info.edge_u = pack(u);
                info.edge_v = pack(v);
                const double uu = glm::dot(u, u), uv = glm::dot(u, v), vv = glm::dot(v, v), det = uu * vv - uv * uv;
                info.dual_u = pack((vv * u - uv * v) / det);
                info.dual_v = pack((uu * v - uv * u) / det);
                irradiance = largest(color) * std::min(pi, area * falloff(place(light.corner + 0.5 * (light.edge_u + light.edge_v))));
                break;
            }
        }
        info.radiance = pack(color);
        info.visible = light.visible_to_camera ? 1 : 0;
        masks.grey = masks.grey && is_grey(color);
        masks.brightest = std::max(masks.brightest, largest(color));
        masks.present |= info.kind;
        masks.visible_background = masks.visible_background || light.visible_to_camera;
        out.lights.push_back(info);
        power.push_back(irradiance);
    }
    const device::uint found_by_paths = LIGHT_CONSTANT | LIGHT_ENVMAP | LIGHT_SPHERE | LIGHT_RECTANGLE;
    switch (scene.render.light_sampling) {
        case LightSampling::mis:  // a constant environment is found by escaping paths with less variance
            masks.nee = masks.present & ~device::uint{LIGHT_CONSTANT};
            masks.hits = masks.present & found_by_paths;
            break;
        case LightSampling::nee: masks.nee = masks.present; break;
        case LightSampling::phase: masks.hits = masks.present & found_by_paths; break;
    }
    // Half by what each light gives, half evenly, so that none is starved where it happens to be near.
    double total = 0;
    int count = 0;
    for (std::size_t i = 0; i < power.size(); ++i) {
        if (!(out.lights[i].kind & masks.nee) || !(power[i] > 0)) power[i] = 0;
        total += power[i];
        count += power[i] > 0;
    }
    if (count == 0) masks.nee = 0;
    double cumulative = 0;
    for (std::size_t i = 0; i < power.size(); ++i) {
        const double p = power[i] > 0 ? 0.5 * power[i] / total + 0.5 / count : 0;
        cumulative += p;
        out.lights[i].select_pdf = static_cast<float>(p);
        out.lights[i].radiance.w = static_cast<float>(cumulative);
    }
    return masks;
}

bool samples_lights(const Scene& scene) {
    DeviceScene scratch;
    scratch.normalization = normalize(scene);
    return add_lights(scene, scratch, false).nee != 0;
}

}  // namespace clume
