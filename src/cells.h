// SPDX-License-Identifier: MIT
// The spatial cells: a uniform grid over the media, crowded cells split into octrees; every cell lists all primitives whose
// support meets it and bounds their extinction. The same cells come out for any number of threads.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kernels/layout.h"
#include "src/bvh.h"
#include "src/ellipsoid.h"

namespace clume {

/// What a kernel pays, in nanoseconds of one core (fitted once to a 16-wide CPU; only ratios matter). The builder minimises
/// the cost of travelling through the media.
struct CellCosts {
    double step = 28;        ///< entering a cell
    double tentative = 25;   ///< one tentative collision
    double chord = 45;       ///< one group's chords and free flights or depths
    double null_share = 1;   ///< rays that sample by null collisions (0..1)
    double chord_share = 0;  ///< rays that visit every chord (decomposition, analytic transmittance)
    double density_share = 0;  ///< rays that sample by null collisions with the density of the cell looked up
    bool operator==(const CellCosts&) const = default;
};

struct CellOptions {
    CellCosts costs;
    std::uint32_t max_levels = 8;        ///< of the octrees; 0: a plain grid
    std::optional<int> roots;            ///< root cells along the longest axis; default: by the costs
    bool control = false;                ///< fill Leaf::control
    std::size_t max_references = 0;      ///< kept to by larger cells, never by dropping a primitive
    bool operator==(const CellOptions&) const = default;
};

struct Cells {
    glm::dvec3 origin{0};
    double root_size = 1;
    glm::uvec3 roots{1};
    std::uint32_t levels = 0;                        ///< octree levels below the roots
    std::vector<std::uint32_t> table;                ///< links: layout.h, CELL_*
    struct Leaf {
        std::vector<std::uint32_t> primitives;       ///< ascending
        std::vector<float> bounds;                   ///< of each one's extinction in this cell
        double majorant = 0;                         ///< their sum
        double control = 0;                          ///< lower bound of the extinction in this cell, if asked for
    };
    std::vector<Leaf> leaves;
    std::size_t references = 0;                      ///< primitives over all leaves
};

Cells build_cells(std::span<const Ellipsoid> ellipsoids, const BvhTree& tree, const CellOptions& options);

/// An upper bound of the extinction of all primitives together anywhere, within 2 % of the highest value found or as near as
/// 4,000 boxes bring it (branch and bound).
double scene_bound(std::span<const Ellipsoid> ellipsoids, const BvhTree& tree);

/// For each empty root (an entry below CELL_EMPTY_MAX) of a table, x fastest, the Chebyshev distance to the nearest root that
/// is not empty, capped: how far a ray may leap. Beyond the table all is empty.
void measure_emptiness(std::span<std::uint32_t> roots, const glm::uvec3& counts);

}  // namespace clume
