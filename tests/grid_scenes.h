// SPDX-License-Identifier: MIT
// Voxel grids made from functions, scenes of them, and rays in normalised coordinates as double precision knows them.
#pragma once

#include <array>
#include <map>

#include "src/device_scene.h"
#include "tests/flight_reference.h"
#include "tests/reference/host_grid.h"

namespace clume::probing {

/// Samples f(i) at lattice points lo ≤ i < hi, placed by world = origin + axes · i. Sparse grids store no brick that is all 0.
template <class F>
VoxelGrid voxel_grid(const glm::ivec3& lo, const glm::ivec3& hi, const F& f, bool sparse = false, const glm::dmat3& axes = glm::dmat3(1), const glm::dvec3& origin = glm::dvec3(0)) {
    VoxelGrid g;
    g.lo = lo;
    g.hi = hi;
    g.sparse = sparse;
    g.axes = axes;
    g.origin = origin;
    std::map<std::array<int, 3>, std::vector<float>> bricks;
    for (int z = lo.z; z < hi.z; ++z)
        for (int y = lo.y; y < hi.y; ++y)
            for (int x = lo.x; x < hi.x; ++x) {
                const auto v = static_cast<float>(f(glm::ivec3(x, y, z)));
                if (v == 0) continue;
                std::vector<float>& b = bricks[{(z >> 3) * 8, (y >> 3) * 8, (x >> 3) * 8}];
                b.resize(512);
                b[static_cast<std::size_t>((x & 7) + 8 * ((y & 7) + 8 * (z & 7)))] = v;
            }
    for (const auto& [at, values] : bricks) {
        g.brick_origins.emplace_back(at[2], at[1], at[0]);
        g.values.insert(g.values.end(), values.begin(), values.end());
    }
    return g;
}

/// An even cloud of random samples, 0 in about a third of them.
inline auto random_samples(std::uint64_t seed) {
    return [seed](const glm::ivec3& p) {
        TestRandom random(seed ^ (static_cast<std::uint64_t>(p.x + 512) << 40 | static_cast<std::uint64_t>(p.y + 512) << 20 | static_cast<std::uint64_t>(p.z + 512)));
        return std::max(0.0, random.uniform(-0.5, 1));
    };
}

/// A smooth cloud: bumps about several points, 0 beyond a distance from them; p in lattice units, `size` across.
inline auto smooth_samples(int size, std::uint64_t seed = 1) {
    TestRandom random(seed);
    std::vector<glm::dvec4> bumps;
    for (int i = 0; i < 6; ++i) bumps.emplace_back(static_cast<double>(size) * glm::dvec3(random.uniform(0.25, 0.75), random.uniform(0.25, 0.75), random.uniform(0.25, 0.75)), size * random.uniform(0.08, 0.2));
    return [bumps](const glm::ivec3& p) {
        double sum = 0;
        for (const glm::dvec4& b : bumps) {
            const glm::dvec3 x = (glm::dvec3(p) - glm::dvec3(b)) / b.w;
            sum += std::max(0.0, 1 - glm::dot(x, x) / 2);
        }
        return sum;
    };
}

/// Rotated, unlike in each axis, and mirrored.
inline glm::dmat3 turned_axes(double edge) {
    return glm::dmat3(glm::dvec3(0.8, 0.5, -0.1) * edge, glm::dvec3(0.4, -0.7, 0.3) * (-0.8 * edge), glm::dvec3(0.1, -0.3, -0.9) * (1.3 * edge));
}

inline GridMedium grid_medium(VoxelGrid grid, double density_scale, Interpolation interpolation = Interpolation::trilinear) {
    GridMedium m;
    m.density = std::move(grid);
    m.density_scale = density_scale;
    m.interpolation = interpolation;
    return m;
}

inline Scene grid_scene(GridMedium medium) {
    Scene scene = empty_scene();
    scene.grids.push_back(std::move(medium));
    return scene;
}

inline reference::HostGrid host_density(const GridMedium& m) { return {m.density, m.interpolation, m.density_scale}; }

/// A ray of the probe in world units: lengths along it are 1 / scale as long.
struct WorldRay {
    glm::dvec3 origin, direction;
    double t_end, scale;  ///< t_end in world units; normalised = world · scale
    WorldRay(const ProbeRay& r, const Normalization& n)
        : origin(glm::dvec3(r.origin[0], r.origin[1], r.origin[2]) / n.scale + n.center),
          direction(r.direction[0], r.direction[1], r.direction[2]),
          t_end(static_cast<double>(r.t_end) / n.scale),
          scale(n.scale) {}
};

}  // namespace clume::probing
