// SPDX-License-Identifier: MIT
// The study's generated scenes: a ball of equal ellipsoids, of which one thing at a time is varied. A pure function of the
// specification. Lengths are world units.
#pragma once

#include <cstdint>

#include "src/scene.h"

namespace clume::bench {

/// `n` ellipsoids of one size, centres uniform in the unit ball, rotations uniform.
struct BallSpec {
    std::uint32_t n = 10000;
    double overlap = 8;       ///< supports that cover a point well inside the ball, on average
    double depth = 10;        ///< optical depth along the ball's diameter, on average
    double anisotropy = 1;    ///< longest over shortest axis, of a volume that `overlap` gives
    bool needles = false;     ///< one long axis and two short ones, instead of a disc's two long and one short
    KernelFamily family = KernelFamily::gaussian;
    bool sun = false;         ///< a directional light, to be sampled; else constant light, which no path needs to sample
    std::uint64_t seed = 1;
};

/// Seen by an orthographic camera whose film, `side`² pixels and 1.4 wide, the ball covers; albedo 0.9, isotropic.
Scene study_ball(const BallSpec& spec, int side = 32);

/// Semi-axis of a sphere's support in that ball: n r³ = overlap.
double support_radius(const BallSpec& spec);

/// ∫K over the support, in units of the product of the scales.
double kernel_mass(KernelFamily family, double extent);

/// A bundled scene with its film shrunk to about `side`² pixels. Throws SceneError if it is not found.
Scene study_file(const char* name, int side = 32);

}  // namespace clume::bench
