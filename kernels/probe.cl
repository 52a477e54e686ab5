// SPDX-License-Identifier: MIT
// Entry points that run one building block each over arrays: for the tests and the benchmarks.
// The same code as in `render`, under the same defines.
#include "lane_path.cl"
#include "self_test.cl"

/// out[i]: the words of draw counter[i] = (sample, pixel, depth, draw) under one seed, CLUME_WIDTH of them at once.
__kernel void probe_draw(__global const uint4* counter, uint2 seed, __global uint4* out, uint count) {
    const uint first = (uint)get_global_id(0) * CLUME_WIDTH;
    if (first >= count) return;
    vuint c[4], w[4];
    for (uint i = 0; i < CLUME_WIDTH; ++i) {
        const uint4 mine = counter[min(first + i, count - 1u)];
        ((uint*)&c[0])[i] = mine.x;
        ((uint*)&c[1])[i] = mine.y;
        ((uint*)&c[2])[i] = mine.z;
        ((uint*)&c[3])[i] = mine.w;
    }
    draw_v(sample_number_v(c[0]), c[1], c[2], c[3], seed, w, w + 1, w + 2, w + 3);
    for (uint i = 0; i < CLUME_WIDTH && first + i < count; ++i)
        out[first + i] = (uint4)(((const uint*)&w[0])[i], ((const uint*)&w[1])[i], ((const uint*)&w[2])[i], ((const uint*)&w[3])[i]);
}

/// out[i] = philox(counter[i], key[i].xy).
__kernel void probe_philox(__global const uint4* counter, __global const uint4* key, __global uint4* out, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i < count) out[i] = philox(counter[i], key[i].xy);
}

/// Bits per primitive id under a key, ids first + [0, count), count a multiple of CLUME_WIDTH.
__kernel void probe_primitive_bits(uint first, uint2 key, __global uint* out, uint count) {
    const uint base = (uint)get_global_id(0) * CLUME_WIDTH;
    if (base >= count) return;
    vuint id;
    uint* lane = (uint*)&id;
    for (int i = 0; i < CLUME_WIDTH; ++i) lane[i] = first + base + (uint)i;
    const vuint bits = primitive_bits(id, key);
    for (int i = 0; i < CLUME_WIDTH; ++i) out[base + i] = ((const uint*)&bits)[i];
}

/// One ray against one group (16 primitives): per lane d2, t_in, t_out, density at along(o, d, t0), depth between t0 and t1
/// clipped to the chord, and the free flight from t0 for optical depth tau. quadratic != 0: rows hold Σ⁻¹.
/// rays: float4 origin with t0, float4 direction with t1, float4 tau and unused.
__kernel void probe_group(__global const float* groups, __global const float4* rays, __global float* out, uint count, uint family, float e2, uint quadratic) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[3 * i].xyz, d = rays[3 * i + 1].xyz;
    const float t0 = rays[3 * i].w, t1 = rays[3 * i + 1].w, tau = rays[3 * i + 2].x;
    for (int k = 0; k < CLUME_PARTS; ++k) {
        __global const float* part = groups + (size_t)i * CLUME_GROUP_FLOATS + k * CLUME_WIDTH;
        Chord c;
        const vint hit = quadratic ? intersect_quadratic(part, o, d, e2, &c) : intersect(part, o, d, e2, &c);
        const vfloat start = vselect(c.t_in, (vfloat)t0, c.t_in < (vfloat)t0), stop = vselect(c.t_out, (vfloat)t1, c.t_out > (vfloat)t1);
        const vint inside = hit & (start < stop);
        const vfloat sigma = vload_row(part + 16 * CLUME_ROW_SIGMA), none = (vfloat)0.0f;
        vfloat r[6];
        r[0] = c.d2;
        r[1] = vselect((vfloat)CLUME_INFINITY, c.t_in, hit);
        r[2] = vselect((vfloat)CLUME_INFINITY, c.t_out, hit);
        r[3] = density_part(part, along_s(o, d, t0), family, (vfloat)e2);
        r[4] = vselect(none, depth_part(&c, sigma, start, vselect(start, stop, inside), family, (vfloat)e2), inside);
        r[5] = vselect((vfloat)CLUME_INFINITY, flight_part(&c, sigma, start, (vfloat)tau, family, (vfloat)e2), inside);
        for (int q = 0; q < 6; ++q)
            for (int lane = 0; lane < CLUME_WIDTH; ++lane) out[((size_t)i * 6 + (size_t)q) * 16 + (size_t)(k * CLUME_WIDTH + lane)] = ((const float*)&r[q])[lane];
    }
}

/// Sum over groups and lanes of one building block's results, `what` a constant: 0 whitened intersection, 1 direct quadratic,
/// 2 density at along(o, d, t1), 3 depth from the entry or 0 to the exit, 4 flight for optical depth tau from there.
static float group_work(const uint what, __global const float* groups, uint group_count, float3 o, float3 d, float t1, float tau, uint family, float e2) {
    vfloat sum = (vfloat)0.0f;
    const vfloat none = (vfloat)0.0f;
    for (uint part = 0; part < group_count * CLUME_PARTS; ++part) {
        __global const float* lanes = groups + (size_t)(part / CLUME_PARTS) * CLUME_GROUP_FLOATS + (part % CLUME_PARTS) * CLUME_WIDTH;
        if (what == 2) {
            sum += density_part(lanes, along_s(o, d, t1), family, (vfloat)e2);
            continue;
        }
        Chord c;
        const vint hit = what == 1 ? intersect_quadratic(lanes, o, d, e2, &c) : intersect(lanes, o, d, e2, &c);
        const vfloat sigma = vload_row(lanes + 16 * CLUME_ROW_SIGMA), start = vselect(c.t_in, none, c.t_in < none);
        const vint inside = hit & (start < c.t_out);
        vfloat value = c.t_out - start;
        if (what == 3) value = depth_part(&c, sigma, start, vselect(start, c.t_out, inside), family, (vfloat)e2);
        if (what == 4) value = flight_part(&c, sigma, start, (vfloat)tau, family, (vfloat)e2);
        sum += vselect(none, value, inside);
    }
    float total = 0.0f;
    for (int lane = 0; lane < CLUME_WIDTH; ++lane) total += ((const float*)&sum)[lane];
    return total;
}

/// Every ray (as in probe_group) against every group, for timing: out[ray] = group_work.
__kernel void probe_group_work(__global const float* groups, __global const float4* rays, __global float* out, uint count, uint group_count, uint family, float e2, uint what) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[3 * i].xyz, d = rays[3 * i + 1].xyz;
    const float t1 = rays[3 * i + 1].w, tau = rays[3 * i + 2].x;
    if (what == 0) out[i] = group_work(0, groups, group_count, o, d, t1, tau, family, e2);
    if (what == 1) out[i] = group_work(1, groups, group_count, o, d, t1, tau, family, e2);
    if (what == 2) out[i] = group_work(2, groups, group_count, o, d, t1, tau, family, e2);
    if (what == 3) out[i] = group_work(3, groups, group_count, o, d, t1, tau, family, e2);
    if (what == 4) out[i] = group_work(4, groups, group_count, o, d, t1, tau, family, e2);
}

/// Ray i, two float4: origin with t_end, direction. Free flight by the program's strategy up to t_end: out t
/// (CLUME_INFINITY if it escapes), primitive (as_uint), transmittance to t_end, groups, single primitives and voxels evaluated (as_uint; 0 unless counted). what: 1 flight, 2 transmittance, 4 transmittance
/// by roulette past CLUME_EXACT_DEPTH, 8 transmittance by the program's estimator.
__kernel void probe_ray(SCENE_ARGS, __global const float4* rays, __global float4* out, uint count, uint sample, uint what) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[2 * i].xyz, d = rays[2 * i + 1].xyz;
    const float t_end = rays[2 * i].w;
    float4 r = (float4)(CLUME_INFINITY, as_float(CLUME_NO_PRIMITIVE), 1.0f, 0.0f);
    Draws draws = {sample_number_s(sample), i, 1, (uint2)(params->seed_lo, params->seed_hi)};
    Flight f;
    flight_clear(&f);
    if ((what & 1u) && flight_to_end(o, d, t_end, &f, &draws, SCENE) == FLIGHT_COLLIDED) {
        r.x = f.t;
        r.y = as_float(f.primitive);
    }
    const float roulette = what & 4u ? exponential_s(draw_bits(&draws, 1).x) : CLUME_INFINITY;
    if (what & 8u) r.z = transmittance_estimate(o, d, t_end, draw_bits(&draws, 1).x, &draws, &f, SCENE);
    if (what & 6u) r.z = transmittance_analytic(o, d, t_end, transmittance_limit(roulette), &f.work, SCENE);
#if CLUME_COUNT
    r.w = as_float((uint)(f.work.n[WORK_GROUPS] + f.work.n[WORK_PRIMITIVES] + f.work.n[WORK_VOXELS]));
#endif
    out[i] = r;
}

#if CLUME_LANES
/// Free flights as of probe_ray with `what` = 1, CLUME_WIDTH side by side: each work-item does `each` of them.
__kernel void probe_flights(SCENE_ARGS, __global const float4* rays, __global float4* out, uint count, uint sample, uint each) {
    uint next = (uint)get_global_id(0) * each;
    if (next >= count) return;
    const uint last = min(next + each, count);
    const LaneDraws draws = {sample_number_v((vuint)sample), (vuint)0u, (vuint)1u, (uint2)(params->seed_lo, params->seed_hi)};
    LaneDraws r = draws;
    LaneFlights f;
    for (uint i = 0; i < sizeof(LaneFlights) / sizeof(uint); ++i) ((uint*)&f)[i] = 0;  // idle lanes are computed with, too
    vfloat t_end = (vfloat)0.0f;
    vint flying = (vint)0, result = (vint)FLIGHT_ESCAPED, waiting = (vint)0;
    vuint above = (vuint)0u;
    for (;;) {
        for (int i = 0; i < CLUME_WIDTH; ++i) {
            if (LANE_OF(int, flying, i) || LANE_OF(int, waiting, i) || next == last) continue;
            const float4 o = rays[2 * next], d = rays[2 * next + 1];
            ((float*)&f.ox)[i] = o.x;
            ((float*)&f.oy)[i] = o.y;
            ((float*)&f.oz)[i] = o.z;
            ((float*)&t_end)[i] = o.w;
            ((float*)&f.dx)[i] = d.x;
            ((float*)&f.dy)[i] = d.y;
            ((float*)&f.dz)[i] = d.z;
            ((float*)&f.t)[i] = 0.0f;
            ((uint*)&f.draw)[i] = 0;
            ((uint*)&r.pixel)[i] = next++;
            ((int*)&waiting)[i] = -1;
        }
        vint out_now = flying | waiting;
        if (!vany(out_now)) break;
        const vint begun = lanes_begin(&f, t_end, &r, waiting, params, cells);
        LANE_SET(result, (vint)FLIGHT_ESCAPED, waiting);
        flying |= begun;
        const int busy = lanes_count(flying);
        if (busy > 0) lanes_fly(&f, &r, &flying, &result, busy * CLUME_LANES_ENOUGH / 16, &above, SCENE);
        const vint ended = out_now & vnot(flying);
        waiting = ended & (result == (vint)FLIGHT_PAUSED);
        for (int i = 0; i < CLUME_WIDTH; ++i) {
            if (!LANE_OF(int, ended, i) || LANE_OF(int, waiting, i)) continue;
            const bool collided = LANE_OF(int, result, i) == FLIGHT_COLLIDED;
            out[LANE_OF(uint, r.pixel, i)] = (float4)(collided ? LANE_OF(float, f.t, i) : CLUME_INFINITY, collided ? as_float(LANE_OF(uint, f.primitive, i)) : as_float(CLUME_NO_PRIMITIVE), 1.0f, 0.0f);
        }
    }
}
#endif

#if CLUME_GRIDS
/// Ray i as in probe_ray, direction.w an optical depth tau, against grid g alone: out the depth up to t_end, where it reaches
/// tau (CLUME_INFINITY if not), the density at along(o, d, t_end), the emission grid's integral up to t_end times emission.x.
__kernel void probe_grid(SCENE_ARGS, __global const float4* rays, __global float4* out, uint count, uint g) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = rays[2 * i].xyz, d = rays[2 * i + 1].xyz;
    const float t_end = rays[2 * i].w, tau = rays[2 * i + 1].w;
    Work work;
    work_clear(&work);
    float4 r = (float4)0.0f, origin, direction;
    r.x = convert_float_rte(grid_depth(g, o, d, t_end, ~(ulong)0, &work, SCENE)) * 0x1p-40f;
    r.y = grid_invert(g, o, d, t_end, tau, &work, SCENE);
    float begin = t_end, end = t_end + fabs(t_end) * 0x1p-20f;
    if (grid_clip(grids + g, o, d, &origin, &direction, &begin, &end)) r.z = grid_value(grids + g, fma((float4)t_end, direction, origin), grid_cells, grid_values);
#if CLUME_GRID_EMISSION
    r.w = grids_emission(o, d, t_end, &work, SCENE).x;
#endif
    out[i] = r;
}
#endif

/// Camera rays of pixels' samples, as probe_ray takes them.
__kernel void probe_camera(SCENE_ARGS, __global const uint* pixels, __global float4* rays, uint count, uint sample) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    Path p;
    path_begin(&p, pixels[i], sample, params);
    rays[2 * i] = (float4)(p.o, CLUME_INFINITY);
    rays[2 * i + 1] = (float4)(p.d, 0.0f);
}

/// Phase function i: in: g, cosine to evaluate, unused; out: value at the cosine, then a sampled direction's cosine, its pdf.
__kernel void probe_phase(uint kind, float g, float3 d, uint seed, __global float4* out, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const uint4 bits = philox((uint4)(i, 0, 0, 0), (uint2)(seed, 1));
    float pdf;
    const float3 s = phase_sample(kind, g, d, bits, &pdf);
    out[i] = (float4)(dot_s(s, d), pdf, phase_value_s(kind, g, phase_versine(g, d, s)), dot_s(s, s));
}

#if CLUME_LAMPS
/// View i, in: foot, gap, t0, t1; u[i]: out: the equiangular place from the foot, and the view's begin, end and span.
__kernel void probe_lamp(__global const float4* views, __global const float* u, __global float4* out, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const LampView v = lamp_view(views[i].x, views[i].y, views[i].z, views[i].w);
    out[i] = (float4)(lamp_place(&v, u[i]), v.begin, v.end, v.span);
}
#endif
