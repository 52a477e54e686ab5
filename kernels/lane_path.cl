// SPDX-License-Identifier: MIT
// CLUME_WIDTH paths side by side: path.cl, lane by lane, with the same results to the bit. What meets lights goes lane by lane
// through path.cl's own functions; the rest is done for all lanes at once.
#include "lane_flight.cl"
#include "path.cl"

#if CLUME_LANES

// Shadow rays that are flights, too, are flown side by side with the others: lanes stay full. Of CLUME_WIDTH 1, those that add up
// depths go on step by step beside the neighbours' flights, for the same reason.
#define LANE_WALKS (CLUME_NEE && CLUME_WIDTH == 1 && CLUME_TRANSMITTANCE == TRANSMITTANCE_ANALYTIC && CLUME_ACCEL == ACCEL_BVH && !CLUME_GRIDS)
#define LANE_SHADOWS (LANE_WALKS || (CLUME_NEE && CLUME_TRANSMITTANCE == TRANSMITTANCE_BINARY))
#define LANE_STACK (LANE_WALKS ? CLUME_BVH_STACK : 1)

typedef struct {
    LaneFlights flight;
    vuint sample;
    LaneDraws draws;
    vfloat beta[CLUME_CHANNELS], radiance[CLUME_CHANNELS];
    vfloat phase_pdf;
    vfloat t_surface;         // where the ray ends
    vuint surface;            // on which light (NO_LIGHT: none)
    vuint row;                // of the work-item's sums
    vfloat film_x, film_y;    // lower corner of the pixel, from the scene's centre
    vint alive, alpha;        // masks
    vint under_way, result;   // of the flights
#if LANE_SHADOWS
    vint shadow;                     // mask: the flight is a shadow ray's
    vfloat light[CLUME_CHANNELS];    // what it adds if it gets through; before beta, if it adds up depths
    vfloat next_x, next_y, next_z;   // direction that the path takes afterwards
#endif
#if LANE_WALKS
    vint walking;      // mask: the shadow ray adds up depths
    BvhWalk walk;
    float3 inverse;
    ulong depth, limit;
#endif
    vuint above;              // look-ups above their bound by lanes_fly
    uint violations;          // such look-ups by others
    uint tentative;           // tentative collisions of shadow rays
    ulong excess;
} Lanes;

#if CLUME_CHANNELS == 1
#define LANE_SPECTRUM(v, i) (((const float*)&(v)[0])[i])
#define LANE_CHANNEL(s, c) (s)
#define PARAM_CHANNEL(p, c) ((p).x)
#else
#define LANE_SPECTRUM(v, i) (float3)(((const float*)&(v)[0])[i], ((const float*)&(v)[1])[i], ((const float*)&(v)[2])[i])
#define LANE_CHANNEL(s, c) (((const float*)&(s))[c])
#define PARAM_CHANNEL(p, c) ((c) == 0 ? (p).x : (c) == 1 ? (p).y : (p).z)
#endif

static void lane_add(vfloat* radiance, int i, spectrum s) {
    for (int c = 0; c < CLUME_CHANNELS; ++c) ((float*)(radiance + c))[i] += LANE_CHANNEL(s, c);
}

/// A pixel's lower corner on the film, from the scene's centre.
static float2 film_corner(uint pixel, __constant const RenderParams* params) {
    const uint y = pixel / params->film_width;
    return (float2)((float)(pixel - y * params->film_width) - params->film_cx, (float)y - params->film_cy);
}

/// Lane i's paths are the pixel's from now on.
static void lanes_aim(Lanes* l, uint i, uint pixel, __constant const RenderParams* params) {
    const float2 corner = film_corner(pixel, params);
    ((uint*)&l->draws.pixel)[i] = pixel;
    ((float*)&l->film_x)[i] = corner.x;
    ((float*)&l->film_y)[i] = corner.y;
}

/// path_begin of the lanes in `mask`, whose sample and pixel are set.
static void lanes_start(Lanes* l, vint mask, __constant const RenderParams* params) {
    vuint a, b, c, d;
    LANE_SET(l->draws.depth, (vuint)0u, mask);
    LANE_SET(l->draws.number, sample_number_v(l->sample), mask);
    lanes_bits(&l->draws, (vuint)DRAW_CAMERA, &a, &b, &c, &d);
    const vfloat fx = l->film_x + uniform_v(a), fy = l->film_y + uniform_v(d);
    LaneFlights* f = &l->flight;
    LANE_SET(f->ox, fma(fx, (vfloat)params->plane_x.x, fma(fy, (vfloat)params->plane_y.x, (vfloat)params->plane_c.x)), mask);
    LANE_SET(f->oy, fma(fx, (vfloat)params->plane_x.y, fma(fy, (vfloat)params->plane_y.y, (vfloat)params->plane_c.y)), mask);
    LANE_SET(f->oz, fma(fx, (vfloat)params->plane_x.z, fma(fy, (vfloat)params->plane_y.z, (vfloat)params->plane_c.z)), mask);
    vfloat dx = fma(fx, (vfloat)params->dir_x.x, fma(fy, (vfloat)params->dir_y.x, (vfloat)params->dir_c.x));
    vfloat dy = fma(fx, (vfloat)params->dir_x.y, fma(fy, (vfloat)params->dir_y.y, (vfloat)params->dir_c.y));
    vfloat dz = fma(fx, (vfloat)params->dir_x.z, fma(fy, (vfloat)params->dir_y.z, (vfloat)params->dir_c.z));
    normalize3_v(&dx, &dy, &dz);
    LANE_SET(f->dx, dx, mask);
    LANE_SET(f->dy, dy, mask);
    LANE_SET(f->dz, dz, mask);
    LANE_SET(f->t, (vfloat)0.0f, mask);
    LANE_SET(f->draw, (vuint)0u, mask);
    for (int k = 0; k < CLUME_CHANNELS; ++k) {
        LANE_SET(l->beta[k], (vfloat)1.0f, mask);
        LANE_SET(l->radiance[k], (vfloat)0.0f, mask);
    }
    LANE_SET(l->phase_pdf, (vfloat)0.0f, mask);
    l->alive |= mask;
    l->alpha &= vnot(mask);
}

/// Begins the flights of the lanes in `mask`.
static void lanes_depart(Lanes* l, uint* stack, vint mask, __constant const RenderParams* params, __global const CellEntry* cells, __global const LightInfo* lights) {
    vint path = mask;
#if LANE_WALKS
    if (l->shadow) {
        bvh_begin(&l->walk, stack);
        l->inverse = ray_inverse(lane_direction(&l->flight, 0));
        l->depth = 0;
        l->walking = -1;
        return;
    }
#elif LANE_SHADOWS
    path &= vnot(l->shadow);  // a shadow ray knows its end
#endif
    LANE_SET(l->t_surface, (vfloat)CLUME_INFINITY, path);
#if LIGHT_SURFACES
    for (int i = 0; i < CLUME_WIDTH; ++i)
        if (LANE_OF(int, path, i))
            ((float*)&l->t_surface)[i] = surfaces_nearest(lane_origin(&l->flight, i), lane_direction(&l->flight, i), CLUME_INFINITY, NO_LIGHT, (uint*)&l->surface + i, params, lights);
#endif
    const vint under_way = lanes_begin(&l->flight, l->t_surface, &l->draws, mask, params, cells);
    LANE_SET(l->result, (vint)FLIGHT_ESCAPED, mask & vnot(under_way));
    l->under_way |= under_way;
}

#if LIGHT_ENVIRONMENTS == LIGHT_CONSTANT
/// environment_radiance of constant environments, for the lanes in `mask`.
static void lanes_environment(Lanes* l, vint mask, __constant const RenderParams* params, __global const LightInfo* lights) {
    const vint camera = l->draws.depth == (vuint)0u;
    vfloat sum[CLUME_CHANNELS];
    for (int k = 0; k < CLUME_CHANNELS; ++k) sum[k] = (vfloat)0.0f;
    for (uint i = 0; i < params->light_count; ++i) {
        const uint kind = lights[i].kind;
        if (kind != LIGHT_CONSTANT) continue;
        const vint counts = vselect((vint)((kind & CLUME_HITS) ? -1 : 0), (vint)(lights[i].visible ? -1 : 0), camera);
        const float other = (kind & CLUME_NEE) ? lights[i].select_pdf * CLUME_INV_4PI : 0.0f;
        const vfloat weight = vselect(divide_v(l->phase_pdf, l->phase_pdf + other), (vfloat)1.0f, camera);
        for (int k = 0; k < CLUME_CHANNELS; ++k) LANE_SET(sum[k], sum[k] + PARAM_CHANNEL(lights[i].radiance, k) * weight, counts);
    }
    for (int k = 0; k < CLUME_CHANNELS; ++k) LANE_SET(l->radiance[k], l->radiance[k] + l->beta[k] * sum[k], mask);
}
#endif

/// What the paths that escape find; they end.
static void lanes_escape(Lanes* l, vint mask, SCENE_ARGS) {
    vint missing = mask;
#if LIGHT_SURFACES
    missing &= l->surface == (vuint)NO_LIGHT;
    l->alpha |= mask & vnot(missing) & (l->draws.depth == (vuint)0u);
#endif
#if LIGHT_ENVIRONMENTS == LIGHT_CONSTANT
    if (vany(missing)) lanes_environment(l, missing, params, lights);
#endif
#if LIGHT_SURFACES || (CLUME_LIGHTS & LIGHT_ENVMAP)
    for (int i = 0; i < CLUME_WIDTH; ++i) {
        if (!LANE_OF(int, mask, i)) continue;
        const float3 d = lane_direction(&l->flight, i);
        const uint depth = LANE_OF(uint, l->draws.depth, i);
        const float phase_pdf = LANE_OF(float, l->phase_pdf, i);
#if LIGHT_SURFACES
        if (LANE_OF(uint, l->surface, i) != NO_LIGHT) {
            lane_add(l->radiance, i, LANE_SPECTRUM(l->beta, i) * path_surface(LANE_OF(uint, l->surface, i), lane_origin(&l->flight, i), d, LANE_OF(float, l->t_surface, i), phase_pdf, depth, lights));
            continue;
        }
#endif
#if CLUME_LIGHTS & LIGHT_ENVMAP
        lane_add(l->radiance, i, LANE_SPECTRUM(l->beta, i) * path_background(d, phase_pdf, depth, params, lights, texels, alias));
#endif
    }
#endif
    l->alive &= vnot(mask);
}

/// The paths in `mask` go on from where they are, in a new direction.
static void lanes_turn(Lanes* l, vfloat x, vfloat y, vfloat z, vint mask) {
    LANE_SET(l->flight.dx, x, mask);
    LANE_SET(l->flight.dy, y, mask);
    LANE_SET(l->flight.dz, z, mask);
    LANE_SET(l->draws.depth, l->draws.depth + 1u, mask);
    LANE_SET(l->flight.draw, (vuint)0u, mask);
}

/// Scatters the paths of the lanes in `mask`, or ends them.
static void lanes_collide(Lanes* l, vint mask, SCENE_ARGS) {
    LaneFlights* f = &l->flight;
    l->alpha |= mask & (l->draws.depth == (vuint)0u);
    vuint phase = (vuint)CLUME_PHASES;
    vfloat g = (vfloat)params->albedo.w, albedo[CLUME_CHANNELS], emission[CLUME_CHANNELS];
    for (int k = 0; k < CLUME_CHANNELS; ++k) {
        albedo[k] = (vfloat)PARAM_CHANNEL(params->albedo, k);
        emission[k] = (vfloat)PARAM_CHANNEL(params->emission, k);
    }
#if CLUME_PER_PRIMITIVE
    vuint row[4];
    const vuint first = vselect((vuint)0u, 2u * f->primitive, mask);
    lanes_load((__global const uint4*)shading, first, row, row + 1, row + 2, row + 3);
#if !CLUME_UNIFORM_ALBEDO
    for (int k = 0; k < CLUME_CHANNELS; ++k) albedo[k] = as_vfloat(row[k]);
#endif
#if !CLUME_UNIFORM_G
    g = as_vfloat(row[3]);
#endif
#if CLUME_EMISSION == 2 || !CLUME_ONE_MEDIUM
    lanes_load((__global const uint4*)shading, first + 1u, row, row + 1, row + 2, row + 3);
#if CLUME_EMISSION == 2
    for (int k = 0; k < CLUME_CHANNELS; ++k) emission[k] = as_vfloat(row[k]);
#endif
#if !CLUME_ONE_MEDIUM
    for (int i = 0; i < CLUME_WIDTH; ++i)
        if (LANE_OF(int, mask, i)) ((uint*)&phase)[i] = media[LANE_OF(uint, row[3], i)].phase;
#endif
#endif
#endif
#if CLUME_EMISSION
    for (int k = 0; k < CLUME_CHANNELS; ++k) LANE_SET(l->radiance[k], l->radiance[k] + l->beta[k] * (1.0f - albedo[k]) * emission[k], mask);
#endif
    vint lives = mask;
#if CLUME_DEPTH_LIMIT
    lives &= l->draws.depth != (vuint)(uint)params->max_depth;
#endif
    vfloat most = (vfloat)0.0f;
    for (int k = 0; k < CLUME_CHANNELS; ++k) {
        LANE_SET(l->beta[k], l->beta[k] * albedo[k], lives);
        most = max_v(most, l->beta[k]);
    }
    lives &= most > (vfloat)0.0f;
    vuint a, b, c, d;
    const vint roulette = lives & (as_vint(l->draws.depth) >= (vint)params->rr_depth) & (most < (vfloat)1.0f);
    if (vany(roulette)) {
        lanes_bits(&l->draws, (vuint)DRAW_ROULETTE, &a, &b, &c, &d);
        lives &= vnot(roulette & (uniform_v(a) >= most));
        const vfloat gain = rcp_v(most);
        for (int k = 0; k < CLUME_CHANNELS; ++k) LANE_SET(l->beta[k], l->beta[k] * gain, roulette & lives);
    }
    l->alive &= vnot(mask) | lives;
    if (!vany(lives)) return;
    LANE_SET(f->ox, fma(f->t, f->dx, f->ox), lives);
    LANE_SET(f->oy, fma(f->t, f->dy, f->oy), lives);
    LANE_SET(f->oz, fma(f->t, f->dz, f->oz), lives);
    lanes_bits(&l->draws, (vuint)DRAW_PHASE, &a, &b, &c, &d);
    vfloat x = f->dx, y = f->dy, z = f->dz;
    LANE_SET(l->phase_pdf, phase_sample_v(phase, g, a, d, b, c, &x, &y, &z), lives);
    vint onward = lives;
#if CLUME_NEE
    for (int i = 0; i < CLUME_WIDTH; ++i) {
        if (!LANE_OF(int, lives, i)) continue;
        const Draws r = {LANE_OF(uint, l->draws.number, i), LANE_OF(uint, l->draws.pixel, i), LANE_OF(uint, l->draws.depth, i), l->draws.seed};
        LightSample s;
        spectrum value;
        uint word;
        if (!path_light_sample(lane_origin(f, i), lane_direction(f, i), LANE_OF(uint, phase, i), LANE_OF(float, g, i), &r, &s, &value, &word, SCENE)) continue;
#if LANE_SHADOWS
#if LANE_WALKS
        l->limit = transmittance_limit(exponential_s(word));
#else
        value *= LANE_SPECTRUM(l->beta, i);
#endif
        for (int k = 0; k < CLUME_CHANNELS; ++k) ((float*)(l->light + k))[i] = LANE_CHANNEL(value, k);
        ((float*)&f->dx)[i] = s.direction.x;
        ((float*)&f->dy)[i] = s.direction.y;
        ((float*)&f->dz)[i] = s.direction.z;
        ((float*)&l->t_surface)[i] = s.distance;
        ((int*)&onward)[i] = 0;
#else
        Flight flight;
        flight.violations = l->violations;
        flight.tentative = 0;
        flight.excess = l->excess;
        value *= transmittance_estimate(lane_origin(f, i), s.direction, s.distance, word, &r, &flight, SCENE);
        lane_add(l->radiance, i, LANE_SPECTRUM(l->beta, i) * value);
        l->violations = flight.violations;
        l->tentative += flight.tentative;
        l->excess = flight.excess;
#endif
    }
#endif
    LANE_SET(f->t, (vfloat)0.0f, lives);
#if LANE_SHADOWS
    const vint shadow = lives & vnot(onward);
    LANE_SET(l->next_x, x, shadow);
    LANE_SET(l->next_y, y, shadow);
    LANE_SET(l->next_z, z, shadow);
    LANE_SET(f->draw, (vuint)DRAW_SHADOW, shadow);
    l->shadow |= shadow;
#endif
    lanes_turn(l, x, y, z, onward);
}

#if LANE_WALKS
/// The next groups of a shadow ray that adds up depths, as transmittance_analytic does.
static void lanes_walk(Lanes* l, uint* stack, SCENE_ARGS) {
    const float3 o = lane_origin(&l->flight, 0), d = lane_direction(&l->flight, 0);
    Work work;
    work_clear(&work);
    for (int round = 0; round < CLUME_LANES_GROUPS && l->walking; ++round) {
        const uint group = bvh_next(&l->walk, stack, o, l->inverse, 0.0f, l->t_surface, &work, nodes);
        if (group != BVH_NONE) l->depth += group_depth(group, o, d, 0.0f, l->t_surface, -CLUME_INFINITY, CLUME_INFINITY, SCENE);
        const bool dark = l->depth >= l->limit;
        if (group != BVH_NONE && !dark) continue;
        const float through = dark ? 0.0f : transmittance_below(l->depth, l->limit);
        for (int k = 0; k < CLUME_CHANNELS; ++k) l->light[k] = l->beta[k] * (l->light[k] * through);
        l->walking = 0;
        l->result = FLIGHT_ESCAPED;
    }
}
#endif

#if LANE_SHADOWS
/// Shadow rays that have ended: what got through counts, and the paths go on.
static void lanes_lit(Lanes* l, vint mask) {
    const vint clear = mask & (l->result == (vint)FLIGHT_ESCAPED);
    for (int k = 0; k < CLUME_CHANNELS; ++k) LANE_SET(l->radiance[k], l->radiance[k] + l->light[k], clear);
    LANE_SET(l->flight.t, (vfloat)0.0f, mask);
    l->shadow &= vnot(mask);
    lanes_turn(l, l->next_x, l->next_y, l->next_z, mask);
}
#endif

/// All lanes idle. They are computed with, too, so that nothing may be undefined.
static void lanes_clear(Lanes* l, __constant const RenderParams* params) {
    for (uint i = 0; i < sizeof(Lanes) / sizeof(uint); ++i) ((uint*)l)[i] = 0;
    l->result = (vint)FLIGHT_ESCAPED;
    l->draws.seed = (uint2)(params->seed_lo, params->seed_hi);
}

/// A step of all paths: those in *waiting depart (if `tired`, only to end a shadow ray: paths are not saved amid one), those in *out
/// fly on, and what has ended is looked after. *over: the paths that are complete. False if none is out.
static bool lanes_advance(Lanes* l, uint* stack, vint* waiting, vint* out, bool tired, vint* over, int* events, SCENE_ARGS) {
    vint departing = tired ? (vint)0 : *waiting;
#if LANE_SHADOWS
    departing |= *waiting & l->shadow;
#endif
    if (vany(departing)) lanes_depart(l, stack, departing, params, cells, lights);
    *out |= departing;
    *waiting &= vnot(departing);
    if (!vany(*out)) return false;
    const int busy = lanes_count(l->under_way);
    if (busy > 0) lanes_fly(&l->flight, &l->draws, &l->under_way, &l->result, tired ? 0 : busy * CLUME_LANES_ENOUGH / 16, &l->above, SCENE);
    vint going = l->under_way;
#if LANE_WALKS
    if (l->walking) lanes_walk(l, stack, SCENE);
    going |= l->walking;
#endif
    vint ended = *out & vnot(going);
    *out = going;
    const vuint tentative = vselect(l->flight.draw % (vuint)CLUME_FLIGHT_DRAWS, (vuint)CLUME_FLIGHT_DRAWS, l->result == (vint)FLIGHT_PAUSED);
    *events += (int)lanes_total(vselect((vuint)0u, 1u + TENTATIVE_EVENTS(tentative), ended));
#if LANE_SHADOWS
    const vint shadow = ended & l->shadow;
    if (vany(shadow)) lanes_lit(l, shadow & (l->result != (vint)FLIGHT_PAUSED));
    *waiting |= shadow;
    ended &= vnot(shadow);
#endif
    const vint escaped = ended & (l->result == (vint)FLIGHT_ESCAPED), collided = ended & (l->result == (vint)FLIGHT_COLLIDED);
    if (vany(escaped)) lanes_escape(l, escaped, SCENE);
    if (vany(collided)) lanes_collide(l, collided, SCENE);
    *events += (int)TENTATIVE_EVENTS(l->tentative);
    l->tentative = 0;
    *waiting |= ended & l->alive;
    *over = ended & vnot(l->alive);
    return true;
}

static void lanes_resume(Lanes* l, uint i, __global const PathState* s) {
    ((float*)&l->flight.ox)[i] = s->origin.x;
    ((float*)&l->flight.oy)[i] = s->origin.y;
    ((float*)&l->flight.oz)[i] = s->origin.z;
    ((float*)&l->flight.t)[i] = s->origin.w;
    ((float*)&l->flight.dx)[i] = s->direction.x;
    ((float*)&l->flight.dy)[i] = s->direction.y;
    ((float*)&l->flight.dz)[i] = s->direction.z;
    ((float*)&l->phase_pdf)[i] = s->direction.w;
    for (int k = 0; k < CLUME_CHANNELS; ++k) {
        ((float*)(l->beta + k))[i] = PARAM_CHANNEL(s->beta, k);
        ((float*)(l->radiance + k))[i] = PARAM_CHANNEL(s->radiance, k);
    }
    ((uint*)&l->sample)[i] = s->sample;
    ((uint*)&l->draws.depth)[i] = s->depth;
    ((uint*)&l->flight.draw)[i] = s->draw;
    ((uint*)&l->row)[i] = s->row;
    ((int*)&l->alive)[i] = (s->flags & PATH_ALIVE) ? -1 : 0;
    ((int*)&l->alpha)[i] = (s->flags & PATH_ALPHA) ? -1 : 0;
}

static void lanes_save(const Lanes* l, uint i, __global PathState* s) {
    const LaneFlights* f = &l->flight;
    s->origin = (float4)(lane_origin(f, i), LANE_OF(float, f->t, i));
    s->direction = (float4)(lane_direction(f, i), LANE_OF(float, l->phase_pdf, i));
    s->beta = (float4)(LANE_OF(float, l->beta[0], i), LANE_OF(float, l->beta[CLUME_CHANNELS / 2], i), LANE_OF(float, l->beta[CLUME_CHANNELS - 1], i), 0.0f);
    s->radiance = (float4)(LANE_OF(float, l->radiance[0], i), LANE_OF(float, l->radiance[CLUME_CHANNELS / 2], i), LANE_OF(float, l->radiance[CLUME_CHANNELS - 1], i), 0.0f);
    s->sample = LANE_OF(uint, l->sample, i);
    s->depth = LANE_OF(uint, l->draws.depth, i);
    s->draw = LANE_OF(uint, f->draw, i);
    s->flags = (LANE_OF(int, l->alive, i) ? PATH_ALIVE : 0u) | (LANE_OF(int, l->alpha, i) ? PATH_ALPHA : 0u);
    s->row = LANE_OF(uint, l->row, i);
}

#endif
