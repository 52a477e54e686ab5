// SPDX-License-Identifier: MIT
// Random numbers as a pure function of (seed, pixel, sample, depth, draw[, primitive]): no state, so that the image does not
// depend on devices, batches or traversal order. Philox4x32 with 7 rounds [Salmon11, doi 10.1145/2063384.2063405]; the tests
// compare it with Random123's. Per-primitive bits come from a keyed 32-bit mixer, one multiply-xorshift chain per vector.
#include "math.cl"

// Draw numbers: flights count up from 0; the others have their own block each. A grid's flight and its part in a shadow ray
// count up from 2^20 times its index above theirs (grid_bits of grid.cl).
#define DRAW_GRID_FLIGHT 0x80000000u
#define DRAW_GRID_SHADOW 0xc0000000u
#define DRAW_PHASE 0xf0000000u
#define DRAW_LIGHT 0xf0000001u
#define DRAW_CAMERA 0xf0000002u
#define DRAW_ROULETTE 0xf0000003u
#define DRAW_LIGHT_MORE 0xf0000004u
#define DRAW_LAMP 0xf0000005u         // and the next: one more place near a lamp, from a scattering
#define DRAW_LAMP_CAMERA 0xf0000007u  // and the next: the same on the camera's ray
#define DRAW_SHADOW 0x40000000u  // and on: transmittance estimates
// Bits of the depth that give the two legs of light by a place near a lamp numbers of their own.
#define DRAWS_TO_PLACE 0x80000000u
#define DRAWS_TO_LAMP 0x40000000u
#define DRAWS_FROM_CAMERA 0x20000000u  // beside one of them

/// 128 random bits; counter = (sample, pixel, depth, draw), key = seed. 64-bit products: some mul_hi are slow.
static uint4 philox(uint4 counter, uint2 key) {
    uint x = counter.x, y = counter.y, z = counter.z, w = counter.w, a = key.x, b = key.y;
    for (int round = 0; round < 7; ++round) {
        const ulong p = (ulong)x * 0xD2511F53u, q = (ulong)z * 0xCD9E8D57u;
        x = (uint)(q >> 32) ^ y ^ a;
        y = (uint)q;
        z = (uint)(p >> 32) ^ w ^ b;
        w = (uint)p;
        a += 0x9E3779B9u;
        b += 0xBB67AE85u;
    }
    return (uint4)(x, y, z, w);
}

/// floor(x · n / 2^32): uniform in [0, n) for 32 random bits, to within n 2^-32.
static uint uniform_index(uint x, uint n) { return (uint)(((ulong)x * n) >> 32); }

/// Uniform in (0, 1): (x + 1/2) 2^-32 rounded to float, kept below 1; error < 1.3e-7 relative.
static float uniform_s(uint x) { return min_s((from_uint_s(x) + 0.5f) * 0x1p-32f, 0x1.fffffep-1f); }

/// 32 random bits per primitive id under a 64-bit key: a bijective mixer (three multiply-xorshift rounds). Keys are words of
/// `philox`; ones that differ in a bit of y alone would not do.
static vuint primitive_bits(vuint id, uint2 key) {
    vuint x = id * (vuint)0x9E3779B9u ^ (vuint)key.x;
    x = (x ^ (x >> (vuint)16)) * (vuint)0x7feb352du;
    x = (x ^ (x >> (vuint)15)) * (vuint)0x846ca68bu + (vuint)key.y;
    x = (x ^ (x >> (vuint)16)) * (vuint)0x9e485565u;
    return x ^ (x >> (vuint)15);
}
