// SPDX-License-Identifier: MIT
// Entry points that only the benchmarks have: the renderer's building blocks in loops over arrays that stay in the cache, one
// float left per work-item, beside the implementation's own functions; and rays whose every evaluation is tallied.
#define CLUME_POOL 0  // a pixel's sums are a work-item's own
#include "ellipsoid.cl"

// In a program that counts, a word of `raised` goes up at each call (intersect, density, depth, inverse; then groups of 16
// active chords summed for depth and for density): how often vectors are evaluated depends on the lanes that are hit.
#if CLUME_COUNT && defined(CLUME_TALLY)
#define TALLY(k, n) atomic_add(raised + CLUME_TALLY + (k), (uint)(n))
#define intersect(part, o, d, e2, chord) (TALLY(0, 1), intersect(part, o, d, e2, chord))
#define density_part(part, p, family, e2) (TALLY(1, 1), density_part(part, p, family, e2))
#define depth_part(chord, sigma, t0, t1, family, e2) (TALLY(2, 1), depth_part(chord, sigma, t0, t1, family, e2))
#define flight_part(chord, sigma, t, tau, family, e2) (TALLY(3, 1), flight_part(chord, sigma, t, tau, family, e2))
#endif
#include "medium.cl"
#undef density_part
#undef depth_part
#include "chords.cl"
#ifdef TALLY
#define active_sum(a, density, t0, t1) (TALLY(4 + (density), ((a)->count + 15) / 16), active_sum(a, density, t0, t1))
#endif
#include "strategy_regular.cl"
#undef active_sum
#undef intersect
#undef flight_part
#include "path.cl"
#include "lanes.cl"

/// Four words to draw from, cheaper than anything that is measured with them.
static uint4 cheap_bits(uint i, uint k) {
    const uint x = (i * 64u + k) * 0x9E3779B9u;
    return (uint4)(x, x * 0x85EBCA6Bu, x ^ 0x27D4EB2Fu, x * 0xC2B2AE35u);
}

static vfloat sine_of_turns(vfloat x) {
    vfloat cosine;
    return sincos_turns_v(x, &cosine);
}
static vfloat cosine_of_turns(vfloat x) {
    vfloat cosine;
    sincos_turns_v(x, &cosine);
    return cosine;
}

// Elementary functions: `vectors` pairs of vectors x, y, one after the other.
#define MATH(name, type, width, load, call)                                                                    \
    __kernel void name(__global const float* in, __global float* out, uint count, uint vectors) {             \
        const uint i = (uint)get_global_id(0);                                                                 \
        if (i >= count) return;                                                                                \
        type sum = (type)0.0f;                                                                                 \
        for (uint k = 0; k < vectors; ++k) {                                                                   \
            const type x = load(in + 2 * width * k), y = load(in + 2 * width * k + width);                     \
            (void)y;                                                                                           \
            sum += call;                                                                                       \
        }                                                                                                      \
        float total = 0.0f;                                                                                    \
        for (int lane = 0; lane < width; ++lane) total += ((const float*)&sum)[lane];                          \
        out[i] = total;                                                                                        \
    }
#define LOAD_SCALAR(p) (*(p))
#define MATH_V(name, own, built_in)                            \
    MATH(own_##name, vfloat, CLUME_WIDTH, vload_row, own)      \
    MATH(built_in_##name, vfloat, CLUME_WIDTH, vload_row, built_in)
#define MATH_S(name, own, built_in)                      \
    MATH(own_##name, float, 1, LOAD_SCALAR, own)         \
    MATH(built_in_##name, float, 1, LOAD_SCALAR, built_in)
#if CLUME_WIDTH == 1
#define convert_vfloat(x) convert_float(x)
#else
#define convert_vfloat(x) CONCAT(convert_float, CLUME_WIDTH)(x)
#endif
MATH_V(rcp, rcp_v(x), 1.0f / x)
MATH_V(divide, divide_v(x, y), x / y)
MATH_V(rsqrt, rsqrt_v(x), rsqrt(x))
MATH_V(sqrt, sqrt_v(x), sqrt(x))
MATH_V(exp, exp_v(x), exp(x))
MATH_V(log, log_v(x), log(x))
MATH_V(exponential, exponential_v(as_vuint(x)), -log((convert_vfloat(as_vuint(x)) + 0.5f) * 0x1p-32f))
MATH_V(erfc, erfc_v(x), erfc(x))
MATH_V(erf_between, erf_between(x, y, y - x), erf(y) - erf(x))
MATH_V(from_uint, from_uint_v(as_vuint(x)), convert_vfloat(as_vuint(x)))
MATH_V(uniform, uniform_v(as_vuint(x)), (convert_vfloat(as_vuint(x)) + 0.5f) * 0x1p-32f)
MATH_V(sin, sine_of_turns(x), sinpi(2.0f * x))
MATH_V(cos, cosine_of_turns(x), cospi(2.0f * x))
MATH(own_erfc_inverse, vfloat, CLUME_WIDTH, vload_row, erfc_inverse_v(x))
MATH(own_epanechnikov_inverse, vfloat, CLUME_WIDTH, vload_row, epanechnikov_inverse_v(x))
MATH_S(asin, asin_s(x), asin(x))
MATH_S(acos, acos_s(x), acos(x))
MATH_S(atan2, atan2_s(x, y), atan2(x, y))
MATH_S(normalize, normalize_s((float3)(x, y, y)).x, normalize((float3)(x, y, y)).x)

static vuint lane_numbers(uint first) {
    vuint numbers;
    for (int lane = 0; lane < CLUME_WIDTH; ++lane) ((uint*)&numbers)[lane] = first + (uint)lane;
    return numbers;
}

static float lanes_folded(vuint x) {
    uint total = 0;
    for (int lane = 0; lane < CLUME_WIDTH; ++lane) total ^= ((const uint*)&x)[lane];
    return (float)total;
}

/// Draws of four random words by CLUME_WIDTH paths at a time.
__kernel void random_draw(__global float* out, uint count, uint rounds) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const vuint pixel = lane_numbers(i * CLUME_WIDTH);
    vuint sum = (vuint)0u;
    for (uint k = 0; k < rounds; ++k) {
        vuint x, y, z, w;
        draw_v(pixel + (vuint)k, pixel, pixel >> (vuint)1u, (vuint)k, (uint2)(3u, 5u), &x, &y, &z, &w);
        sum += x ^ y ^ z ^ w;
    }
    out[i] = lanes_folded(sum);
}

/// Words of CLUME_WIDTH primitives at a time.
__kernel void random_primitive_bits(__global float* out, uint count, uint rounds) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const vuint id = lane_numbers(0);
    vuint sum = (vuint)0u;
    for (uint k = 0; k < rounds; ++k) sum += primitive_bits(id + (vuint)(k * CLUME_WIDTH), (uint2)(i, 5u));
    out[i] = lanes_folded(sum);
}

// Phase functions: directions sampled about those given, or values at versines between 0 and 2.
#define PHASE(name, kind)                                                                                                     \
    __kernel void phase_sample_##name(__global const float4* directions, __global float* out, uint count, uint rounds, float g) { \
        const uint i = (uint)get_global_id(0);                                                                                \
        if (i >= count) return;                                                                                               \
        float sum = 0.0f, pdf;                                                                                                \
        for (uint k = 0; k < rounds; ++k) {                                                                                   \
            const float3 s = phase_sample(kind, g, directions[k].xyz, cheap_bits(i, k), &pdf);                                \
            sum += s.x + s.y + s.z + pdf;                                                                                     \
        }                                                                                                                     \
        out[i] = sum;                                                                                                         \
    }                                                                                                                         \
    __kernel void phase_value_##name(__global const float4* directions, __global float* out, uint count, uint rounds, float g) { \
        const uint i = (uint)get_global_id(0);                                                                                \
        if (i >= count) return;                                                                                               \
        float sum = 0.0f;                                                                                                     \
        for (uint k = 0; k < rounds; ++k) sum += phase_value_s(kind, g, 1.0f + directions[k].x);                                \
        out[i] = sum;                                                                                                         \
    }
PHASE(isotropic, PHASE_ISOTROPIC)
PHASE(henyey_greenstein, PHASE_HENYEY_GREENSTEIN)
PHASE(rayleigh, PHASE_RAYLEIGH)

#if CLUME_NEE
/// Next-event samples from points in the media.
__kernel void light_samples(SCENE_ARGS, __global const float4* points, __global float* out, uint count, uint rounds) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    float sum = 0.0f;
    for (uint k = 0; k < rounds; ++k) {
        LightSample s;
        const uint4 bits = cheap_bits(i, k);
        if (light_sample(points[k].xyz, bits, bits.wzyx, &s, params, lights, texels, alias)) sum += s.direction.x + s.pdf + spectrum_sum(s.value);
    }
    out[i] = sum;
}
#endif

/// Radiance that scattered rays find when they escape.
__kernel void environment_lookups(SCENE_ARGS, __global const float4* directions, __global float* out, uint count, uint rounds) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    float sum = 0.0f;
    for (uint k = 0; k < rounds; ++k) sum += spectrum_sum(environment_radiance(directions[k].xyz, 0.1f, false, params, lights, texels, alias));
    out[i] = sum;
}

#if !CLUME_LANES  // which add to sums in global memory
/// Samples added to the sums of one pixel.
__kernel void film_samples(__global const float4* colours, __global float* out, uint count, uint rounds) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    ulong sums[FILM_WORDS];
    for (int k = 0; k < FILM_WORDS; ++k) sums[k] = 0;
    for (uint k = 0; k < rounds; ++k) film_sample(sums, to_spectrum(fabs(colours[k])), 1.0f);
    ulong total = 0;
    for (int k = 0; k < FILM_WORDS; ++k) total ^= sums[k];
    out[i] = (float)total;
}
#endif

/// Every ray against the boxes of `rounds` nodes of the bvh.
__kernel void node_tests(SCENE_ARGS, __global const float4* rays, __global float* out, uint count, uint rounds, uint ray_count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[2 * (i % ray_count)].xyz, inverse = ray_inverse(rays[2 * (i % ray_count) + 1].xyz);
    float8 sum = (float8)0.0f;
    for (uint k = 0; k < rounds; ++k) sum += bvh_test(nodes + k, o, inverse, 0.0f, CLUME_INFINITY);
    const float4 s = sum.lo + sum.hi;
    out[i] = s.x + s.y + s.z + s.w;
}

// Every ray against `rounds` leaves of the bvh: the earliest collision in each, or its optical depth.
__kernel void leaf_decompose(SCENE_ARGS, __global const float4* rays, __global float* out, uint count, uint rounds, uint ray_count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[2 * (i % ray_count)].xyz, d = rays[2 * (i % ray_count) + 1].xyz;
    float sum = 0.0f;
    for (uint g = 0; g < rounds; ++g) {
        float best = CLUME_INFINITY;
        uint primitive = CLUME_NO_PRIMITIVE;
        group_decompose(g, o, d, 0.0f, -CLUME_INFINITY, CLUME_INFINITY, (uint2)(i, g), &best, &primitive, SCENE);
        sum += min_s(best, 1.0f);
    }
    out[i] = sum;
}
__kernel void leaf_depth(SCENE_ARGS, __global const float4* rays, __global float* out, uint count, uint rounds, uint ray_count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[2 * (i % ray_count)].xyz, d = rays[2 * (i % ray_count) + 1].xyz;
    ulong sum = 0;
    for (uint g = 0; g < rounds; ++g) sum += group_depth(g, o, d, 0.0f, CLUME_INFINITY, -CLUME_INFINITY, CLUME_INFINITY, SCENE);
    out[i] = (float)sum;
}

// Ray i's whole walk through an accelerator, with nothing done in the leaves: how many of them (or cells) it met.
__kernel void walk_bvh(SCENE_ARGS, __global const float4* rays, __global float* out, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[2 * i].xyz, d = rays[2 * i + 1].xyz, inverse = ray_inverse(d);
    uint stack[CLUME_BVH_STACK];
    BvhWalk w;
    Work work;
    work_clear(&work);
    float met = 0.0f;
    bvh_begin(&w, stack);
    while (bvh_next(&w, stack, o, inverse, 0.0f, CLUME_INFINITY, &work, nodes) != BVH_NONE) met += 1.0f;
#if CLUME_COUNT
    met = (float)work.n[WORK_NODES];
#endif
    out[i] = met;
}
__kernel void walk_cells(SCENE_ARGS, __global const float4* rays, __global float* out, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    CellWalk w;
    float met = 0.0f;
    if (cells_enter(&w, rays[2 * i].xyz, rays[2 * i + 1].xyz, 0.0f, CLUME_INFINITY, params, cells)) do met += 1.0f;
        while (cells_next(&w, CLUME_CELL_LEVELS, cells));
    out[i] = met;
}

/// Ray i's chords gathered once, its segments walked `rounds` times as `regular` does when nothing is drawn. out, per ray: x
/// segments, y sums over 16 active chords, z active chords of all segments, w optical depth.
__kernel void walk_segments(SCENE_ARGS, __global const float4* rays, __global float4* out, uint count, uint rounds) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    Gathering all;
    Chords active;
    Work work;
    work_clear(&work);
    gather(&all, rays[2 * i].xyz, rays[2 * i + 1].xyz, 0.0f, CLUME_INFINITY, &work, SCENE);
    float4 sum = (float4)0.0f;
    for (uint round = 0; round < rounds; ++round) {
        float t = 0.0f;
        int next = 0;
        active.count = 0;
        while (t < all.window) {
            float end;
            if (!segment_begin(&all, &active, &next, &t, &end)) continue;
            sum += (float4)(1.0f, (float)((active.count + 15) / 16), (float)active.count, active_sum(&active, 0, t, end));
            t = end;
            active_expire(&active, t);
        }
    }
    out[i] = sum;
}

#if CLUME_COUNT
/// Operations by kind of ray i's flight (what 1) or of its transmittance by the program's estimator (what 8); draws as in probe_ray.
__kernel void count_ray(SCENE_ARGS, __global const float4* rays, __global ulong* work, uint count, uint what) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[2 * i].xyz, d = rays[2 * i + 1].xyz;
    const float t_end = rays[2 * i].w;
    const Draws draws = {0, i, 1, (uint2)(params->seed_lo, params->seed_hi)};
    Flight f;
    flight_clear(&f);
    if (what & 1u) flight_to_end(o, d, t_end, &f, &draws, SCENE);
    // The estimate is kept where no count is: a compiler may not leave it out.
    const float estimate = what & 8u ? transmittance_estimate(o, d, t_end, draw_bits(&draws, 1).x, &draws, &f, SCENE) : 1.0f;
    for (int k = 0; k < WORK_KINDS; ++k) work[(WORK_KINDS + 1) * (size_t)i + (size_t)k] = f.work.n[k];
    work[(WORK_KINDS + 1) * (size_t)i + WORK_KINDS] = as_uint(estimate);
}
#endif
