// SPDX-License-Identifier: MIT
// Tracking by segments. `regular`: entry and exit events sorted, segments with a fixed active set walked until the optical
// depth drawn is reached, the last one inverted: in closed form for one active primitive, by safeguarded Newton (or bisection)
// for several. `regular-linear`: the last segment taken as homogeneous. `march-analytic`: fixed steps instead of segments,
// exact depth per step, the last step taken as homogeneous.
#include "chords.cl"

/// x in [a, b] where the depth from a reaches tau, given that it is `depth` > tau at b. `streamed`: by traversals instead of
/// the active set. Error: the depth's own (4e-6 of it), and 2^-20 of the segment.
static float segment_root(const int streamed, const Chords* active, float3 o, float3 d, float a, float b, float tau, float depth, Work* work, SCENE_ARGS) {
    float low = a, high = b;
    float x = fma(b - a, divide_s(tau, depth), a);
    for (int i = 0; i < 48; ++i) {
        const float middle = fma(0.5f, high - low, low);
        if (!(middle > low && middle < high)) break;
        if (CLUME_BISECTION || !(x > low && x < high) || i % 4 == 3) x = middle;
        COUNT(work, WORK_ROOTS, 1);
        float density, value;
        if (streamed) {
            value = streamed_depth(!CLUME_BISECTION, o, d, a, x, &density, 0.0f, 0, work, SCENE) - tau;
        } else {
            value = active_sum(active, 0, a, x) - tau;
            density = CLUME_BISECTION ? 0.0f : active_sum(active, 1, a, x);
        }
        if (value < 0.0f) low = x;
        else high = x;
#if CLUME_BISECTION
        if (!(high - low > 0x1p-20f * (b - a))) return fma(0.5f, high - low, low);
#else
        const float change = density > 0.0f ? divide_s(value, density) : CLUME_INFINITY;
        x -= change;
        if (fabs(change) <= 0x1p-20f * (b - a)) break;
#endif
    }
    return min_s(max_s(x, a), b);
}

/// Where in the segment [a, b] the active set's depth reaches tau < depth.
static float segment_invert(const Chords* active, float3 o, float3 d, float a, float b, float tau, float depth, Work* work, SCENE_ARGS) {
#if CLUME_STRATEGY == STRATEGY_REGULAR
    if (active->count > 1) return segment_root(0, active, o, d, a, b, tau, depth, work, SCENE);
    const Chord c = {active->t_perp[0], active->w[0], active->inverse_w[0], active->d2[0], active->h[0], active->t_in[0], active->t_out[0]};
#if CLUME_ONE_MEDIUM
    const vfloat t = flight_part(&c, active->sigma[0], (vfloat)a, (vfloat)tau, (uint)CLUME_FAMILIES, (vfloat)CLUME_EXTENT_SQUARED);
#else
    const vfloat t = flight_part(&c, active->sigma[0], (vfloat)a, (vfloat)tau, ((const uint*)active->family)[0], active->e2[0]);
#endif
    return min_s(max_s(LANE(&t, 0), a), b);
#else
    return min_s(fma(b - a, divide_s(tau, depth), a), b);
#endif
}

/// The rest of a flight from t, where more chords overlap than are held at once: the same collision, found as the root of the
/// whole depth, which traversals sum.
static int regular_streamed(float3 o, float3 d, float t, float t_end, float tau, float u, Flight* f, SCENE_ARGS) {
    float begin, end, unused;
    if (!bounds_clip(o, d, t, t_end, &begin, &end, params)) return FLIGHT_ESCAPED;
    const float depth = streamed_depth(0, o, d, begin, end, &unused, 0.0f, 0, &f->work, SCENE);
    if (!(tau < depth)) return FLIGHT_ESCAPED;
    f->t = segment_root(1, 0, o, d, begin, end, tau, depth, &f->work, SCENE);
#if CLUME_STRATEGY == STRATEGY_REGULAR_LINEAR
    float a = begin, b = end;
    streamed_segment(o, d, f->t, &a, &b, &f->work, SCENE);
    const float before = streamed_depth(0, o, d, begin, a, &unused, 0.0f, 0, &f->work, SCENE);
    const float within = streamed_depth(0, o, d, a, b, &unused, u, &f->primitive, &f->work, SCENE);
    if (within > 0.0f) f->t = min_s(max_s(fma(b - a, divide_s(tau - before, within), a), a), b);
#endif
    // Where the density is 0 to rounding, whichever has depth nearby.
    streamed_depth(0, o, d, begin, f->t, &unused, u, &f->primitive, &f->work, SCENE);
    bvh_density(along_s(o, d, f->t), &f->primitive, u, &f->work, SCENE);
    return FLIGHT_COLLIDED;
}

/// Takes the chords that have begun by *t, from the *next on, into `active`. True: the segment from *t ends at *end. False: no
/// chord lies at *t, which moves on to where one begins, or to the window's end.
static bool segment_begin(const Gathering* all, Chords* active, int* next, float* t, float* end) {
    for (; *next < all->chords.count && LANE(all->chords.t_in, all->order[*next]) <= *t; ++*next) active_add(active, &all->chords, all->order[*next]);
    const float entry = *next < all->chords.count ? min_s(LANE(all->chords.t_in, all->order[*next]), all->window) : all->window;
    if (active->count == 0) {
        *t = entry;
        return false;
    }
    *end = min_s(entry, active_first_exit(active));
    return true;
}

static int flight_regular(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    const uint4 bits = draw_bits(r, 0);
    COUNT(&f->work, WORK_DRAWS, 1);
    float tau = exponential_s(bits.x), t = 0.0f;
    const float u = uniform_s(bits.y);
    Gathering all;
    Chords active;
    for (;;) {
        gather(&all, o, d, t, t_end, &f->work, SCENE);
        if (!(all.window > t)) return regular_streamed(o, d, t, t_end, tau, u, f, SCENE);
        active.count = 0;
        int next = 0;
        while (t < all.window) {
            float end;
            if (!segment_begin(&all, &active, &next, &t, &end)) continue;
            COUNT(&f->work, WORK_SEGMENTS, 1);
            const float depth = active_sum(&active, 0, t, end);
            if (tau < depth) {
                f->t = segment_invert(&active, o, d, t, end, tau, depth, &f->work, SCENE);
                f->primitive = active_pick(&active, 1, t, f->t, u);
                return FLIGHT_COLLIDED;
            }
            tau -= depth;
            t = end;
            active_expire(&active, t);
        }
        if (!(all.window < t_end)) return FLIGHT_ESCAPED;
    }
}

static int flight_march_analytic(float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    const uint4 bits = draw_bits(r, 0);
    COUNT(&f->work, WORK_DRAWS, 1);
    const float step = params->march_step, u = uniform_s(bits.y);
    float tau = exponential_s(bits.x), from = 0.0f;
    float k = 0.0f;  // steps before this one; exact up to 2^24
    Gathering all;
    Chords active;
    for (;;) {
        gather(&all, o, d, from, t_end, &f->work, SCENE);
        active.count = 0;
        int next = 0;
        for (;;) {
            if (active.count == 0) {
                if (next == all.chords.count && !(all.window < t_end)) return FLIGHT_ESCAPED;
                // Steps that no chord meets are skipped whole.
                const float entry = next < all.chords.count ? LANE(all.chords.t_in, all.order[next]) : all.window;
                k = max_s(k, floor(divide_s(entry, step)));
            }
            const float begin = k * step, end = min_s(begin + step, t_end);
            if (!(begin < t_end)) return FLIGHT_ESCAPED;
            COUNT(&f->work, WORK_SEGMENTS, 1);
            float depth, density;
            uint primitive = CLUME_NO_PRIMITIVE;
            const bool partly = all.window < end;  // a chord that meets this step may not be here
            if (partly && from < begin) {
                from = begin;
                break;
            }
            if (partly) {
                depth = streamed_depth(0, o, d, begin, end, &density, u, &primitive, &f->work, SCENE);
            } else {
                for (; next < all.chords.count && LANE(all.chords.t_in, all.order[next]) < end; ++next) active_add(&active, &all.chords, all.order[next]);
                depth = active_sum(&active, 0, begin, end);
            }
            if (tau < depth) {
                f->t = min_s(fma(end - begin, divide_s(tau, depth), begin), end);
                f->primitive = partly ? primitive : active_pick(&active, 0, begin, end, u);
                return FLIGHT_COLLIDED;
            }
            tau -= depth;
            k += 1.0f;
            if (partly) {
                from = end;
                break;
            }
            active_expire(&active, end);
        }
        if (!(from < t_end)) return FLIGHT_ESCAPED;
    }
}
