// SPDX-License-Identifier: MIT
// Every kernel run once on a device, its output kept word by word: what has to be the same on all devices and at every vector
// width, and what a checker of memory and races looks at. Scenes and methods are chosen so that every strategy, estimator,
// bound, kernel family, phase function, kind of light and kind of grid takes part.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "runtime/device.h"
#include "tests/pairs.h"

namespace clume::test {

/// A method on the one scene that has everything it can handle.
struct MethodCase {
    Pair pair;
    bool grids;  ///< ellipsoids and voxel media, or ellipsoids alone
};

/// Each strategy, estimator, bound, way of root finding and accelerator at least once.
std::span<const MethodCase> method_cases();

/// Media of all families and phase functions, every kind of light, emission, albedo and g per primitive; 16 × 16 pixels.
Scene everything(bool grids);
/// Grey, one medium, one light, orthographic: the program with most left out. 16 × 16 pixels.
Scene hardly_anything();

/// The scene with the case's method in it, packed for the device.
Scene scene_of(const MethodCase& c);
DeviceScene packed(const Scene& scene, const Pair& pair);

/// Words of output by "kernel what"; a larger `count` gives longer outputs that begin the same.
using Outputs = std::map<std::string, std::vector<std::uint32_t>>;

/// The kernels that need no scene.
Outputs run_building_blocks(const DeviceInfo& device, int width, std::size_t count);
/// Those of stress.cl; and those of bench/, whose values are of no use.
Outputs run_stress_kernels(const DeviceInfo& device, std::size_t count);
Outputs run_bench_kernels(const DeviceInfo& device, int width);
/// The kernels that do: probe_ray, probe_camera, probe_grid, and the image of `spp` samples per pixel. Only the image if `count` is 0.
Outputs run_method(const DeviceInfo& device, int width, const Scene& scene, const Pair& pair, std::size_t count, std::uint32_t spp = 1);

}  // namespace clume::test
