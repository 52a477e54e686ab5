// SPDX-License-Identifier: MIT
// Orders of a ray's events by (t, id), one list per work-item: the insertion that the tracker by segments uses
// (gathering_insert of chords.cl), beside the two sorting networks [Batcher68, doi 10.1145/1468075.1468121]. Only measured.
#include "config.cl"

#ifndef SORT_COUNT  // events of a list: a power of two
#define SORT_COUNT 64
#endif

static void compare_exchange(float* t, uint* id, int a, int b) {
    const float ta = t[a], tb = t[b];
    const uint ia = id[a], ib = id[b];
    const int swap = (tb < ta) | ((tb == ta) & (ib < ia));
    t[a] = swap ? tb : ta;
    t[b] = swap ? ta : tb;
    id[a] = swap ? ib : ia;
    id[b] = swap ? ia : ib;
}

/// Every merge begins with a comparison of mirrored places, so that all comparisons point the same way.
static void sort_bitonic(float* t, uint* id) {
    for (int size = 2; size <= SORT_COUNT; size *= 2) {
        for (int base = 0; base < SORT_COUNT; base += size)
            for (int i = 0; i < size / 2; ++i) compare_exchange(t, id, base + i, base + size - 1 - i);
        for (int step = size / 4; step > 0; step /= 2)
            for (int base = 0; base < SORT_COUNT; base += 2 * step)
                for (int i = base; i < base + step; ++i) compare_exchange(t, id, i, i + step);
    }
}

/// Merge exchange.
static void sort_odd_even(float* t, uint* id) {
    for (int size = 1; size < SORT_COUNT; size *= 2)
        for (int step = size; step > 0; step /= 2)
            for (int base = step % size; base + step < SORT_COUNT; base += 2 * step)
                for (int i = base; i < base + step && i + step < SORT_COUNT; ++i)
                    if (i / (2 * size) == (i + step) / (2 * size)) compare_exchange(t, id, i, i + step);
}

static void sort_insertion(float* t, uint* id) {
    for (int n = 1; n < SORT_COUNT; ++n) {
        const float own = t[n];
        const uint own_id = id[n];
        int i = n;
        for (; i > 0 && !(t[i - 1] < own || (t[i - 1] == own && id[i - 1] < own_id)); --i) {
            t[i] = t[i - 1];
            id[i] = id[i - 1];
        }
        t[i] = own;
        id[i] = own_id;
    }
}

#define SORT(name)                                                                                                              \
    /* List i % lists of `in` (t), sorted into t_out and id_out; ids are the places before. */                                  \
    __kernel void name(__global const float* in, __global float* t_out, __global uint* id_out, uint count, uint lists) {       \
        const uint i = (uint)get_global_id(0);                                                                                  \
        if (i >= count) return;                                                                                                 \
        float t[SORT_COUNT];                                                                                                    \
        uint id[SORT_COUNT];                                                                                                    \
        for (int k = 0; k < SORT_COUNT; ++k) {                                                                                  \
            t[k] = in[(i % lists) * SORT_COUNT + k];                                                                            \
            id[k] = (uint)k;                                                                                                    \
        }                                                                                                                       \
        sort_##name(t, id);                                                                                                     \
        for (int k = 0; k < SORT_COUNT; ++k) {                                                                                  \
            t_out[(size_t)i * SORT_COUNT + (size_t)k] = t[k];                                                                   \
            id_out[(size_t)i * SORT_COUNT + (size_t)k] = id[k];                                                                 \
        }                                                                                                                       \
    }
SORT(bitonic)
SORT(odd_even)
SORT(insertion)
