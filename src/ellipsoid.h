// SPDX-License-Identifier: MIT
// A primitive as the accelerators and the device see it: recentred, normalised, whitened, in double; and the geometry that
// bounds it. All bounds are conservative against the float arithmetic of the kernels: the support is dilated accordingly.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "runtime/host_array.h"
#include "src/scene.h"

namespace clume {

struct Ellipsoid {
    glm::dvec3 center;
    double w[6];             ///< W: rows of the upper triangle, w00 w01 w02 w11 w12 w22; |W (x − center)| = r
    double descent[3];       ///< 1 / diagonal of WᵀW
    double sigma;            ///< peak extinction, density_scale included, per normalised length
    double extent;           ///< E
    double dilation;         ///< whitened distance by which float evaluation may be off
    glm::dvec3 half;         ///< half edges of the dilated support's box
    std::uint32_t medium;    ///< index into the scene's media
    KernelFamily family;
};

struct Box {
    glm::dvec3 lo, hi;
};

/// World to normalised coordinates: x' = (x − center) · scale, scale a power of two that brings the radius into [1, 2).
struct Normalization {
    glm::dvec3 center{0};
    double scale = 1;
    double radius = 1;  ///< of the media and area lights about center, world units
};

/// Most extinction of a primitive, per normalised length: 2³² of them still add up in single precision.
inline constexpr double most_extinction = 1e28;
/// Greatest |W|, so least scale about its inverse: |W d|² must fit in single precision.
inline constexpr double most_whitening = 1e18;

/// Whitened, normalised primitives of all media, in file order, media one after the other. Throws SceneError where single
/// precision can't hold one.
HostArray<Ellipsoid> make_ellipsoids(const Scene& scene, const Normalization& n);

/// The box of all dilated supports; empty media give lo > hi.
Box bounds_of(std::span<const Ellipsoid> ellipsoids);

/// A lower bound of |W (x − center)| over x in the box, tight but for rounding; 0 if the centre is inside.
double box_distance(const Ellipsoid& e, const Box& box);

/// Upper bound of the primitive's extinction over the box; 0 if its dilated support does not meet the box.
double box_extinction(const Ellipsoid& e, const Box& box);

/// Lower bound of the primitive's extinction over the box; 0 unless its support holds all of it.
double box_extinction_least(const Ellipsoid& e, const Box& box);

/// ∫K over space for unit scales, as the file formats' `mass` has it (Gaussians untruncated).
double kernel_mass(KernelFamily kernel, double extent);

}  // namespace clume
