// SPDX-License-Identifier: MIT
// Phase functions, as threes of map, pdf and value; all are normalised over solid angle, so value = pdf [1/sr].
// c is the cosine between the directions of flight before and after. Bits that a map uses: all four words at most.
#include "rng.cl"

#include "scalar.inc.cl"
#include "phase_body.inc.cl"
#include "body_end.inc.cl"
#include "vector.inc.cl"
#include "phase_body.inc.cl"
#include "body_end.inc.cl"

/// around_s of a direction.
static float3 around(float3 d, float c, float s, float turn) {
    float x = d.x, y = d.y, z = d.z;
    around_s(&x, &y, &z, c, s, turn);
    return (float3)(x, y, z);
}

/// sphere_uniform_s, as a direction.
static float3 sphere_uniform(float u, float turn) {
    float x, y, z;
    sphere_uniform_s(u, turn, &x, &y, &z);
    return (float3)(x, y, z);
}

/// 1 − c (1 + c if g < 0) for the directions of flight before and after: what the phase functions peak at, to all its digits.
static float phase_versine(float g, float3 before, float3 after) {
    const float3 v = g < 0.0f ? after + before : after - before;
    return 0.5f * dot_s(v, v);
}

/// phase_sample_s of a direction.
static float3 phase_sample(uint kind, float g, float3 d, uint4 bits, float* pdf) {
    float x = d.x, y = d.y, z = d.z;
    *pdf = phase_sample_s(kind, g, bits.x, bits.y, bits.z, bits.w, &x, &y, &z);
    return (float3)(x, y, z);
}
