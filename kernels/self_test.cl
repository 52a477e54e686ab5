// SPDX-License-Identifier: MIT
// The entry points of the self-test that a device passes before it renders: its arithmetic and the elementary functions.
// A small program of its own, since it is built at every start.
#include "ellipsoid.cl"

/// Which arithmetic the device has: out[k] is compared with what one arithmetic gives (src/self_test.cpp).
__kernel void probe_arithmetic(__global const float* in, __global uint* out) {
    if (get_global_id(0) != 0) return;
    const float a = in[0], b = in[1], c = in[2], tiny = in[3];
    out[0] = as_uint(a * b + c);  // contracted: not 0
    out[1] = as_uint(fma(a, b, c));
    const vfloat va = (vfloat)a, vb = (vfloat)b, vc = (vfloat)c;
    const vfloat product = va * vb + vc, fused = fma(va, vb, vc);
    out[2] = as_uint(((const float*)&product)[0]);
    out[3] = as_uint(((const float*)&fused)[0]);
    out[4] = as_uint(convert_float_rte((ulong)as_uint(in[4]) << 20));
    out[5] = (uint)convert_ulong_rtz(in[5]);
    out[6] = as_uint(rint(in[6]));
    out[7] = as_uint(tiny * 0.5f);  // a denormal, or 0 where they are flushed (both are allowed, nothing here depends on it)
}

/// out[i] = philox of (i, 0, 0, 0) under (seed, 0): integers, so that what comes back is right or wrong to the bit.
__kernel void probe_words(__global uint4* out, uint count, uint seed) {
    const uint i = (uint)get_global_id(0);
    if (i < count) out[i] = philox((uint4)(i, 0, 0, 0), (uint2)(seed, 0));
}

#define PROBE_RCP 0
#define PROBE_DIVIDE 1
#define PROBE_RSQRT 2
#define PROBE_SQRT 3
#define PROBE_EXP 4
#define PROBE_LOG 5
#define PROBE_EXPONENTIAL 6
#define PROBE_ERFC 7
#define PROBE_ERFC_INVERSE 8
#define PROBE_EPANECHNIKOV_INVERSE 9
#define PROBE_ASIN 10
#define PROBE_ATAN2 11
#define PROBE_SIN_TURNS 12
#define PROBE_COS_TURNS 13
#define PROBE_ERF_BETWEEN 14
#define PROBE_UNIFORM 15
#define PROBE_ACOS 16
#define PROBE_FROM_UINT 17
#define PROBE_NORMALIZE_X 18

/// out[i] = f(x[i], y[i]), f by number; work-item k does CLUME_WIDTH of them. Scalar-only functions run lane by lane.
__kernel void probe_math(__global const float* x, __global const float* y, __global float* out, uint count, uint function) {
    const uint first = (uint)get_global_id(0) * CLUME_WIDTH;
    if (first >= count) return;
    const vfloat a = vload_row(x + first), b = vload_row(y + first);
    vfloat r = (vfloat)0.0f;
    switch (function) {
        case PROBE_RCP: r = rcp_v(a); break;
        case PROBE_DIVIDE: r = divide_v(a, b); break;
        case PROBE_RSQRT: r = rsqrt_v(a); break;
        case PROBE_SQRT: r = sqrt_v(a); break;
        case PROBE_EXP: r = exp_v(a); break;
        case PROBE_LOG: r = log_v(a); break;
        case PROBE_EXPONENTIAL: r = exponential_v(as_vuint(a)); break;
        case PROBE_ERFC: r = erfc_v(a); break;
        case PROBE_ERFC_INVERSE: r = erfc_inverse_v(a); break;
        case PROBE_EPANECHNIKOV_INVERSE: r = epanechnikov_inverse_v(a); break;
        case PROBE_ERF_BETWEEN: r = erf_between(a, b, b - a); break;
        case PROBE_FROM_UINT: r = from_uint_v(as_vuint(a)); break;
        default: break;
    }
    const float* al = (const float*)&a;
    const float* bl = (const float*)&b;
    float* rl = (float*)&r;
    for (int i = 0; i < CLUME_WIDTH; ++i) {
        float other;
        switch (function) {
            case PROBE_ASIN: rl[i] = asin_s(al[i]); break;
            case PROBE_ATAN2: rl[i] = atan2_s(al[i], bl[i]); break;
            case PROBE_SIN_TURNS: rl[i] = sincos_turns_s(al[i], &other); break;
            case PROBE_COS_TURNS: sincos_turns_s(al[i], &rl[i]); break;
            case PROBE_UNIFORM: rl[i] = uniform_s(as_uint(al[i])); break;
            case PROBE_ACOS: rl[i] = acos_s(al[i]); break;
            case PROBE_NORMALIZE_X: rl[i] = normalize_s((float3)(al[i], bl[i], bl[i])).x; break;
            default: break;
        }
        out[first + i] = rl[i];
    }
}

