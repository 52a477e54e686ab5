// SPDX-License-Identifier: MIT
// `delta`: null collisions under each cell's own bounding extinction [Novak18]. The residual optical depth is carried from
// cell to cell. A density above its bound is counted: the host reports it. Needs the cells.
#include "medium.cl"

static int flight_delta(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    CellWalk w;
    if (!cells_enter(&w, o, d, f->t, t_end, params, cells)) return FLIGHT_ESCAPED;
    uint draw = f->draw;
    const uint pause = draw + CLUME_FLIGHT_DRAWS;
    uint4 bits = draw_bits(r, draw >> 1);  // two tentative collisions a block
    float tau = exponential_s(bits.x);
    do {
        if (w.entry < CELL_EMPTY_MAX) continue;
        const CellLeaf leaf = leaves[w.entry - CELL_EMPTY_MAX];
        const float end = min_s(w.t_exit, w.t_end);
        float t = w.t;
        for (;;) {
            const float next = fma(tau, leaf.inverse_majorant, t);
            if (!(next < end)) {
                tau = max_s(fma(t - end, leaf.majorant, tau), 0.0f);
                break;
            }
            t = next;
            const float3 p = along_s(o, d, t);
            const float sigma = groups_density(leaf.first_group, leaf.group_count, p, SCENE);
            const float target = uniform_s((draw & 1u) ? bits.w : bits.y) * leaf.majorant;
            f->violations += sigma > leaf.majorant ? 1u : 0u;
            f->work += leaf.group_count;
            draw += 1;
            if (target < sigma) {
#if CLUME_PER_PRIMITIVE
                f->primitive = groups_pick(leaf.first_group, leaf.group_count, p, target, SCENE);
#endif
                f->t = t;
                return FLIGHT_COLLIDED;
            }
            if (draw == pause) {
                f->t = t;
                f->draw = draw;
                return FLIGHT_PAUSED;
            }
            if (!(draw & 1u)) bits = draw_bits(r, draw >> 1);
            tau = exponential_s((draw & 1u) ? bits.z : bits.x);
        }
    } while (cells_next(&w, params, cells));
    return FLIGHT_ESCAPED;
}
