// SPDX-License-Identifier: MIT
// Phase functions of the host path tracer. `cosine` is between the directions of travel before and after, so that g > 0
// scatters forward; values are densities per steradian and sampling follows them exactly (its weight is 1).
#pragma once

#include "src/scene.h"
#include "tests/reference/host_random.h"

#include <cmath>
#include <numbers>

namespace clume::reference {

/// Density per steradian; `cosine` in [-1, 1].
inline double phase_value(const Phase& phase, double cosine) {
    constexpr double pi = std::numbers::pi;
    if (phase.kind == PhaseKind::rayleigh) return 3 / (16 * pi) * (1 + cosine * cosine);
    if (phase.kind == PhaseKind::isotropic) return 1 / (4 * pi);
    const double g = phase.g, denominator = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * pi * denominator * std::sqrt(denominator));
}

/// Uniform on the unit sphere (Marsaglia's rejection from the disc).
inline glm::dvec3 sample_sphere(HostRandom& random) {
    for (;;) {
        const double u = 2 * random.uniform() - 1, v = 2 * random.uniform() - 1, s = u * u + v * v;
        if (s >= 1) continue;
        const double f = 2 * std::sqrt(1 - s);
        return {u * f, v * f, 1 - 2 * s};
    }
}

/// A new direction of travel after one along the unit vector `d`, distributed as `phase_value`.
inline glm::dvec3 sample_phase(const Phase& phase, const glm::dvec3& d, HostRandom& random) {
    if (phase.kind == PhaseKind::isotropic || (phase.kind == PhaseKind::henyey_greenstein && std::abs(phase.g) < 1e-7))
        return sample_sphere(random);
    const double xi = random.uniform();
    double cosine;
    if (phase.kind == PhaseKind::rayleigh) {
        const double z = 2 * (2 * xi - 1), a = std::cbrt(z + std::sqrt(z * z + 1));  // c³ + 3c = 8ξ − 4
        cosine = a - 1 / a;
    } else {
        const double g = phase.g, s = (1 - g * g) / (1 - g + 2 * g * xi);
        cosine = (1 + g * g - s * s) / (2 * g);
    }
    cosine = std::fmin(1, std::fmax(-1, cosine));
    const double sine = std::sqrt(1 - cosine * cosine), azimuth = 2 * std::numbers::pi * random.uniform();
    // Orthonormal frame around d: Duff et al., "Building an orthonormal basis, revisited", JCGT 6(1).
    const double sign = std::copysign(1.0, d.z), a = -1 / (sign + d.z), b = d.x * d.y * a;
    const glm::dvec3 s{1 + sign * d.x * d.x * a, sign * b, -sign * d.x}, t{b, sign + d.y * d.y * a, -d.y};
    const glm::dvec3 out = s * (sine * std::cos(azimuth)) + t * (sine * std::sin(azimuth)) + d * cosine;
    return out / std::sqrt(out.x * out.x + out.y * out.y + out.z * out.z);
}

}  // namespace clume::reference
