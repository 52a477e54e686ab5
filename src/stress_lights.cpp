// SPDX-License-Identifier: MIT
// Samples of lights against the exact map of the same random bits: of the floats that the device has, and, for what rounding
// the scene does, of the scene's doubles.
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "src/device_scene.h"
#include "src/device_values.h"
#include "src/stress_parts.h"
#include "src/stress_sampling.h"

namespace clume {
namespace {

using oracle::Real;
using oracle::Vector;

double num(const Real& r) { return static_cast<double>(r); }

struct LightFamily {
    const char* name;
    LightKind kind;
    double size[2], distance[2];  ///< of the light, and from it to the point, normalised lengths
    bool in_radii = false;        ///< the distance is in radii of the sphere
};
constexpr LightFamily kLights[] = {{"constant", LightKind::constant, {1, 1}, {1, 1}},
                                   {"directional", LightKind::directional, {1, 1}, {1, 1}},
                                   {"point", LightKind::point, {1, 1}, {1e-6, 1e6}},
                                   {"spot", LightKind::spot, {1, 1}, {1e-3, 1e3}},
                                   {"sphere", LightKind::sphere, {0.01, 1}, {0.1, 3}},
                                   {"sphere, small and far", LightKind::sphere, {1e-7, 1e-3}, {0.3, 1.5}},
                                   {"sphere, next to it", LightKind::sphere, {0.1, 1}, {0.01, 0.05}, true},
                                   {"rectangle", LightKind::rectangle, {0.01, 1}, {0.05, 1.5}},
                                   {"rectangle, small and far", LightKind::rectangle, {1e-7, 1e-3}, {0.3, 1.5}}};

/// A light of the family in a scene of radius about 1.
Light make_light(const LightFamily& f, StressRandom& random, double size) {
    Light l;
    l.kind = f.kind;
    l.radiance = l.intensity = l.irradiance = glm::dvec3(random.spread(1e-3, 1e3));
    const glm::dvec3 place = 0.2 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    l.position = l.center = l.corner = place;
    l.direction = some_direction(random);
    l.target = place + some_direction(random);
    l.beam_rad = 0.3, l.cutoff_rad = 2.9;
    l.radius = size;
    l.edge_u = size * glm::normalize(glm::dvec3(1, random.uniform(-1, 1), 0.1));
    l.edge_v = size * random.uniform(0.3, 1) * glm::normalize(glm::dvec3(random.uniform(-0.3, 0.3), 0.2, 1));
    return l;
}

/// A light's numbers: the floats that the device has, or the scene's doubles, normalised.
struct LightNumbers {
    device::uint kind;
    Vector position{}, axis{}, edge_u{}, edge_v{};  ///< position: of a directional light, where it shines to
    Real radiance, select, radius, area, cutoff, slope;
};

LightNumbers floats_of(const device::LightInfo& l) {
    const auto wide = [](float v) { return Real(static_cast<double>(v)); };
    return {l.kind, exact(l.position), exact(l.axis), exact(l.edge_u), exact(l.edge_v), wide(l.radiance.x), wide(l.select_pdf), wide(l.position.w), wide(l.position.w), wide(l.axis.w), wide(l.edge_u.x)};
}

LightNumbers doubles_of(const Light& l, device::uint kind, const Normalization& n) {
    const auto wide = [](const glm::dvec3& v) { return Vector{Real(v.x), Real(v.y), Real(v.z)}; };
    const auto times = [](const Vector& v, const Real& s) { return Vector{v[0] * s, v[1] * s, v[2] * s}; };
    const auto minus = [](const Vector& a, const Vector& b) { return Vector{a[0] - b[0], a[1] - b[1], a[2] - b[2]}; };
    const Real scale = n.scale;
    LightNumbers e;
    e.kind = kind;
    e.select = 1;  // there is no other
    e.radiance = (kind == LIGHT_DIRECTIONAL ? l.irradiance : l.radiance).x;
    e.position = times(minus(wide(kind == LIGHT_SPHERE ? l.center : kind == LIGHT_RECTANGLE ? l.corner : l.position), wide(n.center)), scale);
    if (kind & (LIGHT_POINT | LIGHT_SPOT)) e.radiance = Real(l.intensity.x) * scale * scale;
    if (kind == LIGHT_DIRECTIONAL) e.position = oracle::unit(wide(l.direction));
    if (kind == LIGHT_SPOT) e.axis = oracle::unit(minus(wide(l.target), wide(l.position))), e.cutoff = l.cutoff_rad, e.slope = 1 / (Real(l.cutoff_rad) - Real(l.beam_rad));
    if (kind == LIGHT_SPHERE) e.radius = Real(l.radius) * scale;
    if (kind == LIGHT_RECTANGLE) {
        const Vector u = e.edge_u = times(wide(l.edge_u), scale), v = e.edge_v = times(wide(l.edge_v), scale);
        e.axis = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
        e.area = sqrt(oracle::dot(e.axis, e.axis));
        e.axis = oracle::unit(e.axis);
    }
    return e;
}

/// The exact sample for the same bits.
struct LightTruth {
    Vector direction{}, end{};
    Vector axis{};  ///< of a sphere's cap
    Real tilt = 0;  ///< from it, rad
    Real pdf = 0, value = 0;
    Real weight = 1;  ///< of relative errors: a spot's falloff, the cosine at a rectangle
    bool lit = true;
};

LightTruth light_truth(const LightNumbers& l, const Vector& o, const StressBits& bits) {
    LightTruth s;
    const Real pi = oracle::pi(), u = stress_uniform(bits.v[1]), turn = stress_uniform(bits.v[2]);
    const Vector v{l.position[0] - o[0], l.position[1] - o[1], l.position[2] - o[2]};
    const Real q2 = oracle::dot(v, v);
    switch (l.kind) {
        case LIGHT_CONSTANT:
            s.direction = around({Real(0), Real(0), Real(1)}, 2 * u, turn);
            s.pdf = l.select / (4 * pi);
            s.value = l.radiance / s.pdf;
            break;
        case LIGHT_DIRECTIONAL:
            s.direction = {-l.position[0], -l.position[1], -l.position[2]};
            s.value = l.radiance / l.select;
            break;
        case LIGHT_POINT:
        case LIGHT_SPOT:
            s.direction = oracle::unit(v);
            s.end = l.position;
            s.value = l.radiance / q2 / l.select;
            if (l.kind == LIGHT_POINT) break;
            s.weight = std::min(Real(1), Real((l.cutoff - acos(-oracle::dot(s.direction, oracle::unit(l.axis)))) * l.slope));
            s.lit = s.weight > 0;
            s.value *= s.weight;
            break;
        case LIGHT_SPHERE: {
            const Real sin2 = l.radius * l.radius / q2;
            if (!(sin2 < 1)) return s.lit = false, s;
            const Real cap = sin2 / (1 + sqrt(1 - sin2));
            s.axis = oracle::unit(v);
            s.tilt = 2 * asin(sqrt(u * cap / 2));
            s.direction = around(s.axis, u * cap, turn);
            const Real along = oracle::dot(v, s.direction), aside = l.radius * l.radius - q2 + along * along;
            s.end = oracle::along(o, s.direction, along - sqrt(std::max(Real(0), aside)));
            s.pdf = l.select / (2 * pi * cap);
            s.value = l.radiance / s.pdf;
            break;
        }
        default: {
            for (std::size_t k = 0; k < 3; ++k) s.end[k] = l.position[k] + u * l.edge_u[k] + turn * l.edge_v[k];
            const Vector to{s.end[0] - o[0], s.end[1] - o[1], s.end[2] - o[2]};
            s.direction = oracle::unit(to);
            s.weight = -oracle::dot(s.direction, l.axis);
            s.lit = s.weight > 0;
            s.pdf = l.select * oracle::dot(to, to) / (s.weight * l.area);
            s.value = l.radiance / s.pdf;
            break;
        }
    }
    return s;
}

}  // namespace

void stress_lights(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress) {
    double done = 0;
    const Limit direction_limit = stated_limit("light.cl", "light_sample", "direction"), end_limit = stated_limit("light.cl", "light_sample", "end"), pdf_limit = stated_limit("light.cl", "light_sample", "pdf"),
                value_limit = stated_limit("light.cl", "light_sample", "value");
    const std::size_t n = options.quick ? 60 : 1500, scenes = options.quick ? 4 : 12;
    StressRandom random(41);
    for (const LightFamily& f : kLights) {
        std::vector<StressError> directions, ends, pdfs, values;
        std::size_t lost = 0, invented = 0, cases = 0;
        for (std::size_t part = 0; part < scenes; ++part) {
            Scene scene;
            scene.camera.origin = {0, 0, 5};
            scene.render.light_sampling = LightSampling::nee;
            scene.render.strategy = "decomposition";
            EllipsoidMedium& medium = scene.media.emplace_back();
            Primitive ball;
            ball.center = {0, 0, 0}, ball.axes = glm::dmat3(0.4), ball.sigma_t = 1;
            medium.primitives.push_back(ball);
            const double size = random.spread(f.size[0], f.size[1]);
            scene.lights.push_back(make_light(f, random, size));
            const DeviceScene packed = make_device_scene(scene, {});
            const device::LightInfo& light = packed.lights[0];
            const LightNumbers given = floats_of(light), meant = doubles_of(scene.lights[0], light.kind, packed.normalization);
            std::vector<device::float4> points(n);
            std::vector<StressBits> bits(2 * n);
            const glm::dvec3 at(light.position.x, light.position.y, light.position.z);
            for (std::size_t i = 0; i < n; ++i) {
                const double gap = random.spread(f.distance[0], f.distance[1]);
                const double radius = f.kind == LightKind::sphere ? static_cast<double>(light.position.w) : 0, away = f.in_radii ? radius * (1 + gap) : radius + gap;
                points[i] = pack(f.kind == LightKind::constant || f.kind == LightKind::directional ? glm::dvec3(0) : at + away * some_direction(random), 0);
                bits[2 * i] = some_bits(random), bits[2 * i + 1] = some_bits(random);
            }
            const auto got = device.lights(packed, points, bits);
            for (std::size_t i = 0; i < n; ++i) {
                const LightTruth truth = light_truth(given, exact(points[i]), bits[2 * i]), scene_truth = light_truth(meant, exact(points[i]), bits[2 * i]);
                const auto& s = got[i];
                const bool lit = s.lit > 0;
                ++cases;
                lost += truth.lit && !lit, invented += !truth.lit && lit;
                if (!truth.lit || !lit) continue;
                const std::string where = fmt::format("light at ({:.9g}, {:.9g}, {:.9g}) size {:.9g}, point ({:.9g}, {:.9g}, {:.9g}), bits {:08x} {:08x}: direction ({:.9g}, {:.9g}, {:.9g}), t {:.9g}, pdf {:.9g}, value {:.9g}", light.position.x,
                                                      light.position.y, light.position.z, light.position.w, points[i].x, points[i].y, points[i].z, bits[2 * i].v[1], bits[2 * i].v[2], s.direction[0], s.direction[1], s.direction[2],
                                                      s.distance, s.pdf, s.value);
                const bool ok = all_finite({s.direction[0], s.direction[1], s.direction[2], s.distance, s.value, s.pdf});
                const Vector direction = oracle::vector(s.direction);
                // What rounding the scene does, where its light is seen at all.
                const auto rounding = [&](StressError& e, const Real& off) { e.rounding = scene_truth.lit ? num(off) : NAN; };
                const auto relative = [&](std::vector<StressError>& to, float value, const Real& exact_value, const Real& scene_value, LimitUnit unit) {
                    StressError e = compare_to(static_cast<double>(value), exact_value, unit);
                    const Real weight = std::min(Real(1), truth.weight);
                    e.error *= num(weight);
                    if (scene_truth.lit) rounding(e, abs(exact_value - scene_value) / scene_value * weight);
                    e.at = where;
                    to.push_back(e);
                };
                directions.push_back(error_of(ok ? oracle::distance(direction, truth.direction) : Real(0), ok, where));
                // A cap's frame turns at once where its axis crosses z = 0: there the axis and the tilt are compared, not the turn about it.
                rounding(directions.back(), f.kind == LightKind::sphere ? Real(oracle::distance(truth.axis, scene_truth.axis) + abs(truth.tilt - scene_truth.tilt)) : oracle::distance(truth.direction, scene_truth.direction));
                if (truth.pdf > 0) relative(pdfs, s.pdf, truth.pdf, scene_truth.pdf, pdf_limit.unit);
                relative(values, s.value, truth.value, scene_truth.value, value_limit.unit);
                if (f.kind == LightKind::constant || f.kind == LightKind::directional || !ok) continue;
                const Vector end = oracle::along(exact(points[i]), direction, Real(static_cast<double>(s.distance)));
                // A sphere's end may be any point of it: of a line next to its limb, float knows no better where.
                const Real off = f.kind == LightKind::sphere ? Real(abs(oracle::distance(end, given.position) - given.radius)) : oracle::distance(end, truth.end);
                const Real ulps = Real(0x1p23) / std::max(1.0, static_cast<double>(s.distance));  // of the radius, or of the distance where that is greater
                ends.push_back(error_of(off * ulps, true, where));
                rounding(ends.back(), ulps * (f.kind == LightKind::sphere ? Real(abs(oracle::distance(scene_truth.end, given.position) - given.radius)) : oracle::distance(truth.end, scene_truth.end)));
            }
        }
        StressRow row = stress_row("light sampling: direction", "light_sample", f.name, direction_limit, directions, options);
        row.lost = {lost, cases, ""}, row.invented = {invented, cases, ""};
        result.rows.push_back(row);
        if (!ends.empty()) result.rows.push_back(stress_row("light sampling: end", "light_sample", f.name, end_limit, ends, options));
        if (!pdfs.empty()) result.rows.push_back(stress_row("light sampling: density", "light_sample", f.name, pdf_limit, pdfs, options));
        result.rows.push_back(stress_row("light sampling: value", "light_sample", f.name, value_limit, values, options));
        progress((done += 1) / std::size(kLights));
    }
}

}  // namespace clume
