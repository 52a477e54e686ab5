// SPDX-License-Identifier: MIT
// Mitsuba's .vol, version 3: "VOL", the version, encoding, resolution, channels and a bounding box, 48 bytes, then samples at
// the centres of the box's voxels, x fastest. The format is documented with Mitsuba's `gridvolume`.
#pragma once

#include <cstdio>
#include <glm/glm.hpp>
#include <string>

namespace clume {

/// The 48 bytes before float32 samples of one channel. The box is rounded to float, as the format has it.
std::string vol_header(const glm::ivec3& size, const glm::dvec3& min, const glm::dvec3& max);

}  // namespace clume
