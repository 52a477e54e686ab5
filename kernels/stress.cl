// SPDX-License-Identifier: MIT
// Entry points of `clume stress` that no other program has: samplers one at a time with their random bits given, and the
// textbook's formulas, which stand here to be measured beside the kernels' own and are used nowhere else.
#include "path.cl"

/// Depth from start to stop by erf(u1) − erf(u0), and t of the flight from start by inversion of the depth counted from t = 0;
/// u = w t + s0 along the line, d2 its squared whitened distance, h = sqrt(e2 − d2).
static float2 naive_depth_flight(uint family, float e2, float sigma, float w, float d2, float h, float s0, float start, float stop, float t_out, float tau) {
    const float u0 = w * start + s0, u1 = w * stop + s0;
    float depth = 0.0f, flight = CLUME_INFINITY;
    if (family == FAMILY_UNIFORM) {
        depth = divide_s(sigma * (u1 - u0), w);
        flight = divide_s(tau + sigma * start, sigma);
    } else if (family == FAMILY_GAUSSIAN) {
        const float x0 = 0.707106781f * u0, x1 = 0.707106781f * u1, xt = 0.707106781f * s0;
        const float f0 = copysign(1.0f - erfc_s(fabs(x0)), x0), f1 = copysign(1.0f - erfc_s(fabs(x1)), x1), ft = copysign(1.0f - erfc_s(fabs(xt)), xt);
        const float c = divide_s(1.25331414f * sigma * exp_s(-0.5f * d2), w);
        depth = c * (f1 - f0);
        const float whole = c * (f0 - ft) + tau;  // from t = 0 on
        const float target = ft + divide_s(whole, max_s(c, 0x1p-90f));
        if (target < 1.0f && target > -1.0f) {
            const float u = 1.41421356f * copysign(erfc_inverse_s(1.0f - fabs(target)), target);
            flight = divide_s(u - s0, w);
        }
    } else {
        const float v0 = divide_s(u0, h), v1 = divide_s(u1, h), vt = divide_s(s0, h);
        const float a = divide_s(sigma * h * h * h, w * e2);
        depth = a * ((v1 - v1 * v1 * v1 * 0.333333333f) - (v0 - v0 * v0 * v0 * 0.333333333f));
        const float zero = vt - vt * vt * vt * 0.333333333f;
        const float whole = a * ((v0 - v0 * v0 * v0 * 0.333333333f) - zero) + tau;
        const float q = 1.5f * (zero + divide_s(whole, max_s(a, 0x1p-90f)));
        if (q < 1.0f && q > -1.0f) {
            float cosine;
            const float v = 2.0f * sincos_turns_s(fabs(asin_s(q)) * (CLUME_INV_2PI / 3.0f), &cosine);
            flight = divide_s(h * copysign(v, q) - s0, w);
        }
    }
    return (float2)(depth, flight <= t_out ? flight : CLUME_INFINITY);
}

/// c − b²/a for the chord, and depth and flight in that geometry. Rays, groups and output as in probe_group.
__kernel void stress_naive(__global const float* groups, __global const float4* rays, __global float* out, uint count, uint family, float e2) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[3 * i].xyz, d = rays[3 * i + 1].xyz;
    const float t0 = rays[3 * i].w, t1 = rays[3 * i + 1].w, tau = rays[3 * i + 2].x;
    __global const float* row = groups + (size_t)i * CLUME_GROUP_FLOATS;  // its first primitive alone
    __global float* to = out + (size_t)i * 6 * 16;
    const float x = o.x - row[0], y = o.y - row[16], z = o.z - row[32];
    const float w00 = row[48], w01 = row[64], w02 = row[80], w11 = row[96], w12 = row[112], w22 = row[128];
    const float a0 = w00 * x + w01 * y + w02 * z, a1 = w11 * y + w12 * z, a2 = w22 * z;
    const float b0 = w00 * d.x + w01 * d.y + w02 * d.z, b1 = w11 * d.y + w12 * d.z, b2 = w22 * d.z;
    const float bb = b0 * b0 + b1 * b1 + b2 * b2, ab = a0 * b0 + a1 * b1 + a2 * b2, aa = a0 * a0 + a1 * a1 + a2 * a2;
    const float w = sqrt_s(bb), d2 = aa - divide_s(ab * ab, bb);  // the difference that cancels
    const int hit = d2 < e2;
    const float h = sqrt_s(hit ? e2 - d2 : 0.0f);
    const float t_in = divide_s(-ab - h * w, bb), t_out = divide_s(-ab + h * w, bb);
    const float start = max_s(t_in, t0), stop = min_s(t_out, t1);
    float2 r = (float2)(0.0f, CLUME_INFINITY);
    if (hit && start < stop) r = naive_depth_flight(family, e2, row[16 * CLUME_ROW_SIGMA], w, d2, h, divide_s(ab, w), start, stop, t_out, tau);
    to[0] = d2;
    to[16] = hit ? t_in : CLUME_INFINITY;
    to[32] = hit ? t_out : CLUME_INFINITY;
    to[48] = 0.0f;
    to[64] = r.x;
    to[80] = r.y;
}

/// Depth and flight with the geometry that they are made from, for each group's first primitive: out (t_perp, w, d2, whether there
/// is a part of the chord between t0 and t1), that part and its depth, the flight from its start; the textbook's depth and flight
/// in the same geometry, unused.
__kernel void stress_given(__global const float* groups, __global const float4* rays, __global float4* out, uint count, uint family, float e2) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float t0 = rays[3 * i].w, t1 = rays[3 * i + 1].w, tau = rays[3 * i + 2].x;
    __global const float* part = groups + (size_t)i * CLUME_GROUP_FLOATS;
    Chord c;
    const vint hit = intersect(part, rays[3 * i].xyz, rays[3 * i + 1].xyz, e2, &c);
    const vfloat start = vselect(c.t_in, (vfloat)t0, c.t_in < (vfloat)t0), stop = vselect(c.t_out, (vfloat)t1, c.t_out > (vfloat)t1);
    const vint inside = hit & (start < stop);
    const vfloat sigma = vload_row(part + 16 * CLUME_ROW_SIGMA);
    const vfloat depth = depth_part(&c, sigma, start, vselect(start, stop, inside), family, (vfloat)e2), flight = flight_part(&c, sigma, start, (vfloat)tau, family, (vfloat)e2);
#define FIRST(v) (((const float*)&(v))[0])
    const float t_perp = FIRST(c.t_perp), w = FIRST(c.w), d2 = FIRST(c.d2), from = FIRST(start), to = FIRST(stop);
    const bool has = ((const int*)&inside)[0] != 0;
    float2 naive = (float2)(0.0f, CLUME_INFINITY);
    if (has) naive = naive_depth_flight(family, e2, FIRST(sigma), w, d2, FIRST(c.h), -(w * t_perp), from, to, FIRST(c.t_out), tau);
    out[3 * i] = (float4)(t_perp, w, d2, has ? 1.0f : 0.0f);
    out[3 * i + 1] = (float4)(from, to, FIRST(depth), FIRST(flight));
    out[3 * i + 2] = (float4)(naive, 0.0f, 0.0f);
#undef FIRST
}

/// Phase function and its sampling: in: direction and g; versine to evaluate at; bits. Out: direction and its pdf; the value there.
__kernel void stress_phase(__global const float4* d_g, __global const float* versine, __global const uint4* bits, __global float4* out, __global float* value, uint count, uint kind) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    float pdf;
    const float3 s = phase_sample(kind, d_g[i].w, d_g[i].xyz, bits[i], &pdf);
    out[i] = (float4)(s, pdf);
    value[i] = phase_value_s(kind, d_g[i].w, versine[i]);
}

/// Camera rays through film points: in: x, y (as_uint), u, v; out as probe_ray takes them.
__kernel void stress_camera(SCENE_ARGS, __global const float4* points, __global float4* rays, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    float3 o, d;
    camera_ray(params, as_uint(points[i].x), as_uint(points[i].y), points[i].z, points[i].w, &o, &d);
    rays[2 * i] = (float4)(o, CLUME_INFINITY);
    rays[2 * i + 1] = (float4)(d, 0.0f);
}

/// Light samples: in: points, two words of bits; out: direction and distance; first channel of the value, pdf, whether there is one.
__kernel void stress_light(SCENE_ARGS, __global const float4* points, __global const uint4* bits, __global float4* out, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    LightSample s;
    const bool lit = light_sample(points[i].xyz, bits[2 * i], bits[2 * i + 1], &s, params, lights, texels, alias);
    out[2 * i] = lit ? (float4)(s.direction, s.distance) : (float4)0.0f;
    out[2 * i + 1] = lit ? (float4)(((const float*)&s.value)[0], s.pdf, 1.0f, 0.0f) : (float4)0.0f;
}

/// Samples of light 0, an environment image, and look-ups: in: two words of bits, a direction; out: direction sampled and its pdf;
/// the value's first channel; texels sampled, found along that direction, found along the one given.
__kernel void stress_environment(SCENE_ARGS, __global const uint4* bits, __global const float4* directions, __global float4* samples, __global float* values, __global uint4* found, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    LightSample s;
    uint texel;
    envmap_sample(0, bits[2 * i], bits[2 * i + 1], &texel, lights, alias);
    light_sample((float3)(0.0f, 0.0f, 0.0f), bits[2 * i], bits[2 * i + 1], &s, params, lights, texels, alias);
    samples[i] = (float4)(s.direction, s.pdf);
    values[i] = ((const float*)&s.value)[0];
    found[i] = (uint4)(texel, envmap_texel(0, s.direction, lights), envmap_texel(0, directions[i].xyz, lights), 0);
}

/// Exact transmittance of a ray's mixture, no roulette: the fixed-point sum of optical depths.
__kernel void stress_transmittance(SCENE_ARGS, __global const float4* rays, __global float* out, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    Work work;
    work_clear(&work);
    out[i] = transmittance_analytic(rays[2 * i].xyz, rays[2 * i + 1].xyz, rays[2 * i].w, transmittance_limit(CLUME_INFINITY), &work, SCENE);
}
