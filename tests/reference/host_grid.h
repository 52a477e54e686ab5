// SPDX-License-Identifier: MIT
// A voxel medium in plain double precision: density at a point, optical depth along a ray by quadrature between the lattice
// planes, and delta tracking under a coarse table of bounds. World units; extinctions include `density_scale`.
// It knows scene.h's conventions alone: nothing of bricks, tables or cubics.
#pragma once

#include "src/scene.h"
#include "tests/reference/host_random.h"

#include <vector>

namespace clume::reference {

/// One scalar lattice, samples kept densely with one layer of what lies beyond.
class HostGrid {
public:
    HostGrid(const VoxelGrid& grid, Interpolation interpolation, double factor);

    /// Value at a world point, 0 outside the support.
    double at(const glm::dvec3& world) const { return at_lattice(to_lattice(world)); }
    double at_lattice(const glm::dvec3& p) const;

    /// The part of [t0, t1] inside the support; false if there is none.
    bool clip(const glm::dvec3& o, const glm::dvec3& d, double& t0, double& t1) const;

    /// ∫ value dt over [t0, t1]: Gauss-Legendre, 4 points, between crossings of lattice planes.
    double integral(const glm::dvec3& o, const glm::dvec3& d, double t0, double t1) const;
    /// Where the integral from t0 on reaches `target`; infinite if it does not by t1. Bisection.
    double inverse(const glm::dvec3& o, const glm::dvec3& d, double t0, double t1, double target) const;

    /// t of the next collision in [0, t1], infinite if there is none: null collisions under bounds of blocks of 8³.
    double fly(const glm::dvec3& o, const glm::dvec3& d, double t1, HostRandom& random) const;

    glm::dvec3 to_lattice(const glm::dvec3& world) const { return inverse_ * (world - origin_); }
    glm::dvec3 to_world(const glm::dvec3& lattice) const { return origin_ + axes_ * lattice; }
    const glm::dvec3& lower() const { return lower_; }  ///< support, lattice coordinates
    const glm::dvec3& upper() const { return upper_; }
    double largest() const { return largest_; }

private:
    bool nearest_;
    glm::dmat3 axes_, inverse_;
    glm::dvec3 origin_, lower_, upper_;
    glm::ivec3 first_, size_;      ///< of the samples held
    std::vector<float> samples_;   ///< times factor_
    double factor_, largest_ = 0;
    glm::ivec3 blocks_;
    std::vector<float> bounds_;    ///< per block of 8³ cells from lower_ on

    float sample(int x, int y, int z) const;
    void make_bounds();
    std::vector<double> cuts(const glm::dvec3& o, const glm::dvec3& d, double t0, double t1) const;
};

}  // namespace clume::reference
