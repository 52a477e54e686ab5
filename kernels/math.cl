// SPDX-License-Identifier: MIT
// Elementary functions made of +, −, ×, fma and integer operations only, so that every conforming device gives the same
// bits: names end in _s for one float and in _v for a vector of CLUME_WIDTH. See math_body.inc.cl for domains and errors.
#include "config.cl"

#include "scalar.inc.cl"
#include "math_body.inc.cl"
#include "body_end.inc.cl"
#include "vector.inc.cl"
#include "math_body.inc.cl"
#include "body_end.inc.cl"

static float clamp_s(float x, float lo, float hi) { return min_s(max_s(x, lo), hi); }
static float dot_s(float3 a, float3 b) { return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z)); }
static float3 cross_s(float3 a, float3 b) {
    return (float3)(fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x)));
}
static float3 along_s(float3 o, float3 d, float t) {
    return (float3)(fma(t, d.x, o.x), fma(t, d.y, o.y), fma(t, d.z, o.z));
}
/// v / |v|, for 1e-12 < |v| < 1e12; of each component, error < 1.5e-7 absolute.
static float3 normalize_s(float3 v) {
    const float s = rsqrt_s(dot_s(v, v));
    return v * s;
}

/// asin(x) for |x| <= 1, error < 3e-7 relative.
static float asin_s(float x) {
    const float a = fabs(x);
    const int big = a > 0.5f;
    const float z = big ? 0.5f * (1.0f - a) : a * a;
    const float r = big ? sqrt_s(z) : a;
    const float q = fma(z, fma(z, fma(z, fma(z, 4.263563517e-2f, 2.385817372e-2f), 4.555018440e-2f), 7.494434768e-2f), 1.666679011e-1f);
    const float p = fma(r * z, q, r);
    return copysign(big ? fma(-2.0f, p, -4.37113883e-8f) + 1.57079637f : p, x);
}

/// Angle of (x, y) from +x in (−π, π], error < 3e-7 absolute; 0 for the origin.
static float atan2_s(float y, float x) {
    const float ax = fabs(x), ay = fabs(y);
    const float hi = max_s(ax, ay), lo = min_s(ax, ay);
    const float q = hi > 0.0f ? divide_s(lo, hi) : 0.0f;
    const float z = q * q;
    float p = fma(z, fma(z, 2.849878011e-3f, -1.606858262e-2f), 4.269144415e-2f);
    p = fma(z, fma(z, fma(z, p, -7.504288202e-2f), 1.064093107e-1f), -1.420364372e-1f);
    p = q * fma(z, fma(z, fma(z, p, 1.999261930e-1f), -3.333307334e-1f), 1.0f);
    p = ay > ax ? 1.57079633f - p : p;
    p = x < 0.0f ? 3.14159265f - p : p;
    return y < 0.0f ? -p : p;
}



/// acos(c) for |c| <= 1; error < 6e-7 absolute.
static float acos_s(float c) { return 1.57079633f - asin_s(c); }
