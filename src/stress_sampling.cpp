// SPDX-License-Identifier: MIT
// Phase functions and their sampling, and camera rays, each against the exact map of the same random bits. The uniform numbers
// that a map starts from are taken as the floats they are; how bits become them is judged in stress_math.
#include "src/stress_sampling.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "src/device_scene.h"
#include "src/device_values.h"
#include "src/parallel.h"
#include "src/stress_parts.h"

namespace clume {

using oracle::Real;
using oracle::Vector;

Real stress_uniform(std::uint32_t x) { return static_cast<double>(std::min((static_cast<float>(x) + 0.5f) * 0x1p-32f, 0x1.fffffep-1f)); }

/// The map of phase.cl's `around`, for d of length 1 exactly, from 1 − c.
Vector around(const Vector& d, const Real& versine, const Real& turn) {
    const Real c = 1 - versine, s = sqrt(versine * (2 - versine)), phi = 2 * oracle::pi() * turn;
    const Real sign = std::signbit(static_cast<double>(d[2])) ? -1 : 1, a = -1 / (sign + d[2]), b = d[0] * d[1] * a;
    const Vector u{1 + sign * d[0] * d[0] * a, sign * b, -sign * d[0]}, v{b, sign + d[1] * d[1] * a, -d[1]};
    const Real cosine = s * cos(phi), sine = s * sin(phi);
    return {c * d[0] + cosine * u[0] + sine * v[0], c * d[1] + cosine * u[1] + sine * v[1], c * d[2] + cosine * u[2] + sine * v[2]};
}

glm::dvec3 some_direction(StressRandom& random) {
    if (random.below(4) == 0) {  // axes, with signed zeros, and next to them
        glm::dvec3 d(random.below(2) ? 0.0 : -0.0);
        const int axis = random.below(3);
        d[axis] = random.sign();
        if (random.below(2)) d[(axis + 1) % 3] = random.sign() * random.spread(1e-12, 1e-3);
        return d / glm::length(d);
    }
    return glm::normalize(glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
}

StressBits some_bits(StressRandom& random) {
    StressBits b;
    for (auto& w : b.v) {
        const int kind = random.below(6);
        w = kind == 0 ? static_cast<std::uint32_t>(random.below(3)) : kind == 1 ? 0xffffffffu - static_cast<std::uint32_t>(random.below(3)) : kind == 2 ? random.word() >> random.below(32) : random.word();
    }
    return b;
}

StressError error_of(const Real& off, bool finite, const std::string& at) {
    StressError e;
    e.nonfinite = !finite;
    e.error = finite ? static_cast<double>(off) : INFINITY;
    e.at = at;
    return e;
}

bool all_finite(std::initializer_list<float> values) {
    return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

namespace {

double num(const Real& r) { return static_cast<double>(r); }

/// 1/sr, from 1 − c
Real phase_value(device::uint kind, const Real& g, const Real& versine) {
    const Real c = 1 - versine, sphere = 4 * oracle::pi();
    if (kind == PHASE_RAYLEIGH) return Real(3) / 4 / sphere * (1 + c * c);
    if (kind == PHASE_ISOTROPIC) return 1 / sphere;
    const Real q = (1 - g) * (1 - g) + 2 * g * versine;
    return (1 - g * g) / (sphere * q * sqrt(q));
}

/// 1 − c of the sampled direction.
Real phase_versine(device::uint kind, const Real& g, const StressBits& bits) {
    const Real u = stress_uniform(bits.v[0]);
    if (kind == PHASE_HENYEY_GREENSTEIN) {
        const Real denominator = 1 - g + 2 * g * u;
        return 2 * (1 - g) * (1 - g) * (1 - u) * (1 + g * u) / (denominator * denominator);
    }
    if (kind == PHASE_RAYLEIGH) {  // three quarters uniform, one quarter the largest of three
        const Real first = stress_uniform(bits.v[0] << 3), largest = std::max(first, std::max(stress_uniform(bits.v[2]), stress_uniform(bits.v[3])));
        if (bits.v[0] >> 30) return 2 - 2 * first;
        return bits.v[0] & 0x20000000u ? Real(1 - largest) : Real(1 + largest);
    }
    return 2 * u;  // z = 1 − 2u, about the z axis
}

struct PhaseFamily {
    const char* name;
    device::uint kind;
    double least, most;  ///< of 1 − |g|
};
constexpr PhaseFamily kPhases[] = {{"isotropic", PHASE_ISOTROPIC, 1, 1},
                                   {"rayleigh", PHASE_RAYLEIGH, 1, 1},
                                   {"henyey-greenstein, |g| below 1e-3", PHASE_HENYEY_GREENSTEIN, 1 - 1e-3, 1},
                                   {"henyey-greenstein, |g| to 0.99", PHASE_HENYEY_GREENSTEIN, 0.01, 1},
                                   {"henyey-greenstein, |g| to 1 − 1e-6", PHASE_HENYEY_GREENSTEIN, 1e-6, 0.01}};

void stress_phases(StressDevice& device, const StressOptions& options, StressResult& result) {
    const Limit value_limit = stated_limit("phase_body.inc.cl", "FN(phase_value)"), direction_limit = stated_limit("phase_body.inc.cl", "FN(phase_sample)", "direction"), pdf_limit = stated_limit("phase_body.inc.cl", "FN(phase_sample)", "pdf");
    const std::size_t n = options.quick ? 500 : 20000;
    StressRandom random(31);
    for (const PhaseFamily& f : kPhases) {
        std::vector<device::float4> directions(n);
        std::vector<float> versines(n);
        std::vector<StressBits> bits(n);
        for (std::size_t i = 0; i < n; ++i) {
            directions[i] = pack(some_direction(random), f.kind == PHASE_HENYEY_GREENSTEIN ? random.sign() * (1 - random.spread(f.least, f.most)) : 0);
            versines[i] = static_cast<float>(random.below(3) ? random.uniform(0, 2) : random.below(2) ? 2 - random.spread(1e-7, 1) : random.spread(1e-12, 1));
            bits[i] = some_bits(random);
        }
        const StressDevice::Phase got = device.phase(f.kind, directions, versines, bits);
        std::vector<StressError> values(n), sampled(n), pdfs(n);
        parallel_chunks(n, 64, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Real g = static_cast<double>(directions[i].w), given = static_cast<double>(versines[i]);
                // The device is told 1 − c for g >= 0, 1 + c for g < 0: the side of the peak.
                values[i] = compare_to(static_cast<double>(got.values[i]), phase_value(f.kind, abs(g), given), value_limit.unit);
                const Vector d = oracle::unit(exact(directions[i])), axis{Real(0), Real(0), Real(1)};
                const Real versine = phase_versine(f.kind, g, bits[i]), turn = stress_uniform(bits[i].v[1]);
                // An isotropic direction does not turn with d; its frame is that of sphere_uniform: x by cosine, y by sine.
                const Vector truth = around(f.kind == PHASE_ISOTROPIC ? axis : d, versine, turn);
                const device::float4& s = got.directions[i];
                const std::string at = fmt::format("g {:.9g}, d ({:.9g}, {:.9g}, {:.9g}), bits {:08x} {:08x} {:08x} {:08x}, 1 - c {:.9g}: ({:.9g}, {:.9g}, {:.9g}), pdf {:.9g}, value {:.9g}", directions[i].w, directions[i].x,
                                                   directions[i].y, directions[i].z, bits[i].v[0], bits[i].v[1], bits[i].v[2], bits[i].v[3], versines[i], s.x, s.y, s.z, s.w, got.values[i]);
                const bool ok = all_finite({s.x, s.y, s.z, s.w});
                sampled[i] = error_of(ok ? oracle::distance(exact(s), truth) : Real(0), ok, at);
                pdfs[i] = compare_to(static_cast<double>(s.w), phase_value(f.kind, g, versine), pdf_limit.unit);
                values[i].at = pdfs[i].at = at;
            }
        });
        result.rows.push_back(stress_row("phase function", "FN(phase_value)", f.name, value_limit, values, options));
        result.rows.push_back(stress_row("phase sampling: direction", "FN(phase_sample)", f.name, direction_limit, sampled, options));
        result.rows.push_back(stress_row("phase sampling: density", "FN(phase_sample)", f.name, pdf_limit, pdfs, options));
    }
}

struct CameraFamily {
    const char* name;
    CameraKind kind;
    double distance[2];  ///< of the eye from the centre, radii
    double fov_rad;      ///< 0: such that the scene fills the film
    int film;
};
constexpr CameraFamily kCameras[] = {{"perspective, near", CameraKind::perspective, {1.2, 10}, 0, 512},
                                     {"perspective, inside", CameraKind::perspective, {0.01, 0.9}, 1.2, 512},
                                     {"perspective, 1e2 to 1e7 radii away", CameraKind::perspective, {1e2, 1e7}, 0, 512},
                                     {"perspective, 170°", CameraKind::perspective, {0.5, 3}, 2.967, 512},
                                     {"perspective, film of 16384", CameraKind::perspective, {1.5, 5}, 0, 16384},
                                     {"orthographic, 1 to 1e7 radii away", CameraKind::orthographic, {1, 1e7}, 0, 1024}};

void stress_cameras(StressDevice& device, const StressOptions& options, StressResult& result) {
    const Limit origin_limit = stated_limit("camera.cl", "camera_ray", "origin"), direction_limit = stated_limit("camera.cl", "camera_ray", "direction");
    const std::size_t n = options.quick ? 60 : 1000, scenes = options.quick ? 4 : 12;
    StressRandom random(51);
    for (const CameraFamily& f : kCameras) {
        std::vector<StressError> origins, directions;
        for (std::size_t part = 0; part < scenes; ++part) {
            Scene scene;
            scene.render.strategy = "decomposition";
            scene.film.width = f.film, scene.film.height = f.film / 2;
            const double world = random.spread(1e-6, 1e6);
            const glm::dvec3 offset = 100.0 * world * some_direction(random);
            EllipsoidMedium& medium = scene.media.emplace_back();
            Primitive ball;
            ball.center = offset, ball.axes = glm::dmat3(world / medium.extent), ball.sigma_t = 1 / world;
            medium.primitives.push_back(ball);
            const double away = random.spread(f.distance[0], f.distance[1]);
            Camera& camera = scene.camera;
            camera.kind = f.kind;
            camera.origin = offset + world * away * some_direction(random);
            camera.target = offset + 0.3 * world * some_direction(random);
            camera.up = glm::normalize(glm::dvec3(0.1, 1, 0.2));
            camera.fov_rad = f.fov_rad > 0 ? f.fov_rad : 2 * std::atan(1.7 / away);
            camera.width = 3 * world;
            const DeviceScene packed = make_device_scene(scene, {});
            std::vector<StressDevice::FilmPoint> points(n);
            for (auto& p : points) {
                p.x = static_cast<std::uint32_t>(random.below(scene.film.width)), p.y = static_cast<std::uint32_t>(random.below(scene.film.height));
                p.u = static_cast<float>(num(stress_uniform(some_bits(random).v[0]))), p.v = static_cast<float>(num(stress_uniform(some_bits(random).v[0])));
            }
            const auto got = device.camera(packed, points);
            const device::RenderParams& p = packed.params;
            // The scene's own camera, in normalised coordinates.
            const auto wide = [](const glm::dvec3& v) { return Vector{Real(v.x), Real(v.y), Real(v.z)}; };
            const auto cross = [](const Vector& a, const Vector& b) { return Vector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; };
            const Vector from = wide(camera.origin), to = wide(camera.target), forward = oracle::unit({to[0] - from[0], to[1] - from[1], to[2] - from[2]}), right = oracle::unit(cross(forward, wide(camera.up))),
                         up = cross(right, forward);
            const Real scale = packed.normalization.scale, width = static_cast<double>(scene.film.width);
            const Real step = f.kind == CameraKind::perspective ? Real(2 * tan(Real(camera.fov_rad) / 2) / width) : Real(Real(camera.width) * scale / width);
            Vector eye;
            for (std::size_t k = 0; k < 3; ++k) eye[k] = (from[k] - Real(packed.normalization.center[static_cast<int>(k)])) * scale;
            for (std::size_t i = 0; i < n; ++i) {
                const Real x = points[i].x + Real(static_cast<double>(points[i].u)), y = points[i].y + Real(static_cast<double>(points[i].v));
                const Real fx = x - Real(static_cast<double>(p.film_cx)), fy = y - Real(static_cast<double>(p.film_cy));
                Vector o, d, scene_o = eye, scene_d = forward;
                const Vector pc = exact(p.plane_c), px = exact(p.plane_x), py = exact(p.plane_y), dc = exact(p.dir_c), dx = exact(p.dir_x), dy = exact(p.dir_y);
                for (std::size_t k = 0; k < 3; ++k) {
                    o[k] = pc[k] + fx * px[k] + fy * py[k];
                    d[k] = dc[k] + fx * dx[k] + fy * dy[k];
                    const Real aside = ((x - width / 2) * right[k] - (y - Real(scene.film.height) / 2) * up[k]) * step;
                    (f.kind == CameraKind::perspective ? scene_d : scene_o)[k] += aside;
                }
                d = oracle::unit(d);
                scene_d = oracle::unit(scene_d);
                const ProbeRay& r = got[i];
                const std::string at = fmt::format("eye {:.3g} radii away, film point ({} + {:.9g}, {} + {:.9g}): o ({:.9g}, {:.9g}, {:.9g}), d ({:.9g}, {:.9g}, {:.9g})", away, points[i].x, points[i].u, points[i].y, points[i].v,
                                                   r.origin[0], r.origin[1], r.origin[2], r.direction[0], r.direction[1], r.direction[2]);
                const bool ok = all_finite({r.origin[0], r.origin[1], r.origin[2], r.direction[0], r.direction[1], r.direction[2]});
                const Real ulps = Real(0x1p23) / std::max(Real(1), Real(sqrt(oracle::dot(o, o))));  // of the radius, or of the place where that is farther out
                StressError origin = error_of(oracle::distance(oracle::vector(r.origin), o) * ulps, ok, at), direction = error_of(oracle::distance(oracle::vector(r.direction), d), ok, at);
                const Vector between{o[0] - scene_o[0], o[1] - scene_o[1], o[2] - scene_o[2]};
                origin.rounding = num(oracle::distance(o, oracle::along(scene_o, scene_d, oracle::dot(between, scene_d)))) * 0x1p23;
                direction.rounding = num(oracle::distance(d, scene_d));
                origins.push_back(origin);
                directions.push_back(direction);
            }
        }
        result.rows.push_back(stress_row("camera ray: origin", "camera_ray", f.name, origin_limit, origins, options));
        result.rows.push_back(stress_row("camera ray: direction", "camera_ray", f.name, direction_limit, directions, options));
    }
}

}  // namespace

void stress_sampling(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress) {
    stress_phases(device, options, result);
    progress(0.5);
    stress_cameras(device, options, result);
    progress(1);
}

}  // namespace clume
