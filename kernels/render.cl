// SPDX-License-Identifier: MIT
// Entry point, but for CLUME_POOL. A row of sums gathers a share of one pixel's samples; a work-item renders a row's, one after the other, or, with
// CLUME_LANES, those of `rows_each` rows, CLUME_WIDTH paths side by side: lanes take the next sample of any of them as they come
// free. After CLUME_LAUNCH_EVENTS events a row it saves its paths, counts itself in `unfinished`, and goes on in the next launch.
#include "lane_path.cl"

#if CLUME_POOL
#include "render_pool.cl"
#elif !CLUME_LANES
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

__kernel void render(SCENE_ARGS, __global const uint* pixels, __global PathState* states, __global ulong* sums, __global uint* unfinished, uint pixel_first,
                     uint pixel_count, uint splits, uint sample_begin, uint sample_end, uint rows_each, uint resume) {
    const uint item = (uint)get_global_id(0);
    if (item >= pixel_count * splits) return;
    const uint pixel = pixels[pixel_first + item % pixel_count];
    // Samples of this work-item: every splits-th of the range.
    Path p;
    p.sample = sample_begin + item / pixel_count;
    p.flags = 0;
    flight_clear(&p.flight);
    if (resume) path_resume(&p, states + item);
    ulong sum[FILM_WORDS];
    for (int i = 0; i < FILM_WORDS; ++i) sum[i] = 0;
    uint events = 0;
    for (;;) {
        if (!(p.flags & PATH_ALIVE)) {
            if (p.sample >= sample_end) break;
            path_begin(&p, pixel, p.sample, params);
        }
        if (events >= CLUME_LAUNCH_EVENTS) break;
        p.flight.tentative = 0;
        path_event(&p, pixel, SCENE);
        events += 1 + TENTATIVE_EVENTS(p.flight.tentative);
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
        path_save(&p, states + item);
        atomic_inc(unfinished);
    } else {
        // Others may go on in a launch to come: there this one must find itself done.
        states[item].sample = p.sample;
        states[item].flags = 0;
    }
    sums_add(sums + (size_t)item * FILM_WORDS, sum, resume);
}
#else
/// The rows of sums that lanes take samples of, a row each: its index among the work-item's, its pixel, its next sample.
typedef struct {
    vuint index, pixel, next;
    vfloat x, y;        // the pixel's lower corner on the film
    uint fresh, count;  // the first row that no lane has begun; all of them
} Rows;

/// What a work-item's rows have in common.
typedef struct {
    uint first_row, pixel_first, pixel_count, splits, sample_begin, sample_end;
} Share;

/// Lane i takes samples of a row from now on: those from `next` on.
static void rows_enter(Rows* rows, uint i, uint index, uint next, const Share* share, __global const uint* pixels, __constant const RenderParams* params) {
    const uint pixel = pixels[share->pixel_first + (share->first_row + index) % share->pixel_count];
    const float2 corner = film_corner(pixel, params);
    ((uint*)&rows->index)[i] = index;
    ((uint*)&rows->pixel)[i] = pixel;
    ((uint*)&rows->next)[i] = next;
    ((float*)&rows->x)[i] = corner.x;
    ((float*)&rows->y)[i] = corner.y;
}

/// A row's first sample: every splits-th of the range from there is its own.
static uint first_sample(uint index, const Share* share) { return share->sample_begin + (share->first_row + index) / share->pixel_count; }

/// Whether samples are left that no lane has begun.
static bool rows_left(const Rows* rows, const Share* share) { return rows->fresh < rows->count || vany(rows->next < (vuint)share->sample_end); }

/// Gives each idle lane the next sample of its row; that row being done, of a row that is nobody's yet; none being left, of the
/// row of which most is left. Returns the lanes that got one.
static vint lanes_assign(Lanes* l, Rows* rows, vint idle, const Share* share, __global const uint* pixels, __constant const RenderParams* params) {
    vint begun = idle & (rows->next < (vuint)share->sample_end);
    LANE_SET(l->sample, rows->next, begun);
    LANE_SET(l->draws.pixel, rows->pixel, begun);
    LANE_SET(l->film_x, rows->x, begun);
    LANE_SET(l->film_y, rows->y, begun);
    LANE_SET(l->row, rows->index, begun);
    LANE_SET(rows->next, rows->next + share->splits, begun);
    const vint rest = idle & vnot(begun);
    if (!vany(rest) || !rows_left(rows, share)) return begun;
    for (uint i = 0; i < CLUME_WIDTH; ++i) {
        if (!LANE_OF(int, rest, i)) continue;
        uint from = i;
        if (rows->fresh < rows->count) {
            rows_enter(rows, i, rows->fresh, first_sample(rows->fresh, share), share, pixels, params);
            ++rows->fresh;
        } else {
            for (uint k = 0; k < CLUME_WIDTH; ++k)
                if (LANE_OF(uint, rows->next, k) < LANE_OF(uint, rows->next, from)) from = k;
        }
        if (LANE_OF(uint, rows->next, from) >= share->sample_end) continue;
        ((uint*)&l->row)[i] = LANE_OF(uint, rows->index, from);
        ((uint*)&l->sample)[i] = LANE_OF(uint, rows->next, from);
        ((uint*)&l->draws.pixel)[i] = LANE_OF(uint, rows->pixel, from);
        ((float*)&l->film_x)[i] = LANE_OF(float, rows->x, from);
        ((float*)&l->film_y)[i] = LANE_OF(float, rows->y, from);
        ((uint*)&rows->next)[from] += share->splits;
        ((int*)&begun)[i] = -1;
    }
    return begun;
}

__kernel void render(SCENE_ARGS, __global const uint* pixels, __global PathState* states, __global ulong* sums, __global uint* unfinished, uint pixel_first,
                     uint pixel_count, uint splits, uint sample_begin, uint sample_end, uint rows_each, uint resume) {
    const Share share = {(uint)get_global_id(0) * rows_each, pixel_first, pixel_count, splits, sample_begin, sample_end};
    if (share.first_row >= pixel_count * splits) return;
    states += (size_t)get_global_id(0) * CLUME_WIDTH;
    sums += (size_t)share.first_row * FILM_WORDS;
    Lanes l;
    uint stack[LANE_STACK];
    lanes_clear(&l, params);
    Rows rows;
    rows.index = rows.pixel = (vuint)0u;
    rows.next = (vuint)sample_end;
    rows.x = rows.y = (vfloat)0.0f;
    rows.count = min(rows_each, pixel_count * splits - share.first_row);
    rows.fresh = resume ? states[0].fresh : min((uint)CLUME_WIDTH, rows.count);
    for (uint i = 0; i < CLUME_WIDTH; ++i) {
        if (resume) {
            rows_enter(&rows, i, states[i].row, 0, &share, pixels, params);
            ((uint*)&l.draws.pixel)[i] = LANE_OF(uint, rows.pixel, i);
            rows_enter(&rows, i, states[i].next_row, states[i].next, &share, pixels, params);
            lanes_resume(&l, i, states + i);
        } else if (i < rows.count) {
            rows_enter(&rows, i, i, first_sample(i, &share), &share, pixels, params);
        }
    }
    l.draws.number = sample_number_v(l.sample);
    int events = 0;
    vint waiting = l.alive, out = (vint)0;  // paths about to fly; paths flying, or at the end of a flight
    for (;;) {
        const bool tired = events >= CLUME_LAUNCH_EVENTS * (int)rows_each;
        if (!tired) {
            const vint idle = vnot(l.alive);
            if (vany(idle) && rows_left(&rows, &share)) {
                const vint begun = lanes_assign(&l, &rows, idle, &share, pixels, params);
                lanes_start(&l, begun, params);
                waiting |= begun;
            }
        }
        vint over;
        if (!lanes_advance(&l, stack, &waiting, &out, tired, &over, &events, SCENE)) break;
        if (!vany(over)) continue;
        for (int i = 0; i < CLUME_WIDTH; ++i) {
            if (!LANE_OF(int, over, i)) continue;
            __global ulong* s = sums + LANE_OF(uint, l.row, i) * FILM_WORDS;
            film_sample(s, LANE_SPECTRUM(l.radiance, i), params->film_scale);
            s[FILM_ALPHA] += LANE_OF(int, l.alpha, i) ? 1 : 0;
        }
    }
    sums[FILM_VIOLATIONS] += l.violations + lanes_total(l.above);
    sums[FILM_EXCESS] += l.excess;
    if (vany(l.alive) || rows_left(&rows, &share)) atomic_inc(unfinished);
    for (uint i = 0; i < CLUME_WIDTH; ++i) {
        lanes_save(&l, i, states + i);
        states[i].next_row = LANE_OF(uint, rows.index, i);
        states[i].next = LANE_OF(uint, rows.next, i);
        states[i].fresh = rows.fresh;
    }
}
#endif
