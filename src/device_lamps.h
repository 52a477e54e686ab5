// SPDX-License-Identifier: MIT
// Which point and spot lights have medium so near that light sampling at collisions needs help (kernels/lamp.cl).
#pragma once

#include <cstddef>

#include "src/bvh.h"
#include "src/device_scene.h"

namespace clume {

/// Sets lamp_sigma and lamp_pdf of the lights concerned; returns how many there are. out.lights and out.ellipsoids must be set,
/// `tree` be over the latter.
std::size_t mark_lamps(const Scene& scene, const BvhTree& tree, DeviceScene& out);

}  // namespace clume
