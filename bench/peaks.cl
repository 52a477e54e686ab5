// SPDX-License-Identifier: MIT
// What a device can do at most: fused multiply-adds in vectors of CLUME_WIDTH, alone and among additions, reading in order, reading lines at random, and
// a launch that does nothing. Every result depends on all the work, so none of it can be left out.
#include "lanes.cl"

// Sixteen independent chains of operations, 16 · rounds · CLUME_WIDTH of them in all: EVEN and ODD of x are done in turns.
#define CHAINS(EVEN, ODD)                                                                                                                              \
    const uint i = (uint)get_global_id(0);                                                                                                             \
    if (i >= count) return;                                                                                                                            \
    const vfloat va = (vfloat)a, vb = (vfloat)b;                                                                                                       \
    vfloat x0 = (vfloat)(float)i, x1 = x0 + 1.0f, x2 = x0 + 2.0f, x3 = x0 + 3.0f, x4 = x0 + 4.0f, x5 = x0 + 5.0f, x6 = x0 + 6.0f, x7 = x0 + 7.0f;      \
    vfloat x8 = x0 + 8.0f, x9 = x0 + 9.0f, xa = x0 + 10.0f, xb = x0 + 11.0f, xc = x0 + 12.0f, xd = x0 + 13.0f, xe = x0 + 14.0f, xf = x0 + 15.0f;       \
    for (uint round = 0; round < rounds; ++round) {                                                                                                    \
        x0 = EVEN(x0), x1 = ODD(x1), x2 = EVEN(x2), x3 = ODD(x3), x4 = EVEN(x4), x5 = ODD(x5), x6 = EVEN(x6), x7 = ODD(x7);                            \
        x8 = EVEN(x8), x9 = ODD(x9), xa = EVEN(xa), xb = ODD(xb), xc = EVEN(xc), xd = ODD(xd), xe = EVEN(xe), xf = ODD(xf);                            \
    }                                                                                                                                                  \
    out[i] = lanes_sum(((x0 + x1) + (x2 + x3)) + ((x4 + x5) + (x6 + x7)) + (((x8 + x9) + (xa + xb)) + ((xc + xd) + (xe + xf))));
#define FMA(x) fma(x, va, vb)
#define ADD(x) ((x) + vb)

__kernel void peak_fma(__global float* out, uint count, uint rounds, float a, float b) { CHAINS(FMA, FMA) }

__kernel void peak_fma_add(__global float* out, uint count, uint rounds, float a, float b) { CHAINS(FMA, ADD) }

#ifndef PEAK_INTERLEAVED  // 1: neighbours read neighbours, as GPUs like it; 0: a work-item reads a stretch of its own
#define PEAK_INTERLEAVED 0
#endif

/// Reads 8 · rounds vectors, wrapping around at `mask` + 1 of them (a power of two, 8 at least); `first`: work-items of the launches before.
__kernel void peak_read(__global const vfloat* data, __global float* out, uint count, uint mask, uint rounds, uint first) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    vfloat s0 = (vfloat)0.0f, s1 = s0, s2 = s0, s3 = s0, s4 = s0, s5 = s0, s6 = s0, s7 = s0;
#if PEAK_INTERLEAVED
    const uint step = count;
    uint at = i + first * 8u * rounds;
#define AT(k) data[(at + k * step) & mask]
#else
    const uint step = 1;
    uint at = (i + first) * 8u * rounds;
#define AT(k) data[(at & mask) + k]
#endif
    for (uint round = 0; round < rounds; ++round, at += 8u * step) {
        s0 += AT(0u), s1 += AT(1u), s2 += AT(2u), s3 += AT(3u);
        s4 += AT(4u), s5 += AT(5u), s6 += AT(6u), s7 += AT(7u);
    }
    out[i] = lanes_sum(((s0 + s1) + (s2 + s3)) + ((s4 + s5) + (s6 + s7)));
}

/// Reads a float of 8 · rounds lines of 64 bytes at places that do not depend on what was read.
__kernel void peak_gather(__global const float* data, __global float* out, uint count, uint mask, uint rounds, uint first) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    uint state = (i + first) * 0x9E3779B9u + 1u;
    float s0 = 0.0f, s1 = 0.0f, s2 = 0.0f, s3 = 0.0f, s4 = 0.0f, s5 = 0.0f, s6 = 0.0f, s7 = 0.0f;
    for (uint round = 0; round < rounds; ++round) {
        state = state * 1664525u + 1013904223u;
        const uint at = (state ^ (state >> 16)) & mask;
        s0 += data[16u * at], s1 += data[16u * (at ^ (0x5bd1e995u & mask))], s2 += data[16u * (at ^ (0x2545f491u & mask))], s3 += data[16u * (at ^ (0x6c078965u & mask))];
        s4 += data[16u * (at ^ (0x7feb352du & mask))], s5 += data[16u * (at ^ (0x846ca68bu & mask))], s6 += data[16u * (at ^ (0x1b873593u & mask))], s7 += data[16u * (at ^ (0x32a3b4f7u & mask))];
    }
    out[i] = ((s0 + s1) + (s2 + s3)) + ((s4 + s5) + (s6 + s7));
}

__kernel void peak_nothing(__global float* out, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i < count) out[i] = 1.0f;
}
