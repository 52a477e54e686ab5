// SPDX-License-Identifier: MIT
// What the judges of samplers share: random bits that are hard to map, and the kernels' maps in 256 bits.
#pragma once

#include <initializer_list>

#include "src/stress.h"
#include "src/stress_device.h"
#include "src/stress_families.h"

namespace clume {

/// uniform_s of rng.cl: every step is exactly rounded on any machine.
oracle::Real stress_uniform(std::uint32_t x);

/// The map of phase.cl's `around`, for d of length 1 exactly, from 1 − c.
oracle::Vector around(const oracle::Vector& d, const oracle::Real& versine, const oracle::Real& turn);

/// Axes with signed zeros and directions next to them, else any.
glm::dvec3 some_direction(StressRandom& random);

/// Any words, with those next to 0 and 2^32 often.
StressBits some_bits(StressRandom& random);

/// `off` in the limit's unit, or not finite.
StressError error_of(const oracle::Real& off, bool finite, const std::string& at);
bool all_finite(std::initializer_list<float> values);

inline oracle::Vector exact(const device::float4& v) { return oracle::vector(&v.x); }

}  // namespace clume
