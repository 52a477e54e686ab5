// SPDX-License-Identifier: MIT
// Elementary functions made of +, −, ×, fma and integer operations only, so that every conforming device gives the same
// bits: names end in _s for one float and in _v for a vector of CLUME_WIDTH. See math_body.inc.cl for domains and errors.
#include "config.cl"

#define FN(name) name##_s
#define VF float
#define VI int
#define VU uint
#define SEL(a, b, mask) ((mask) ? (b) : (a))
#define ANY(mask) (mask)
#define AS_F(x) as_float(x)
#define AS_I(x) as_int(x)
#define AS_U(x) as_uint(x)
#include "math_body.inc.cl"
#undef FN
#undef VF
#undef VI
#undef VU
#undef SEL
#undef ANY
#undef AS_F
#undef AS_I
#undef AS_U

#define FN(name) name##_v
#define VF vfloat
#define VI vint
#define VU vuint
#define SEL(a, b, mask) vselect(a, b, mask)
#define ANY(mask) vany(mask)
#define AS_F(x) as_vfloat(x)
#define AS_I(x) as_vint(x)
#define AS_U(x) as_vuint(x)
#include "math_body.inc.cl"
#undef FN
#undef VF
#undef VI
#undef VU
#undef SEL
#undef ANY
#undef AS_F
#undef AS_I
#undef AS_U

/// Smaller and larger of two numbers that are not NaN.
static float min_s(float a, float b) { return a < b ? a : b; }
static float max_s(float a, float b) { return a > b ? a : b; }
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

/// sin and cos of 2π x, x in [0, 1]: quarter turns by rint, then Taylor-like minimax on ±1/8 turn; error < 1.5e-7 absolute.
static float2 sincos_turns_s(float x) {
    const float y = 4.0f * x;
    const float k = rint(y);
    const float r = y - k;  // exact, in [-1/2, 1/2], quarter turns
    const float r2 = r * r;
    const float s = r * fma(r2, fma(r2, fma(r2, fma(r2, 1.581950817e-4f, -4.681260631e-3f), 7.969258184e-2f), -6.459640961e-1f), 1.570796327f);
    const float c = fma(r2, fma(r2, fma(r2, fma(r2, 9.033629753e-4f, -2.085993603e-2f), 2.536691826e-1f), -1.233700540f), 1.0f);
    const int q = (int)k & 3;
    const float sn = (q & 1) ? c : s;
    const float cn = (q & 1) ? s : c;
    return (float2)((q & 2) ? -sn : sn, (q == 1 || q == 2) ? -cn : cn);
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
