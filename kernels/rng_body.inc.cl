// SPDX-License-Identifier: MIT
// Included twice by rng.cl: bodies for one draw (FN(x) = x_s) and for vectors of them (x_v).

/// 128 random bits in place of the counter (sample, pixel, depth, draw), key = seed.
static void FN(philox)(VU* c0, VU* c1, VU* c2, VU* c3, uint2 key) {
    VU x = *c0, y = *c1, z = *c2, w = *c3;
    uint a = key.x, b = key.y;
    for (int round = 0; round < 7; ++round) {
        VU p_high, p_low, q_high, q_low;
        FN(product)(x, 0xD2511F53u, &p_high, &p_low);
        FN(product)(z, 0xCD9E8D57u, &q_high, &q_low);
        x = q_high ^ y ^ (VU)a;
        y = q_low;
        z = p_high ^ w ^ (VU)b;
        w = p_low;
        a += 0x9E3779B9u;
        b += 0xBB67AE85u;
    }
    *c0 = x;
    *c1 = y;
    *c2 = z;
    *c3 = w;
}

#if CLUME_SOBOL
/// Swaps the bits of x in the mask with those `distance` above them.
static VU FN(swap_bits)(VU x, uint distance, uint mask) {
    const VU t = ((x >> (VU)distance) ^ x) & (VU)mask;
    return x ^ t ^ (t << (VU)distance);
}

/// The bits of x in reverse order. Not by shifts and `|`: compilers make an intrinsic of them that Oclgrind 21.10 does not know.
static VU FN(reverse)(VU x) {
    x = FN(swap_bits)(FN(swap_bits)(FN(swap_bits)(x, 16u, 0x0000ffffu), 8u, 0x00ff00ffu), 4u, 0x0f0f0f0fu);
    return FN(swap_bits)(FN(swap_bits)(x, 2u, 0x33333333u), 1u, 0x55555555u);
}

/// Nested permutation [Owen95]: every bit is flipped by a hash of the seed and of the bits below it [Laine11], Vegdahl's constants.
static VU FN(nested)(VU x, VU seed) {
    x ^= x * (VU)0x3d20adeau;
    x += seed;
    x *= (seed >> (VU)16) | (VU)1u;
    x ^= x * (VU)0x05526c56u;
    return x ^ (x * (VU)0x53a22864u);
}

/// Second coordinate of the Sobol' sequence from the first, that is, from the point's number with its bits reversed: bit 31 − j is
/// the sum modulo 2 of (k over j) times bit 31 − k, over k >= j.
static VU FN(sobol_second)(VU x) {
    x ^= x << (VU)16;
    x ^= (x & (VU)0x00ff00ffu) << (VU)8;
    x ^= (x & (VU)0x0f0f0f0fu) << (VU)4;
    x ^= (x & (VU)0x33333333u) << (VU)2;
    return x ^ ((x & (VU)0x55555555u) << (VU)1);
}

/// The words of `philox` for (any sample, pixel, depth, draw) become those of this sample: *c0 with *c3 and *c1 with *c2 are the
/// coordinates of a two-dimensional Sobol' sequence over the samples of a pixel, in an order of its own, shifted digitally. What is
/// added to the words does not depend on them, so those of one sample are as random as `philox` makes them.
static void FN(sobol)(VU number, VU pixel, VU depth, VU draw, uint2 key, VU* c0, VU* c1, VU* c2, VU* c3) {
    VU seed = (pixel * (VU)0x9E3779B9u) ^ (depth * (VU)0x85EBCA6Bu) ^ (draw * (VU)0xC2B2AE35u) ^ (VU)key.x;
    seed = (seed ^ (seed >> (VU)16)) * (VU)0x7FEB352Du + (VU)key.y;
    seed = (seed ^ (seed >> (VU)15)) * (VU)0x846CA68Bu;
    seed ^= seed >> (VU)16;
    const VU p = FN(nested)(number, seed), q = FN(nested)(number, seed * (VU)0x9E485565u + (VU)0x632BE59Bu);
    *c0 ^= p;
    *c3 ^= FN(sobol_second)(p);
    *c1 ^= q;
    *c2 ^= FN(sobol_second)(q);
}
#endif

/// What `draw` needs to know of a sample.
static VU FN(sample_number)(VU sample) {
#if CLUME_SOBOL
    return FN(reverse)(sample);
#else
    return sample;
#endif
}

/// The words of one draw for a sample's number: by `philox` alone, or (CLUME_SOBOL) spread evenly over a pixel's samples.
static void FN(draw)(VU number, VU pixel, VU depth, VU draw, uint2 seed, VU* c0, VU* c1, VU* c2, VU* c3) {
    *c0 = CLUME_SOBOL ? (VU)0xffffffffu : number;
    *c1 = pixel;
    *c2 = depth;
    *c3 = draw;
    FN(philox)(c0, c1, c2, c3, seed);
#if CLUME_SOBOL
    FN(sobol)(number, pixel, depth, draw, seed, c0, c1, c2, c3);
#endif
}

/// floor(x · n / 2^32): uniform in [0, n) for 32 random bits, to within n 2^-32.
static VU FN(uniform_index)(VU x, VU n) { return TO_U((TO_L(x) * TO_L(n)) >> (VL)32); }

/// Uniform in (0, 1): (x + 1/2) 2^-32 rounded to float, kept below 1; error < 1.3e-7 relative.
static VF FN(uniform)(VU x) { return FN(min)((FN(from_uint)(x) + 0.5f) * 0x1p-32f, (VF)0x1.fffffep-1f); }
