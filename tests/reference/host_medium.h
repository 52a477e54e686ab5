// SPDX-License-Identifier: MIT
// The media of a scene as the host path tracer sees them: one list of primitives whatever their medium, a uniform grid of
// cells that list the primitives reaching them, and per cell a bound on the extinction. `fly` is delta tracking through
// these cells: a free flight by null collisions under the local bound, with no closed form of any depth.
// All double precision, world units; extinctions include `density_scale`.
#pragma once

#include "src/scene.h"
#include "tests/reference/host_grid.h"
#include "tests/reference/host_random.h"

#include <cstdint>
#include <span>
#include <vector>

namespace clume::reference {

/// Hot data of one primitive: the extinction is sigma K(|W (x − mu)|²), W upper triangular, row by row.
struct alignas(128) HostPrimitive {
    double mu[3];
    double w[6];
    double sigma;               ///< peak extinction [1/world unit]
    double extent_squared;      ///< support radius squared, whitened
    double inv_extent_squared;  ///< Epanechnikov
    KernelFamily family;
};

/// What happens at a collision with a primitive.
struct HostMaterial {
    glm::dvec3 albedo;
    glm::dvec3 emission;  ///< (1 − albedo) L_e
    Phase phase;
};

struct HostRay {
    glm::dvec3 origin, direction;  ///< direction has length 1
};

struct HostCollision {
    int primitive = -1;  ///< −1: none
    double t = 0;        ///< distance along the ray [world units]
};

class HostMedium {
public:
    /// `cells`: resolution along the longest side of the media's bounds; cells are nearly cubes.
    HostMedium(const Scene& scene, int cells);

    /// Next collision with t in [0, t_max]; t_max may be infinite. `max_extinction` of the cells bounds the rate.
    HostCollision fly(const HostRay& ray, double t_max, HostRandom& random) const;

    /// Extinction at a point: sum over all primitives of its cell, 0 outside the bounds [1/world unit].
    double extinction(const glm::dvec3& x) const;
    /// Bound of the cell that holds x, 0 outside the bounds.
    double max_extinction(const glm::dvec3& x) const;

    /// Light that emission grids add on average along [0, t_max]: j at one uniform point of it, times the length.
    glm::dvec3 glow(const HostRay& ray, double t_max, HostRandom& random) const;

    bool empty() const { return primitives_.empty(); }
    const glm::dvec3& lower() const { return lower_; }
    const glm::dvec3& upper() const { return upper_; }
    const HostMaterial& material(int primitive) const { return materials_[static_cast<std::size_t>(primitive)]; }
    std::size_t list_entries() const { return lists_.size(); }

private:
    glm::dvec3 lower_{0}, upper_{0}, cell_size_{1}, inv_cell_size_{1};
    glm::ivec3 resolution_{0};
    std::vector<HostPrimitive> primitives_;
    std::vector<HostMaterial> materials_;  ///< of the primitives, then of the grids
    std::vector<HostGrid> grids_;
    std::vector<std::pair<HostGrid, glm::dvec3>> glows_;  ///< emission grids with their factors
    std::vector<float> majorants_;        ///< per cell, rounded up
    std::vector<std::uint32_t> offsets_;  ///< per cell + 1, into lists_
    std::vector<std::uint32_t> lists_;    ///< primitive indices, the largest in the cell first
    bool gaussian_only_ = true;

    void pack(const Scene& scene);
    void fill_cells(int cells);
    long cell_of(const glm::dvec3& x) const;
    HostCollision fly_mixture(const HostRay& ray, double t_max, HostRandom& random) const;
    template <bool gaussian_only> HostCollision walk(const HostRay& ray, double t_max, HostRandom& random) const;
    std::span<const std::uint32_t> list(std::size_t cell) const {
        return {lists_.data() + offsets_[cell], lists_.data() + offsets_[cell + 1]};
    }
};

}  // namespace clume::reference
