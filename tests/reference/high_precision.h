// SPDX-License-Identifier: MIT
// One ray, one ellipsoid in 50 decimal digits (166 bits), header only, for tests: chord, optical depth in closed form and by
// quadrature of the density itself, its inverse, and scalar references for the kernels' arithmetic. Inputs are doubles,
// taken exactly. Notation as in the design notes: a = W(o − mu), b = W d, w = |b|, u = w (t − t_perp), |u| ≤ h.
// Link mpfr and gmp. Only tests may include this; nothing here is fast.
#pragma once

#include "src/scene.h"

#include <algorithm>
#include <boost/math/quadrature/tanh_sinh.hpp>
#include <boost/math/special_functions/erf.hpp>
#include <boost/multiprecision/mpfr.hpp>
#include <optional>
#include <utility>

namespace clume::reference::high {

namespace mp = boost::multiprecision;
using Real = mp::number<mp::mpfr_float_backend<50>, mp::et_off>;

/// Scalar references, correctly rounded to 50 digits on their whole domain but for `erf_inv` (relative error < 1e-45).
inline Real exp(const Real& x) { return mp::exp(x); }
inline Real log(const Real& x) { return mp::log(x); }
inline Real sqrt(const Real& x) { return mp::sqrt(x); }
inline Real sin(const Real& x) { return mp::sin(x); }
inline Real cos(const Real& x) { return mp::cos(x); }
inline Real asin(const Real& x) { return mp::asin(x); }
inline Real pi() { return mp::acos(Real(-1)); }
inline Real erf(const Real& x) {
    Real y;
    mpfr_erf(y.backend().data(), x.backend().data(), MPFR_RNDN);
    return y;
}
inline Real erfc(const Real& x) {
    Real y;
    mpfr_erfc(y.backend().data(), x.backend().data(), MPFR_RNDN);
    return y;
}

/// x ≥ 0 with erfc(x) = q for 1e-300 < q ≤ 1, by Newton's method from a double.
inline Real erfc_inv(const Real& q) {
    Real x = boost::math::erfc_inv(static_cast<double>(q));
    for (int i = 0; i < 4; ++i) x += (erfc(x) - q) * sqrt(pi()) / 2 * exp(x * x);
    return x;
}

/// −1 < y < 1; near ±1 y must be given with all its digits.
inline Real erf_inv(const Real& y) {
    const Real m = mp::abs(y);
    Real x;
    if (m < Real(0.5)) {
        x = boost::math::erf_inv(static_cast<double>(m));
        for (int i = 0; i < 4; ++i) x -= (erf(x) - m) * sqrt(pi()) / 2 * exp(x * x);
    } else {
        x = erfc_inv(1 - m);
    }
    return y < 0 ? Real(-x) : x;
}

/// erf(b) − erf(a), without cancellation when both lie on one side of 0.
inline Real erf_difference(const Real& a, const Real& b) {
    if (a > 0 && b > 0) return erfc(a) - erfc(b);
    if (a < 0 && b < 0) return erfc(-b) - erfc(-a);
    return erf(b) - erf(a);
}

struct Vector {
    Real x, y, z;
};
inline Real dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Rows of a matrix W with Wᵀ W = Σ⁻¹.
struct Whitening {
    Vector rows[3];
};
inline Vector operator*(const Whitening& w, const Vector& v) {
    return {dot(w.rows[0], v), dot(w.rows[1], v), dot(w.rows[2], v)};
}

/// W = axes⁻¹ by cofactors; `axes` as in `Primitive`.
inline Whitening whitening_from_axes(const glm::dmat3& axes) {
    Real m[3][3];
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) m[r][c] = axes[c][r];
    Whitening w;
    Real determinant = 0;
    for (int r = 0; r < 3; ++r) {
        const auto cofactor = [&](int row, int col) {
            const int a = (row + 1) % 3, b = (row + 2) % 3, c = (col + 1) % 3, d = (col + 2) % 3;
            return Real(m[a][c] * m[b][d] - m[a][d] * m[b][c]);
        };
        w.rows[r] = {cofactor(0, r), cofactor(1, r), cofactor(2, r)};
        if (r == 0) determinant = m[0][0] * w.rows[0].x + m[1][0] * w.rows[0].y + m[2][0] * w.rows[0].z;
    }
    for (Vector& row : w.rows) row = {row.x / determinant, row.y / determinant, row.z / determinant};
    return w;
}

/// W from upper-triangular numbers, row by row: w00 w01 w02 w11 w12 w22.
inline Whitening whitening_from_upper(const double (&w)[6]) {
    return {{{w[0], w[1], w[2]}, {0, w[3], w[4]}, {0, 0, w[5]}}};
}

/// K(r²), 0 outside the support.
inline Real density(KernelFamily family, const Real& r_squared, const Real& extent) {
    if (r_squared >= extent * extent) return 0;
    if (family == KernelFamily::gaussian) return exp(-r_squared / 2);
    return family == KernelFamily::uniform ? Real(1) : Real(1 - r_squared / (extent * extent));
}

struct Interval {
    Real enter, exit;
};

/// The line of a ray against one ellipsoid. `direction` need not have length 1: t is in its units, and so is the depth.
class Chord {
public:
    /// `sigma`: peak extinction [1/length], density scale included; `extent` in scales.
    Chord(const glm::dvec3& origin, const glm::dvec3& direction, const glm::dvec3& mu, const Whitening& w, Real sigma,
          Real extent, KernelFamily family)
        : sigma_(std::move(sigma)), extent_(std::move(extent)), family_(family) {
        a_ = w * Vector{Real(origin.x) - mu.x, Real(origin.y) - mu.y, Real(origin.z) - mu.z};
        b_ = w * Vector{direction.x, direction.y, direction.z};
        const Real w_squared = dot(b_, b_);
        w_ = sqrt(w_squared);
        t_perp_ = -dot(a_, b_) / w_squared;
        const Vector p{a_.x + t_perp_ * b_.x, a_.y + t_perp_ * b_.y, a_.z + t_perp_ * b_.z};
        d_squared_ = dot(p, p);
        const Real square = extent_ * extent_ - d_squared_;
        if (square > 0) h_ = sqrt(square);
    }

    bool hit() const { return h_ > 0; }
    const Real& t_perp() const { return t_perp_; }
    const Real& d_squared() const { return d_squared_; }

    /// Where the line is inside the support and t_min ≤ t ≤ t_max; nothing when that is empty.
    std::optional<Interval> interval(const Real& t_min, const Real& t_max) const {
        const Interval i{std::max(t_min, Real(t_perp_ - h_ / w_)), std::min(t_max, Real(t_perp_ + h_ / w_))};
        if (!hit() || !(i.enter < i.exit)) return {};
        return i;
    }

    /// Optical depth between t0 ≤ t1, closed form.
    Real optical_depth(const Real& t0, const Real& t1) const {
        const auto i = interval(t0, t1);
        if (!i) return 0;
        const Real u0 = w_ * (i->enter - t_perp_), u1 = w_ * (i->exit - t_perp_);
        if (family_ == KernelFamily::uniform) return sigma_ * (u1 - u0) / w_;
        if (family_ == KernelFamily::gaussian)
            return sigma_ * sqrt(pi() / 2) * exp(-d_squared_ / 2) / w_ * erf_difference(u0 / sqrt(Real(2)), u1 / sqrt(Real(2)));
        // ∫ 1 − (d² + u²)/E² du = ∫ (h² − u²)/E² du, factored so that no difference of cubes is left.
        return sigma_ / (w_ * extent_ * extent_) * (u1 - u0) * (h_ * h_ - (u0 * u0 + u0 * u1 + u1 * u1) / 3);
    }

    /// The same by tanh-sinh quadrature of the density along the line, which shares only the interval with the closed form.
    Real optical_depth_quadrature(const Real& t0, const Real& t1) const {
        const auto i = interval(t0, t1);
        if (!i) return 0;
        static boost::math::quadrature::tanh_sinh<Real> integrator(10, Real(1e-200));
        const Real middle = (i->enter + i->exit) / 2, half = (i->exit - i->enter) / 2;
        const auto along = [&](const Real& v) {
            const Real t = middle + half * v;
            const Vector x{a_.x + t * b_.x, a_.y + t * b_.y, a_.z + t * b_.z};
            return density(family_, dot(x, x), extent_);
        };
        return sigma_ * half * integrator.integrate(along, Real(1e-35));
    }

    /// t ≥ t0 at which the depth from t0 reaches `tau` > 0, by bisection with Newton steps; nothing when the ellipsoid's
    /// own depth ahead is smaller. Relative error of t − t0 below 1e-40 unless the density vanishes there.
    std::optional<Real> invert(const Real& t0, const Real& tau) const {
        const auto i = interval(t0, t_perp_ + h_ / w_ + 1);
        if (!i || optical_depth(i->enter, i->exit) < tau) return {};
        Real low = i->enter, high = i->exit, t = (low + high) / 2;
        for (int step = 0; step < 200; ++step) {
            const Real error = optical_depth(i->enter, t) - tau;
            (error < 0 ? low : high) = t;
            const Vector x{a_.x + t * b_.x, a_.y + t * b_.y, a_.z + t * b_.z};
            const Real slope = sigma_ * density(family_, dot(x, x), extent_);
            const Real before = t;
            t = slope > 0 ? Real(t - error / slope) : low;
            if (!(t > low && t < high)) t = (low + high) / 2;
            if (mp::abs(t - before) <= mp::abs(t - i->enter) * Real(1e-45)) break;
        }
        return t;
    }

private:
    Real sigma_, extent_, w_, t_perp_, d_squared_, h_ = 0;
    KernelFamily family_;
    Vector a_, b_;
};

}  // namespace clume::reference::high
