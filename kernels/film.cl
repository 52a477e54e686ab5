// SPDX-License-Identifier: MIT
// Exact sums: samples become 128-bit fixed-point numbers with 64 fraction bits (truncated below), so that any order of
// adding gives the same bits. Samples are non-negative; the host's film_scale brings the scene's radiance near 1.
#include "config.cl"

#if CLUME_CHANNELS == 1
typedef float spectrum;
#define to_spectrum(v) ((v).x)
#define spectrum_max(s) (s)
#define spectrum_sum(s) (s)
#else
typedef float3 spectrum;
#define to_spectrum(v) ((v).xyz)
#define spectrum_max(s) max_s((s).x, max_s((s).y, (s).z))
#define spectrum_sum(s) ((s).x + (s).y + (s).z)
#endif

#if CLUME_LANES || CLUME_POOL
#define FILM_SPACE __global  // a work-item adds to many pixels
#else
#define FILM_SPACE
#endif

/// The 128-bit sum (lo, hi) += (lo, hi).
static void film_add_pair(FILM_SPACE ulong* sum, ulong lo, ulong hi) {
#if CLUME_POOL
    // Others add to it, too: word by word, each addition passing on the carry that it makes, so that in the end all are in.
    volatile __global uint* words = (volatile __global uint*)sum;
    const uint parts[4] = {(uint)lo, (uint)(lo >> 32), (uint)hi, (uint)(hi >> 32)};
    uint carry = 0;
    for (int k = 0; k < 4; ++k) {
        const uint part = parts[k] + carry;
        carry = part < carry ? 1 : 0;
        if (part != 0 && atomic_add(words + k, part) > ~part) carry = 1;
    }
#else
    sum[0] += lo;
    sum[1] += hi + (sum[0] < lo ? 1 : 0);
#endif
}

/// The counter += n.
static void film_count(FILM_SPACE ulong* counter, ulong n) {
#if CLUME_POOL
    volatile __global uint* words = (volatile __global uint*)counter;
    const uint lo = (uint)n, hi = (uint)(n >> 32);
    const uint carry = lo != 0 && atomic_add(words, lo) > ~lo ? 1 : 0;
    if (hi + carry != 0) atomic_add(words + 1, hi + carry);
#else
    *counter += n;
#endif
}

/// (lo, hi) += x, for 0 <= x < 2^61.
static void film_add(FILM_SPACE ulong* sum, float x) {
    const uint bits = as_uint(x);
    const int exponent = (int)(bits >> 23);
    const ulong mantissa = (ulong)((bits & 0x7fffffu) | 0x800000u);
    const int shift = exponent - 86;  // 127 + 23 − 64
    ulong lo, hi;
    if (shift < 0) {
        lo = shift > -24 ? mantissa >> -shift : 0;
        hi = 0;
    } else if (shift < 64) {
        lo = mantissa << shift;
        hi = shift > 40 ? mantissa >> (64 - shift) : 0;
    } else {
        lo = 0;
        hi = mantissa << (shift - 64);
    }
    film_add_pair(sum, lo, hi);
}

/// Adds one sample: per channel x and x². A sample that is not finite (or beyond 2^30) is counted and adds nothing.
static void film_sample(FILM_SPACE ulong* sums, spectrum radiance, float scale) {
    const float total = spectrum_sum(radiance) * scale;
    if (total == 0.0f) return;
    if (!(total > 0.0f && total < 0x1p30f)) {
        film_count(sums + FILM_NONFINITE, 1);
        return;
    }
#if CLUME_CHANNELS == 1
    const float x = radiance * scale;
    film_add(sums, x);
    film_add(sums + 2, x * x);
#else
    const float x[3] = {radiance.x * scale, radiance.y * scale, radiance.z * scale};
    for (int c = 0; c < 3; ++c) {
        if (!(x[c] > 0x1p-100f)) continue;
        film_add(sums + 4 * c, x[c]);
        film_add(sums + 4 * c + 2, x[c] * x[c]);
    }
#endif
}
