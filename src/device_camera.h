// SPDX-License-Identifier: MIT
// The camera as the device gets it, and which pixels can see anything at all.
#pragma once

#include <vector>

#include "src/device_scene.h"

namespace clume {

/// Fills the camera's part of params: a plane just in front of all that can be seen, relative to the pixel that looks at it.
void set_camera(const Scene& scene, DeviceScene& out);

/// Width and height of the squares of the window, from its corner on, that pixels are listed by.
inline constexpr int film_tile = 16;

/// Pixels (x + width · y) of the window whose footprint may meet a medium or a surface, square by square for coherence.
/// Conservative: a pixel left out sees only the background. Everything if the background is an image that the camera sees.
std::vector<device::uint> active_pixels(const Scene& scene, const DeviceScene& device, const CropWindow& window);

}  // namespace clume
