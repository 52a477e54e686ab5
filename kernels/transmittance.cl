// SPDX-License-Identifier: MIT
// Transmittance estimators of the mixture; the program has the one of CLUME_TRANSMITTANCE.
// `analytic`: exp(−Σ τ_i), exact; needs no order. A primitive listed in several cells counts in the one where its chord
// begins, so the sum does not depend on the cells. Past an optical depth of CLUME_EXACT_DEPTH it goes on by roulette: one
// exponential number e, and the answer is exp(−CLUME_EXACT_DEPTH) if the whole depth stays below CLUME_EXACT_DEPTH + e,
// else 0. That has the right mean, ends as soon as a partial sum exceeds the limit, and does not depend on the order.
// `march`: fixed steps, the extinction of a step's middle held over it (biased). `ratio`, `residual-ratio`: null collisions,
// each multiplying the estimate by the chance that it is not real; small estimates go on by roulette [Novak14, doi
// 10.1145/2661229.2661292]. `binary`: whether a free flight gets through.
#include "strategy_progressive.cl"
#include "strategy_decomposition.cl"
#include "grid_transmittance.cl"

#ifndef CLUME_EXACT_DEPTH  // in units of 1
#define CLUME_EXACT_DEPTH 2
#endif

/// Fixed-point optical depth at which a sum may end, for an exponential number e (CLUME_INFINITY: no roulette).
static ulong transmittance_limit(float e) {
    return ((ulong)CLUME_EXACT_DEPTH << 40) + convert_ulong_rtz(min_s(e, 128.0f - CLUME_EXACT_DEPTH) * 0x1p40f);
}

/// What a sum that has ended below the limit says.
static float transmittance_below(ulong depth, ulong limit) {
    const ulong exact = (ulong)CLUME_EXACT_DEPTH << 40;
    return depth_transmittance(limit < ((ulong)128 << 40) && depth > exact ? exact : depth);
}

/// Estimate of the transmittance from o along d up to t_end; `limit` from transmittance_limit. Without roulette, error < 1e-6 absolute
/// against lines within the intersection's limit.
static float transmittance_analytic(float3 o, float3 d, float t_end, ulong limit, Work* work, SCENE_ARGS) {
    ulong depth = 0;
#if CLUME_MIXTURE && CLUME_ACCEL == ACCEL_CELLS
    CellWalk w;
    float lower = -CLUME_INFINITY;
    if (cells_enter(&w, o, d, 0.0f, t_end, params, cells)) do {
        if (w.entry.link >= CELL_EMPTY_MAX) {
            const CellLeaf leaf = leaves[w.entry.link - CELL_EMPTY_MAX];
            for (uint g = leaf.first_group; g < leaf.first_group + leaf.group_count; ++g)
                depth += group_depth(g, o, d, 0.0f, t_end, lower, w.t_exit, SCENE);
            COUNT(work, WORK_GROUPS, leaf.group_count);
            if (depth >= limit) return 0.0f;
        }
        COUNT(work, WORK_CELLS, 1);
        lower = w.t_exit;
    } while (cells_next(&w, CLUME_CELL_LEVELS, cells));
#elif CLUME_MIXTURE
    depth = bvh_depth(o, d, 0.0f, t_end, limit, work, SCENE);
    if (depth >= limit) return 0.0f;
#endif
#if CLUME_GRIDS
    depth = grids_depth(depth, o, d, t_end, limit, work, SCENE);
    if (depth >= limit) return 0.0f;
#endif
    return transmittance_below(depth, limit);
}

/// exp(−Σ σ(middle) step) by steps from the origin, as `march` flights have them.
static float transmittance_march(float3 o, float3 d, float t_end, Work* work, SCENE_ARGS) {
    float first, last, depth = 0.0f;
    if (!bounds_clip(o, d, 0.0f, t_end, &first, &last, params)) return 1.0f;
    const float step = params->march_step;
    for (float k = floor(divide_s(first, step)); k * step < last && depth < 100.0f; k += 1.0f) {
        const float begin = k * step;
        depth = fma(march_density(along_s(o, d, fma(0.5f, step, begin)), work, SCENE), min_s(step, t_end - begin), depth);
    }
    return depth < 100.0f ? exp_s(-depth) : 0.0f;
}

/// Estimate of the mixture's transmittance by null collisions, or by a flight.
static float transmittance_sampled(float3 o, float3 d, float t_end, const Draws* r, Flight* path, SCENE_ARGS) {
    Flight f = *path;
    f.t = 0.0f;
    f.draw = DRAW_SHADOW;
    float weight = 1.0f;
#if CLUME_TRANSMITTANCE == TRANSMITTANCE_BINARY
    // Null collisions where the flights have them, else every primitive's own collision; both end at the first.
#if CLUME_STRATEGY == STRATEGY_DELTA
    int result;
    do result = flight_delta(o, d, t_end, &f, r, SCENE);
    while (result == FLIGHT_PAUSED);
    if (result == FLIGHT_COLLIDED) weight = 0.0f;
#else
    if (decomposition_blocks(o, d, t_end, draw_key(r, DRAW_SHADOW), &f.work, SCENE)) weight = 0.0f;
#endif
#elif CLUME_SCENE_BOUND
    null_collisions_scene(CLUME_TRANSMITTANCE == TRANSMITTANCE_RATIO ? NULL_RATIO : NULL_RESIDUAL_RATIO, o, d, t_end, &f, &weight, r, SCENE);
#else
    null_collisions(CLUME_TRANSMITTANCE == TRANSMITTANCE_RATIO ? NULL_RATIO : NULL_RESIDUAL_RATIO, o, d, t_end, &f, &weight, r, SCENE);
#endif
    path->work = f.work;
    path->violations = f.violations;
    path->tentative = f.tentative;
    return weight;
}

/// Estimate from o along d up to t_end; `bits`: for the roulette of `analytic`, the others take random numbers of r. Work and
/// violations of bounds are added to those of `path`.
static float transmittance_estimate(float3 o, float3 d, float t_end, uint bits, const Draws* r, Flight* path, SCENE_ARGS) {
#if CLUME_TRANSMITTANCE == TRANSMITTANCE_ANALYTIC
    return transmittance_analytic(o, d, t_end, transmittance_limit(exponential_s(bits)), &path->work, SCENE);
#else
    float weight = 1.0f;
#if CLUME_MIXTURE && CLUME_TRANSMITTANCE == TRANSMITTANCE_MARCH
    weight = transmittance_march(o, d, t_end, &path->work, SCENE);
#elif CLUME_MIXTURE
    weight = transmittance_sampled(o, d, t_end, r, path, SCENE);
#endif
#if CLUME_GRIDS
    if (weight > 0.0f) weight *= grids_transmittance(o, d, t_end, r, path, SCENE);
#endif
    return weight;
#endif
}
