// SPDX-License-Identifier: MIT
// What every strategy needs of the medium: the kernels' common arguments, a group's family, the density of a list of groups,
// which primitive a collision belongs to, and one group's part in a decomposition flight or in a sum of optical depths.
#include "cells.cl"

#define SCENE_ARGS                                                                                                    \
    __constant const RenderParams *params, __global const CellEntry *cells, __global const CellLeaf *leaves,               \
        __global const Reference *references, __global const Primitive *primitives, __global const BvhNode *nodes,    \
        __global const float *groups, __global const uint *group_medium, __global const MediumInfo *media,            \
        __global const float4 *shading, __global const LightInfo *lights, __global const float4 *texels,              \
        __global const AliasEntry *alias, __global const float *learned, __global uint *raised,                              \
        __global const GridInfo *grids, __global const CellEntry *grid_cells, __global const float *grid_values
#define SCENE params, cells, leaves, references, primitives, nodes, groups, group_medium, media, shading, lights, texels, alias, learned, raised, grids, grid_cells, grid_values

// With one medium, family and extent are constants of the program.
#if CLUME_ONE_MEDIUM
#ifndef CLUME_EXTENT_SQUARED
#define CLUME_EXTENT_SQUARED 9.0f
#endif
#define group_family(g) ((uint)CLUME_FAMILIES)
#define group_extent_squared(g) CLUME_EXTENT_SQUARED
#else
#define group_family(g) media[group_medium[g]].family
#define group_extent_squared(g) media[group_medium[g]].extent_squared
#endif

/// Random numbers of one scattering event of one sample, known by its sample_number.
typedef struct {
    uint number, pixel, depth;
    uint2 seed;
} Draws;

static uint4 draw_bits(const Draws* r, uint draw) { return draw_words(r->number, r->pixel, r->depth, draw, r->seed); }

/// A key for `primitive_bits`: independent words, whatever CLUME_SOBOL is.
static uint2 draw_key(const Draws* r, uint draw) { return philox((uint4)(r->number, r->pixel, r->depth, draw), r->seed).xy; }

#define FLIGHT_ESCAPED 0
#define FLIGHT_COLLIDED 1
#define FLIGHT_PAUSED 2

/// Operations by kind (WORK_*), if they are counted.
typedef struct {
#if CLUME_COUNT
    ulong n[WORK_KINDS];
#else
    uint unused;
#endif
} Work;
#if CLUME_COUNT
#define COUNT(work, kind, amount) (work)->n[kind] += (ulong)(amount)
#else
#define COUNT(work, kind, amount)
#endif

static void work_clear(Work* work) {
#if CLUME_COUNT
    for (int i = 0; i < WORK_KINDS; ++i) work->n[i] = 0;
#else
    work->unused = 0;
#endif
}

/// A flight under way or ended: t reached, draws used, the primitive it collided with (if CLUME_PER_PRIMITIVE), how often
/// the density exceeded its bound, and the sum of the shares of density lost by that (20 fraction bits). `tentative`: tentative
/// collisions, of the path's other flights and estimates too, since it was 0.
typedef struct {
    float t;
    uint draw, primitive, violations, tentative;
    ulong excess;
    Work work;
} Flight;

static void flight_clear(Flight* f) {
    f->t = 0.0f;
    f->draw = 0;
    f->primitive = CLUME_NO_PRIMITIVE;
    f->violations = 0;
    f->tentative = 0;
    f->excess = 0;
    work_clear(&f->work);
}

/// Extinction at p of the groups [first, first + count): lanes add up over the groups, then by fixed pairs.
static float groups_density(uint first, uint count, float3 p, SCENE_ARGS) {
    vfloat sum[CLUME_PARTS];
    for (int k = 0; k < CLUME_PARTS; ++k) sum[k] = (vfloat)0.0f;
    for (uint g = first; g < first + count; ++g) {
        const uint family = group_family(g);
        const float e2 = group_extent_squared(g);
        __global const float* part = groups + (size_t)g * CLUME_GROUP_FLOATS;
        for (int k = 0; k < CLUME_PARTS; ++k) sum[k] += density_part(part + k * CLUME_WIDTH, p, family, (vfloat)e2);
    }
    return reduce_lanes(sum);
}

/// The primitive whose share of the density at p holds `target` (uniform below the density): found by adding them in order.
static uint groups_pick(uint first, uint count, float3 p, float target, SCENE_ARGS) {
    uint last = CLUME_NO_PRIMITIVE;
    float sum = 0.0f;
    for (uint g = first; g < first + count; ++g) {
        __global const float* part = groups + (size_t)g * CLUME_GROUP_FLOATS;
        for (int k = 0; k < CLUME_PARTS; ++k) {
            const vfloat density = density_part(part + k * CLUME_WIDTH, p, group_family(g), (vfloat)group_extent_squared(g));
            const float* lane = (const float*)&density;
            for (int i = 0; i < CLUME_WIDTH; ++i) {
                if (!(lane[i] > 0.0f)) continue;
                sum += lane[i];
                last = as_uint(part[16 * CLUME_ROW_ID + k * CLUME_WIDTH + i]);
                if (sum > target) return last;
            }
        }
    }
    return last;
}

/// 1 / d for slab tests; an axis along which the ray does not move counts as 2^-60.
static float3 ray_inverse(float3 d) {
    return (float3)(rcp_s(copysign(max_s(fabs(d.x), 0x1p-60f), d.x)), rcp_s(copysign(max_s(fabs(d.y), 0x1p-60f), d.y)),
                    rcp_s(copysign(max_s(fabs(d.z), 0x1p-60f), d.z)));
}

/// The part [t0, t1) of the ray, within [t_begin, t_end), that lies in the media's bounds; false if there is none.
static bool bounds_clip(float3 o, float3 d, float t_begin, float t_end, float* t0, float* t1, __constant const RenderParams* params) {
    const float3 inverse = ray_inverse(d);
    const float3 a = (params->bounds_min.xyz - o) * inverse, b = (params->bounds_max.xyz - o) * inverse;
    *t0 = max_s(t_begin, max_s(min_s(a.x, b.x), max_s(min_s(a.y, b.y), min_s(a.z, b.z))));
    *t1 = min_s(t_end, min_s(max_s(a.x, b.x), min_s(max_s(a.y, b.y), max_s(a.z, b.z))));
    return *t0 < *t1;
}

/// Lets each primitive of group g whose chord begins (after t_begin) in [lower, upper) draw its own collision, and keeps the
/// earliest in *best, ties by the smaller id [Kutz17, Theorem 1].
static void group_decompose(uint g, float3 o, float3 d, float t_begin, float lower, float upper, uint2 key, float* best, uint* primitive, SCENE_ARGS) {
    const uint family = group_family(g);
    const float e2 = group_extent_squared(g);
    for (int k = 0; k < CLUME_PARTS; ++k) {
        __global const float* part = groups + (size_t)g * CLUME_GROUP_FLOATS + k * CLUME_WIDTH;
        Chord c;
        vint mask = intersect(part, o, d, e2, &c);
        const vfloat start = vselect(c.t_in, (vfloat)t_begin, c.t_in < (vfloat)t_begin);
        mask &= (c.t_out > (vfloat)t_begin) & (start >= (vfloat)lower) & (start < (vfloat)upper) & (start < (vfloat)*best);
        if (!vany(mask)) continue;
        const vuint id = as_vuint(vload_row(part + 16 * CLUME_ROW_ID));
        const vfloat tau = exponential_v(primitive_bits(id, key));
        vfloat t = flight_part(&c, vload_row(part + 16 * CLUME_ROW_SIGMA), start, tau, family, (vfloat)e2);
        t = vselect((vfloat)CLUME_INFINITY, t, mask);
        if (!vany(t <= (vfloat)*best)) continue;
        const float* lane = (const float*)&t;
        for (int i = 0; i < CLUME_WIDTH; ++i) {
            const uint lane_id = as_uint(part[16 * CLUME_ROW_ID + i]);
            // No tie with "none yet": lanes that do not collide stand at CLUME_INFINITY, where `best` may, too.
            if (lane[i] < *best || (lane[i] == *best && *primitive != CLUME_NO_PRIMITIVE && lane_id < *primitive)) {
                *best = lane[i];
                *primitive = lane_id;
            }
        }
    }
}

/// Optical depth between t_begin and t_end of the primitives of group g whose chord begins in [lower, upper): fixed point,
/// 40 fraction bits, clamped to 2^8. Each primitive is rounded to 37 fraction bits on its own, in two exact halves, so that
/// the sum does not depend on which group holds it.
static ulong group_depth(uint g, float3 o, float3 d, float t_begin, float t_end, float lower, float upper, SCENE_ARGS) {
    const uint family = group_family(g);
    const float e2 = group_extent_squared(g);
    vint high = (vint)0, low = (vint)0;
    for (int k = 0; k < CLUME_PARTS; ++k) {
        __global const float* part = groups + (size_t)g * CLUME_GROUP_FLOATS + k * CLUME_WIDTH;
        Chord c;
        vint mask = intersect(part, o, d, e2, &c);
        const vfloat start = vselect(c.t_in, (vfloat)t_begin, c.t_in < (vfloat)t_begin);
        const vfloat stop = vselect(c.t_out, (vfloat)t_end, c.t_out > (vfloat)t_end);
        mask &= (start < stop) & (start >= (vfloat)lower) & (start < (vfloat)upper);
        if (!vany(mask)) continue;
        vfloat depth = depth_part(&c, vload_row(part + 16 * CLUME_ROW_SIGMA), start, vselect(start, stop, mask), family, (vfloat)e2);
        depth = vselect((vfloat)0.0f, depth, mask);
        depth = vselect(depth, (vfloat)128.0f, depth > (vfloat)128.0f);
        const vfloat magic = (vfloat)12582912.0f;  // adding it rounds to an integer, found in the low bits
        const vfloat shifted = fma(depth, (vfloat)0x1p14f, magic);
        const vfloat rest = fma(shifted - magic, (vfloat)-0x1p-14f, depth);
        high += as_vint(shifted) - (vint)0x4b400000;
        low += as_vint(fma(rest, (vfloat)0x1p37f, magic)) - (vint)0x4b400000;
    }
    int high_sum = 0, low_sum = 0;
    for (int i = 0; i < CLUME_WIDTH; ++i) {
        high_sum += ((const int*)&high)[i];
        low_sum += ((const int*)&low)[i];
    }
    const ulong sum = (ulong)(((long)high_sum << 26) + ((long)low_sum << 3));
    return min(sum, (ulong)256 << 40);
}

/// e^(−depth) of a fixed-point sum; 0 from 2^7 on.
static float depth_transmittance(ulong depth) {
    return depth >= ((ulong)128 << 40) ? 0.0f : exp_s(-convert_float_rte(depth) * 0x1p-40f);
}
