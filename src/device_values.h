// SPDX-License-Identifier: MIT
// Values as they are written into device buffers, and what is asked of colours on the way. Host values are double.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>

#include "kernels/layout.h"

namespace clume {

/// Rounded to float; the fourth component is at the caller's disposal.
inline device::float4 pack(const glm::dvec3& v, double w = 0) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)};
}

/// An index where the device expects a float: the same bits.
inline float as_float(std::uint32_t bits) { return std::bit_cast<float>(bits); }

inline double largest(const glm::dvec3& v) { return std::max({v.x, v.y, v.z}); }
inline bool is_grey(const glm::dvec3& v) { return v.x == v.y && v.y == v.z; }

}  // namespace clume
