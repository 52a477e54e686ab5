// SPDX-License-Identifier: MIT
// Scenes made in memory, for tests and benchmarks: furnaces, single bodies with closed forms, random mixtures and the
// benchmark ball. Lengths are world units, radiances W/m²/sr.
#pragma once

#include "src/scene.h"

#include <cstdint>

namespace clume::reference {

/// Support radius that scene.md gives a kernel by default, in scales.
double default_extent(KernelFamily kernel);

/// A primitive of the given semi-scales, turned by a uniform random rotation made from three numbers in [0, 1).
Primitive make_primitive(const glm::dvec3& center, const glm::dvec3& scale, double sigma_t,
                         const glm::dvec3& rotation = {0, 0, 0});

/// Five overlapping ellipsoids of peak extinction `density`, albedo 1, in a visible constant light of 1: radiance 1
/// everywhere. The camera looks from outside, or stands in the middle of the medium. 16² pixels.
Scene white_furnace(KernelFamily kernel, double density, bool camera_inside);

/// The same with albedos from 0 to 0.8 and L_e = 1: radiance 1 everywhere.
Scene emissive_furnace(KernelFamily kernel, double density, bool camera_inside);

/// One anisotropic, rotated Gaussian of albedo 0, extent 4, under a visible constant light of 1; 32² pixels.
Scene absorbing_gaussian(double peak = 1.5);

/// Transmittance of `absorbing_gaussian` along the ray through film point (x, y) [pixels], in closed form; its radiance.
double absorbing_gaussian_transmittance(const Scene& scene, double x, double y);

/// One uniform ellipsoid: a ball of radius 1 around the origin of extinction `sigma_t`, albedo `albedo`, no light; seen by
/// an orthographic camera of width 2.5 from (0, 0, −3), 32² pixels.
Scene homogeneous_sphere(double sigma_t, double albedo);

/// exp(−sigma_t d) for the ray of `homogeneous_sphere` through film point (x, y).
double homogeneous_sphere_transmittance(const Scene& scene, double x, double y);

/// `n` ellipsoids of random scale (a factor e^±0.7 per axis), rotation, peak, albedo and centre in the unit ball, sized so
/// that about `overlap` supports cover a point of it; constant light 1, not visible to the camera. 32² pixels.
Scene random_mixture(KernelFamily kernel, int n, std::uint64_t seed, double overlap = 8, double peak = 2);

/// The benchmark ball: 16,384 Gaussians of scale 0.03 e^U(−.4, .4) per axis, random rotation, peak 10, albedo 0.9, centres
/// uniform in the unit ball, constant light 1, seen from (0, 0, −3), fov 38°, 256².
Scene ball_scene();

/// The same construction with `n` primitives at the same overlap: the scale shrinks as n^(−1/3).
Scene ball_scene_n(std::uint32_t n, std::uint64_t seed = 1);

}  // namespace clume::reference
