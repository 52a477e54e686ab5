// SPDX-License-Identifier: MIT
#include "src/stress_oracle.h"

#include <algorithm>
#include <boost/math/special_functions/erf.hpp>

namespace clume::oracle {
namespace {

const Real kRoot2 = boost::multiprecision::sqrt(Real(2));
const Real kPi = boost::multiprecision::acos(Real(-1));

/// (1 + λ S)⁻¹ y for symmetric S = xx xy xz yy yz zz; false unless 1 + λ S is positive definite.
bool solve(const std::array<Real, 6>& s, const Real& lambda, const Vector& y, Vector& z) {
    const Real xx = 1 + lambda * s[0], xy = lambda * s[1], xz = lambda * s[2], yy = 1 + lambda * s[3], yz = lambda * s[4], zz = 1 + lambda * s[5];
    if (!(xx > 0)) return false;
    const Real a = xy / xx, b = xz / xx, d1 = yy - a * xy;
    if (!(d1 > 0)) return false;
    const Real c = (yz - a * xz) / d1, d2 = zz - b * xz - c * c * d1;
    if (!(d2 > 0)) return false;
    const Real y1 = y[1] - a * y[0], y2 = (y[2] - b * y[0] - c * y1) / d2;
    z[2] = y2;
    z[1] = y1 / d1 - c * z[2];
    z[0] = y[0] / xx - a * z[1] - b * z[2];
    return true;
}

}  // namespace

Real pi() { return kPi; }

Real erfc(const Real& x) {
    Real y;
    mpfr_erfc(y.backend().data(), x.backend().data(), MPFR_RNDN);
    return y;
}

Real erf_between(const Real& a, const Real& b) {
    if (a > 0) return erfc(a) - erfc(b);
    if (b < 0) return erfc(-b) - erfc(-a);
    Real x, y;
    mpfr_erf(x.backend().data(), a.backend().data(), MPFR_RNDN);
    mpfr_erf(y.backend().data(), b.backend().data(), MPFR_RNDN);
    return y - x;
}

Real erfc_inverse(const Real& q) {
    if (q >= 1) return 0;
    Real x = boost::math::erfc_inv(static_cast<double>(q));
    const Real half_root_pi = sqrt(kPi) / 2;
    for (int i = 0; i < 5; ++i) x += (erfc(x) - q) * half_root_pi * exp(x * x);
    return x;
}

Real dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector unit(const Vector& v) {
    const Real s = 1 / sqrt(dot(v, v));
    return {v[0] * s, v[1] * s, v[2] * s};
}

Real distance(const Vector& a, const Vector& b) {
    const Vector v{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrt(dot(v, v));
}

Vector along(const Vector& o, const Vector& d, const Real& t) { return {o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]}; }

double Range::outside(const Real& v, const Real& size) const {
    if (holds(v)) return 0;
    const Real off = v < lo ? Real(lo - v) : Real(v - hi);
    return size > 0 ? static_cast<double>(off / size) : off > 0 ? INFINITY : 0;
}

Vector Ellipsoid256::whiten(const Vector& x) const { return {w[0] * x[0] + w[1] * x[1] + w[2] * x[2], w[3] * x[1] + w[4] * x[2], w[5] * x[2]}; }
Vector Ellipsoid256::unwhiten(const Vector& y) const { return {w[0] * y[0], w[1] * y[0] + w[3] * y[1], w[2] * y[0] + w[4] * y[1] + w[5] * y[2]}; }

Real Ellipsoid256::surface_distance(const Vector& point, const Real& r) const {
    // The nearest z has z + λ S z = y, S = WᵀW, |W z| = r: Newton's method on 1/|W z(λ)|, which is nearly linear in λ.
    const Vector y{point[0] - mu[0], point[1] - mu[1], point[2] - mu[2]};
    const std::array<Real, 6> s{w[0] * w[0], w[0] * w[1], w[0] * w[2], w[1] * w[1] + w[3] * w[3], w[1] * w[2] + w[3] * w[4], w[2] * w[2] + w[4] * w[4] + w[5] * w[5]};
    Real lambda = 0, low = -1e300, high = 1e300;
    Vector z = y, slope;
    for (int i = 0; i < 100; ++i) {
        if (!solve(s, lambda, y, z)) {  // beyond the first pole
            low = lambda;
            lambda = (lambda + (high < Real(1e299) ? high : Real(0))) / 2;
            continue;
        }
        const Vector wz = whiten(z), swz = unwhiten(wz);
        const Real radius = sqrt(dot(wz, wz));
        if (!(radius > 0)) break;  // the centre: below
        if (abs(radius - r) <= r * Real(1e-40)) break;
        (radius > r ? low : high) = lambda;
        solve(s, lambda, swz, slope);  // dz/dλ = −(1 + λ S)⁻¹ S z
        const Real derivative = -dot(swz, slope) / radius;
        Real next = lambda + radius * (r - radius) / (r * derivative);
        if (!(next > low && next < high) && low > Real(-1e299) && high < Real(1e299)) next = (low + high) / 2;
        if (abs(next - lambda) <= abs(next) * Real(1e-40)) break;
        lambda = next;
    }
    const Vector wz = whiten(z);
    if (dot(wz, wz) < r * r / 4) {  // at or next to the centre, where all directions are alike: the shortest half axis is 1/|W| or more
        Real norm2 = 0;
        for (const Real& v : w) norm2 += v * v;
        return r / sqrt(norm2);
    }
    return oracle::distance(z, y);
}

Real Ellipsoid256::density(const Real& r2) const {
    if (!(r2 < e2)) return 0;
    if (family == KernelFamily::gaussian) return sigma * exp(-r2 / 2);
    return family == KernelFamily::uniform ? sigma : sigma * (1 - r2 / e2);
}

Real Ellipsoid256::density_at(const Vector& point) const {
    const Vector a = whiten({point[0] - mu[0], point[1] - mu[1], point[2] - mu[2]});
    return density(dot(a, a));
}

Range Ellipsoid256::density_near(const Vector& point, const Real& shift) const {
    const Vector a = whiten({point[0] - mu[0], point[1] - mu[1], point[2] - mu[2]});
    Real norm2 = 0;
    for (const Real& v : w) norm2 += v * v;
    const Real r = sqrt(dot(a, a)), step = shift * sqrt(norm2), near = std::max(Real(0), Real(r - step)), far = r + step;
    return {density(far * far), density(near * near)};
}

Line256::Line256(const Ellipsoid256& e, const Vector& o, const Vector& d) : e_(e) {
    const Vector a = e.whiten({o[0] - e.mu[0], o[1] - e.mu[1], o[2] - e.mu[2]}), b = e.whiten(d);
    const Real bb = dot(b, b);
    w = sqrt(bb);
    t_perp = -dot(a, b) / bb;
    const Vector p = oracle::along(a, b, t_perp);
    distance = sqrt(dot(p, p));
    const Real square = e.e2 - dot(p, p);
    half_ = square > 0 ? Real(sqrt(square)) : Real(0);
    Real norm2 = 0;
    for (const Real& v : e.w) norm2 += v * v;
    const Vector back = e.unwhiten(b);
    along_ = sqrt(dot(back, back)) / w;
    across_ = sqrt(std::max(Real(0), Real(norm2 - along_ * along_)));
    const Vector g = e.unwhiten(p);
    gradient_ = distance > 0 ? Real(sqrt(dot(g, g)) / distance) : across_;
}

Line256::Line256(const Ellipsoid256& e, const Real& foot, const Real& scale, const Real& d2)
    : t_perp(foot), w(scale), distance(sqrt(d2)), e_(e), given_(true), half_(d2 < e.e2 ? Real(sqrt(e.e2 - d2)) : Real(0)), across_(0), along_(scale), gradient_(1) {}

Real Line256::tangency() const { return abs(sqrt(e_.e2) - distance) / gradient_; }

Real Line256::depth_at(const Real& d, Real u0, Real u1, const Real& more) const {
    const Real square = e_.e2 - d * d;
    if (!(square > 0)) return 0;
    const bool blurred = e_.family == KernelFamily::uniform || (given_ && e_.family == KernelFamily::gaussian);
    const Real h = blurred ? Real(sqrt(square) + more) : Real(sqrt(square));
    u0 = std::max(u0, Real(-h));
    u1 = std::min(u1, h);
    if (!(u0 < u1)) return 0;
    if (e_.family == KernelFamily::uniform) return e_.sigma * (u1 - u0) / w;
    if (e_.family == KernelFamily::gaussian) return e_.sigma * sqrt(kPi / 2) * exp(-d * d / 2) / w * erf_between(u0 / kRoot2, u1 / kRoot2);
    // ∫ (h² − u²) / E² du
    return e_.sigma / (w * e_.e2) * (u1 - u0) * (square - (u0 * u0 + u0 * u1 + u1 * u1) / 3);
}

Real Line256::depth(const Real& t0, const Real& t1) const { return depth_at(distance, w * (t0 - t_perp), w * (t1 - t_perp)); }

Range Line256::depth_near(const Real& t0, const Real& t1, const Real& shift, const Real& blur) const {
    const Real more = w * blur, u0 = w * (t0 - t_perp), u1 = w * (t1 - t_perp), middle = (u0 + u1) / 2, step = shift * along_, aside = shift * across_;
    const Real nearer = abs(middle) <= step ? Real(-middle) : middle > 0 ? Real(-step) : step, farther = middle > 0 ? step : Real(-step);
    return {depth_at(distance + aside, u0 + farther + more, u1 + farther - more, -more), depth_at(std::max(Real(0), Real(distance - aside)), u0 + nearer - more, u1 + nearer + more, more)};
}

Real Line256::invert(const Real& t0, const Real& tau) const {
    const Real begin = std::max(t0, t_in()), end = t_out();
    if (!hit() || !(begin < end) || depth(begin, end) < tau) return -1;
    Real low = begin, high = end, t = (low + high) / 2;
    for (int step = 0; step < 300; ++step) {
        const Real error = depth(begin, t) - tau, u = w * (t - t_perp), slope = e_.density(distance * distance + u * u);
        (error < 0 ? low : high) = t;
        const Real before = t;
        t = slope > 0 ? Real(t - error / slope) : low;
        if (!(t > low && t < high)) t = (low + high) / 2;
        if (abs(t - before) <= abs(t - begin) * Real(1e-30)) break;
    }
    return t;
}

}  // namespace clume::oracle
