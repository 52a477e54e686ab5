// SPDX-License-Identifier: MIT
// `delta` under the cells' bounds for CLUME_WIDTH flights side by side: null_collisions of strategy_delta.cl, lane by lane, with
// the same results to the bit. In every round each flight has its tentative collision, or steps to its next cell.
#include "lane_cells.cl"
#include "cell_rest.cl"

#if CLUME_LANES

/// Random numbers of one scattering event of each lane's sample, as Draws.
typedef struct {
    vuint number, pixel, depth;
    uint2 seed;
} LaneDraws;

static void lanes_bits(const LaneDraws* r, vuint draw, vuint* a, vuint* b, vuint* c, vuint* d) {
    draw_v(r->number, r->pixel, r->depth, draw, r->seed, a, b, c, d);
}

static int lanes_count(vint mask) {
#if CLUME_WIDTH == 1
    return mask != 0;
#else
#if CLUME_WIDTH == 16
    const int8 a = mask.lo + mask.hi;
    const int4 b = a.lo + a.hi;
#elif CLUME_WIDTH == 8
    const int4 b = mask.lo + mask.hi;
#else
    const int4 b = mask;
#endif
    return -((b.x + b.y) + (b.z + b.w));
#endif
}

/// The sum over the lanes.
static uint lanes_total(vuint v) {
    uint sum = 0;
    for (int i = 0; i < CLUME_WIDTH; ++i) sum += ((const uint*)&v)[i];
    return sum;
}

/// Whether enough of the flights under way wait for a collision.
static bool lanes_brought(vint stepping, vint under_way, int steps) {
#if CLUME_WIDTH == 1
    return !stepping || steps == CLUME_LANES_STEPS;
#else
    return lanes_count(16 * stepping - CLUME_LANES_STEPPING * under_way) <= 0;
#endif
}

/// primitive_kernel of each lane's primitive at its t.
static vfloat lanes_kernel(const LaneFlights* f, vuint primitive, __global const Primitive* primitives) {
    __global const uint4* records = (__global const uint4*)primitives;
    const vuint record = 4u * primitive;
    vuint q[12];
    lanes_load(records, record, q, q + 1, q + 2, q + 3);
    lanes_load(records, record + 1u, q + 4, q + 5, q + 6, q + 7);
    lanes_load(records, record + 2u, q + 8, q + 9, q + 10, q + 11);
    const vfloat x = fma(f->t, f->dx, f->ox) - as_vfloat(q[0]), y = fma(f->t, f->dy, f->oy) - as_vfloat(q[1]), z = fma(f->t, f->dz, f->oz) - as_vfloat(q[2]);
    const vfloat a0 = fma(as_vfloat(q[3]), x, fma(as_vfloat(q[4]), y, as_vfloat(q[5]) * z)), a1 = fma(as_vfloat(q[6]), y, as_vfloat(q[7]) * z), a2 = as_vfloat(q[8]) * z;
    const vfloat r2 = fma(a0, a0, fma(a1, a1, a2 * a2));
#if CLUME_ONE_MEDIUM
    const vuint family = (vuint)CLUME_FAMILIES;
    const vfloat e2 = (vfloat)CLUME_EXTENT_SQUARED;
#else
    const vuint family = q[11];
    const vfloat e2 = as_vfloat(q[10]);
#endif
    vfloat k = (vfloat)1.0f;
#if CLUME_FAMILIES & FAMILY_GAUSSIAN
    LANE_SET(k, exp_v(-0.5f * r2), family == (vuint)FAMILY_GAUSSIAN);
#endif
#if CLUME_FAMILIES & FAMILY_EPANECHNIKOV
    LANE_SET(k, fma(r2, -rcp_v(e2), (vfloat)1.0f), family == (vuint)FAMILY_EPANECHNIKOV);
#endif
    return vselect((vfloat)0.0f, k, r2 < e2);
}

/// Draws the next tentative collision of the lanes in `mask`.
static void lanes_draw(LaneFlights* f, const LaneDraws* r, vint mask) {
    vuint a, b, c, d;
    lanes_bits(r, f->draw, &a, &b, &c, &d);
    LANE_SET(f->tau, exponential_v(a), mask);
    LANE_SET(f->slot, b, mask);
    LANE_SET(f->threshold, c, mask);
    LANE_SET(f->accept, d, mask);
}

/// Begins flights at f->t, draws from f->draw on; returns the lanes that are under way: the others have escaped.
static vint lanes_begin(LaneFlights* f, vfloat t_end, const LaneDraws* r, vint mask, __constant const RenderParams* params, __global const CellEntry* cells) {
    const vint under_way = lanes_enter(f, t_end, mask, params, cells);
    if (vany(under_way)) lanes_draw(f, r, under_way);
    return under_way;
}

// Of tentative collisions that a flight has drawn, a multiple of this may be one of CLUME_FLIGHT_DRAWS or CLUME_PATIENCE.
#if CLUME_FLIGHT_DRAWS < CLUME_PATIENCE
#define LANES_MANY CLUME_FLIGHT_DRAWS
#else
#define LANES_MANY CLUME_PATIENCE
#endif

/// Flies the lanes in *under_way until no more than `enough` are; those that end, or have drawn a multiple of LANES_MANY, are taken
/// out of it, and set *result. *above: look-ups above their bound.
static void lanes_fly_on(LaneFlights* f, const LaneDraws* r, vint* under_way, vint* result, int enough, vuint* above, SCENE_ARGS) {
    for (int round = 0; CLUME_WIDTH > 1 || round < CLUME_LANES_ROUNDS; ++round) {
        // Steps are cheap beside collisions: most lanes are brought to one first.
        vfloat end;
        vint tentative;
        for (int steps = 0;; ++steps) {
            end = min_v(f->t_exit, f->t_end);
            const vfloat depth = f->majorant * (end - f->t);
            tentative = *under_way & (f->tau < depth);
            const vint stepping = *under_way & vnot(tentative);
            if (lanes_brought(stepping, *under_way, steps)) break;
            LANE_SET(f->tau, f->tau - depth, stepping);
            const vint left = stepping & vnot(lanes_next(f, stepping, params, cells));
            LANE_SET(*result, (vint)FLIGHT_ESCAPED, left);
            *under_way &= vnot(left);
        }
        if (vany(tentative)) {
            LANE_SET(f->t, min_v(fma(f->tau, rcp_v(f->majorant), f->t), end), tentative);
            vuint threshold, own, other, scales;
            const vuint slot = vselect((vuint)0u, f->reference + uniform_index_v(f->slot, f->count), tentative);
            lanes_load((__global const uint4*)references, slot, &threshold, &own, &other, &scales);
            const vint mine = f->threshold < threshold;
            const vuint primitive = vselect((vuint)0u, vselect(other, own, mine), tentative);
            const vfloat scale = as_vfloat(vselect(scales, scales << (vuint)16u, mine) & (vuint)0xffff0000u);
            const vfloat probability = scale * lanes_kernel(f, primitive, primitives);
            *above += vselect((vuint)0u, (vuint)1u, tentative & (probability > (vfloat)1.0f));
            LANE_SET(f->draw, f->draw + 1u, tentative);
            const vint real = tentative & (uniform_v(f->accept) < probability);
            LANE_SET(f->primitive, primitive, real);
            const vint many = tentative & vnot(real) & ((f->draw % (vuint)LANES_MANY) == (vuint)0u);
            LANE_SET(*result, (vint)FLIGHT_COLLIDED, real);
            LANE_SET(*result, (vint)FLIGHT_PAUSED, many);
            *under_way &= vnot(real | many);
            lanes_draw(f, r, tentative);
        }
        if (lanes_count(*under_way) <= enough) return;
    }
}

/// Flies the lanes in *under_way until no more than `enough` are; those that end, or pause, are taken out of it, and set *result.
static void lanes_fly(LaneFlights* f, const LaneDraws* r, vint* under_way, vint* result, int enough, vuint* above, SCENE_ARGS) {
    const vint before = *under_way;
    lanes_fly_on(f, r, under_way, result, enough, above, SCENE);
    const vint many = before & vnot(*under_way) & (*result == (vint)FLIGHT_PAUSED) & ((f->draw % (vuint)CLUME_FLIGHT_DRAWS) != (vuint)0u);
    if (!vany(many)) return;
    // Out of patience: the rest of their cells is left to cell_decompose.
    for (int i = 0; i < CLUME_WIDTH; ++i) {
        if (!LANE_OF(int, many, i)) continue;
        const Draws own = {LANE_OF(uint, r->number, i), LANE_OF(uint, r->pixel, i), LANE_OF(uint, r->depth, i), r->seed};
        const float end = min_s(LANE_OF(float, f->t_exit, i), LANE_OF(float, f->t_end, i));
        const float t = cell_decompose(LANE_OF(uint, f->reference, i), LANE_OF(uint, f->count, i), lane_origin(f, i), lane_direction(f, i), LANE_OF(float, f->t, i), end,
                                       draw_key(&own, LANE_OF(uint, f->draw, i) ^ DRAW_REST), (uint*)&f->primitive + i, references, primitives);
        const bool collided = t < CLUME_INFINITY;
        ((float*)&f->t)[i] = collided ? t : end;
        ((int*)result)[i] = collided ? FLIGHT_COLLIDED : FLIGHT_ESCAPED;
        ((int*)under_way)[i] = collided ? 0 : -1;
    }
}

#endif
