// SPDX-License-Identifier: MIT
// Included twice by phase.cl: bodies for one direction (FN(x) = x_s) and for vectors of them (x_v), components apart.

/// *v := *v / |*v|, for 1e-12 < |v| < 1e12; of each component, error < 1.5e-7 absolute.
static void FN(normalize3)(VF* x, VF* y, VF* z) {
    const VF s = FN(rsqrt)(fma(*x, *x, fma(*y, *y, *z * *z)));
    *x = *x * s;
    *y = *y * s;
    *z = *z * s;
}

/// Turns unit (*x, *y, *z) into a unit vector with cosine c and sine s to it and azimuth `turn` in (0, 1) [Duff17, Building an
/// orthonormal basis, revisited]. The sine comes apart: 1 − c² knows no angle below 3e-4.
static void FN(around)(VF* x, VF* y, VF* z, VF c, VF s, VF turn) {
    VF cosine;
    const VF sine = FN(sincos_turns)(turn, &cosine);
    const VF dx = *x, dy = *y, dz = *z, sign = copysign((VF)1.0f, dz);
    const VF a = -FN(rcp)(sign + dz), b = dx * dy * a;
    const VF p = s * cosine, q = s * sine;
    *x = (c * dx + p * fma(sign * dx * dx, a, (VF)1.0f)) + q * b;
    *y = (c * dy + p * (sign * b)) + q * fma(dy * dy, a, sign);
    *z = (c * dz + p * (-sign * dx)) + q * -dy;
    FN(normalize3)(x, y, z);
}

/// Uniform over the sphere, pdf 1/4π.
static void FN(sphere_uniform)(VF u, VF turn, VF* x, VF* y, VF* z) {
    const VF s = 2.0f * FN(sqrt)(FN(max)(u * (1.0f - u), (VF)0.0f));
    VF cosine;
    const VF sine = FN(sincos_turns)(turn, &cosine);
    *x = s * cosine;
    *y = s * sine;
    *z = fma((VF)-2.0f, u, (VF)1.0f);
}

/// Density [1/sr] at `versine`, which phase_versine gives; error < 1e-6 relative.
static VF FN(phase_value)(VU kind, VF g, VF versine) {
    VF value = (VF)CLUME_INV_4PI;
#if CLUME_PHASES & PHASE_HENYEY_GREENSTEIN
    const VI peaked = kind == (VU)PHASE_HENYEY_GREENSTEIN;
    if (ANY(peaked)) {
        // 1 + g² − 2 g c as a sum of what does not cancel: (1 − |g|)² + 2 |g| (1 ∓ c).
        const VF a = fabs(g), q = fma(2.0f * a, versine, (1.0f - a) * (1.0f - a));
        const VF r = FN(rsqrt)(q);
        value = SEL(value, CLUME_INV_4PI * (1.0f - a) * (1.0f + a) * r * r * r, peaked);
    }
#endif
#if CLUME_PHASES & PHASE_RAYLEIGH
    const VI rayleigh = kind == (VU)PHASE_RAYLEIGH;
    if (ANY(rayleigh)) value = SEL(value, 0.75f * CLUME_INV_4PI * fma(1.0f - versine, 1.0f - versine, (VF)1.0f), rayleigh);
#endif
    return value;
}

/// Direction after scattering in place of the one before, direction error < 5e-7 absolute, from four words; returns its density, pdf error < 2e-6 relative.
static VF FN(phase_sample)(VU kind, VF g, VU w0, VU w1, VU w2, VU w3, VF* x, VF* y, VF* z) {
    const VF u = FN(uniform)(w0), turn = FN(uniform)(w1), dx = *x, dy = *y, dz = *z;
    VF pdf = (VF)CLUME_INV_4PI;
#if CLUME_PHASES & PHASE_ISOTROPIC
    FN(sphere_uniform)(u, turn, x, y, z);
#endif
#if CLUME_PHASES & (PHASE_HENYEY_GREENSTEIN | PHASE_RAYLEIGH)
    VF c = (VF)0.0f, s = (VF)1.0f;
#endif
#if CLUME_PHASES & PHASE_HENYEY_GREENSTEIN
    const VI peaked = kind == (VU)PHASE_HENYEY_GREENSTEIN;
    if (ANY(peaked)) {
        // The usual inversion, for 1 − c and 1 + c apart and without its division by g: products of positive factors, so that
        // neither loses digits in a peak, nor as g goes to 0.
        const VF rest = 1.0f - u;
        const VI backward = g < (VF)0.0f;
        const VF inverse = FN(rcp)(SEL(fma(2.0f * g, u, 1.0f - g), fma(-2.0f * g, rest, 1.0f + g), backward));
        const VF back = (1.0f - g) * inverse, forth = (1.0f + g) * inverse;
        const VF versine = 2.0f * back * back * rest * fma(-g, rest, 1.0f + g), other = 2.0f * forth * forth * u * fma(g, u, 1.0f - g);
        pdf = SEL(pdf, FN(phase_value)(kind, g, SEL(versine, other, backward)), peaked);
        c = SEL(other - 1.0f, 1.0f - versine, versine < (VF)1.0f);
        s = FN(sqrt)(versine * other);
    }
#endif
#if CLUME_PHASES & PHASE_RAYLEIGH
    const VI rayleigh = kind == (VU)PHASE_RAYLEIGH;
    if (ANY(rayleigh)) {
        // 3/8 (1 + c²): three quarters uniform, one quarter 3/2 c², whose |c| is the largest of three uniforms.
        const VF v = FN(uniform)(w0 << (VU)3);
        const VF largest = FN(max)(v, FN(max)(FN(uniform)(w2), FN(uniform)(w3)));
        const VI flat = (w0 >> (VU)30) != (VU)0u;
        const VF cosine = SEL(SEL(-largest, largest, (w0 & (VU)0x20000000u) != (VU)0u), fma((VF)2.0f, v, (VF)-1.0f), flat);
        const VF sine = FN(sqrt)(SEL((1.0f - largest) * (1.0f + largest), 4.0f * v * (1.0f - v), flat));
        pdf = SEL(pdf, FN(phase_value)(kind, g, 1.0f - cosine), rayleigh);
        c = SEL(c, cosine, rayleigh);
        s = SEL(s, sine, rayleigh);
    }
#endif
#if CLUME_PHASES & (PHASE_HENYEY_GREENSTEIN | PHASE_RAYLEIGH)
    const VI turned = kind != (VU)PHASE_ISOTROPIC;
    VF ax = dx, ay = dy, az = dz;
    FN(around)(&ax, &ay, &az, c, s, turn);
    *x = SEL(*x, ax, turned);
    *y = SEL(*y, ay, turned);
    *z = SEL(*z, az, turned);
#endif
    return pdf;
}
