// SPDX-License-Identifier: MIT
// `delta`: null collisions [Novak18] under each cell's own bound. The bound is the sum of one bound per primitive, so a
// tentative collision is one primitive's: it is drawn by its share (alias table) and is real with probability density over
// bound of that primitive alone. A superposition of thinned Poisson processes: exact, one primitive evaluated per tentative
// collision at any overlap, and the primitive collided with comes for free. The residual optical depth is carried from cell
// to cell. A density above its bound is counted: the host reports it.
#include "medium.cl"

/// Kernel value K(r²) of one primitive at p, 0 outside its support.
static float primitive_kernel(__global const Primitive* q, float px, float py, float pz) {
    const float x = px - q->mu[0], y = py - q->mu[1], z = pz - q->mu[2];
    const float a0 = fma(q->w[0], x, fma(q->w[1], y, q->w[2] * z)), a1 = fma(q->w[3], y, q->w[4] * z), a2 = q->w[5] * z;
    const float r2 = fma(a0, a0, fma(a1, a1, a2 * a2));
#if CLUME_ONE_MEDIUM
    const uint family = CLUME_FAMILIES;
    const float e2 = CLUME_EXTENT_SQUARED;
#else
    const uint family = q->family;
    const float e2 = q->extent_squared;
#endif
    float k = 1.0f;
#if CLUME_FAMILIES & FAMILY_GAUSSIAN
    if (family == FAMILY_GAUSSIAN) k = exp_s(-0.5f * r2);
#endif
#if CLUME_FAMILIES & FAMILY_EPANECHNIKOV
    if (family == FAMILY_EPANECHNIKOV) k = fma(r2, -rcp_s(e2), 1.0f);
#endif
    return r2 < e2 ? k : 0.0f;
}

static int flight_delta(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    CellWalk w;
    if (!cells_enter(&w, o, d, f->t, t_end, params, cells)) return FLIGHT_ESCAPED;
    uint draw = f->draw;
    const uint pause = draw + CLUME_FLIGHT_DRAWS;
    // Words of a tentative collision: depth to it, slot of the alias table, threshold, acceptance.
    const uint4 first = draw_bits(r, draw);
    uint slot_bits = first.y, threshold_bits = first.z, accept_bits = first.w;
    float tau = exponential_s(first.x);
    do {
        COUNT(&f->work, WORK_CELLS, 1);
        float t = w.t;
        const float end = min_s(w.t_exit, w.t_end);
        for (;;) {
            const float depth = w.entry.majorant * (end - t);
            if (!(tau < depth)) {
                tau -= depth;
                break;
            }
            t = min_s(fma(tau, rcp_s(w.entry.majorant), t), end);
            const Reference slot = references[w.entry.reference + uniform_index(slot_bits, w.entry.count)];
            // Arithmetic, not a branch: which of the two can't be predicted.
            const uint own = (uint)(threshold_bits < slot.threshold);
            const uint primitive = slot.other + (slot.own - slot.other) * own;
            const float scale = as_float((slot.scales << (16u * own)) & 0xffff0000u);
            const float probability = scale * primitive_kernel(primitives + primitive, fma(t, d.x, o.x), fma(t, d.y, o.y), fma(t, d.z, o.z));
            f->violations += probability > 1.0f ? 1u : 0u;
            COUNT(&f->work, WORK_PRIMITIVES, 1);
            COUNT(&f->work, WORK_DRAWS, 1);
            draw += 1;
            if (uniform_s(accept_bits) < probability) {
                f->primitive = primitive;
                f->t = t;
                return FLIGHT_COLLIDED;
            }
            if (draw == pause) {
                f->t = t;
                f->draw = draw;
                return FLIGHT_PAUSED;
            }
            const uint4 bits = draw_bits(r, draw);
            slot_bits = bits.y;
            threshold_bits = bits.z;
            accept_bits = bits.w;
            tau = exponential_s(bits.x);
        }
    } while (cells_next(&w, CLUME_CELL_LEVELS, cells));
    return FLIGHT_ESCAPED;
}
