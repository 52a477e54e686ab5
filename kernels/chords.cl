// SPDX-License-Identifier: MIT
// Chords of a ray gathered for tracking by segments: the earliest CLUME_CHORDS that begin after a point, sorted, and the set
// of them that is active, in lanes of its own. What does not fit is never dropped: a gathering says up to where it is complete
// (its window), and where more chords overlap at one point than fit, depths are summed by traversals (`streamed_*`).
#include "bvh.cl"

#ifndef CLUME_CHORDS  // a multiple of 16
#define CLUME_CHORDS 256
#endif
#define CHORD_VECTORS (CLUME_CHORDS / CLUME_WIDTH)

/// Chords in lanes; `sigma` 0 in lanes that hold none.
typedef struct {
    vfloat t_perp[CHORD_VECTORS], w[CHORD_VECTORS], inverse_w[CHORD_VECTORS], d2[CHORD_VECTORS], h[CHORD_VECTORS];
    vfloat t_in[CHORD_VECTORS], t_out[CHORD_VECTORS], sigma[CHORD_VECTORS];
#if !CLUME_ONE_MEDIUM
    vfloat e2[CHORD_VECTORS];
    vuint family[CHORD_VECTORS];
#endif
    uint id[CLUME_CHORDS];
    int count;
} Chords;

#define LANE(array, i) ((float*)(array))[i]

static void chords_copy(Chords* to, int i, const Chords* from, int j) {
    LANE(to->t_perp, i) = LANE(from->t_perp, j);
    LANE(to->w, i) = LANE(from->w, j);
    LANE(to->inverse_w, i) = LANE(from->inverse_w, j);
    LANE(to->d2, i) = LANE(from->d2, j);
    LANE(to->h, i) = LANE(from->h, j);
    LANE(to->t_in, i) = LANE(from->t_in, j);
    LANE(to->t_out, i) = LANE(from->t_out, j);
    LANE(to->sigma, i) = LANE(from->sigma, j);
#if !CLUME_ONE_MEDIUM
    LANE(to->e2, i) = LANE(from->e2, j);
    ((uint*)to->family)[i] = ((const uint*)from->family)[j];
#endif
    to->id[i] = from->id[j];
}

/// Adds chord j of another set. Lanes of its block of 16 that hold none stay finite in every formula.
static void active_add(Chords* c, const Chords* from, int j) {
    if ((c->count & 15) == 0)
        for (int v = c->count / CLUME_WIDTH; v < c->count / CLUME_WIDTH + CLUME_PARTS; ++v) {
            c->t_perp[v] = c->d2[v] = c->t_in[v] = c->t_out[v] = c->sigma[v] = (vfloat)0.0f;
            c->w[v] = c->inverse_w[v] = c->h[v] = (vfloat)1.0f;
#if !CLUME_ONE_MEDIUM
            c->e2[v] = (vfloat)1.0f;
            c->family[v] = (vuint)FAMILY_UNIFORM;
#endif
        }
    chords_copy(c, c->count, from, j);
    c->count += 1;
}

/// Chords gathered, and their order by (t_in, id).
typedef struct {
    Chords chords;
    uchar order[CLUME_CHORDS];
    float window;  // all chords that begin before it are here
} Gathering;

#if CLUME_CHORDS > 256
#error "order holds bytes"
#endif

/// Lane i of a chord vector; if full, the one that begins last goes, and the window shrinks to its beginning.
static void gathering_insert(Gathering* g, const Chord* c, int i, float sigma, uint id, uint family, float e2) {
    Chords* all = &g->chords;
    const float t_in = LANE(&c->t_in, i);
    int slot = all->count;
    if (slot == CLUME_CHORDS) {
        slot = g->order[CLUME_CHORDS - 1];
        g->window = min_s(g->window, max_s(t_in, LANE(all->t_in, slot)));
        if (!(t_in < LANE(all->t_in, slot))) return;
    } else {
        all->count += 1;
    }
    LANE(all->t_perp, slot) = LANE(&c->t_perp, i);
    LANE(all->w, slot) = LANE(&c->w, i);
    LANE(all->inverse_w, slot) = LANE(&c->inverse_w, i);
    LANE(all->d2, slot) = LANE(&c->d2, i);
    LANE(all->h, slot) = LANE(&c->h, i);
    LANE(all->t_in, slot) = t_in;
    LANE(all->t_out, slot) = LANE(&c->t_out, i);
    LANE(all->sigma, slot) = sigma;
#if !CLUME_ONE_MEDIUM
    LANE(all->e2, slot) = e2;
    ((uint*)all->family)[slot] = family;
#endif
    all->id[slot] = id;
    int j = all->count - 1;
    for (; j > 0; --j) {
        const int before = g->order[j - 1];
        const float other = LANE(all->t_in, before);
        if (other < t_in || (other == t_in && all->id[before] < id)) break;
        g->order[j] = (uchar)before;
    }
    g->order[j] = (uchar)slot;
}

/// The chords that end after t_begin and begin before t_end, as many of the earliest as fit.
static void gather(Gathering* g, float3 o, float3 d, float t_begin, float t_end, Work* work, SCENE_ARGS) {
    uint stack[CLUME_BVH_STACK];
    float distance[CLUME_BVH_STACK];
    const float3 inverse = ray_inverse(d);
    g->chords.count = 0;
    g->window = t_end;
    int height = bvh_push(nodes, bvh_test(nodes, o, inverse, t_begin, t_end), t_end, stack, distance, 0);
    COUNT(work, WORK_NODES, 1);
    while (height > 0) {
        height -= 1;
        if (!(distance[height] < g->window)) continue;
        const uint child = stack[height];
        if (!(child & BVH_LEAF)) {
            height = bvh_push(nodes + child, bvh_test(nodes + child, o, inverse, t_begin, g->window), g->window, stack, distance, height);
            COUNT(work, WORK_NODES, 1);
            continue;
        }
        COUNT(work, WORK_GROUPS, 1);
        const uint group = child & ~BVH_LEAF, family = group_family(group);
        const float e2 = group_extent_squared(group);
        for (int k = 0; k < CLUME_PARTS; ++k) {
            __global const float* part = groups + (size_t)group * CLUME_GROUP_FLOATS + k * CLUME_WIDTH;
            Chord c;
            vint mask = intersect(part, o, d, e2, &c);
            mask &= (c.t_out > (vfloat)t_begin) & (c.t_in < (vfloat)g->window);
            if (!vany(mask)) continue;
            for (int i = 0; i < CLUME_WIDTH; ++i)
                if (((const int*)&mask)[i]) gathering_insert(g, &c, i, part[16 * CLUME_ROW_SIGMA + i], as_uint(part[16 * CLUME_ROW_ID + i]), family, e2);
        }
    }
}

static void active_remove(Chords* a, int i) {
    a->count -= 1;
    chords_copy(a, i, a, a->count);
    LANE(a->sigma, a->count) = 0.0f;
}

/// Removes the chords that have ended at t.
static void active_expire(Chords* a, float t) {
    for (int i = 0; i < a->count;)
        if (LANE(a->t_out, i) <= t) active_remove(a, i);
        else ++i;
}

static float active_first_exit(const Chords* a) {
    float first = CLUME_INFINITY;
    for (int i = 0; i < a->count; ++i) first = min_s(first, LANE(a->t_out, i));
    return first;
}

/// Optical depth of each lane of vector v between t0 and t1, clipped to its chord.
static vfloat lanes_depth(const Chords* a, int v, float t0, float t1) {
    const Chord c = {a->t_perp[v], a->w[v], a->inverse_w[v], a->d2[v], a->h[v], a->t_in[v], a->t_out[v]};
    const vfloat start = vselect(c.t_in, (vfloat)t0, c.t_in < (vfloat)t0), stop = vselect(c.t_out, (vfloat)t1, c.t_out > (vfloat)t1);
    const vint mask = start < stop;
    const vfloat end = vselect(start, stop, mask);
#if CLUME_ONE_MEDIUM
    const vfloat depth = depth_part(&c, a->sigma[v], start, end, (uint)CLUME_FAMILIES, (vfloat)CLUME_EXTENT_SQUARED);
#else
    vfloat depth = (vfloat)0.0f;
    for (uint family = FAMILY_GAUSSIAN; family <= FAMILY_UNIFORM; family <<= 1)
        if (family & CLUME_FAMILIES) depth = vselect(depth, depth_part(&c, a->sigma[v], start, end, family, a->e2[v]), as_vint(a->family[v] == (vuint)family));
#endif
    return vselect((vfloat)0.0f, depth, mask);
}

/// Extinction of each lane of vector v at t.
static vfloat lanes_density(const Chords* a, int v, float t) {
    const vfloat u = a->w[v] * (t - a->t_perp[v]), r2 = fma(u, u, a->d2[v]);
    const vint inside = (a->t_in[v] <= (vfloat)t) & (a->t_out[v] >= (vfloat)t);
    vfloat k = (vfloat)1.0f;
#if CLUME_ONE_MEDIUM
    const vfloat e2 = (vfloat)CLUME_EXTENT_SQUARED;
#define LANES_ARE(bit) (CLUME_FAMILIES == (bit) ? (vint)-1 : (vint)0)
#else
    const vfloat e2 = a->e2[v];
#define LANES_ARE(bit) as_vint(a->family[v] == (vuint)(bit))
#endif
#if CLUME_FAMILIES & FAMILY_GAUSSIAN
    k = vselect(k, exp_v(-0.5f * r2), LANES_ARE(FAMILY_GAUSSIAN));
#endif
#if CLUME_FAMILIES & FAMILY_EPANECHNIKOV
    k = vselect(k, fma(r2, -rcp_v(e2), (vfloat)1.0f), LANES_ARE(FAMILY_EPANECHNIKOV));
#endif
    return vselect((vfloat)0.0f, a->sigma[v] * k, inside & (k > (vfloat)0.0f));
}

/// Sum over the active chords of their depth between t0 and t1 (`density` 0), or of their extinction at t1: sixteen by
/// sixteen, by the same pairs at every width.
static float active_sum(const Chords* a, const int density, float t0, float t1) {
    float sum = 0.0f;
    for (int first = 0; first < a->count; first += 16) {
        vfloat lanes[CLUME_PARTS];
        for (int k = 0; k < CLUME_PARTS; ++k) {
            const int v = first / CLUME_WIDTH + k;
            lanes[k] = v * CLUME_WIDTH >= a->count ? (vfloat)0.0f : density ? lanes_density(a, v, t1) : lanes_depth(a, v, t0, t1);
        }
        sum += reduce_lanes(lanes);
    }
    return sum;
}

/// The active chord whose share of active_sum(…) holds u times that sum.
static uint active_pick(const Chords* a, const int density, float t0, float t1, float u) {
    const float target = u * active_sum(a, density, t0, t1);
    float sum = 0.0f;
    uint last = a->id[0];
    for (int v = 0; v * CLUME_WIDTH < a->count; ++v) {
        const vfloat share = density ? lanes_density(a, v, t1) : lanes_depth(a, v, t0, t1);
        for (int i = 0; i < CLUME_WIDTH && v * CLUME_WIDTH + i < a->count; ++i) {
            if (!(LANE(&share, i) > 0.0f)) continue;
            sum += LANE(&share, i);
            last = a->id[v * CLUME_WIDTH + i];
            if (sum > target) return last;
        }
    }
    return last;
}

/// Depth of all primitives between t0 and t1, by a traversal, and their extinction at t1 (if `with_density`, a constant);
/// unless it is null, *primitive becomes one of them by its share of the depth, u being uniform.
static float streamed_depth(const int with_density, float3 o, float3 d, float t0, float t1, float* density, float u, uint* primitive, Work* work, SCENE_ARGS) {
    uint stack[CLUME_BVH_STACK];
    BvhWalk w;
    const float3 inverse = ray_inverse(d);
    float sum = 0.0f;
    *density = 0.0f;
    bvh_begin(&w, stack);
    for (uint group; (group = bvh_next(&w, stack, o, inverse, t0, t1, work, nodes)) != BVH_NONE;) {
        const uint family = group_family(group);
        const float e2 = group_extent_squared(group);
        vfloat lanes[CLUME_PARTS];
        for (int k = 0; k < CLUME_PARTS; ++k) {
            __global const float* part = groups + (size_t)group * CLUME_GROUP_FLOATS + k * CLUME_WIDTH;
            Chord c;
            vint mask = intersect(part, o, d, e2, &c);
            const vfloat start = vselect(c.t_in, (vfloat)t0, c.t_in < (vfloat)t0), stop = vselect(c.t_out, (vfloat)t1, c.t_out > (vfloat)t1);
            mask &= start < stop;
            lanes[k] = vselect((vfloat)0.0f, depth_part(&c, vload_row(part + 16 * CLUME_ROW_SIGMA), start, vselect(start, stop, mask), family, (vfloat)e2), mask);
        }
        const float part_sum = reduce_lanes(lanes);
        if (with_density) *density += groups_density(group, 1, along_s(o, d, t1), SCENE);
        sum += part_sum;
        if (primitive == 0 || !(part_sum > 0.0f)) continue;
        // Reservoir over the groups: the newcomer wins with its share, u is stretched back to (0, 1).
        const float share = divide_s(part_sum, sum);
        if (!(u < share)) {
            u = divide_s(u - share, max_s(1.0f - share, 0x1p-24f));
            continue;
        }
        u = divide_s(u, share);
        float within = 0.0f;
        bool found = false;
        for (int lane = 0; lane < 16 && !found; ++lane) {
            const float own = LANE(lanes, lane);
            if (!(own > 0.0f)) continue;
            within += own;
            *primitive = as_uint(groups[(size_t)group * CLUME_GROUP_FLOATS + 16 * CLUME_ROW_ID + lane]);
            found = within > u * part_sum;
        }
    }
    return sum;
}

/// The segment that holds t: *begin, raised to the last end of a chord not after t, and *end, lowered to the first after it.
static void streamed_segment(float3 o, float3 d, float t, float* begin, float* end, Work* work, SCENE_ARGS) {
    uint stack[CLUME_BVH_STACK];
    BvhWalk w;
    const float3 inverse = ray_inverse(d);
    bvh_begin(&w, stack);
    for (uint group; (group = bvh_next(&w, stack, o, inverse, *begin, *end, work, nodes)) != BVH_NONE;) {
        for (int k = 0; k < CLUME_PARTS; ++k) {
            Chord c;
            const vint mask = intersect(groups + (size_t)group * CLUME_GROUP_FLOATS + k * CLUME_WIDTH, o, d, group_extent_squared(group), &c);
            if (!vany(mask)) continue;
            for (int lane = 0; lane < 2 * CLUME_WIDTH; ++lane) {
                if (!((const int*)&mask)[lane / 2]) continue;
                const float time = lane & 1 ? LANE(&c.t_out, lane / 2) : LANE(&c.t_in, lane / 2);
                if (time <= t) *begin = max_s(*begin, time);
                else *end = min_s(*end, time);
            }
        }
    }
}
