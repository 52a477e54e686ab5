// SPDX-License-Identifier: MIT
#include "src/device_lamps.h"

#include <algorithm>
#include <cmath>

#include "src/device_values.h"
#include "src/voxel_grid.h"

namespace clume {
namespace {

constexpr double kNear = 1.0 / 32;    // of the scene's radius: a light with medium within it is a lamp
constexpr double kAbout = 1.0 / 8;    // of the scene's radius: half the edge of the cube whose mean extinction counts
constexpr int kPoints = 5;            // of it along each axis
constexpr std::size_t kMost = 65536;  // primitives looked at there

Box cube(const glm::dvec3& p, double half) { return {p - half, p + half}; }

double kernel_value(const Ellipsoid& e, const glm::dvec3& p) {
    const glm::dvec3 x = p - e.center, a(e.w[0] * x.x + e.w[1] * x.y + e.w[2] * x.z, e.w[3] * x.y + e.w[4] * x.z, e.w[5] * x.z);
    const double r2 = glm::dot(a, a), e2 = e.extent * e.extent;
    if (!(r2 < e2)) return 0;
    return e.family == KernelFamily::gaussian ? std::exp(-0.5 * r2) : e.family == KernelFamily::epanechnikov ? 1 - r2 / e2 : 1;
}

/// Whether some sample of the grid that isn't 0 may reach into the box, world units.
bool meets(const GridMedium& m, const Box& box) {
    const VoxelGrid& g = m.density;
    const glm::dmat3 to_lattice = glm::inverse(g.axes);
    glm::dvec3 lo(1e300), hi(-1e300);
    for (int c = 0; c < 8; ++c) {
        const glm::dvec3 p = to_lattice * (glm::dvec3(c & 1 ? box.hi.x : box.lo.x, c & 2 ? box.hi.y : box.lo.y, c & 4 ? box.hi.z : box.lo.z) - g.origin);
        lo = glm::min(lo, p - 1.0);
        hi = glm::max(hi, p + 1.0);
    }
    const auto overlap = [&](const glm::ivec3& first, const glm::ivec3& last) {
        for (int k = 0; k < 3; ++k)
            if (lo[k] > last[k] || hi[k] < first[k]) return false;
        return true;
    };
    if (!overlap(g.lo, g.hi - 1)) return false;
    if (g.sparse && g.background > 0) return true;
    return std::any_of(g.brick_origins.begin(), g.brick_origins.end(), [&](const glm::ivec3& o) { return overlap(o, o + VoxelGrid::brick - 1); });
}

/// The sample nearest to a world point, times the medium's factor.
double extinction(const GridMedium& m, const glm::dvec3& p) {
    const glm::dvec3 q = glm::floor(glm::inverse(m.density.axes) * (p - m.density.origin) + 0.5);
    for (int k = 0; k < 3; ++k)
        if (q[k] < m.density.lo[k] || q[k] >= m.density.hi[k]) return 0;
    return m.density_scale * static_cast<double>(sample_at(m.density, glm::ivec3(q)));
}

/// Film point [pixels] that a world point projects to; far away if it lies behind a perspective camera.
glm::dvec3 film_point(const Scene& scene, const glm::dvec3& p) {
    const Camera& c = scene.camera;
    const glm::dvec3 f = glm::normalize(c.target - c.origin), r = glm::normalize(glm::cross(f, c.up)), u = glm::cross(r, f), q = p - c.origin;
    const bool perspective = c.kind == CameraKind::perspective;
    const double depth = perspective ? glm::dot(q, f) : 1, pixel = 2 * (perspective ? std::tan(c.fov_rad / 2) : c.width / 2) / scene.film.width;
    if (!(depth > 0)) return glm::dvec3(-1e9);
    return glm::clamp(glm::dvec3(0.5 * scene.film.width + glm::dot(q, r) / (depth * pixel), 0.5 * scene.film.height - glm::dot(q, u) / (depth * pixel), 0), -1e9, 1e9);
}

}  // namespace

std::size_t mark_lamps(const Scene& scene, const BvhTree& tree, DeviceScene& out) {
    const Normalization& n = out.normalization;
    const double radius = n.radius * n.scale;
    std::size_t count = 0;
    double total = 0;
    for (std::size_t i = 0; i < out.lights.size(); ++i) {
        device::LightInfo& light = out.lights[i];
        if (!(light.kind & (LIGHT_POINT | LIGHT_SPOT)) || !(light.select_pdf > 0)) continue;
        const glm::dvec3 world = scene.lights[i].position, p = (world - n.center) * n.scale;
        const Box near = cube(p, kNear * radius), about = cube(p, kAbout * radius);
        bool found = std::any_of(scene.grids.begin(), scene.grids.end(), [&](const GridMedium& m) { return meets(m, cube(world, kNear * n.radius)); });
        std::vector<std::uint32_t> those;
        tree.overlapping(out.ellipsoids, about, [&](std::uint32_t e) {
            those.push_back(e);
            found = found || box_distance(out.ellipsoids[e], near) < out.ellipsoids[e].extent;
        });
        if (!found) continue;
        // Where very many meet the cube, some stand for all: it need not be exact.
        const std::size_t stride = 1 + those.size() / kMost;
        double sum = 0;
        for (int k = 0; k < kPoints * kPoints * kPoints; ++k) {
            const glm::dvec3 at = (glm::dvec3(k % kPoints, k / kPoints % kPoints, k / (kPoints * kPoints)) + 0.5) / static_cast<double>(kPoints), offset = (2.0 * at - 1.0) * kAbout;
            for (std::size_t j = 0; j < those.size(); j += stride) {
                const Ellipsoid& e = out.ellipsoids[those[j]];
                sum += static_cast<double>(stride) * e.sigma * kernel_value(e, p + offset * radius);
            }
            for (const GridMedium& m : scene.grids) sum += extinction(m, world + offset * n.radius) / n.scale;
        }
        // A power of two: every host finds the same one, whatever its exp.
        const double mean = sum / (kPoints * kPoints * kPoints);
        light.lamp_sigma = static_cast<float>(std::exp2(std::rint(std::log2(std::clamp(mean, 1.0 / 16, 0x1p20)))));
        light.edge_v = pack(film_point(scene, world));
        total += static_cast<double>(light.select_pdf);
        ++count;
    }
    for (device::LightInfo& light : out.lights)
        if (light.lamp_sigma > 0) light.lamp_pdf = static_cast<float>(static_cast<double>(light.select_pdf) / total);
    return count;
}

}  // namespace clume
