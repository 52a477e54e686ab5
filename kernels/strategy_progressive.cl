// SPDX-License-Identifier: MIT
// `progressive`: null collisions under bounds that start low and are learned [Misso23, Progressive null-tracking for
// volumetric rendering, SIGGRAPH 2023]. A density above its cell's bound raises it for the next pass (atomically; the bounds
// of a pass are frozen, so that runs repeat) and is clamped to it in this one: consistent, not unbiased. What was clamped is
// counted. Cells that no primitive meets are known to be empty; no other starts at 0. Under bounds far too low a pass makes
// hardly any look-ups, and would learn as slowly: in passes outside the image each cell crossed is looked into once.
#include "strategy_delta.cl"

/// A place in [begin, end) of cell `index` to look at while exploring; the word need not be used for nothing else.
static float progressive_place(uint word, uint index, float begin, float end) {
    return min_s(fma(uniform_s(word * (2u * index + 1u)), end - begin, begin), end);
}

/// The density sigma was found in a cell whose bound in this pass is `bound`: returns it clamped, reports and raises.
static float progressive_clamp(float sigma, float bound, __global uint* raised, Flight* f) {
    if (!(sigma > bound)) return sigma;
    atomic_max(raised, as_uint(sigma));  // bits of positive floats are ordered as they are
    f->violations += 1;
    // Look-ups come at the rate `bound`: each stands for so much optical depth that is missing.
    f->excess += convert_ulong_rtz(min_s(divide_s(sigma - bound, bound), 0x1p20f) * 0x1p20f);
    return bound;
}

static int flight_progressive(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    CellWalk w;
    if (!cells_enter(&w, o, d, f->t, t_end, params, cells)) return FLIGHT_ESCAPED;
    uint draw = f->draw;
    const uint pause = draw + CLUME_FLIGHT_DRAWS;
    uint4 bits = draw_bits(r, draw);
    float tau = exponential_s(bits.x);
    do {
        COUNT(&f->work, WORK_CELLS, 1);
        if (w.entry.link < CELL_EMPTY_MAX) continue;
        const CellLeaf leaf = leaves[w.entry.link - CELL_EMPTY_MAX];
        const uint index = CLUME_SCENE_BOUND ? 0u : w.entry.link - CELL_EMPTY_MAX;
        const float bound = learned[index], end = min_s(w.t_exit, w.t_end);
        if (params->explore) {
            const float3 p = along_s(o, d, progressive_place(bits.w, w.entry.link, w.t, end));
            const float sigma = groups_density(leaf.first_group, leaf.group_count, p, SCENE);
            if (sigma > bound) atomic_max(raised + index, as_uint(sigma));
        }
        float t = w.t;
        for (;;) {
            const float depth = bound * (end - t);
            if (!(tau < depth)) {
                tau -= depth;
                break;
            }
            t = min_s(fma(tau, rcp_s(bound), t), end);
            const float3 p = along_s(o, d, t);
            const float density = groups_density(leaf.first_group, leaf.group_count, p, SCENE);
            COUNT(&f->work, WORK_GROUPS, leaf.group_count);
            COUNT(&f->work, WORK_DENSITIES, 1);
            COUNT(&f->work, WORK_DRAWS, 1);
            const float sigma = progressive_clamp(density, bound, raised + index, f);
            draw += 1;
            f->tentative += 1;
            if (uniform_s(bits.y) * bound < sigma) {
#if CLUME_PER_PRIMITIVE
                f->primitive = groups_pick(leaf.first_group, leaf.group_count, p, uniform_s(bits.z) * density, SCENE);
#endif
                f->t = t;
                return FLIGHT_COLLIDED;
            }
            if (draw == pause) {
                f->t = t;
                f->draw = draw;
                return FLIGHT_PAUSED;
            }
            bits = draw_bits(r, draw);
            tau = exponential_s(bits.x);
        }
    } while (cells_next(&w, CLUME_CELL_LEVELS, cells));
    return FLIGHT_ESCAPED;
}
