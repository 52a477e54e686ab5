// SPDX-License-Identifier: MIT
// Entry point. A row of sums gathers a share of one pixel's samples; a work-item renders a row's, one after the other, or, with
// CLUME_LANES, those of CLUME_WIDTH rows side by side: lanes take the next sample of any of them as they come free. After
// CLUME_LAUNCH_EVENTS events (a lane) it saves its paths, counts itself in `unfinished`, and goes on in the next launch.
#include "lane_path.cl"

/// Adds what a work-item has gathered for one row of sums to what earlier launches left there, if any.
static void sums_add(__global ulong* out, const ulong* sum, uint resume) {
    ulong carry = 0;
    for (int i = 0; i < FILM_WORDS; ++i) {
        const ulong old = resume ? out[i] : 0, value = old + sum[i] + carry;
        // 128-bit sums carry from their even to their odd word; the counters that follow stand alone.
        carry = i < FILM_ALPHA && !(i & 1) && value < old ? 1 : 0;
        out[i] = value;
    }
}

#if !CLUME_LANES
__kernel void render(SCENE_ARGS, __global const uint* pixels, __global PathState* states, __global ulong* sums,
                     __global uint* unfinished, uint pixel_first, uint pixel_count, uint splits, uint sample_begin, uint sample_end, uint resume) {
    const uint item = (uint)get_global_id(0);
    if (item >= pixel_count * splits) return;
    const uint pixel = pixels[pixel_first + item % pixel_count];
    // Samples of this work-item: every splits-th of the range.
    Path p;
    p.sample = sample_begin + item / pixel_count;
    p.flags = 0;
    flight_clear(&p.flight);
    if (resume) {
        __global const PathState* s = states + item;
        p.o = s->origin.xyz;
        p.flight.t = s->origin.w;
        p.d = s->direction.xyz;
        p.phase_pdf = s->direction.w;
        p.beta = to_spectrum(s->beta);
        p.radiance = to_spectrum(s->radiance);
        p.sample = s->sample;
        p.depth = s->depth;
        p.flight.draw = s->draw;
        p.flags = s->flags;
    }
    ulong sum[FILM_WORDS];
    for (int i = 0; i < FILM_WORDS; ++i) sum[i] = 0;
    uint events = 0;
    for (;;) {
        if (!(p.flags & PATH_ALIVE)) {
            if (p.sample >= sample_end) break;
            path_begin(&p, pixel, p.sample, params);
        }
        if (events++ == CLUME_LAUNCH_EVENTS) break;
        path_event(&p, pixel, SCENE);
        if (!(p.flags & PATH_ALIVE)) {
            film_sample(sum, p.radiance, params->film_scale);
            sum[FILM_ALPHA] += (p.flags & PATH_ALPHA) ? 1 : 0;
            p.sample += splits;
        }
    }
    sum[FILM_VIOLATIONS] = p.flight.violations;
    sum[FILM_EXCESS] = p.flight.excess;
#if CLUME_COUNT
    for (int i = 0; i < WORK_KINDS; ++i) sum[FILM_WORK + i] = p.flight.work.n[i];
#endif
    const bool more = p.sample < sample_end;
    if (more) {
        __global PathState* s = states + item;  // one by one: what pads them is nobody's
        s->origin = (float4)(p.o, p.flight.t);
        s->direction = (float4)(p.d, p.phase_pdf);
#if CLUME_CHANNELS == 1
        s->beta = (float4)(p.beta);
        s->radiance = (float4)(p.radiance);
#else
        s->beta = (float4)(p.beta, 0.0f);
        s->radiance = (float4)(p.radiance, 0.0f);
#endif
        s->sample = p.sample;
        s->depth = p.depth;
        s->draw = p.flight.draw;
        s->flags = p.flags;
        atomic_inc(unfinished);
    } else {
        // Others may go on in a launch to come: there this one must find itself done.
        states[item].sample = p.sample;
        states[item].flags = 0;
    }
    sums_add(sums + (size_t)item * FILM_WORDS, sum, resume);
}
#else
/// A work-item's rows of sums, lane i being row i (`own`): their pixels, and the next sample of each.
typedef struct {
    vuint own, next, pixel;
    vfloat x, y;  // the pixel's lower corner on the film
} Rows;

/// Gives each idle lane the next sample of its own row, or, that row being done, of the one of which most is left; returns the
/// lanes that got one.
static vint lanes_assign(Lanes* l, Rows* rows, vint idle, uint splits, uint sample_end) {
    vint begun = idle & (rows->next < (vuint)sample_end);
    LANE_SET(l->draws.sample, rows->next, begun);
    LANE_SET(l->draws.pixel, rows->pixel, begun);
    LANE_SET(l->film_x, rows->x, begun);
    LANE_SET(l->film_y, rows->y, begun);
    LANE_SET(l->row, rows->own, begun);
    LANE_SET(rows->next, rows->next + splits, begun);
    const vint rest = idle & ~begun;
    if (!vany(rest) || !vany(rows->next < (vuint)sample_end)) return begun;
    for (int i = 0; i < CLUME_WIDTH; ++i) {
        if (!LANE_OF(int, rest, i)) continue;
        uint row = 0;
        for (uint k = 1; k < CLUME_WIDTH; ++k)
            if (LANE_OF(uint, rows->next, k) < LANE_OF(uint, rows->next, row)) row = k;
        if (LANE_OF(uint, rows->next, row) >= sample_end) break;
        ((uint*)&l->row)[i] = row;
        ((uint*)&l->draws.sample)[i] = LANE_OF(uint, rows->next, row);
        ((uint*)&l->draws.pixel)[i] = LANE_OF(uint, rows->pixel, row);
        ((float*)&l->film_x)[i] = LANE_OF(float, rows->x, row);
        ((float*)&l->film_y)[i] = LANE_OF(float, rows->y, row);
        ((uint*)&rows->next)[row] += splits;
        ((int*)&begun)[i] = -1;
    }
    return begun;
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
    ((uint*)&l->draws.sample)[i] = s->sample;
    ((uint*)&l->draws.depth)[i] = s->depth;
    ((uint*)&l->flight.draw)[i] = s->draw;
    ((uint*)&l->row)[i] = s->row;
    ((int*)&l->alive)[i] = (s->flags & PATH_ALIVE) ? -1 : 0;
    ((int*)&l->alpha)[i] = (s->flags & PATH_ALPHA) ? -1 : 0;
}

static void lanes_save(const Lanes* l, uint i, uint next, __global PathState* s) {
    const LaneFlights* f = &l->flight;
    s->origin = (float4)(lane_origin(f, i), LANE_OF(float, f->t, i));
    s->direction = (float4)(lane_direction(f, i), LANE_OF(float, l->phase_pdf, i));
    s->beta = (float4)(LANE_OF(float, l->beta[0], i), LANE_OF(float, l->beta[CLUME_CHANNELS / 2], i), LANE_OF(float, l->beta[CLUME_CHANNELS - 1], i), 0.0f);
    s->radiance = (float4)(LANE_OF(float, l->radiance[0], i), LANE_OF(float, l->radiance[CLUME_CHANNELS / 2], i), LANE_OF(float, l->radiance[CLUME_CHANNELS - 1], i), 0.0f);
    s->sample = LANE_OF(uint, l->draws.sample, i);
    s->depth = LANE_OF(uint, l->draws.depth, i);
    s->draw = LANE_OF(uint, f->draw, i);
    s->flags = (LANE_OF(int, l->alive, i) ? PATH_ALIVE : 0u) | (LANE_OF(int, l->alpha, i) ? PATH_ALPHA : 0u);
    s->row = LANE_OF(uint, l->row, i);
    s->next = next;
}

__kernel void render(SCENE_ARGS, __global const uint* pixels, __global PathState* states, __global ulong* sums,
                     __global uint* unfinished, uint pixel_first, uint pixel_count, uint splits, uint sample_begin, uint sample_end, uint resume) {
    const uint first_row = (uint)get_global_id(0) * CLUME_WIDTH;
    if (first_row >= pixel_count * splits) return;
    const uint count = min((uint)CLUME_WIDTH, pixel_count * splits - first_row);
    Rows rows;
    rows.next = (vuint)sample_end;
    rows.own = rows.pixel = (vuint)0u;
    rows.x = rows.y = (vfloat)0.0f;
    vint usable = (vint)0;  // a lane without a row has nowhere to leave its path
    for (uint i = 0; i < count; ++i) {
        ((int*)&usable)[i] = -1;
        ((uint*)&rows.own)[i] = i;
        const uint pixel = pixels[pixel_first + (first_row + i) % pixel_count], y = pixel / params->film_width;
        ((uint*)&rows.next)[i] = resume ? states[first_row + i].next : sample_begin + (first_row + i) / pixel_count;
        ((uint*)&rows.pixel)[i] = pixel;
        ((float*)&rows.x)[i] = (float)(pixel - y * params->film_width) - params->film_cx;
        ((float*)&rows.y)[i] = (float)y - params->film_cy;
    }
    Lanes l;
    for (uint i = 0; i < sizeof(Lanes) / sizeof(uint); ++i) ((uint*)&l)[i] = 0;  // idle lanes are computed with, too
    l.alive = l.alpha = l.under_way = (vint)0;
    l.result = (vint)FLIGHT_ESCAPED;
    l.row = l.draws.sample = l.draws.pixel = l.draws.depth = (vuint)0u;
    l.draws.seed = (uint2)(params->seed_lo, params->seed_hi);
#if LANE_SHADOWS
    l.shadow = (vint)0;
#endif
    l.above = (vint)0;
    l.violations = 0;
    l.excess = 0;
    for (uint i = 0; resume && i < count; ++i) {
        lanes_resume(&l, i, states + first_row + i);
        ((uint*)&l.draws.pixel)[i] = LANE_OF(uint, rows.pixel, LANE_OF(uint, l.row, i));
    }
    ulong sum[CLUME_WIDTH * FILM_WORDS];
    for (uint i = 0; i < CLUME_WIDTH * FILM_WORDS; ++i) sum[i] = 0;
    int events = 0;
    vint waiting = l.alive, out = (vint)0;  // paths about to fly; paths flying, or at the end of a flight
    for (;;) {
        const bool tired = events >= CLUME_LAUNCH_EVENTS * CLUME_WIDTH;
        if (!tired) {
            const vint idle = usable & ~l.alive;
            if (vany(rows.next < (vuint)sample_end) && vany(idle)) {
                const vint begun = lanes_assign(&l, &rows, idle, splits, sample_end);
                lanes_start(&l, begun, params);
                waiting |= begun;
            }
        }
        vint departing = tired ? (vint)0 : waiting;
#if LANE_SHADOWS
        departing |= waiting & l.shadow;  // paths are not saved amid a shadow ray
#endif
        lanes_depart(&l, departing, params, cells, lights);
        out |= departing;
        waiting &= ~departing;
        if (!vany(out)) break;
        const int busy = lanes_count(l.under_way);
        if (busy > 0) lanes_fly(&l.flight, &l.draws, &l.under_way, &l.result, tired ? 0 : busy * CLUME_LANES_ENOUGH / 16, &l.above, SCENE);
        vint ended = out & ~l.under_way;
        out = l.under_way;
        events += lanes_count(ended);
#if LANE_SHADOWS
        const vint shadow = ended & l.shadow;
        if (vany(shadow)) lanes_lit(&l, shadow & (l.result != (vint)FLIGHT_PAUSED));
        waiting |= shadow;
        ended &= ~shadow;
#endif
        const vint escaped = ended & (l.result == (vint)FLIGHT_ESCAPED), collided = ended & (l.result == (vint)FLIGHT_COLLIDED);
        if (vany(escaped)) lanes_escape(&l, escaped, SCENE);
        if (vany(collided)) lanes_collide(&l, collided, SCENE);
        waiting |= ended & l.alive;
        const vint over = ended & ~l.alive;
        if (!vany(over)) continue;
        for (int i = 0; i < CLUME_WIDTH; ++i) {
            if (!LANE_OF(int, over, i)) continue;
            ulong* s = sum + LANE_OF(uint, l.row, i) * FILM_WORDS;
            film_sample(s, LANE_SPECTRUM(l.radiance, i), params->film_scale);
            s[FILM_ALPHA] += LANE_OF(int, l.alpha, i) ? 1 : 0;
        }
    }
    sum[FILM_VIOLATIONS] = l.violations + (uint)lanes_count(l.above);
    sum[FILM_EXCESS] = l.excess;
    if (vany(l.alive) || vany(rows.next < (vuint)sample_end)) atomic_inc(unfinished);
    for (uint i = 0; i < count; ++i) {
        lanes_save(&l, i, LANE_OF(uint, rows.next, i), states + first_row + i);
        sums_add(sums + (size_t)(first_row + i) * FILM_WORDS, sum + i * FILM_WORDS, resume);
    }
}
#endif
