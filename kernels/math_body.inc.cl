// SPDX-License-Identifier: MIT
// Included twice by math.cl: bodies for one float (FN(x) = x_s) and for vectors (x_v).
// Each function states domain and worst error, checked by tests/test_math.cpp against high precision.

/// Smaller and larger of two numbers that are not NaN.
static VF FN(min)(VF a, VF b) { return SEL(b, a, a < b); }
static VF FN(max)(VF a, VF b) { return SEL(b, a, a > b); }

/// 1 / x for 2^-100 < |x| < 2^100; error < 0.51 ulp. Integer start, three Newton steps.
static VF FN(rcp)(VF x) {
    VF y = AS_F((VI)0x7ef311c7 - AS_I(x));
    y = y * fma(-x, y, (VF)2.0f);
    y = y * fma(-x, y, (VF)2.0f);
    return fma(y, fma(-x, y, (VF)1.0f), y);
}

/// a / b, 2^-50 < |a|, |b| < 2^50; error < 0.51 ulp.
static VF FN(divide)(VF a, VF b) {
    const VF y = FN(rcp)(b);
    const VF q = a * y;
    return fma(fma(-q, b, a), y, q);
}

/// 1 / sqrt(x) for 2^-100 < x < 2^100; error < 1 ulp.
static VF FN(rsqrt)(VF x) {
    const VF half_x = 0.5f * x;
    VF y = AS_F((VI)0x5f375a86 - (AS_I(x) >> (VI)1));
    y = y * fma(-half_x * y, y, (VF)1.5f);
    y = y * fma(-half_x * y, y, (VF)1.5f);
    return fma(y, fma(-half_x * y, y, (VF)0.5f), y);
}

/// sqrt(x) for 0 <= x < 2^100, 0 below 2^-100; error < 0.51 ulp.
static VF FN(sqrt)(VF x) {
    const VF y = FN(rsqrt)(SEL(x, (VF)1.0f, x < (VF)0x1p-100f));
    const VF s = x * y;
    const VF r = fma(fma(-s, s, x), 0.5f * y, s);
    return SEL(r, (VF)0.0f, x < (VF)0x1p-100f);
}

/// exp(x) for x <= 88, 0 below −69 (2^-100); error < 1.1 ulp. x = n ln 2 + r, n by the magic-number add.
static VF FN(exp)(VF x) {
    const VF magic = (VF)12582912.0f;
    const VF shifted = fma(x, (VF)1.44269504f, magic);
    const VF n = shifted - magic;
    VF r = fma(n, (VF)-0.693145752f, x);
    r = fma(n, (VF)-1.42860677e-6f, r);
    VF p = fma(r, fma(r, fma(r, fma(r, (VF)1.390127573e-3f, (VF)8.363144908e-3f), (VF)4.166685354e-2f), (VF)1.666657729e-1f), (VF)0.5f);
    p = fma(p, r * r, r) + 1.0f;
    const VF scaled = AS_F(AS_I(p) + ((AS_I(shifted) - (VI)0x4b400000) << (VI)23));
    return SEL(scaled, (VF)0.0f, x < (VF)-69.0f);
}

/// log(m) with m = 1 + f, f in [sqrt(1/2) − 1, sqrt(2) − 1], plus e ln 2.
static VF FN(log_of)(VF f, VF e) {
    VF p = fma(f, (VF)-7.778033703e-2f, (VF)1.277733210e-1f);
    p = fma(f, p, (VF)-1.311403803e-1f);
    p = fma(f, p, (VF)1.419614611e-1f);
    p = fma(f, p, (VF)-1.662709340e-1f);
    p = fma(f, p, (VF)2.000163625e-1f);
    p = fma(f, p, (VF)-2.500077870e-1f);
    p = fma(f, p, (VF)3.333332535e-1f);
    p = fma(f, p, (VF)-0.5f);
    return fma(e, (VF)0.693145752f, fma(e, (VF)1.42860677e-6f, fma(p, f * f, f)));
}

/// log(x) for 2^-120 < x < 2^120; error < 1.1 ulp (absolute 1.2e-7 near 1 is relative there too, f being exact).
static VF FN(log)(VF x) {
    const VI k = (AS_I(x) - (VI)0x3f3504f3) >> (VI)23;
    const VF f = AS_F(AS_I(x) - (k << (VI)23)) - 1.0f;
    const VF e = AS_F(k + (VI)0x4b400000) - 12582912.0f;
    return FN(log_of)(f, e);
}

/// x as float, correctly rounded (error < 0.5000001 ulp): two exact halves, one rounding.
static VF FN(from_uint)(VU x) {
    const VF hi = AS_F((x >> (VU)16) | (VU)0x53000000u) - 549764202496.0f;  // 2^39 + 2^23
    return hi + AS_F((x & (VU)0xffffu) | (VU)0x4b000000u);
}

/// −log(u), u = (x + 1/2) 2^-32: a unit exponential from 32 random bits; in [1.16e-10, 22.9], error < 1.8 ulp.
/// Above u = 1/2 it works on 1 − u, taken from the complemented bits, so that small depths keep their relative accuracy.
static VF FN(exponential)(VU x) {
    const VI upper = AS_I(x) < (VI)0;
    const VF y = FN(from_uint)(SEL(x, ~x, AS_U(upper))) + 0.5f;  // u or 1 − u, times 2^32
    // u >= 1/2: 1 − u = y 2^-32 = z. For z below 1 − sqrt(1/2): f = −z, e = 0. Else m = 2u = 2 − 2z, f = 1 − 2z, e = −1.
    const VF z = y * 0x1p-32f;
    const VI far = z > (VF)0.2928932f;
    const VF f_upper = SEL(-z, fma((VF)-2.0f, z, (VF)1.0f), far);
    const VF e_upper = SEL((VF)0.0f, (VF)-1.0f, far);
    const VI k = (AS_I(y) - (VI)0x3f3504f3) >> (VI)23;
    const VF f_lower = AS_F(AS_I(y) - (k << (VI)23)) - 1.0f;
    const VF e_lower = AS_F(k + (VI)0x4b400000) - (12582912.0f + 32.0f);
    return -FN(log_of)(SEL(f_lower, f_upper, upper), SEL(e_lower, e_upper, upper));
}

/// erfc(x), x >= 0; error < 5e-7 relative up to x = 8, below 2^-96 from there, 0 from 8.31. erfc = e^(−x²) t P(t), t = 1 / (1 + 0.4 x).
static VF FN(erfc)(VF x) {
    const VF t = FN(rcp)(fma(x, (VF)0.4f, (VF)1.0f));
    VF p = fma(t, (VF)-2.602753242e-2f, (VF)1.788328548e-1f);
    p = fma(t, p, (VF)-4.542150374e-1f);
    p = fma(t, p, (VF)4.887248066e-1f);
    p = fma(t, p, (VF)-2.362534097e-1f);
    p = fma(t, p, (VF)2.466751162e-1f);
    p = fma(t, p, (VF)1.382882528e-1f);
    p = fma(t, p, (VF)2.131149015e-1f);
    p = fma(t, p, (VF)2.251637366e-1f);
    p = fma(t, p, (VF)2.256963238e-1f);
    const VF x2 = x * x;
    const VF low = fma(x, x, -x2);
    const VF e = FN(exp)(-x2);
    return fma(-e, low, e) * (t * p);
}

/// x >= 0 with erfc(x) = q, 2^-90 < q <= 1; error < 8e-7 relative. x = (1 − q) P(w), w = −log(q (2 − q)) [Giles 2012].
static VF FN(erfc_inverse)(VF q) {
    const VF z = 1.0f - q;
    const VF w = -FN(log)(q * (2.0f - q));
    const VF c = w - 3.0f;
    VF p = fma(c, (VF)6.377768435e-10f, (VF)-5.435840904e-9f);
    p = fma(c, p, (VF)-1.854221674e-8f);
    p = fma(c, p, (VF)4.477600366e-7f);
    p = fma(c, p, (VF)-1.774768592e-6f);
    p = fma(c, p, (VF)-1.270510809e-5f);
    p = fma(c, p, (VF)1.951260361e-4f);
    p = fma(c, p, (VF)-8.362000197e-4f);
    p = fma(c, p, (VF)-5.738193736e-3f);
    p = fma(c, p, (VF)2.416304109e-1f);
    p = fma(c, p, (VF)1.623542015f);
    const VI tail = w > (VF)6.25f;
    if (ANY(tail)) {
        const VF s = FN(sqrt)(w) - 5.75f;
        VF r = fma(s, (VF)1.511129212e-9f, (VF)-1.649634889e-8f);
        r = fma(s, r, (VF)1.404285950e-8f);
        r = fma(s, r, (VF)2.732664934e-7f);
        r = fma(s, r, (VF)-3.683547153e-7f);
        r = fma(s, r, (VF)-2.371593949e-6f);
        r = fma(s, r, (VF)4.560800947e-6f);
        r = fma(s, r, (VF)2.237687341e-8f);
        r = fma(s, r, (VF)2.127411332e-5f);
        r = fma(s, r, (VF)-7.979536046e-5f);
        r = fma(s, r, (VF)-4.242656273e-4f);
        r = fma(s, r, (VF)1.009837473f);
        r = fma(s, r, (VF)5.607482086f);
        p = SEL(p, r, tail);
    }
    return z * p;
}

/// s in [0, 1] with s² (1 − s/3) = y, y in [0, 2/3]: the Epanechnikov penetration depth; error < 3e-7 relative, 0 for y
/// below 2^-100.
static VF FN(epanechnikov_inverse)(VF y) {
    const VF z = FN(sqrt)(y);
    VF p = fma(z, (VF)4.074856393e-1f, (VF)-1.351777349f);
    p = fma(z, p, (VF)1.994200024f);
    p = fma(z, p, (VF)-1.635745489f);
    p = fma(z, p, (VF)8.377333612e-1f);
    p = fma(z, p, (VF)-2.456125093e-1f);
    p = fma(z, p, (VF)7.220458716e-2f);
    p = fma(z, p, (VF)3.151734176e-2f);
    p = fma(z, p, (VF)6.975467061e-2f);
    p = fma(z, p, (VF)1.666599057e-1f);
    p = fma(z, p, (VF)1.0f);
    return z * p;
}

/// sin and cos (*cosine) of 2π x, x in [0, 1]: quarter turns by rint, then Taylor-like minimax on ±1/8 turn; error < 1.5e-7 absolute.
static VF FN(sincos_turns)(VF x, VF* cosine) {
    const VF y = 4.0f * x;
    const VF k = rint(y);
    const VF r = y - k;  // exact, in [-1/2, 1/2], quarter turns
    const VF r2 = r * r;
    const VF s = r * fma(r2, fma(r2, fma(r2, fma(r2, (VF)1.581950817e-4f, (VF)-4.681260631e-3f), (VF)7.969258184e-2f), (VF)-6.459640961e-1f), (VF)1.570796327f);
    const VF c = fma(r2, fma(r2, fma(r2, fma(r2, (VF)9.033629753e-4f, (VF)-2.085993603e-2f), (VF)2.536691826e-1f), (VF)-1.233700540f), (VF)1.0f);
    const VI q = TO_I(k) & (VI)3, odd = (q & (VI)1) == (VI)1;
    const VF sn = SEL(s, c, odd);
    const VF cn = SEL(c, s, odd);
    *cosine = SEL(cn, -cn, (q == (VI)1) | (q == (VI)2));
    return SEL(sn, -sn, q >= (VI)2);
}
