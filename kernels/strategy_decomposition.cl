// SPDX-License-Identifier: MIT
// `decomposition`: every primitive draws its own optical depth and inverts it in closed form; the smallest t wins, and the
// winner is the primitive collided with [Kutz17, Theorem 1, doi 10.1145/3072959.3073665]. Exact, no sort, no root finding.
#include "bvh.cl"

static int flight_decomposition(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    const uint2 key = draw_key(r, 0);
    float best = t_end;
    uint primitive = CLUME_NO_PRIMITIVE;
#if CLUME_ACCEL == ACCEL_CELLS
    CellWalk w;
    if (cells_enter(&w, o, d, 0.0f, t_end, params, cells)) {
        float lower = -CLUME_INFINITY;
        do {
            if (w.entry.link >= CELL_EMPTY_MAX) {
                const CellLeaf leaf = leaves[w.entry.link - CELL_EMPTY_MAX];
                for (uint g = leaf.first_group; g < leaf.first_group + leaf.group_count; ++g)
                    group_decompose(g, o, d, 0.0f, lower, w.t_exit, key, &best, &primitive, SCENE);
                COUNT(&f->work, WORK_GROUPS, leaf.group_count);
                COUNT(&f->work, WORK_CELLS, 1);
            }
            lower = w.t_exit;
        } while (best > w.t_exit && cells_next(&w, CLUME_CELL_LEVELS, cells));
    }
#else
    bvh_decompose(o, d, 0.0f, key, &best, &primitive, &f->work, SCENE);
#endif
    if (primitive == CLUME_NO_PRIMITIVE) return FLIGHT_ESCAPED;
    f->t = best;
    f->primitive = primitive;
    return FLIGHT_COLLIDED;
}

/// Whether any primitive's own collision comes before t_end: the flight above, ended at the first that is found.
static bool decomposition_blocks(float3 o, float3 d, float t_end, uint2 key, Work* work, SCENE_ARGS) {
    float best = t_end;
    uint primitive = CLUME_NO_PRIMITIVE;
#if CLUME_ACCEL == ACCEL_CELLS
    CellWalk w;
    if (!cells_enter(&w, o, d, 0.0f, t_end, params, cells)) return false;
    float lower = -CLUME_INFINITY;
    do {
        COUNT(work, WORK_CELLS, 1);
        if (w.entry.link >= CELL_EMPTY_MAX) {
            const CellLeaf leaf = leaves[w.entry.link - CELL_EMPTY_MAX];
            for (uint g = leaf.first_group; g < leaf.first_group + leaf.group_count; ++g) {
                COUNT(work, WORK_GROUPS, 1);
                group_decompose(g, o, d, 0.0f, lower, w.t_exit, key, &best, &primitive, SCENE);
                if (primitive != CLUME_NO_PRIMITIVE) return true;
            }
        }
        lower = w.t_exit;
    } while (cells_next(&w, CLUME_CELL_LEVELS, cells));
    return false;
#else
    uint stack[CLUME_BVH_STACK];
    BvhWalk w;
    const float3 inverse = ray_inverse(d);
    bvh_begin(&w, stack);
    for (uint group; (group = bvh_next(&w, stack, o, inverse, 0.0f, t_end, work, nodes)) != BVH_NONE;) {
        group_decompose(group, o, d, 0.0f, -CLUME_INFINITY, CLUME_INFINITY, key, &best, &primitive, SCENE);
        if (primitive != CLUME_NO_PRIMITIVE) return true;
    }
    return false;
#endif
}
