// SPDX-License-Identifier: MIT
// Entry point: each work-item renders a share of one pixel's samples and adds them to its own sums. After
// CLUME_LAUNCH_EVENTS events it saves its path, counts itself in `unfinished`, and goes on in the next launch.
#include "path.cl"

__kernel void render(SCENE_ARGS, __global const uint* pixels, __global PathState* states, __global ulong* sums,
                     __global uint* unfinished, uint pixel_first, uint pixel_count, uint splits, uint sample_begin, uint sample_end, uint resume) {
    const uint item = (uint)get_global_id(0);
    if (item >= pixel_count * splits) return;
    const uint pixel = pixels[pixel_first + item % pixel_count];
    // Samples of this work-item: every splits-th of the range.
    Path p;
    p.sample = sample_begin + item / pixel_count;
    p.flags = 0;
    p.flight.primitive = CLUME_NO_PRIMITIVE;
    p.flight.violations = 0;
    p.flight.excess = 0;
    work_clear(&p.flight.work);
    if (resume) {
        const PathState s = states[item];
        p.o = s.origin.xyz;
        p.flight.t = s.origin.w;
        p.d = s.direction.xyz;
        p.phase_pdf = s.direction.w;
        p.beta = to_spectrum(s.beta);
        p.radiance = to_spectrum(s.radiance);
        p.sample = s.sample;
        p.depth = s.depth;
        p.flight.draw = s.draw;
        p.flags = s.flags;
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
        PathState s;
        s.origin = (float4)(p.o, p.flight.t);
        s.direction = (float4)(p.d, p.phase_pdf);
#if CLUME_CHANNELS == 1
        s.beta = (float4)(p.beta);
        s.radiance = (float4)(p.radiance);
#else
        s.beta = (float4)(p.beta, 0.0f);
        s.radiance = (float4)(p.radiance, 0.0f);
#endif
        s.sample = p.sample;
        s.depth = p.depth;
        s.draw = p.flight.draw;
        s.flags = p.flags;
        states[item] = s;
        atomic_inc(unfinished);
    } else {
        // Others may go on in a launch to come: there this one must find itself done.
        states[item].sample = p.sample;
        states[item].flags = 0;
    }
    __global ulong* out = sums + (size_t)item * FILM_WORDS;
    for (int i = 0; i < FILM_WORDS; ++i) {
        // 128-bit sums carry from their even to their odd word; the counters that follow stand alone.
        const ulong old = resume ? out[i] : 0;
        ulong carry = 0;
        if (i < FILM_ALPHA && (i & 1)) carry = out[i - 1] < sum[i - 1] ? 1 : 0;
        out[i] = old + sum[i] + carry;
    }
}
