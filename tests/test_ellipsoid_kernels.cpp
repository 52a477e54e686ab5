// SPDX-License-Identifier: MIT
// One ray against one group of ellipsoids on the device, against 50-digit arithmetic on the very floats that the device has:
// interval, density, optical depth, free flight, for the three families. Axis ratios 1 … 1e4, any rotation, axis-parallel
// rays with signed zeros, grazing rays, origins inside, on the boundary, outside and 1e3 scales away, short and long
// intervals in both tails.
//
// Tolerances (γ = 2^-24): the line's place in whitened space is known to ε = 4γ (|W||o − μ| + |t⊥||W||d| + E |W||d|/w), the
// float error of evaluating W(o − μ) and W d, row by row in absolute values. A chord's ends then move by ε plus what h
// gets from d² (δh), divided by w. Depths err by what that moves, plus what depth_part states of their own value;
// free flights by 4e-6 of the primitive's whole depth (erfc and erfc_inverse together).
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "src/stress_limits.h"
#include "tests/probe_harness.h"
#include "tests/reference/analytic_scenes.h"
#include "tests/reference/high_precision.h"

namespace {

using namespace clume;
using namespace clume::probing;
using reference::high::Real;
using Chord = reference::high::Chord;

constexpr double kGamma = 0x1p-24;
const double depth_limit = stated_limit("ellipsoid.cl", "depth_part").value;

using Family = cases::FamilyCase;
/// The families, and a Gaussian whose support ends where hardly anything is left.
const std::vector<Family> kFamilies = [] {
    std::vector<Family> all(std::begin(cases::families), std::end(cases::families));
    all.insert(all.begin() + 1, {KernelFamily::gaussian, FAMILY_GAUSSIAN, 30.25f, "gaussian, extent 5.5"});
    return all;
}();

double d(float v) { return static_cast<double>(v); }
double num(const Real& r) { return static_cast<double>(r); }

/// Upper-triangular W of axes, in long double by Cholesky of Σ⁻¹ from the columns of axes⁻¹ (Gram-Schmidt, twice).
std::array<double, 6> whitening(const glm::dmat3& axes) {
    glm::dmat3 q = glm::inverse(axes), r(1.0);
    for (int pass = 0; pass < 2; ++pass) {
        glm::dmat3 step(0.0);
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < j; ++i) step[j][i] = glm::dot(q[i], q[j]), q[j] -= step[j][i] * q[i];
            step[j][j] = glm::length(q[j]), q[j] /= step[j][j];
        }
        r = step * r;
    }
    return {r[0][0], r[1][0], r[2][0], r[1][1], r[2][1], r[2][2]};
}

struct Lane {
    float mu[3], w[6], sigma;
};
/// The same numbers as doubles.
struct Exact {
    explicit Exact(const Lane& l) : sigma(static_cast<double>(l.sigma)) {
        for (int k = 0; k < 3; ++k) mu[k] = static_cast<double>(l.mu[k]);
        for (int k = 0; k < 6; ++k) w[k] = static_cast<double>(l.w[k]);
    }
    double mu[3], w[6], sigma;
};
struct Case {
    ProbeGroupRay ray;
    Lane lanes[16];
};

Lane place(TestRandom& random, const glm::dvec3& o, const glm::dvec3& dir, double t0, double t1, double e, double ratio, double tau) {
    const double s = random.spread(0.01, 1);
    const int shape = random.below(3);
    const glm::dvec3 scale = shape == 0 ? glm::dvec3(s, s / ratio, s / ratio) : shape == 1 ? glm::dvec3(s, s, s / ratio) : glm::dvec3(s, s / std::sqrt(ratio), s / ratio);
    const bool straight = random.below(4) == 0;
    const Primitive p = reference::make_primitive({0, 0, 0}, scale, 1, straight ? glm::dvec3(0) : glm::dvec3(random.uniform(), random.uniform(), random.uniform()));
    const glm::dmat3 inverse = glm::inverse(p.axes);
    const glm::dvec3 b = inverse * dir;
    const double w = glm::length(b);
    // Whitened distance of the line: anything, through the centre, or grazing on either side.
    const int graze = random.below(6);
    const double distance = graze == 0 ? 0 : graze == 1 ? e * (1 + random.spread(1e-8, 1e-2) * (random.below(2) ? 1 : -1)) : random.uniform(0, 1.1 * e);
    const double h = std::sqrt(std::max(0.0, e * e - distance * distance));
    // Where the middle of the chord lies: about the interval's begin or end (inside, on the boundary, just outside), between, or far ahead.
    double t = 0;
    switch (random.below(6)) {
        case 0: t = t0 + random.uniform(-1.3, 1.3) * h / w; break;
        case 1: t = t0 + (random.below(2) ? h : -h) / w; break;
        case 2: t = t1 + random.uniform(-1.3, 1.3) * h / w; break;
        case 3: t = t0 + random.uniform() * (t1 - t0); break;
        case 4: t = t0 + random.spread(1, 1000) * s; break;
        default: t = t0 + random.spread(1, 30) / w; break;
    }
    const glm::dvec3 helper = std::abs(b.x) < 0.5 * w ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 n = glm::normalize(glm::cross(b, helper));
    const glm::dvec3 mu = o + t * dir - p.axes * (distance * n);
    const auto rows = whitening(p.axes);
    Lane lane;
    for (int k = 0; k < 3; ++k) lane.mu[k] = static_cast<float>(mu[k]);
    for (int k = 0; k < 6; ++k) lane.w[k] = static_cast<float>(rows[static_cast<std::size_t>(k)]);
    lane.sigma = static_cast<float>(std::clamp(tau * random.spread(0.1, 1e3) * w, 1e-6, 1e6));
    return lane;
}

std::vector<Case> make_cases(std::size_t count, float e2, std::uint64_t seed) {
    TestRandom random(seed);
    std::vector<Case> cases(count);
    for (Case& c : cases) {
        glm::dvec3 dir(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const int axis = random.below(9);
        if (axis < 3) dir = glm::dvec3(random.below(2) ? 0.0 : -0.0), dir[axis] = random.below(2) ? 1 : -1;
        if (axis == 3) dir[random.below(3)] = -0.0;
        dir = glm::normalize(dir);
        for (int k = 0; k < 3; ++k) {
            c.ray.origin[k] = static_cast<float>(random.uniform(-2, 2));
            c.ray.direction[k] = static_cast<float>(dir[k]);
        }
        c.ray.t0 = random.below(2) ? 0.0f : static_cast<float>(random.spread(1e-3, 3));
        const int length = random.below(4);
        c.ray.t1 = length == 0 ? 1e30f : c.ray.t0 + static_cast<float>(length == 1 ? random.spread(1e-5, 1e-2) : random.spread(1e-2, 4));
        c.ray.tau = static_cast<float>(random.spread(1e-4, 20));
        const double ratio = random.below(3) == 0 ? 1 : random.spread(1, 1e4);
        const glm::dvec3 o(c.ray.origin[0], c.ray.origin[1], c.ray.origin[2]), along(c.ray.direction[0], c.ray.direction[1], c.ray.direction[2]);
        for (Lane& lane : c.lanes) lane = place(random, o, along, d(c.ray.t0), std::min(d(c.ray.t1), 10.0), std::sqrt(d(e2)), ratio, d(c.ray.tau));
    }
    return cases;
}

std::vector<float> pack(const std::vector<Case>& cases) {
    std::vector<float> groups(cases.size() * CLUME_GROUP_FLOATS);
    for (std::size_t i = 0; i < cases.size(); ++i)
        for (std::size_t lane = 0; lane < 16; ++lane) {
            const Lane& l = cases[i].lanes[lane];
            float* row = groups.data() + i * CLUME_GROUP_FLOATS + lane;
            for (std::size_t k = 0; k < 3; ++k) row[16 * k] = l.mu[k];
            for (std::size_t k = 0; k < 6; ++k) row[16 * (CLUME_ROW_W + k)] = l.w[k];
            row[16 * CLUME_ROW_SIGMA] = l.sigma;
        }
    return groups;
}

std::vector<ProbeGroupRay> rays_of(const std::vector<Case>& cases) {
    std::vector<ProbeGroupRay> rays;
    for (const Case& c : cases) rays.push_back(c.ray);
    return rays;
}

/// What float arithmetic can know of one line and one ellipsoid; all but t in whitened units.
struct Condition {
    double w, t_perp, distance, h, e;  ///< true
    double epsilon, square, delta_h;   ///< of the line's place, of h², of the half chord
    double end() const { return (epsilon + delta_h) / w; }  ///< of a chord's ends, in t, but for rounding t itself
};

double absolute_norm(const double (&w)[6], double x, double y, double z) {
    x = std::abs(x), y = std::abs(y), z = std::abs(z);
    const double a = std::abs(w[0]) * x + std::abs(w[1]) * y + std::abs(w[2]) * z, b = std::abs(w[3]) * y + std::abs(w[4]) * z, c = std::abs(w[5]) * z;
    return std::sqrt(a * a + b * b + c * c);
}

Condition condition_of(const Exact& l, const ProbeGroupRay& r, const Chord& truth, double e2) {
    Condition c;
    c.e = std::sqrt(e2);
    c.t_perp = num(truth.t_perp());
    c.distance = std::sqrt(num(truth.d_squared()));
    c.h = std::sqrt(std::max(0.0, e2 - num(truth.d_squared())));
    const double b0 = l.w[0] * d(r.direction[0]) + l.w[1] * d(r.direction[1]) + l.w[2] * d(r.direction[2]), b1 = l.w[3] * d(r.direction[1]) + l.w[4] * d(r.direction[2]),
                 b2 = l.w[5] * d(r.direction[2]);
    c.w = std::sqrt(b0 * b0 + b1 * b1 + b2 * b2);
    const double at = absolute_norm(l.w, d(r.origin[0]) - l.mu[0], d(r.origin[1]) - l.mu[1], d(r.origin[2]) - l.mu[2]);
    const double along = absolute_norm(l.w, d(r.direction[0]), d(r.direction[1]), d(r.direction[2]));
    c.epsilon = 4 * kGamma * (at + std::abs(c.t_perp) * along + c.e * along / c.w);
    c.square = 2 * c.distance * c.epsilon + c.epsilon * c.epsilon + 4 * kGamma * e2;
    c.delta_h = c.square / std::max(c.h, std::sqrt(c.square));
    return c;
}

double kernel(const Family& f, double r2) {
    if (r2 >= d(f.e2)) return 0;
    return f.kernel == KernelFamily::gaussian ? std::exp(-0.5 * r2) : f.kernel == KernelFamily::uniform ? 1 : 1 - r2 / d(f.e2);
}

struct Worst {
    double value = 0;
    void add(double error, double tolerance) { value = std::max(value, error / tolerance); }
};

}  // namespace

TEST_CASE("Ellipsoid.KernelsAgainstHighPrecision", "[kernels][quick]") {
    for (const Family& f : kFamilies) {
        const auto cases = make_cases(160, f.e2, 1 + f.bit + static_cast<unsigned>(f.e2));
        const auto got = bare_probe(16).groups(rays_of(cases), pack(cases), f.bit, f.e2);
        const Real extent = reference::high::sqrt(Real(f.e2));
        Worst interval, density, depth, flight;
        double depth_relative = 0, flight_whole = 0;
        std::size_t hits = 0, depths = 0, flights = 0;
        for (std::size_t i = 0; i < cases.size(); ++i)
            for (std::size_t k = 0; k < 16; ++k) {
                const Exact l(cases[i].lanes[k]);
                const ProbeGroupRay& r = cases[i].ray;
                const Chord truth({d(r.origin[0]), d(r.origin[1]), d(r.origin[2])}, {d(r.direction[0]), d(r.direction[1]), d(r.direction[2])}, {l.mu[0], l.mu[1], l.mu[2]},
                                  reference::high::whitening_from_upper(l.w), Real(l.sigma), extent, f.kernel);
                const Condition c = condition_of(l, r, truth, d(f.e2));
                const double t0 = d(r.t0), t1 = d(r.t1), tau = d(r.tau);
                const double t_in = d(got[i].t_in[k]), t_out = d(got[i].t_out[k]), got_depth = d(got[i].depth[k]), got_flight = d(got[i].flight[k]);
                INFO(f.name << " ray " << i << " lane " << k << ": w " << c.w << " t_perp " << c.t_perp << " distance " << c.distance << " epsilon " << c.epsilon << " h " << c.h
                            << " delta_h " << c.delta_h << " sigma " << l.sigma << " t0 " << t0 << " t1 " << t1 << " tau " << tau << " got t_in " << t_in << " t_out " << t_out
                            << " depth " << got_depth << " flight " << got_flight << " density " << got[i].density[k]);
                for (const float v : {got[i].d2[k], got[i].t_in[k], got[i].t_out[k], got[i].density[k], got[i].depth[k], got[i].flight[k]})
                    if (!std::isfinite(v)) FAIL("not finite");

                // Hits are lost or invented within rounding of tangency only.
                const bool hit = t_in < 1e30;
                if (std::abs(c.distance - c.e) > c.epsilon + 4 * kGamma * c.e && hit != truth.hit()) FAIL("hit " << hit);
                if (hit && truth.hit()) {
                    ++hits;
                    const double rounding = 4 * kGamma * (std::abs(c.t_perp) + c.h / c.w);
                    interval.add(std::abs(t_in - num(truth.t_perp()) + c.h / c.w), c.end() + rounding);
                    interval.add(std::abs(t_out - num(truth.t_perp()) - c.h / c.w), c.end() + rounding);
                }

                // Density at the point that t0 gives.
                {
                    double p[3], size[3];
                    for (int a = 0; a < 3; ++a) p[a] = d(r.origin[a]) + t0 * d(r.direction[a]) - l.mu[a], size[a] = std::abs(d(r.origin[a])) + std::abs(t0 * d(r.direction[a])) + std::abs(p[a]);
                    const double a0 = l.w[0] * p[0] + l.w[1] * p[1] + l.w[2] * p[2], a1 = l.w[3] * p[1] + l.w[4] * p[2], a2 = l.w[5] * p[2];
                    const double radius = std::sqrt(a0 * a0 + a1 * a1 + a2 * a2), error = 4 * kGamma * absolute_norm(l.w, size[0], size[1], size[2]);
                    const double lo = kernel(f, (radius + error) * (radius + error)), hi = kernel(f, std::pow(std::max(0.0, radius - error), 2));
                    const double value = d(got[i].density[k]) / l.sigma;
                    density.add(std::max(0.0, std::max(lo - value, value - hi)), 4 * kGamma * (f.kernel == KernelFamily::gaussian ? std::max(hi, 1e-30) : 1));
                }

                // Optical depth between t0 and t1.
                const auto inside = truth.interval(Real(r.t0), Real(r.t1));
                const double exact = inside ? num(truth.optical_depth(Real(r.t0), Real(r.t1))) : 0;
                const double from = inside ? num(inside->enter) : t0, to = inside ? num(inside->exit) : t0, length = std::max(0.0, to - from);
                const auto near_end = [&](double t) {  // greatest density within the error of an end
                    const double u = std::max(0.0, std::abs(t - c.t_perp) * c.w - c.epsilon - c.delta_h);
                    return kernel(f, std::min(std::pow(std::max(0.0, c.distance - c.epsilon), 2) + u * u, d(f.e2) * (1 - 1e-15)));
                };
                const double least_u = c.t_perp > from && c.t_perp < to ? 0 : std::max(0.0, std::min(std::abs(from - c.t_perp), std::abs(to - c.t_perp)) * c.w - c.epsilon);
                const double peak = kernel(f, std::min(std::pow(std::max(0.0, c.distance - c.epsilon), 2) + least_u * least_u, d(f.e2) * (1 - 1e-15)));
                const double slope = f.kernel == KernelFamily::gaussian ? peak * c.e : f.kernel == KernelFamily::epanechnikov ? 2 / c.e : 0;
                const double margin = c.end() + 4 * kGamma * (std::abs(c.t_perp) + c.h / c.w);
                const bool begins = inside && t0 < c.t_perp - c.h / c.w + margin, ends = inside && t1 > c.t_perp + c.h / c.w - margin;
                double tolerance = depth_limit * exact + l.sigma * length * slope * c.epsilon + 1e-30;
                if (begins || !inside) tolerance += l.sigma * near_end(from) * (c.end() + 4 * kGamma * std::abs(from));
                if (ends || !inside) tolerance += l.sigma * near_end(to) * (c.end() + 4 * kGamma * std::abs(to));
                if (c.h * c.h <= 4 * c.square)  // a hit in doubt, or as short as its error
                    tolerance += l.sigma * kernel(f, std::pow(std::max(0.0, std::min(c.distance, c.e * (1 - kGamma)) - c.epsilon), 2)) * 2 * std::sqrt(c.h * c.h + c.square) / c.w;
                depth.add(std::abs(got_depth - exact), tolerance);
                if (exact > 0 && c.epsilon < 4e-6 && !begins && !ends) ++depths, depth_relative = std::max(depth_relative, std::abs(got_depth - exact) / exact);
                if (std::abs(got_depth - exact) > tolerance) CHECK(got_depth == Approx(exact).margin(tolerance));

                // Free flight from t0 (or the entry) for tau: the true depth up to the device's t is tau.
                if (!inside) continue;
                const Real far = truth.t_perp() + c.h / c.w + 1;
                const double ahead = num(truth.optical_depth(Real(r.t0), far));
                const double whole = num(truth.optical_depth(truth.t_perp() - c.h / c.w - 1, far));
                const double at = got_flight < 1e30 ? got_flight : num(truth.t_perp()) + c.h / c.w;
                const double allowed = 1e-5 * tau + (4e-6 + slope * c.epsilon + (f.kernel == KernelFamily::epanechnikov ? 4 * c.distance * c.epsilon / std::max(c.h * c.h, 1e-12) : 0)) * whole +
                                       l.sigma * (near_end(at) + near_end(from)) * (c.end() + 4 * kGamma * std::abs(at)) + l.sigma * 2 * c.h / c.w * slope * c.epsilon;
                if (got_flight < 1e30) {
                    ++flights;
                    const double reached = num(truth.optical_depth(Real(r.t0), Real(got_flight)));
                    flight.add(std::abs(reached - tau), allowed);
                    if (c.epsilon < 4e-6) flight_whole = std::max(flight_whole, (std::abs(reached - tau) - 4 * kGamma * std::abs(at) * l.sigma) / whole);
                    if (std::abs(reached - tau) > allowed) CHECK(reached == Approx(tau).margin(allowed));
                    if (got_flight < t0) FAIL("flight begins before t0");
                    if (got_flight > t_out) FAIL("flight ends behind the exit");
                } else if (ahead > tau + allowed && std::min(t1, t_out) > t0) {
                    FAIL("a collision is lost: depth ahead " << ahead);
                }
            }
        const std::string text = fmt::format("{}: errors over tolerance: interval {:.2f}, density {:.2f}, depth {:.2f}, flight {:.2f}; well-conditioned depth {:.2g} of itself, flight {:.2g} of the whole; {} hits, {} flights",
                                             f.name, interval.value, density.value, depth.value, flight.value, depth_relative, flight_whole, hits, flights);
        report(text);
        INFO(text);
        CHECK(interval.value <= 1);
        CHECK(density.value <= 1);
        CHECK(depth.value <= 1);
        CHECK(flight.value <= 1);
        CHECK(hits > 800);
        CHECK(flights > 200);
        CHECK(depths > 20);
    }
}

TEST_CASE("Ellipsoid.EveryWidthGivesTheSameBits", "[kernels][quick]") {
    for (const Family& f : kFamilies)
        for (const bool quadratic : {false, true}) {
            const auto cases = make_cases(300, f.e2, 77);
            const auto first = bare_probe(16).groups(rays_of(cases), pack(cases), f.bit, f.e2, quadratic);
            for (const int width : kWidths) {
                INFO(f.name << " on width " << width);
                CHECK(first_difference(first, bare_probe(width).groups(rays_of(cases), pack(cases), f.bit, f.e2, quadratic)) == first.size());
            }
        }
}

TEST_CASE("Ellipsoid.DepthsAddUp", "[kernels][quick]") {
    // τ(a, b) + τ(b, c) = τ(a, c) on asymmetric splits: the geometry is the same in all three, so only erf's error is left.
    for (const Family& f : kFamilies) {
        auto cases = make_cases(400, f.e2, 5);
        TestRandom random(6);
        std::vector<ProbeGroupRay> first, second, both;
        for (Case& c : cases) {
            ProbeGroupRay r = c.ray;
            r.t1 = std::min(r.t1, 8.0f);
            both.push_back(r);
            const float middle = r.t0 + (r.t1 - r.t0) * static_cast<float>(random.below(2) ? random.uniform() : random.spread(1e-4, 1));
            r.t1 = middle;
            first.push_back(r);
            r = both.back();
            r.t0 = middle;
            second.push_back(r);
        }
        const auto groups = pack(cases);
        const auto a = bare_probe(16).groups(first, groups, f.bit, f.e2), b = bare_probe(16).groups(second, groups, f.bit, f.e2), whole = bare_probe(16).groups(both, groups, f.bit, f.e2);
        double worst = 0;
        for (std::size_t i = 0; i < cases.size(); ++i)
            for (std::size_t k = 0; k < 16; ++k) {
                const double sum = d(a[i].depth[k]) + d(b[i].depth[k]), all = d(whole[i].depth[k]);
                // Rounding of u = w (t − t⊥) moves an end by γ t, which only matters next to a depth as short.
                const double rounding = 4 * kGamma * d(cases[i].lanes[k].sigma) * (std::abs(d(first[i].t1)) + 1);
                if (all > 0 && std::abs(sum - all) > rounding) worst = std::max(worst, (std::abs(sum - all) - rounding) / all);
                if (all == 0 && sum > rounding) worst = 1;
            }
        INFO(f.name << ": worst " << worst);
        report(fmt::format("{}: additivity off by {:.2g} of the depth", f.name, worst));
        CHECK(worst < stated_limit("ellipsoid.cl", "depth_part", "additivity").value);
    }
}

TEST_CASE("Ellipsoid.FlightInvertsDepth", "[kernels][quick]") {
    // τ(inverse(τ)) = τ, device against device: to 4e-6 of the whole depth and what one rounding of t makes.
    for (const Family& f : kFamilies) {
        auto cases = make_cases(400, f.e2, 8);
        for (Case& c : cases) c.ray.t1 = 1e30f;
        const auto groups = pack(cases);
        const auto out = bare_probe(16).groups(rays_of(cases), groups, f.bit, f.e2);
        std::vector<Case> again;
        std::vector<std::array<std::size_t, 2>> from;
        for (std::size_t i = 0; i < cases.size(); ++i)
            for (std::size_t k = 0; k < 16; ++k)
                if (out[i].flight[k] < 1e30f) {
                    again.push_back(cases[i]);
                    again.back().ray.t1 = out[i].flight[k];
                    from.push_back({i, k});
                }
        const auto back = bare_probe(16).groups(rays_of(again), pack(again), f.bit, f.e2);
        double worst = 0;
        for (std::size_t j = 0; j < again.size(); ++j) {
            const auto [i, k] = from[j];
            const double tau = d(cases[i].ray.tau), got = d(back[j].depth[k]), whole = std::max(d(out[i].depth[k]), tau);
            const double rounding = 4 * kGamma * d(cases[i].lanes[k].sigma) * (std::abs(d(out[i].flight[k])) + std::abs(d(out[i].t_in[k])));
            worst = std::max(worst, (std::abs(got - tau) - rounding) / whole);
        }
        report(fmt::format("{}: round trip off by {:.2g} of the whole, {} flights", f.name, worst, again.size()));
        INFO(f.name << ": worst " << worst);
        CHECK(again.size() > 500);
        CHECK(worst < stated_limit("ellipsoid.cl", "flight_part").value + depth_limit);
    }
}
