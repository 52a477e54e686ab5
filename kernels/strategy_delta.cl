// SPDX-License-Identifier: MIT
// `delta`: null collisions [Novak18] under each cell's own bound. The bound is the sum of one bound per primitive, so a
// tentative collision is one primitive's: it is drawn by its share (alias table) and is real with probability density over
// bound of that primitive alone. A superposition of thinned Poisson processes: exact, one primitive evaluated per tentative
// collision at any overlap, and the primitive collided with comes for free. The residual optical depth is carried from cell
// to cell. A density above its bound is counted: the host reports it.
#include "medium.cl"

/// Kernel value K(r²) of one primitive at p, 0 outside its support.
static float primitive_kernel(__global const Primitive* q, float3 p) {
    const float x = p.x - q->mu[0], y = p.y - q->mu[1], z = p.z - q->mu[2];
    const float a0 = fma(q->w[0], x, fma(q->w[1], y, q->w[2] * z)), a1 = fma(q->w[3], y, q->w[4] * z), a2 = q->w[5] * z;
    const float r2 = fma(a0, a0, fma(a1, a1, a2 * a2));
#if CLUME_ONE_MEDIUM
    const uint family = CLUME_FAMILIES;
    const float e2 = CLUME_EXTENT_SQUARED;
#else
    const uint family = q->family;
    const float e2 = q->extent_squared;
#endif
    if (!(r2 < e2)) return 0.0f;
#if CLUME_FAMILIES & FAMILY_GAUSSIAN
    if (family == FAMILY_GAUSSIAN) return exp_s(-0.5f * r2);
#endif
#if CLUME_FAMILIES & FAMILY_EPANECHNIKOV
    if (family == FAMILY_EPANECHNIKOV) return fma(r2, -rcp_s(e2), 1.0f);
#endif
    return 1.0f;
}

static int flight_delta(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    CellWalk w;
    if (!cells_enter(&w, o, d, f->t, t_end, params, cells)) return FLIGHT_ESCAPED;
    uint draw = f->draw;
    const uint pause = draw + CLUME_FLIGHT_DRAWS;
    // Words of a tentative collision: depth to it, slot of the alias table, threshold, acceptance.
    uint4 bits = draw_bits(r, draw);
    float tau = exponential_s(bits.x);
    do {
        if (w.entry < CELL_EMPTY_MAX) continue;
        __global const CellLeaf* leaf = leaves + (w.entry - CELL_EMPTY_MAX);
        const float majorant = leaf->majorant, inverse_majorant = leaf->inverse_majorant;
        const float end = min_s(w.t_exit, w.t_end);
        float t = w.t;
        for (;;) {
            const float next = fma(tau, inverse_majorant, t);
            if (!(next < end)) {
                tau = max_s(fma(t - end, majorant, tau), 0.0f);
                break;
            }
            t = next;
            __global const Reference* list = references + leaf->first_reference;
            const uint slot = uniform_index(bits.y, leaf->reference_count);
            const uint chosen = bits.z < list[slot].threshold ? slot : list[slot].other;
            const uint primitive = list[chosen].primitive;
            const float probability = primitive_kernel(primitives + primitive, along_s(o, d, t)) * list[chosen].scale;
            f->violations += probability > 1.0f ? 1u : 0u;
            f->work += 1u;
            draw += 1;
            if (uniform_s(bits.w) < probability) {
                f->primitive = primitive;
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
    } while (cells_next(&w, cells));
    return FLIGHT_ESCAPED;
}
