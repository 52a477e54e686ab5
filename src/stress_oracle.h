// SPDX-License-Identifier: MIT
// 256-bit arithmetic for `clume stress`: one line and one ellipsoid, taken from the very floats that the device has, or from
// the scene's doubles. Shares nothing with the kernels; the closed forms are checked against quadrature by the tests.
// Notation of kernels/ellipsoid.cl: a = W(o − mu), b = W d, u = |b| (t − t⊥), d the whitened distance of the line.
#pragma once

#include <array>
#include <boost/multiprecision/mpfr.hpp>

#include "src/scene.h"

namespace clume::oracle {

/// 78 decimal digits: 260 bits.
using Real = boost::multiprecision::number<boost::multiprecision::mpfr_float_backend<78, boost::multiprecision::allocate_stack>, boost::multiprecision::et_off>;
using Vector = std::array<Real, 3>;

Real pi();
Real erfc(const Real& x);
/// erf(b) − erf(a) for a <= b without cancellation in the tails.
Real erf_between(const Real& a, const Real& b);
/// x >= 0 with erfc(x) = q, 0 < q <= 1.
Real erfc_inverse(const Real& q);
Real dot(const Vector& a, const Vector& b);
/// v / |v|
Vector unit(const Vector& v);
/// |a − b|
Real distance(const Vector& a, const Vector& b);
template <class T>
Vector vector(const T* v) { return {Real(v[0]), Real(v[1]), Real(v[2])}; }
/// o + t d
Vector along(const Vector& o, const Vector& d, const Real& t);

/// By how much a place may be off, and how far an answer may move when it is: a sensitivity interval.
struct Range {
    Real lo, hi;
    bool holds(const Real& v) const { return lo <= v && v <= hi; }
    /// How far v lies outside, as a share of `size`.
    double outside(const Real& v, const Real& size) const;
};

struct Ellipsoid256 {
    Vector mu;
    std::array<Real, 6> w;  ///< upper triangle, row-major
    Real sigma, e2;         ///< peak extinction, squared extent
    KernelFamily family;

    Vector whiten(const Vector& x) const;       ///< W x
    Vector unwhiten(const Vector& y) const;     ///< Wᵀ y
    /// From a point to the nearest of those with whitened radius r > 0.
    Real surface_distance(const Vector& point, const Real& r) const;
    /// K(r²) sigma, 0 outside the support.
    Real density(const Real& r2) const;
    Real density_at(const Vector& point) const;
    /// Densities of points up to `shift` away.
    Range density_near(const Vector& point, const Real& shift) const;
};

/// A line against an ellipsoid.
class Line256 {
public:
    Line256(const Ellipsoid256& e, const Vector& o, const Vector& d);
    /// The line with that t⊥, w and squared whitened distance, which can be moved along alone: no tangency. `blur` moves the ends of a
    /// Gaussian's chord too.
    Line256(const Ellipsoid256& e, const Real& t_perp, const Real& w, const Real& d2);

    Real t_perp, w, distance;  ///< t of the foot, |W d|, whitened distance
    bool hit() const { return half_ > 0; }
    Real t_in() const { return t_perp - half_ / w; }
    Real t_out() const { return t_perp + half_ / w; }
    /// By how much the line must move for hit to become miss, or the other way round, lengths as the scene's.
    Real tangency() const;
    /// Depth between t0 and t1, clipped to the chord.
    Real depth(const Real& t0, const Real& t1) const;
    /// Depths of lines moved by up to `shift`, t being measured from the moved origin; of intervals whose ends are each off
    /// by up to `blur`, as are a uniform chord's own.
    Range depth_near(const Real& t0, const Real& t1, const Real& shift, const Real& blur = 0) const;
    /// As depth_part means it: half the chord is less than 2^-5 of its distance.
    bool brief() const { return half_ / w < abs(t_perp) / 31.9; }
    Real reach() const { return half_ / w; }  ///< half the chord, in t
    /// t at which the depth from t0 reaches tau; negative if the chord ends before.
    Real invert(const Real& t0, const Real& tau) const;

private:
    const Ellipsoid256& e_;
    bool given_ = false;                     ///< by t⊥, w and distance
    Real half_, across_, along_, gradient_;  ///< half chord; greatest whitened length of a unit step across, along the line; slope of `distance`
    Real depth_at(const Real& d, Real u0, Real u1, const Real& more = 0) const;  ///< `more`: of the half chord, where its ends matter
};

}  // namespace clume::oracle
