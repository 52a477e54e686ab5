// SPDX-License-Identifier: MIT
// `analytic`: exp(−Σ τ_i), exact; needs no order. A primitive listed in several cells counts in the one where its chord
// begins, so the sum does not depend on the cells.
#include "bvh.cl"

/// Transmittance from o along d up to t_end.
static float transmittance_analytic(float3 o, float3 d, float t_end, SCENE_ARGS) {
#if CLUME_ACCEL == ACCEL_CELLS
    CellWalk w;
    if (!cells_enter(&w, o, d, 0.0f, t_end, params, cells)) return 1.0f;
    float lower = -CLUME_INFINITY;
    ulong depth = 0;
    do {
        if (w.link >= CELL_EMPTY_MAX) {
            const CellLeaf leaf = leaves[w.link - CELL_EMPTY_MAX];
            for (uint g = leaf.first_group; g < leaf.first_group + leaf.group_count; ++g)
                depth += group_depth(g, o, d, 0.0f, t_end, lower, w.t_exit, SCENE);
            if (depth >= ((ulong)128 << 40)) return 0.0f;
        }
        lower = w.t_exit;
    } while (cells_next(&w, params, cells));
    return depth_transmittance(depth);
#else
    return depth_transmittance(bvh_depth(o, d, 0.0f, t_end, SCENE));
#endif
}
