// SPDX-License-Identifier: MIT
// `march`: fixed steps from the ray's origin, the extinction of a step's middle held constant over it. The simplest
// baseline, biased by the step. Empty cells are skipped a whole number of steps at a time.
#include "bvh.cl"
#include "strategy_delta.cl"

/// Extinction at p.
static float march_density(float3 p, Work* work, SCENE_ARGS) {
#if CLUME_ACCEL == ACCEL_CELLS
    CellEntry cell;
    return point_density(p, &cell, work, SCENE);
#else
    uint unused;
    return bvh_density(p, &unused, 0.5f, work, SCENE);
#endif
}

static int flight_march(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    const float step = params->march_step;
    const uint4 bits = draw_bits(r, 0);
    float tau = exponential_s(bits.x);
#if CLUME_ACCEL == ACCEL_CELLS
    CellWalk w;
    if (!cells_enter(&w, o, d, 0.0f, t_end, params, cells)) return FLIGHT_ESCAPED;
    const float last = w.t_end;
    float k = floor(divide_s(w.t, step));  // steps before this one; exact up to 2^24
#else
    float first, last;
    if (!bounds_clip(o, d, 0.0f, t_end, &first, &last, params)) return FLIGHT_ESCAPED;
    float k = floor(divide_s(first, step));
#endif
    for (;;) {
        const float begin = k * step, middle = fma(0.5f, step, begin);
        if (!(begin < last)) return FLIGHT_ESCAPED;
#if CLUME_ACCEL == ACCEL_CELLS
        while (w.t_exit <= middle)
            if (!cells_next(&w, CLUME_CELL_LEVELS, cells)) return FLIGHT_ESCAPED;
        if (w.entry.link < CELL_EMPTY_MAX) {
            k = max_s(k + 1.0f, floor(divide_s(w.t_exit, step) - 0.5f));
            continue;
        }
        const CellLeaf leaf = leaves[w.entry.link - CELL_EMPTY_MAX];
        const float3 p = along_s(o, d, middle);
        const float sigma = groups_density(leaf.first_group, leaf.group_count, p, SCENE);
        COUNT(&f->work, WORK_GROUPS, leaf.group_count);
        COUNT(&f->work, WORK_DENSITIES, 1);
#else
        const float3 p = along_s(o, d, middle);
        const float sigma = bvh_density(p, &f->primitive, uniform_s(bits.y), &f->work, SCENE);
#endif
        const float available = sigma * min_s(step, t_end - begin);
        if (tau < available) {
#if CLUME_ACCEL == ACCEL_CELLS && CLUME_PER_PRIMITIVE
            f->primitive = groups_pick(leaf.first_group, leaf.group_count, p, uniform_s(bits.y) * sigma, SCENE);
#endif
            f->t = min_s(fma(tau, rcp_s(sigma), begin), t_end);
            return FLIGHT_COLLIDED;
        }
        tau -= available;
        k += 1.0f;
    }
}
