// SPDX-License-Identifier: MIT
// Phase functions, as threes of map, pdf and value; all are normalised over solid angle, so value = pdf [1/sr].
// c is the cosine between the directions of flight before and after. Bits that a map uses: all four words at most.
#include "rng.cl"

/// A unit vector with cosine c and sine s to unit d and azimuth `turn` in (0, 1) [Duff17, Building an orthonormal basis,
/// revisited]. The sine comes apart: 1 − c² knows no angle below 3e-4.
static float3 around(float3 d, float c, float s, float turn) {
    const float2 phi = sincos_turns_s(turn);
    const float sign = copysign(1.0f, d.z);
    const float a = -rcp_s(sign + d.z), b = d.x * d.y * a;
    const float3 u = (float3)(fma(sign * d.x * d.x, a, 1.0f), sign * b, -sign * d.x);
    const float3 v = (float3)(b, fma(d.y * d.y, a, sign), -d.y);
    return normalize_s(c * d + (s * phi.y) * u + (s * phi.x) * v);
}

/// Uniform over the sphere, pdf 1/4π.
static float3 sphere_uniform(float u, float turn) {
    const float z = fma(-2.0f, u, 1.0f);
    const float s = 2.0f * sqrt_s(max_s(u * (1.0f - u), 0.0f));
    const float2 phi = sincos_turns_s(turn);
    return (float3)(s * phi.y, s * phi.x, z);
}

/// 1 − c (1 + c if g < 0) for the directions of flight before and after: what `phase_value` peaks at, to all its digits.
static float phase_versine(float g, float3 before, float3 after) {
    const float3 v = g < 0.0f ? after + before : after - before;
    return 0.5f * dot_s(v, v);
}

/// Density [1/sr] at `versine`, which phase_versine gives; error < 1e-6 relative.
static float phase_value(uint kind, float g, float versine) {
#if CLUME_PHASES & PHASE_HENYEY_GREENSTEIN
    if (kind == PHASE_HENYEY_GREENSTEIN) {
        // 1 + g² − 2 g c as a sum of what does not cancel: (1 − |g|)² + 2 |g| (1 ∓ c).
        const float a = fabs(g), q = fma(2.0f * a, versine, (1.0f - a) * (1.0f - a));
        const float r = rsqrt_s(q);
        return CLUME_INV_4PI * (1.0f - a) * (1.0f + a) * r * r * r;
    }
#endif
#if CLUME_PHASES & PHASE_RAYLEIGH
    if (kind == PHASE_RAYLEIGH) return 0.75f * CLUME_INV_4PI * fma(1.0f - versine, 1.0f - versine, 1.0f);
#endif
    return CLUME_INV_4PI;
}

/// Direction after scattering, direction error < 5e-7 absolute; *pdf is its density, pdf error < 2e-6 relative.
static float3 phase_sample(uint kind, float g, float3 d, uint4 bits, float* pdf) {
    const float turn = uniform_s(bits.y);
#if CLUME_PHASES & PHASE_HENYEY_GREENSTEIN
    if (kind == PHASE_HENYEY_GREENSTEIN) {
        // The usual inversion, for 1 − c and 1 + c apart and without its division by g: products of positive factors, so that
        // neither loses digits in a peak, nor as g goes to 0.
        const float u = uniform_s(bits.x), rest = 1.0f - u;
        const float inverse = rcp_s(g < 0.0f ? fma(-2.0f * g, rest, 1.0f + g) : fma(2.0f * g, u, 1.0f - g));
        const float back = (1.0f - g) * inverse, forth = (1.0f + g) * inverse;
        const float versine = 2.0f * back * back * rest * fma(-g, rest, 1.0f + g), other = 2.0f * forth * forth * u * fma(g, u, 1.0f - g);
        *pdf = phase_value(kind, g, g < 0.0f ? other : versine);
        return around(d, versine < 1.0f ? 1.0f - versine : other - 1.0f, sqrt_s(versine * other), turn);
    }
#endif
#if CLUME_PHASES & PHASE_RAYLEIGH
    if (kind == PHASE_RAYLEIGH) {
        // 3/8 (1 + c²): three quarters uniform, one quarter 3/2 c², whose |c| is the largest of three uniforms.
        const float u = uniform_s(bits.x << 3);
        const float largest = max_s(u, max_s(uniform_s(bits.z), uniform_s(bits.w)));
        const bool uniform = (bits.x >> 30) != 0u;
        const float c = uniform ? fma(2.0f, u, -1.0f) : ((bits.x & 0x20000000u) ? largest : -largest);
        const float s = sqrt_s(uniform ? 4.0f * u * (1.0f - u) : (1.0f - largest) * (1.0f + largest));
        *pdf = phase_value(kind, g, 1.0f - c);
        return around(d, c, s, turn);
    }
#endif
    *pdf = CLUME_INV_4PI;
    return sphere_uniform(uniform_s(bits.x), turn);
}
