// SPDX-License-Identifier: MIT
// Null collisions [Novak18], for free flights (`delta`) and for transmittance (`ratio`, `residual-ratio`).
// Under each cell's own bound (grid or tree): the bound is the sum of one bound per primitive, so a tentative collision is one
// primitive's: it is drawn by its share (alias table) and is real with probability density over bound of that primitive
// alone. A superposition of thinned Poisson processes: exact, one primitive evaluated per tentative collision at any overlap,
// and the primitive collided with comes for free. The residual optical depth is carried from cell to cell.
// Under one bound for the scene (CLUME_SCENE_BOUND): the density of all primitives is looked up at each tentative collision.
// A density above its bound is counted: the host reports it.
#include "cell_rest.cl"

#define NULL_FLIGHT 0          // ends at the first real collision
#define NULL_RATIO 1           // multiplies *weight by the chances of not colliding
#define NULL_RESIDUAL_RATIO 2  // the same for what the density exceeds each cell's control by; the control in closed form

#ifndef CLUME_RATIO_ROULETTE  // a weight below it goes on with the chance weight / CLUME_RATIO_ROULETTE
#define CLUME_RATIO_ROULETTE 0.1f
#endif

/// Roulette on a small weight, unbiased; false if the path of the estimate ends.
static bool weight_roulette(float* weight, uint bits) {
    if (*weight >= CLUME_RATIO_ROULETTE) return true;
    const bool lives = uniform_s(bits) * CLUME_RATIO_ROULETTE < *weight;
    *weight = lives ? CLUME_RATIO_ROULETTE : 0.0f;
    return lives;
}

/// Multiplies *weight by exp(−*depth), *depth becoming 0; then roulette.
static bool weight_attenuate(float* weight, float* depth, uint bits) {
    *weight *= exp_s(-min_s(*depth, 80.0f));
    *depth = 0.0f;
    return weight_roulette(weight, bits);
}

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

/// Under the cells' bounds from f->t to t_end, random numbers r from f->draw on. `mode`, a constant: NULL_*; *weight is not
/// looked at by flights.
static int null_collisions(const int mode, float3 o, float3 d, float t_end, Flight* f, float* weight, const Draws* r, SCENE_ARGS) {
    CellWalk w;
    if (!cells_enter(&w, o, d, f->t, t_end, params, cells)) return FLIGHT_ESCAPED;
    uint draw = f->draw;
    const uint pause = draw + CLUME_FLIGHT_DRAWS;
    // Words of a tentative collision: depth to it, slot of the alias table, threshold, acceptance (or roulette).
    const uint4 first = draw_bits(r, draw);
    uint slot_bits = first.y, threshold_bits = first.z, accept_bits = first.w;
    float tau = exponential_s(first.x), control_depth = 0.0f;
    do {
        COUNT(&f->work, WORK_CELLS, 1);
        float t = w.t, rate = w.entry.majorant, gain = 1.0f;
        const float end = min_s(w.t_exit, w.t_end);
        if (mode == NULL_RESIDUAL_RATIO && w.entry.link >= CELL_EMPTY_MAX) {
            const float control = leaves[w.entry.link - CELL_EMPTY_MAX].control;
            control_depth = fma(control, end - t, control_depth);
            rate -= control;
            gain = divide_s(w.entry.majorant, max_s(rate, 0x1p-60f));
        }
        for (;;) {
            const float depth = rate * (end - t);
            if (!(tau < depth)) {
                tau -= depth;
                break;
            }
            t = min_s(fma(tau, rcp_s(rate), t), end);
            const Reference slot = references[w.entry.reference + uniform_index_s(slot_bits, w.entry.count)];
            // Arithmetic, not a branch: which of the two can't be predicted.
            const uint own = (uint)(threshold_bits < slot.threshold);
            const uint primitive = slot.other + (slot.own - slot.other) * own;
            const float scale = as_float((slot.scales << (16u * own)) & 0xffff0000u);
            const float probability = scale * primitive_kernel(primitives + primitive, fma(t, d.x, o.x), fma(t, d.y, o.y), fma(t, d.z, o.z));
            f->violations += probability > 1.0f ? 1u : 0u;
            COUNT(&f->work, WORK_PRIMITIVES, 1);
            COUNT(&f->work, WORK_DRAWS, 1);
            draw += 1;
            f->tentative += 1;
            if (mode == NULL_FLIGHT) {
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
            } else {
                *weight *= max_s(1.0f - probability, 0.0f) * gain;
                if (!weight_roulette(weight, accept_bits)) return FLIGHT_COLLIDED;
            }
            if (draw % CLUME_PATIENCE == 0) {
                COUNT(&f->work, WORK_PRIMITIVES, w.entry.count);
                if (mode == NULL_FLIGHT) {
                    f->t = cell_decompose(w.entry.reference, w.entry.count, o, d, t, end, draw_key(r, draw ^ DRAW_REST), &f->primitive, references, primitives);
                    if (f->t < CLUME_INFINITY) return FLIGHT_COLLIDED;
                } else {
                    // Of a control, all that the cell has is known already.
                    const float known = mode == NULL_RESIDUAL_RATIO ? (w.entry.majorant - rate) * (end - t) : 0.0f;
                    *weight *= exp_s(-clamp_s(cell_depth(w.entry.reference, w.entry.count, o, d, t, end, references, primitives) - known, 0.0f, 80.0f));
                }
                t = end;
            }
            const uint4 bits = draw_bits(r, draw);
            slot_bits = bits.y;
            threshold_bits = bits.z;
            accept_bits = bits.w;
            tau = exponential_s(bits.x);
        }
        if (mode == NULL_RESIDUAL_RATIO && control_depth > 2.0f) {
            draw += 1;
            if (!weight_attenuate(weight, &control_depth, draw_bits(r, draw ^ 0x20000000u).x)) return FLIGHT_COLLIDED;
        }
    } while (cells_next(&w, CLUME_CELL_LEVELS, cells));
    if (mode == NULL_RESIDUAL_RATIO) *weight *= exp_s(-control_depth);
    return FLIGHT_ESCAPED;
}

/// Extinction at p, of the cell there; *cell is that cell.
static float point_density(float3 p, CellEntry* cell, Work* work, SCENE_ARGS) {
    *cell = cells_at(p, params, cells);
    COUNT(work, WORK_CELLS, 1);
    COUNT(work, WORK_DENSITIES, 1);
    if (cell->link < CELL_EMPTY_MAX) return 0.0f;
    const CellLeaf leaf = leaves[cell->link - CELL_EMPTY_MAX];
    COUNT(work, WORK_GROUPS, leaf.group_count);
    return groups_density(leaf.first_group, leaf.group_count, p, SCENE);
}

/// Under one bound for the whole mixture; as null_collisions. The control of the residual is 0: the scene has empty parts.
static int null_collisions_scene(const int mode, float3 o, float3 d, float t_end, Flight* f, float* weight, const Draws* r, SCENE_ARGS) {
    float t, last;
    if (!bounds_clip(o, d, f->t, t_end, &t, &last, params)) return FLIGHT_ESCAPED;
    const float bound = params->scene_bound, inverse_bound = rcp_s(bound);
    uint draw = f->draw;
    const uint pause = draw + CLUME_FLIGHT_DRAWS;
    for (;; ++draw) {
        const uint4 bits = draw_bits(r, draw);
        COUNT(&f->work, WORK_DRAWS, 1);
        t = fma(exponential_s(bits.x), inverse_bound, t);
        if (!(t < last)) return FLIGHT_ESCAPED;
        if (mode == NULL_FLIGHT && draw == pause) {
            f->t = t;  // memoryless: the flight may begin anew anywhere before its next tentative collision
            f->draw = draw + 1;
        }
        const float3 p = along_s(o, d, t);
        CellEntry cell;
        const float sigma = point_density(p, &cell, &f->work, SCENE), probability = sigma * inverse_bound;
        f->violations += sigma > bound ? 1u : 0u;
        f->tentative += 1;
        if (mode == NULL_FLIGHT) {
            if (uniform_s(bits.y) < probability) {
#if CLUME_PER_PRIMITIVE
                const CellLeaf leaf = leaves[cell.link - CELL_EMPTY_MAX];
                f->primitive = groups_pick(leaf.first_group, leaf.group_count, p, uniform_s(bits.z) * sigma, SCENE);
#endif
                f->t = t;
                return FLIGHT_COLLIDED;
            }
            if (draw == pause) return FLIGHT_PAUSED;
        } else {
            *weight *= max_s(1.0f - probability, 0.0f);
            if (!weight_roulette(weight, bits.w)) return FLIGHT_COLLIDED;
        }
    }
}

static int flight_delta(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    float unused = 1.0f;
#if CLUME_SCENE_BOUND
    return null_collisions_scene(NULL_FLIGHT, o, d, t_end, f, &unused, r, SCENE);
#else
    return null_collisions(NULL_FLIGHT, o, d, t_end, f, &unused, r, SCENE);
#endif
}
