// SPDX-License-Identifier: MIT
#include "src/ellipsoid.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "src/error.h"
#include "src/parallel.h"

namespace clume {
namespace {

/// Upper-triangular W with WᵀW = (A Aᵀ)⁻¹: the R of A⁻¹ = Q R, by Gram-Schmidt done twice (needles of any axis ratio).
void whiten(const glm::dmat3& axes, double w[6]) {
    glm::dmat3 q = glm::inverse(axes);
    glm::dmat3 r(0.0);
    for (int pass = 0; pass < 2; ++pass) {
        glm::dmat3 step(0.0);
        for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < j; ++i) {
                step[j][i] = glm::dot(q[i], q[j]);
                q[j] -= step[j][i] * q[i];
            }
            step[j][j] = glm::length(q[j]);
            q[j] /= step[j][j];
        }
        r = pass == 0 ? step : step * r;
    }
    w[0] = r[0][0], w[1] = r[1][0], w[2] = r[2][0], w[3] = r[1][1], w[4] = r[2][1], w[5] = r[2][2];
}

glm::dvec3 apply(const double* w, const glm::dvec3& x) {
    return {w[0] * x.x + w[1] * x.y + w[2] * x.z, w[3] * x.y + w[4] * x.z, w[5] * x.z};
}

glm::dvec3 apply_transposed(const double* w, const glm::dvec3& y) {
    return {w[0] * y.x, w[1] * y.x + w[3] * y.y, w[2] * y.x + w[4] * y.y + w[5] * y.z};
}

[[noreturn]] void fail_range(const EllipsoidMedium& medium, const Primitive& p, const std::string& what) {
    throw SceneError(fmt::format("{}: the primitive at ({:g}, {:g}, {:g}) is outside single precision: {}", medium.source, p.center.x, p.center.y, p.center.z, what));
}

}  // namespace

HostArray<Ellipsoid> make_ellipsoids(const Scene& scene, const Normalization& n) {
    std::vector<std::size_t> first;
    std::size_t count = 0;
    for (const auto& m : scene.media) {
        first.push_back(count);
        count += m.primitives.size();
    }
    HostArray<Ellipsoid> out(count);
    for (std::size_t m = 0; m < scene.media.size(); ++m) {
        const auto& medium = scene.media[m];
        parallel_chunks(medium.primitives.size(), 4096, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Primitive& p = medium.primitives[i];
                Ellipsoid& e = out[first[m] + i];
                e.center = (p.center - n.center) * n.scale;
                const glm::dmat3 axes = p.axes * n.scale;
                whiten(axes, e.w);
                e.descent[0] = 1 / (e.w[0] * e.w[0]);
                e.descent[1] = 1 / (e.w[1] * e.w[1] + e.w[3] * e.w[3]);
                e.descent[2] = 1 / (e.w[2] * e.w[2] + e.w[4] * e.w[4] + e.w[5] * e.w[5]);
                e.sigma = p.sigma_t * medium.density_scale / n.scale;
                e.extent = medium.extent;
                e.medium = static_cast<std::uint32_t>(m);
                e.family = medium.kernel;
                // Float evaluation is off by some ulp of |W| times the lengths involved (primitive's own and scene's).
                double norm2 = 0;
                for (double v : e.w) norm2 += v * v;
                if (!(norm2 <= most_whitening * most_whitening)) fail_range(medium, p, fmt::format("a scale less than {:g} of the scene's radius {:g}", 1 / most_whitening, n.radius));
                if (!(e.sigma <= most_extinction))
                    fail_range(medium, p, fmt::format("extinction {:g} over the scene's radius {:g} is an optical depth above {:g}", p.sigma_t * medium.density_scale, n.radius, most_extinction));
                glm::dvec3 row2(0.0);
                for (int k = 0; k < 3; ++k) row2 += axes[k] * axes[k];
                const double longest = std::sqrt(row2.x + row2.y + row2.z);
                e.dilation = 0x1p-21 * std::sqrt(norm2) * (medium.extent * longest + 4.0) + 1e-5 * medium.extent;
                e.half = glm::sqrt(row2) * (e.extent + e.dilation) + 0x1p-20;
            }
        });
    }
    return out;
}

Box bounds_of(std::span<const Ellipsoid> ellipsoids) {
    Box b{glm::dvec3(1e300), glm::dvec3(-1e300)};
    for (const auto& e : ellipsoids) {
        b.lo = glm::min(b.lo, e.center - e.half);
        b.hi = glm::max(b.hi, e.center + e.half);
    }
    return b;
}

double box_distance(const Ellipsoid& e, const Box& box) {
    glm::dvec3 x = glm::clamp(e.center, box.lo, box.hi);
    if (x == e.center) return 0;
    // Coordinate descent on |W (x − μ)|² inside the box ...
    const double* w = e.w;
    const double m01 = w[0] * w[1], m02 = w[0] * w[2], m12 = w[1] * w[2] + w[3] * w[4];
    glm::dvec3 v = x - e.center;
    const glm::dvec3 lo = box.lo - e.center, hi = box.hi - e.center;
    for (int sweep = 0; sweep < 2; ++sweep) {
        v.x = std::clamp(-(m01 * v.y + m02 * v.z) * e.descent[0], lo.x, hi.x);
        v.y = std::clamp(-(m01 * v.x + m12 * v.z) * e.descent[1], lo.y, hi.y);
        v.z = std::clamp(-(m02 * v.x + m12 * v.y) * e.descent[2], lo.z, hi.z);
    }
    // ... then the bound that this point's direction certifies: the least of n · W (x − μ) over the box.
    const glm::dvec3 y = apply(w, v);
    const double length = glm::length(y);
    if (!(length > 0)) return 0;
    const glm::dvec3 n = apply_transposed(w, y) / length;
    const double least = (n.x > 0 ? n.x * lo.x : n.x * hi.x) + (n.y > 0 ? n.y * lo.y : n.y * hi.y) + (n.z > 0 ? n.z * lo.z : n.z * hi.z);
    return std::max(0.0, least);
}

double box_extinction(const Ellipsoid& e, const Box& box) {
    const double distance = box_distance(e, box) - e.dilation;
    if (distance >= e.extent) return 0;
    const double r = std::max(distance, 0.0);
    switch (e.family) {
        case KernelFamily::gaussian: return e.sigma * std::exp(-0.5 * r * r);
        case KernelFamily::epanechnikov: return e.sigma * std::max(0.0, 1 - r * r / (e.extent * e.extent));
        case KernelFamily::uniform: break;
    }
    return e.sigma;
}

double box_extinction_least(const Ellipsoid& e, const Box& box) {
    // The distance is convex: it is greatest at a corner.
    double farthest = 0;
    for (int k = 0; k < 8; ++k) {
        const glm::dvec3 corner(k & 1 ? box.hi.x : box.lo.x, k & 2 ? box.hi.y : box.lo.y, k & 4 ? box.hi.z : box.lo.z);
        farthest = std::max(farthest, glm::length(apply(e.w, corner - e.center)));
    }
    const double r = farthest + e.dilation;
    if (r >= e.extent) return 0;
    switch (e.family) {
        case KernelFamily::gaussian: return e.sigma * std::exp(-0.5 * r * r);
        case KernelFamily::epanechnikov: return e.sigma * (1 - r * r / (e.extent * e.extent));
        case KernelFamily::uniform: break;
    }
    return e.sigma;
}

double kernel_mass(KernelFamily kernel, double extent) {
    const double cube = extent * extent * extent;
    switch (kernel) {
        case KernelFamily::gaussian: return std::pow(2 * std::numbers::pi, 1.5);
        case KernelFamily::epanechnikov: return 8 * std::numbers::pi * cube / 15;
        case KernelFamily::uniform: break;
    }
    return 4 * std::numbers::pi * cube / 3;
}

}  // namespace clume
