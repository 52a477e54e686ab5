// SPDX-License-Identifier: MIT
// Entry point for devices whose work-items go side by side (CLUME_WIDTH 1). A work-item renders one path after the other, the
// next one being whichever sample of whichever pixel nobody has begun: there is one row of sums a pixel, which all add to. After
// CLUME_LAUNCH_EVENTS events it saves its path, counts itself in progress[0], and goes on in the next launch.

/// The samples [sample_begin, sample_end) of the pixels [pixel_first, pixel_first + pixel_count) of the list; progress[1]: how many
/// of them have been begun, by more than there are at the end.
typedef struct {
    volatile __global uint* progress;
    uint pixel_first, pixel_count, sample_begin, path_count;
} Pool;

/// Takes a path from the pool; false if there is none left.
static bool pool_take(const Pool* pool, __global const uint* pixels, uint* row, uint* pixel, uint* sample) {
    if (pool->progress[1] >= pool->path_count) return false;
    const uint path = atomic_inc(pool->progress + 1);
    if (path >= pool->path_count) return false;
    *row = path % pool->pixel_count;
    *pixel = pixels[pool->pixel_first + *row];
    *sample = pool->sample_begin + path / pool->pixel_count;
    return true;
}

__kernel void render(SCENE_ARGS, __global const uint* pixels, __global PathState* states, __global ulong* sums, __global uint* progress, uint pixel_first,
                     uint pixel_count, uint splits, uint sample_begin, uint sample_end, uint items, uint resume) {
    if (get_global_id(0) >= items) return;
    const Pool pool = {progress, pixel_first, pixel_count, sample_begin, pixel_count * (sample_end - sample_begin)};
    __global PathState* state = states + get_global_id(0);
    bool left = true;  // in the pool, as far as known
#if CLUME_LANES
    Lanes l;
    uint stack[LANE_STACK];
    lanes_clear(&l, params);
    if (resume) {
        lanes_resume(&l, 0, state);
        lanes_aim(&l, 0, pixels[pixel_first + state->row], params);
    }
    l.draws.number = sample_number_v(l.sample);
    int events = 0;
    vint waiting = l.alive, out = 0;
    for (;;) {
        const bool tired = events >= CLUME_LAUNCH_EVENTS;
        if (!l.alive && !tired && left) {
            uint pixel;
            left = pool_take(&pool, pixels, &l.row, &pixel, &l.sample);
            if (left) {
                lanes_aim(&l, 0, pixel, params);
                lanes_start(&l, -1, params);
                waiting = -1;
            }
        }
        vint over;
        if (!lanes_advance(&l, stack, &waiting, &out, tired, &over, &events, SCENE)) break;
        if (!over) continue;
        __global ulong* sum = sums + (size_t)l.row * FILM_WORDS;
        film_sample(sum, LANE_SPECTRUM(l.radiance, 0), params->film_scale);
        film_count(sum + FILM_ALPHA, l.alpha ? 1 : 0);
    }
    film_count(sums + FILM_VIOLATIONS, l.violations + l.above);
    film_count(sums + FILM_EXCESS, l.excess);
    if (l.alive || left) atomic_inc(progress);
    lanes_save(&l, 0, state);
#else
    Path p;
    p.flags = 0;
    flight_clear(&p.flight);
    uint row = 0, pixel = 0;
    if (resume) {
        path_resume(&p, state);
        row = state->row;
        pixel = pixels[pixel_first + row];
    }
    uint events = 0;
    for (;;) {
        if (events >= CLUME_LAUNCH_EVENTS) break;
        if (!(p.flags & PATH_ALIVE)) {
            uint sample;
            left = pool_take(&pool, pixels, &row, &pixel, &sample);
            if (!left) break;
            path_begin(&p, pixel, sample, params);
        }
        p.flight.tentative = 0;
        path_event(&p, pixel, SCENE);
        events += 1 + TENTATIVE_EVENTS(p.flight.tentative);
        if (p.flags & PATH_ALIVE) continue;
        __global ulong* sum = sums + (size_t)row * FILM_WORDS;
        film_sample(sum, p.radiance, params->film_scale);
        film_count(sum + FILM_ALPHA, (p.flags & PATH_ALPHA) ? 1 : 0);
#if CLUME_COUNT
        for (int i = 0; i < WORK_KINDS; ++i) film_count(sum + FILM_WORK + i, p.flight.work.n[i]);
        work_clear(&p.flight.work);
#endif
    }
    __global ulong* sum = sums + (size_t)row * FILM_WORDS;
    film_count(sum + FILM_VIOLATIONS, p.flight.violations);
    film_count(sum + FILM_EXCESS, p.flight.excess);
#if CLUME_COUNT
    for (int i = 0; i < WORK_KINDS; ++i) film_count(sum + FILM_WORK + i, p.flight.work.n[i]);
#endif
    if ((p.flags & PATH_ALIVE) || left) atomic_inc(progress);
    if (p.flags & PATH_ALIVE)
        path_save(&p, state);
    else
        state->flags = 0;
    state->row = row;
#endif
}
