// SPDX-License-Identifier: MIT
// One point or ray against CLUME_WIDTH ellipsoids of a group: whitened intersection, density, optical depth, free flight.
// Formulas and symbols as in the physics notes of docs/design.md; perpendicular form, never c − b²/a
// [Haines19, Ray Tracing Gems ch. 7]. `part` points at the lanes' first float of row 0.
#include "rng.cl"

/// Where a ray meets CLUME_WIDTH ellipsoids: t of the point nearest the centre, 1/|W d|, squared distance there and half
/// chord h (both whitened), entry and exit t. Only valid where the mask returned by `intersect` is set.
typedef struct {
    vfloat t_perp, w, inverse_w, d2, h, t_in, t_out;
} Chord;

/// `intersect`, the rows of a primitive per lane being given.
static vint intersect_rows(vfloat mu_x, vfloat mu_y, vfloat mu_z, vfloat w00, vfloat w01, vfloat w02, vfloat w11, vfloat w12, vfloat w22, float3 o, float3 d, float e2, Chord* c) {
    const vfloat x = o.x - mu_x, y = o.y - mu_y, z = o.z - mu_z;
    const vfloat a0 = fma(w00, x, fma(w01, y, w02 * z)), a1 = fma(w11, y, w12 * z), a2 = w22 * z;
    const vfloat b0 = fma(w00, (vfloat)d.x, fma(w01, (vfloat)d.y, w02 * d.z)), b1 = fma(w11, (vfloat)d.y, w12 * d.z), b2 = w22 * d.z;
    const vfloat bb = fma(b0, b0, fma(b1, b1, b2 * b2));
    c->inverse_w = rsqrt_v(bb);
    c->w = bb * c->inverse_w;
    const vfloat ab = fma(a0, b0, fma(a1, b1, a2 * b2));
    c->t_perp = -(ab * c->inverse_w) * c->inverse_w;
    const vfloat p0 = fma(c->t_perp, b0, a0), p1 = fma(c->t_perp, b1, a1), p2 = fma(c->t_perp, b2, a2);
    c->d2 = fma(p0, p0, fma(p1, p1, p2 * p2));
    const vint hit = c->d2 < (vfloat)e2;
    c->h = sqrt_v(vselect((vfloat)0.0f, e2 - c->d2, hit));
    c->t_in = fma(-c->h, c->inverse_w, c->t_perp);
    c->t_out = fma(c->h, c->inverse_w, c->t_perp);
    return hit;
}

/// Whitens o − mu and d, and finds the chord inside whitened radius sqrt(e2); mask of lanes hit by the full line.
/// The points o + t d at entry and exit lie on the surface, ends error < 2 ulp of the radius; a hit is lost or invented by lines that
/// are no farther than that from tangency. d needs not be normalised.
static vint intersect(__global const float* part, float3 o, float3 d, float e2, Chord* c) {
    return intersect_rows(vload_row(part), vload_row(part + 16), vload_row(part + 32), vload_row(part + 48), vload_row(part + 64), vload_row(part + 80), vload_row(part + 96),
                          vload_row(part + 112), vload_row(part + 128), o, d, e2, c);
}

/// The same by the quadratic in S = Σ⁻¹ (rows: centre, then S xx xy xz yy yz zz), kept to be measured: the discriminant is taken
/// at the foot of the perpendicular, as above, without whitening; ends error < 2 ulp of the radius
/// for axis ratios up to 30: the floats of Σ⁻¹ square them.
static vint intersect_quadratic(__global const float* part, float3 o, float3 d, float e2, Chord* c) {
    const vfloat x = o.x - vload_row(part), y = o.y - vload_row(part + 16), z = o.z - vload_row(part + 32);
    const vfloat xx = vload_row(part + 48), xy = vload_row(part + 64), xz = vload_row(part + 80);
    const vfloat yy = vload_row(part + 96), yz = vload_row(part + 112), zz = vload_row(part + 128);
    const vfloat sx = fma(xx, (vfloat)d.x, fma(xy, (vfloat)d.y, xz * d.z));
    const vfloat sy = fma(xy, (vfloat)d.x, fma(yy, (vfloat)d.y, yz * d.z));
    const vfloat sz = fma(xz, (vfloat)d.x, fma(yz, (vfloat)d.y, zz * d.z));
    const vfloat bb = fma(sx, (vfloat)d.x, fma(sy, (vfloat)d.y, sz * d.z));
    c->inverse_w = rsqrt_v(bb);
    c->w = bb * c->inverse_w;
    c->t_perp = -(fma(sx, x, fma(sy, y, sz * z)) * c->inverse_w) * c->inverse_w;
    const vfloat px = fma(c->t_perp, (vfloat)d.x, x), py = fma(c->t_perp, (vfloat)d.y, y), pz = fma(c->t_perp, (vfloat)d.z, z);
    c->d2 = fma(px, fma(xx, px, 2.0f * fma(xy, py, xz * pz)), fma(py, fma(yy, py, 2.0f * (yz * pz)), zz * pz * pz));
    const vint hit = c->d2 < (vfloat)e2;
    c->h = sqrt_v(vselect((vfloat)0.0f, e2 - c->d2, hit));
    c->t_in = fma(-c->h, c->inverse_w, c->t_perp);
    c->t_out = fma(c->h, c->inverse_w, c->t_perp);
    return hit;
}

/// Extinction that each primitive adds at p, 0 outside its support: error < 1e-6 relative against the greatest and least within
/// the intersection's limit of p, 0 where K is below 2^-100.
static vfloat density_part(__global const float* part, float3 p, uint family, vfloat e2) {
    const vfloat x = p.x - vload_row(part), y = p.y - vload_row(part + 16), z = p.z - vload_row(part + 32);
    const vfloat w00 = vload_row(part + 48), w01 = vload_row(part + 64), w02 = vload_row(part + 80);
    const vfloat w11 = vload_row(part + 96), w12 = vload_row(part + 112), w22 = vload_row(part + 128);
    const vfloat a0 = fma(w00, x, fma(w01, y, w02 * z)), a1 = fma(w11, y, w12 * z), a2 = w22 * z;
    const vfloat r2 = fma(a0, a0, fma(a1, a1, a2 * a2));
    vfloat k = (vfloat)1.0f;
#if CLUME_FAMILIES & FAMILY_GAUSSIAN
    if (family == FAMILY_GAUSSIAN) k = exp_v(-0.5f * r2);
#endif
#if CLUME_FAMILIES & FAMILY_EPANECHNIKOV
    if (family == FAMILY_EPANECHNIKOV) k = fma(r2, -rcp_v(e2), (vfloat)1.0f);
#endif
    return vselect((vfloat)0.0f, k * vload_row(part + 16 * CLUME_ROW_SIGMA), r2 < e2);
}

/// ∫ 2/√π e^(−x²) from x0 to x1 = x0 + delta, |x| <= 6, without cancellation: midpoint series for short intervals, else by
/// erfc of the side; error < 1e-6 relative. delta >= 0 comes apart, since a short interval's ends do not know its length.
static vfloat erf_between(vfloat x0, vfloat x1, vfloat delta) {
    const vfloat m = 0.5f * (x0 + x1);
    const vfloat f0 = erfc_v(fabs(x0)), f1 = erfc_v(fabs(x1));
    const vint straddle = (x0 < (vfloat)0.0f) & (x1 > (vfloat)0.0f);
    const vfloat far = vselect(fabs(f0 - f1), 2.0f - (f0 + f1), straddle);
    const vint near = (delta < (vfloat)0.5f) & (fabs(m) * delta < (vfloat)0.5f);
    if (!vany(near)) return far;
    // 2/√π δ e^(−m²) (1 + H2 δ²/24 + H4 δ⁴/1920 + H6 δ⁶/322560), H the Hermite polynomials at m.
    const vfloat m2 = m * m, q = delta * delta;
    const vfloat h2 = fma((vfloat)4.0f, m2, (vfloat)-2.0f);
    const vfloat h4 = fma(m2, fma((vfloat)16.0f, m2, (vfloat)-48.0f), (vfloat)12.0f);
    const vfloat h6 = fma(m2, fma(m2, fma((vfloat)64.0f, m2, (vfloat)-480.0f), (vfloat)720.0f), (vfloat)-120.0f);
    const vfloat series = fma(q, fma(q, fma(q, h6 * 3.1001984e-6f, h4 * 5.2083333e-4f), h2 * 4.1666667e-2f), (vfloat)1.0f);
    // What rounding left of m² and of m = x0 + δ/2.
    const vfloat low = fma(2.0f * m, fma((vfloat)0.5f, delta, x0 - m), fma(m, m, -m2)), e = exp_v(-m2);
    return vselect(far, 1.12837917f * delta * series * fma(-e, low, e), near);
}

/// Optical depth of each primitive between t0 and t1 (t0 <= t1, inside its chord): error < 3e-6 relative against lines within the
/// intersection's limit, 0 below 2^-100 (of sigma / w where that is above 1). Split at any t, additivity error < 1e-5 relative; as t1 grows, monotonicity error < 3e-6 relative.
/// On a chord whose half is less than 2^-5 of its distance, an interval's ends count as known to an ulp, and a uniform chord's own.
/// Of the line that c's t_perp, w and d2 give, geometry error < 2e-6 relative, t being known to 2 ulp of |t_perp| + (h + 1) / w.
static vfloat depth_part(const Chord* c, vfloat sigma, vfloat t0, vfloat t1, uint family, vfloat e2) {
    vfloat depth = sigma * (t1 - t0);  // uniform
#if CLUME_FAMILIES & (FAMILY_GAUSSIAN | FAMILY_EPANECHNIKOV)
    // Entry and exit are rounded: a chord that is brief beside its distance is stretched from its floats to its true length.
    const vfloat reach = 0.5f * (c->t_out - c->t_in), per_half = rcp_v(vselect((vfloat)1.0f, reach, reach > (vfloat)0x1p-60f));
    const vint brief = reach < 0x1p-5f * fabs(c->t_perp);
#endif
#if CLUME_FAMILIES & FAMILY_GAUSSIAN
    if (family == FAMILY_GAUSSIAN) {
        const vfloat scale = 0.707106781f * vselect(c->w, c->h * per_half, brief);  // x = from + scale (t − base)
        const vfloat base = vselect(c->t_perp, c->t_in, brief), from = vselect((vfloat)0.0f, -0.707106781f * c->h, brief);
        depth = 1.25331414f * sigma * c->inverse_w * exp_v(-0.5f * c->d2) * erf_between(fma(scale, t0 - base, from), fma(scale, t1 - base, from), scale * (t1 - t0));
    }
#endif
#if CLUME_FAMILIES & FAMILY_EPANECHNIKOV
    if (family == FAMILY_EPANECHNIKOV) {
        // Penetration s from the nearer end of the chord, so that nothing cancels there: s² (1 − s/3), differences factored.
        const vint later = (t0 - c->t_in) > (c->t_out - t1);
        const vfloat s0 = per_half * vselect(t0 - c->t_in, c->t_out - t1, later);
        const vfloat s1 = per_half * vselect(t1 - c->t_in, c->t_out - t0, later);
        const vfloat shape = (s0 + s1) - (1.0f / 3.0f) * fma(s0, s0, fma(s0, s1, s1 * s1));
        depth *= (e2 - c->d2) * rcp_v(e2) * shape * vselect((vfloat)1.0f, c->h * c->inverse_w * per_half, brief);  // h² / E²
    }
#endif
    return vselect((vfloat)0.0f, depth, depth > (vfloat)0x1p-100f);
}

/// t of each primitive's own collision for optical depth tau measured from t0 (inside the chord), or CLUME_INFINITY where its
/// depth to the exit is less: error < 6e-6 relative of tau, t and the line being off by no more than the intersection's limit;
/// tau >= 2^-34, as `exponential` gives it.
/// Clamped to [t0, t_out], so that rounding loses no collision.
/// On the line that c's t_perp, w and d2 give, geometry error < 1e-6 relative of tau, t being known to 3 ulp of |t_perp| + (h + 1) / w.
static vfloat flight_part(const Chord* c, vfloat sigma, vfloat t0, vfloat tau, uint family, vfloat e2) {
    vfloat t = t0;
    vint collides = sigma > (vfloat)0.0f;
    sigma = vselect((vfloat)1.0f, sigma, collides);
    if (family == FAMILY_UNIFORM) {
#if CLUME_FAMILIES & FAMILY_UNIFORM
        t = fma(tau, rcp_v(sigma), t0);
        collides &= t <= c->t_out;
#endif
    }
#if CLUME_FAMILIES & FAMILY_GAUSSIAN
    if (family == FAMILY_GAUSSIAN) {
        const vfloat scale = 0.707106781f * c->w;
        const vfloat x0 = scale * (t0 - c->t_perp);
        // tau / C, C = sigma √(π/2) e^(−d²/2) / w
        const vint dark = c->d2 > (vfloat)138.0f;  // the density is below 2^-99 of the peak all along
        const vfloat step = tau * divide_v(0.797884561f * c->w * exp_v(0.5f * vselect(c->d2, (vfloat)138.0f, dark)), sigma);
        const vfloat f0 = erfc_v(fabs(x0));
        const vint before = x0 < (vfloat)0.0f;
        const vfloat near = f0 + step;  // mass behind the target, counted from −∞, if it starts before the middle
        const vint mirrored = before & (near <= (vfloat)1.0f);
        const vfloat far = vselect(f0 - step, 2.0f - near, before);  // mass ahead of the target
        const vfloat q = vselect(far, near, mirrored);
        collides &= (q > (vfloat)0x1p-80f) & (c->d2 <= (vfloat)138.0f);
        const vfloat x = erfc_inverse_v(vselect((vfloat)1.0f, q, collides));
        t = fma(1.41421356f * vselect(x, -x, mirrored), c->inverse_w, c->t_perp);
        collides &= t <= c->t_out;
    }
#endif
#if CLUME_FAMILIES & FAMILY_EPANECHNIKOV
    if (family == FAMILY_EPANECHNIKOV) {
        const vfloat safe_h = vselect((vfloat)0x1p-20f, c->h, c->h > (vfloat)0x1p-20f);
        const vfloat w_over_h = c->w * rcp_v(safe_h);
        const vfloat step = tau * divide_v(e2, sigma * safe_h * safe_h) * w_over_h;  // tau / A
        const vint later = t0 > c->t_perp;
        const vfloat s0 = w_over_h * vselect(t0 - c->t_in, c->t_out - t0, later);
        const vfloat g0 = s0 * s0 * fma(s0, (vfloat)(-1.0f / 3.0f), (vfloat)1.0f);
        const vfloat behind = g0 + step;
        const vint mirrored = (t0 <= c->t_perp) & (behind <= (vfloat)(2.0f / 3.0f));  // not !later: Oclgrind 21.10 negates vectors of i1 wrongly
        const vfloat ahead = vselect((4.0f / 3.0f) - behind, g0 - step, later);
        const vfloat y = vselect(ahead, behind, mirrored);
        collides &= y > (vfloat)0.0f;
        const vfloat s = epanechnikov_inverse_v(vselect((vfloat)0.0f, y, collides)) * safe_h * c->inverse_w;
        t = vselect(c->t_out - s, c->t_in + s, mirrored);
        collides &= c->h > (vfloat)0x1p-20f;
    }
#endif
    t = vselect(t, t0, t < t0);
    t = vselect(t, c->t_out, t > c->t_out);
    return vselect((vfloat)CLUME_INFINITY, t, collides);
}

/// Sum of the 16 lanes of a group held in CLUME_PARTS vectors, always by the same pairs: i and i + 8, i + 4, i + 2, i + 1.
static float reduce_lanes(const vfloat* v) {
#if CLUME_WIDTH == 4
    const float4 b = (v[0] + v[2]) + (v[1] + v[3]);
#else
#if CLUME_WIDTH == 16
    const float8 a = v[0].lo + v[0].hi;
#elif CLUME_WIDTH == 8
    const float8 a = v[0] + v[1];
#else
    const float8 a = (float8)(v[0] + v[8], v[1] + v[9], v[2] + v[10], v[3] + v[11], v[4] + v[12], v[5] + v[13], v[6] + v[14], v[7] + v[15]);
#endif
    const float4 b = a.lo + a.hi;
#endif
    const float2 c = b.lo + b.hi;
    return c.x + c.y;
}
