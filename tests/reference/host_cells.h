// SPDX-License-Identifier: MIT
// Bounds that the host medium's cells are built from: the kernel value of a primitive at a point, and a lower bound on the
// whitened distance from its centre to any point of a box. All double precision.
#pragma once

#include "tests/reference/host_medium.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace clume::reference {

/// e^−x for 0 ≤ x ≤ 700, relative error below 1e-15; inline, so that the loop over a cell's list keeps its registers.
inline double exp_negative(double x) {
    const double k = std::floor(x * -1.4426950408889634 + 0.5);
    const double r = std::fma(k, -1.9082149292705877e-10, std::fma(k, -6.93147180369123816490e-01, -x));
    double p = 1.0 / 479001600;
    for (double c : {1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320, 1.0 / 5040, 1.0 / 720, 1.0 / 120, 1.0 / 24,
                     1.0 / 6, 0.5, 1.0, 1.0})
        p = std::fma(p, r, c);
    return p * std::bit_cast<double>(static_cast<std::uint64_t>(static_cast<std::int64_t>(k) + 1023) << 52);
}

/// |W (x − mu)|².
inline double whitened_distance_squared(const HostPrimitive& p, double x, double y, double z) {
    const double dx = x - p.mu[0], dy = y - p.mu[1], dz = z - p.mu[2];
    const double a = p.w[0] * dx + p.w[1] * dy + p.w[2] * dz, b = p.w[3] * dy + p.w[4] * dz, c = p.w[5] * dz;
    return a * a + b * b + c * c;
}

/// sigma K(r²), 0 outside the support [1/world unit].
template <bool gaussian_only> inline double kernel_extinction(const HostPrimitive& p, double r_squared) {
    if (r_squared >= p.extent_squared) return 0;
    if (gaussian_only || p.family == KernelFamily::gaussian)
        return p.sigma * (r_squared < 1400 ? exp_negative(0.5 * r_squared) : 0);
    return p.family == KernelFamily::uniform ? p.sigma : p.sigma * (1 - r_squared * p.inv_extent_squared);
}

/// Squared lower bound of |W (x − mu)| over the box |x − centre| ≤ half. Coordinate descent finds a point y near the
/// minimum; whatever it is, the plane through W(y − mu) facing the centre bounds the box from below (|v| ≥ n·v), so that
/// an unfinished descent costs tightness only.
inline double min_whitened_distance_squared(const HostPrimitive& p, const glm::dvec3& centre, const glm::dvec3& half) {
    const double w[3][3] = {{p.w[0], p.w[1], p.w[2]}, {0, p.w[3], p.w[4]}, {0, 0, p.w[5]}};
    double c[3], y[3], v[3], column[3];
    for (int k = 0; k < 3; ++k) {
        c[k] = centre[k] - p.mu[k];
        y[k] = std::clamp(0.0, c[k] - half[k], c[k] + half[k]);
        column[k] = w[0][k] * w[0][k] + w[1][k] * w[1][k] + w[2][k] * w[2][k];
    }
    for (int i = 0; i < 3; ++i) v[i] = w[i][0] * y[0] + w[i][1] * y[1] + w[i][2] * y[2];
    for (int sweep = 0; sweep < 24; ++sweep) {
        double moved = 0;
        for (int k = 0; k < 3; ++k) {
            const double slope = w[0][k] * v[0] + w[1][k] * v[1] + w[2][k] * v[2];
            const double target = std::clamp(y[k] - slope / column[k], c[k] - half[k], c[k] + half[k]), step = target - y[k];
            for (int i = 0; i < 3; ++i) v[i] += w[i][k] * step;
            y[k] = target;
            moved = std::max(moved, std::abs(step) / (half[k] + 1e-300));
        }
        if (moved < 1e-3) break;
    }
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (!(length > 1e-9)) return 0;
    double bound = 0;
    for (int k = 0; k < 3; ++k) {
        const double n = (w[0][k] * v[0] + w[1][k] * v[1] + w[2][k] * v[2]) / length;
        bound += n * c[k] - std::abs(n) * half[k];
    }
    bound = std::max(0.0, bound - 1e-9 * (1 + length));
    return bound * bound;
}

}  // namespace clume::reference
