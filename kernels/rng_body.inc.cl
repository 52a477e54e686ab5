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

/// floor(x · n / 2^32): uniform in [0, n) for 32 random bits, to within n 2^-32.
static VU FN(uniform_index)(VU x, VU n) { return TO_U((TO_L(x) * TO_L(n)) >> (VL)32); }

/// Uniform in (0, 1): (x + 1/2) 2^-32 rounded to float, kept below 1; error < 1.3e-7 relative.
static VF FN(uniform)(VU x) { return FN(min)((FN(from_uint)(x) + 0.5f) * 0x1p-32f, (VF)0x1.fffffep-1f); }
