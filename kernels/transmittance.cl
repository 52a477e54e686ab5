// SPDX-License-Identifier: MIT
// `analytic`: exp(−Σ τ_i), exact; needs no order. A primitive listed in several cells counts in the one where its chord
// begins, so the sum does not depend on the cells. Past an optical depth of CLUME_EXACT_DEPTH it goes on by roulette: one
// exponential number e, and the answer is exp(−CLUME_EXACT_DEPTH) if the whole depth stays below CLUME_EXACT_DEPTH + e,
// else 0. That has the right mean, ends as soon as a partial sum exceeds the limit, and does not depend on the order.
#include "bvh.cl"
#include "grid_transmittance.cl"

#ifndef CLUME_EXACT_DEPTH  // in units of 1
#define CLUME_EXACT_DEPTH 2
#endif

/// Fixed-point optical depth at which a sum may end, for an exponential number e (CLUME_INFINITY: no roulette).
static ulong transmittance_limit(float e) {
    return ((ulong)CLUME_EXACT_DEPTH << 40) + convert_ulong_rtz(min_s(e, 128.0f - CLUME_EXACT_DEPTH) * 0x1p40f);
}

/// Estimate of the transmittance from o along d up to t_end; `limit` from transmittance_limit.
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
    const ulong exact = (ulong)CLUME_EXACT_DEPTH << 40;
    return depth_transmittance(limit < ((ulong)128 << 40) && depth > exact ? exact : depth);
}

/// Estimate from o along d up to t_end; `bits`: for the roulette of `analytic`, the others take random numbers of r. Work and
/// violations of bounds are added to those of `path`.
static float transmittance_estimate(float3 o, float3 d, float t_end, uint bits, const Draws* r, Flight* path, SCENE_ARGS) {
#if CLUME_TRANSMITTANCE == TRANSMITTANCE_ANALYTIC
    return transmittance_analytic(o, d, t_end, transmittance_limit(exponential_s(bits)), &path->work, SCENE);
#elif CLUME_GRIDS
    return grids_transmittance(o, d, t_end, r, path, SCENE);
#else
    return 1.0f;
#endif
}
