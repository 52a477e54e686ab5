// SPDX-License-Identifier: MIT
// The rest of a cell, exactly: for null collisions that get nowhere, where a cell's bound is far above what a ray meets there (beside
// the support of something dense, or in a thin disc). Having drawn CLUME_PATIENCE tentative collisions, a flight leaves the rest of
// its present cell to decomposition among the primitives listed there; an estimate of transmittance takes it as it is. Flights have
// no memory, and when that is done depends on what is behind alone, so the distribution stays what it is.
#include "medium.cl"

#ifndef CLUME_PATIENCE  // tentative collisions of a flight or an estimate between two such cells: a power of two
#define CLUME_PATIENCE 256
#endif

#define DRAW_REST 0x10000000u  // in a draw's number: the key of a decomposition

/// The ray's chord through a primitive between t and end, all lanes alike; false if there is none.
static bool primitive_chord(__global const Primitive* q, float3 o, float3 d, float t, float end, Chord* c, uint* family, float* e2, float* start, float* stop) {
#if CLUME_ONE_MEDIUM
    *family = CLUME_FAMILIES;
    *e2 = CLUME_EXTENT_SQUARED;
#else
    *family = q->family;
    *e2 = q->extent_squared;
#endif
    const vint hit = intersect_rows((vfloat)q->mu[0], (vfloat)q->mu[1], (vfloat)q->mu[2], (vfloat)q->w[0], (vfloat)q->w[1], (vfloat)q->w[2], (vfloat)q->w[3], (vfloat)q->w[4], (vfloat)q->w[5],
                                    o, d, *e2, c);
    *start = max_s(t, ((const float*)&c->t_in)[0]);
    *stop = min_s(end, ((const float*)&c->t_out)[0]);
    return ((const int*)&hit)[0] != 0 && *start < *stop;
}

/// The first collision between t and end with a primitive that the cell lists; CLUME_INFINITY if there is none.
static float cell_decompose(uint reference, uint count, float3 o, float3 d, float t, float end, uint2 key, uint* primitive, __global const Reference* references, __global const Primitive* primitives) {
    float best = CLUME_INFINITY;
    for (uint k = reference; k < reference + count; ++k) {
        const uint id = references[k].own;
        Chord c;
        uint family;
        float e2, start, stop;
        if (!primitive_chord(primitives + id, o, d, t, end, &c, &family, &e2, &start, &stop)) continue;
        const vfloat collision = flight_part(&c, (vfloat)primitives[id].sigma, (vfloat)start, exponential_v(primitive_bits((vuint)id, key)), family, (vfloat)e2);
        const float own = ((const float*)&collision)[0];
        if (own > stop || own > best || (own == best && id > *primitive)) continue;
        best = own;
        *primitive = id;
    }
    return best;
}

/// Optical depth between t and end of the primitives that the cell lists.
static float cell_depth(uint reference, uint count, float3 o, float3 d, float t, float end, __global const Reference* references, __global const Primitive* primitives) {
    float sum = 0.0f;
    for (uint k = reference; k < reference + count; ++k) {
        __global const Primitive* q = primitives + references[k].own;
        Chord c;
        uint family;
        float e2, start, stop;
        if (!primitive_chord(q, o, d, t, end, &c, &family, &e2, &start, &stop)) continue;
        const vfloat depth = depth_part(&c, (vfloat)q->sigma, (vfloat)start, (vfloat)stop, family, (vfloat)e2);
        sum += ((const float*)&depth)[0];
    }
    return sum;
}
