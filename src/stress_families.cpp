// SPDX-License-Identifier: MIT
#include "src/stress_families.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "src/device_mixture.h"
#include "src/device_scene.h"
#include "src/ellipsoid.h"

namespace clume {
namespace {

/// A primitive in normalised coordinates for a ray that is given.
Primitive place(const ChordFamily& f, StressRandom& random, double extent, ProbeGroupRay& ray, ChordCase& about) {
    const glm::dvec3 o(ray.origin[0], ray.origin[1], ray.origin[2]), dir(ray.direction[0], ray.direction[1], ray.direction[2]);
    const double s = random.spread(f.scale[0], f.scale[1]) * (extent > 5 ? 5 / extent : 1), ratio = random.spread(f.ratio[0], f.ratio[1]);
    const int shape = random.below(3);
    const glm::dvec3 scale = shape == 0 ? glm::dvec3(s, s / ratio, s / ratio) : shape == 1 ? glm::dvec3(s, s, s / ratio) : glm::dvec3(s, s / std::sqrt(ratio), s / ratio);
    glm::dmat3 turn(1.0);
    if (random.below(4) != 0)
        turn = glm::mat3_cast(glm::normalize(glm::dquat(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1))));
    else if (random.below(2))  // a permutation: axis-parallel, but not in order
        turn = glm::dmat3(glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1), glm::dvec3(1, 0, 0));
    Primitive p;
    for (int k = 0; k < 3; ++k) p.axes[k] = turn[k] * scale[k];
    const glm::dvec3 b = glm::transpose(turn) * dir / scale;
    const double w = glm::length(b);
    double distance = random.uniform() * (random.below(8) ? 1.05 : 0) * extent;
    if (f.place == Place::grazing) distance = extent * (1 - random.sign() * random.spread(1e-7, 1e-3));
    if (f.place == Place::centre) distance = 0;
    if (f.place == Place::inside || f.place == Place::boundary) distance = std::min(distance, 0.98 * extent);
    const double h = std::sqrt(std::max(0.0, extent * extent - distance * distance));
    double t = 0;  // of the foot
    switch (f.place) {
        case Place::ahead: t = std::min(0.5, random.spread(1, 30) * extent / w); break;
        case Place::grazing:
        case Place::far: t = random.uniform(0.05, 0.5); break;
        case Place::inside: t = random.uniform(-0.99, 0.99) * h / w; break;
        case Place::boundary: t = random.sign() * h / w * (1 + random.sign() * random.below(2) * 1e-7); break;
        case Place::centre: break;
    }
    const glm::dvec3 helper = std::abs(b.x) < 0.5 * w ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0), side = glm::normalize(glm::cross(b, helper)), up = glm::cross(b / w, side);
    const double angle = random.uniform(0, 6.283185307179586);
    p.center = o + t * dir - p.axes * (distance * (std::cos(angle) * side + std::sin(angle) * up));
    const double density = random.spread(f.density[0], f.density[1]);
    p.sigma_t = density * w;
    if (f.denormal) p.sigma_t = random.below(2) ? random.spread(1e-44, 1e-38) : p.sigma_t;

    // The interval, in u = w (t − t⊥).
    double u0 = -1e30, u1 = 1e30;
    Span span = f.span;
    if (span == Span::any) span = static_cast<Span>(1 + random.below(4));
    switch (span) {
        case Span::any:
        case Span::whole: break;
        case Span::brief: u0 = random.uniform(-1, 1) * h, u1 = u0 + random.spread(1e-7, 0.5); break;
        case Span::entry_tail: u0 = -h * (random.below(2) ? 1.5 : 1 - random.spread(1e-6, 0.1)), u1 = -h * (1 - random.spread(1e-5, 0.3)); break;
        case Span::exit_tail: u0 = h * (1 - random.spread(1e-5, 0.3)), u1 = random.below(2) ? 1e30 : h * (1 - random.spread(1e-6, 0.1)); break;
    }
    if (u0 > u1) std::swap(u0, u1);
    ray.t0 = static_cast<float>(std::max(0.0, t + u0 / w));
    ray.t1 = static_cast<float>(std::min(1e30, t + u1 / w));
    if (f.denormal && random.below(2)) ray.t0 = static_cast<float>(random.spread(1e-44, 1e-38));
    if (!(ray.t1 > ray.t0)) ray.t1 = std::nextafter(ray.t0, 1e30f);
    ray.tau = static_cast<float>(std::max(0x1p-33, density * random.spread(1e-6, 3)));
    about.ratio = ratio;
    about.distance = glm::length(p.center - o) * w;
    about.density = density;
    return p;
}

ProbeGroupRay some_ray(const ChordFamily& f, StressRandom& random) {
    glm::dvec3 dir(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    if (f.axis_parallel) {
        const int axis = random.below(3), kind = random.below(3);
        const double sign = random.sign();
        if (kind < 2) dir = glm::dvec3(kind ? 0.0 : -0.0), dir[axis] = sign;  // along an axis
        else dir[axis] = -0.0;                                                // in a plane
    }
    if (f.denormal) dir[random.below(3)] = random.sign() * random.spread(1e-44, 1e-38);
    dir = glm::normalize(dir);
    ProbeGroupRay ray;
    for (int k = 0; k < 3; ++k) {
        ray.origin[k] = static_cast<float>(random.uniform(-0.2, 0.2));
        ray.direction[k] = static_cast<float>(dir[k]);
    }
    if (f.denormal) ray.origin[random.below(3)] = static_cast<float>(random.sign() * random.spread(1e-44, 1e-38));
    return ray;
}

/// Balls at opposite corners, which alone decide how the scene is normalised.
void add_anchors(EllipsoidMedium& medium, double size, const glm::dvec3& offset) {
    const double reach = 0.05 * size / medium.extent, edge = 1.1 * size - medium.extent * reach;
    for (const double sign : {-1.0, 1.0}) {
        Primitive p;
        p.center = offset + sign * glm::dvec3(edge);
        p.axes = glm::dmat3(reach);
        p.sigma_t = 1 / size;
        medium.primitives.push_back(p);
    }
}

template <class Number, class Weights>
oracle::Ellipsoid256 exact(const Number& mu, const Weights& w, double sigma, double e2, KernelFamily kernel) {
    oracle::Ellipsoid256 e;
    for (int k = 0; k < 3; ++k) e.mu[static_cast<std::size_t>(k)] = oracle::Real(mu[k]);
    for (int k = 0; k < 6; ++k) e.w[static_cast<std::size_t>(k)] = oracle::Real(w[k]);
    e.sigma = sigma;
    e.e2 = e2;
    e.family = kernel;
    return e;
}

}  // namespace

const std::vector<ChordFamily>& chord_families() {
    static const std::vector<ChordFamily> families = [] {
        std::vector<ChordFamily> all;
        const auto add = [&](const char* name) -> ChordFamily& {
            all.push_back({});
            all.back().name = name;
            return all.back();
        };
        const auto range = [](double (&to)[2], double lo, double hi) { to[0] = lo, to[1] = hi; };
        range(add("axis ratio 1 to 1e6").ratio, 1, 1e6);
        range(add("scene of 1e-12 to 1e12").world, 1e-12, 1e12);
        range(add("scale 1e-12 to 1 of the scene").scale, 1e-12, 0.05);
        auto& far = add("centres up to 1e7 scales away");
        far.place = Place::far;
        range(far.scale, 3e-8, 1e-2);
        range(far.ratio, 1, 3);
        auto& grazing = add("grazing to 1e-7");
        grazing.place = Place::grazing;
        add("axis-parallel, −0").axis_parallel = true;
        add("origin inside").place = Place::inside;
        add("origin on the boundary").place = Place::boundary;
        add("origin at the centre").place = Place::centre;
        add("very short intervals").span = Span::brief;
        add("whole lines").span = Span::whole;
        add("tail at the entry").span = Span::entry_tail;
        add("tail at the exit").span = Span::exit_tail;
        range(add("density 1e-12 to 1e-3").density, 1e-12, 1e-3);
        range(add("density 1e3 to 1e12").density, 1e3, 1e12);
        auto& dim = add("support 16: exp underflows");
        dim.extent = 16;
        add("denormals").denormal = true;
        return all;
    }();
    return families;
}

double usual_extent(KernelFamily kernel) { return kernel == KernelFamily::gaussian ? 3 : kernel == KernelFamily::epanechnikov ? std::sqrt(7.0) : std::sqrt(5.0); }

std::vector<ChordCase> chord_cases(const ChordFamily& f, KernelFamily kernel, std::size_t count, std::uint64_t seed) {
    StressRandom random(seed);
    std::vector<ChordCase> cases;
    constexpr std::size_t scenes = 5;
    for (std::size_t part = 0; part < scenes; ++part) {
        const double size = f.world[0] == f.world[1] ? f.world[0] : f.world[0] * std::pow(f.world[1] / f.world[0], static_cast<double>(part) / (scenes - 1));
        Scene scene;
        EllipsoidMedium& medium = scene.media.emplace_back();
        medium.kernel = kernel;
        medium.extent = f.extent > 0 ? f.extent : usual_extent(kernel);
        const glm::dvec3 offset = size * 1000.0 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        add_anchors(medium, size, offset);
        const Normalization n = normalize(scene);
        const std::size_t first = cases.size();
        for (std::size_t i = 0; i < count / scenes; ++i) {
            ChordCase& c = cases.emplace_back();
            c.ray = some_ray(f, random);
            Primitive p = place(f, random, medium.extent, c.ray, c);
            p.center = p.center / n.scale + n.center;
            p.axes = p.axes / n.scale;
            p.sigma_t *= n.scale;
            medium.primitives.push_back(p);
        }
        const HostArray<Ellipsoid> ellipsoids = make_ellipsoids(scene, normalize(scene));
        for (std::size_t i = first; i < cases.size(); ++i) {
            const Ellipsoid& e = ellipsoids[i - first + 2];
            ChordCase& c = cases[i];
            c.lane.resize(CLUME_GROUP_ROWS);
            pack_lane(e, 0, c.lane.data(), 1);
            const double e2 = static_cast<double>(static_cast<float>(medium.extent * medium.extent));
            c.device = exact(c.lane.data(), c.lane.data() + CLUME_ROW_W, static_cast<double>(c.lane[CLUME_ROW_SIGMA]), e2, kernel);
            c.scene = exact(e.center, e.w, e.sigma, medium.extent * medium.extent, kernel);
        }
    }
    return cases;
}

}  // namespace clume
