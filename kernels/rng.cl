// SPDX-License-Identifier: MIT
// Random numbers as a pure function of (seed, pixel, sample, depth, draw[, primitive]): no state, so that the image does not
// depend on devices, batches or traversal order. Philox4x32 with 7 rounds [Salmon11, doi 10.1145/2063384.2063405]; the tests
// compare it with Random123's. With CLUME_SOBOL the same words are spread evenly over the samples of a pixel: padded pairs of a
// scrambled Sobol' sequence [Burley20, JCGT 9(4); Laine11, doi 10.1111/j.1467-8659.2011.02010.x]. Per-primitive bits come from a keyed 32-bit mixer, one multiply-xorshift chain per vector.
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

/// x · factor: its upper and lower words. 64-bit products, those of a vector by even and odd lanes: mul_hi is slow on some devices.
static void product_s(uint x, uint factor, uint* high, uint* low) {
    const ulong p = (ulong)x * factor;
    *high = (uint)(p >> 32);
    *low = (uint)p;
}
static void product_v(vuint x, uint factor, vuint* high, vuint* low) {
#if CLUME_WIDTH == 1
    product_s(x, factor, high, low);
#else
    // Lanes picked one by one: from shifts and masks compilers make 64-bit products of three instructions.
    const vpairs both = as_vpairs(x);
    const vuint e = pairs_as_vuint((both & (vpairs)0xffffffffu) * (vpairs)factor), o = pairs_as_vuint((both >> (vpairs)32) * (vpairs)factor);
#if CLUME_WIDTH == 16
    *high = (vuint)(e.s1, o.s1, e.s3, o.s3, e.s5, o.s5, e.s7, o.s7, e.s9, o.s9, e.sb, o.sb, e.sd, o.sd, e.sf, o.sf);
    *low = (vuint)(e.s0, o.s0, e.s2, o.s2, e.s4, o.s4, e.s6, o.s6, e.s8, o.s8, e.sa, o.sa, e.sc, o.sc, e.se, o.se);
#elif CLUME_WIDTH == 8
    *high = (vuint)(e.s1, o.s1, e.s3, o.s3, e.s5, o.s5, e.s7, o.s7);
    *low = (vuint)(e.s0, o.s0, e.s2, o.s2, e.s4, o.s4, e.s6, o.s6);
#else
    *high = (vuint)(e.s1, o.s1, e.s3, o.s3);
    *low = (vuint)(e.s0, o.s0, e.s2, o.s2);
#endif
#endif
}

#include "scalar.inc.cl"
#include "rng_body.inc.cl"
#include "body_end.inc.cl"
#include "vector.inc.cl"
#include "rng_body.inc.cl"
#include "body_end.inc.cl"

static uint4 draw_words(uint number, uint pixel, uint depth, uint draw, uint2 seed) {
    uint x, y, z, w;
    draw_s(number, pixel, depth, draw, seed, &x, &y, &z, &w);
    return (uint4)(x, y, z, w);
}

static uint4 philox(uint4 counter, uint2 key) {
    uint x = counter.x, y = counter.y, z = counter.z, w = counter.w;
    philox_s(&x, &y, &z, &w, key);
    return (uint4)(x, y, z, w);
}

/// 32 random bits per primitive id under a 64-bit key: a bijective mixer (three multiply-xorshift rounds). Keys are words of
/// `philox`; ones that differ in a bit of y alone would not do.
static vuint primitive_bits(vuint id, uint2 key) {
    vuint x = id * (vuint)0x9E3779B9u ^ (vuint)key.x;
    x = (x ^ (x >> (vuint)16)) * (vuint)0x7feb352du;
    x = (x ^ (x >> (vuint)15)) * (vuint)0x846ca68bu + (vuint)key.y;
    x = (x ^ (x >> (vuint)16)) * (vuint)0x9e485565u;
    return x ^ (x >> (vuint)15);
}
