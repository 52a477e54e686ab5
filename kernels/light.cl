// SPDX-License-Identifier: MIT
// Lights: opaque surfaces that rays meet (spheres, rectangles), environments that escaping rays find, and next-event samples
// of all kinds. Kinds a scene does not have are left out of the program (CLUME_LIGHTS). Densities are per solid angle.
#include "film.cl"
#include "flight.cl"
#include "phase.cl"

#define LIGHT_SURFACES (CLUME_LIGHTS & (LIGHT_SPHERE | LIGHT_RECTANGLE))
#define LIGHT_ENVIRONMENTS (CLUME_LIGHTS & (LIGHT_CONSTANT | LIGHT_ENVMAP))
#define NO_LIGHT 0xffffffffu

/// t of the ray's meeting with light i, if nearer than t_end; else t_end.
static float surface_hit(uint i, float3 o, float3 d, float t_end, __global const LightInfo* lights) {
#if CLUME_LIGHTS & LIGHT_SPHERE
    if (lights[i].kind == LIGHT_SPHERE) {
        const float3 oc = o - lights[i].position.xyz;
        const float b = dot_s(oc, d);
        const float3 p = along_s(oc, d, -b);
        const float r = lights[i].position.w, disc = fma(r, r, -dot_s(p, p));
        if (!(disc > 0.0f)) return t_end;
        const float h = sqrt_s(disc);
        const float t = -b - h > 0.0f ? -b - h : h - b;
        return t > 0.0f && t < t_end ? t : t_end;
    }
#endif
#if CLUME_LIGHTS & LIGHT_RECTANGLE
    if (lights[i].kind == LIGHT_RECTANGLE) {
        const float3 n = lights[i].axis.xyz, oc = lights[i].position.xyz - o;
        const float cosine = dot_s(d, n), offset = dot_s(oc, n);
        if (!(fabs(cosine) > 0x1p-40f)) return t_end;
        const float t = divide_s(offset, cosine);
        if (!(t > 0.0f && t < t_end)) return t_end;
        const float3 q = t * d - oc;
        const float u = dot_s(q, lights[i].dual_u.xyz), v = dot_s(q, lights[i].dual_v.xyz);
        return u >= 0.0f && u <= 1.0f && v >= 0.0f && v <= 1.0f ? t : t_end;
    }
#endif
    return t_end;
}

/// The nearest opaque surface before t_end but `except`: its light in *which (NO_LIGHT if none) and its t.
static float surfaces_nearest(float3 o, float3 d, float t_end, uint except, uint* which, __constant const RenderParams* params, __global const LightInfo* lights) {
    *which = NO_LIGHT;
#if LIGHT_SURFACES
    for (uint i = 0; i < params->light_count; ++i) {
        if (i == except || !(lights[i].kind & (LIGHT_SPHERE | LIGHT_RECTANGLE))) continue;
        const float t = surface_hit(i, o, d, t_end, lights);
        if (t < t_end) {
            t_end = t;
            *which = i;
        }
    }
#endif
    return t_end;
}

/// Whether the ray that meets surface i head on sees its emitting side.
static bool surface_emits(uint i, float3 o, float3 d, __global const LightInfo* lights) {
    if (lights[i].kind == LIGHT_RECTANGLE) return dot_s(d, lights[i].axis.xyz) < 0.0f;
    const float3 oc = o - lights[i].position.xyz;
    return dot_s(oc, oc) > lights[i].position.w * lights[i].position.w;
}

/// 1 − cos of the half angle under which a sphere is seen from squared distance q2 > r².
static float sphere_cap(float r, float q2) {
    const float sin2 = min_s(divide_s(r * r, q2), 1.0f);
    return divide_s(sin2, 1.0f + sqrt_s(1.0f - sin2));
}

/// Density with which next-event estimation from o finds direction d on surface i at distance t (selection included).
static float surface_pdf(uint i, float3 o, float3 d, float t, __global const LightInfo* lights) {
    const float select_pdf = lights[i].select_pdf;
    if (lights[i].kind == LIGHT_RECTANGLE) {
        const float cosine = fabs(dot_s(d, lights[i].axis.xyz));
        return divide_s(select_pdf * t * t, max_s(cosine * lights[i].position.w, 0x1p-90f));
    }
    const float3 oc = o - lights[i].position.xyz;
    return divide_s(select_pdf * CLUME_INV_2PI, max_s(sphere_cap(lights[i].position.w, dot_s(oc, oc)), 0x1p-90f));
}

/// Texel of environment i that direction d (unit) points into, after undoing rotate_y: columns by the longitude atan2(x, z), rows by
/// the angle from the nearer pole, which x and z still know where y is 1. d lies in the texel, or outside it by error < 5e-7
/// absolute (rad).
static uint envmap_texel(uint i, float3 d, __global const LightInfo* lights) {
    const float s = lights[i].axis.x, c = lights[i].axis.y;
    const float x = fma(c, d.x, -(s * d.z)), z = fma(s, d.x, c * d.z);
    const uint width = lights[i].width, height = lights[i].height;
    const float column = clamp_s(floor(fma((float)width * -CLUME_INV_2PI, atan2_s(x, z), 0.5f * (float)width)), 0.0f, (float)(width - 1));
    const uint k = min((uint)((float)height * (2.0f * CLUME_INV_2PI * atan2_s(sqrt_s(fma(x, x, z * z)), fabs(d.y)))), (height - 1) / 2);
    return lights[i].texel_offset + (d.y < 0.0f ? height - 1 - k : k) * width + (uint)column;
}

#if CLUME_NEE & LIGHT_ENVMAP
/// A texel of environment i by its alias table, share error < 3e-9 relative (to the mean texel's share if that is greater), and a
/// direction in it, uniform by solid angle: direction error < 2.2e-6 absolute. envmap_texel finds the same texel: of the directions
/// next to an edge, those that rounding could carry across are moved away from it.
static float3 envmap_sample(uint i, uint4 bits, uint4 more, uint* texel, __global const LightInfo* lights, __global const AliasEntry* alias) {
    const uint width = lights[i].width, height = lights[i].height, count = width * height, offset = lights[i].texel_offset;
    // floor(x count / 2^64) for 64 bits x: with 32, texels of large images are not alike.
    uint t = (uint)(((ulong)bits.y * count + (((ulong)bits.w * count) >> 32)) >> 32);
    if (bits.z >= alias[offset + t].threshold) t = alias[offset + t].other;
    *texel = offset + t;
    const uint row = t / width, column = t - row * width;
    // Longitude is linear in the column; half a turn is its right edge, counted from the image's middle.
    const float edge_u = min_s(2.5e-7f * (float)width, 0.5f), u = clamp_s(uniform_s(more.x), edge_u, 1.0f - edge_u);
    const float turn = divide_s(fma(-2.0f, u, (float)((int)width - 2 * (int)column)), 2.0f * (float)width);
    // The versine of the angle from the nearer pole is uniform between those of the row's edges.
    const float v = uniform_s(more.y);
    const bool below = 2 * row + (v < 0.5f ? 1u : 2u) > height;
    const uint k = below ? height - 1 - row : row;
    float cosine_lat, z_lon;
    const float quarter = divide_s(0.25f, (float)height), near_half = sincos_turns_s((float)k * quarter, &cosine_lat), far_half = sincos_turns_s((float)(k + 1) * quarter, &cosine_lat);
    const float near = 2.0f * near_half * near_half, far = 2.0f * far_half * far_half, edge_v = min_s(2.5e-7f * (float)height, 0.5f);
    const float versine = fma(clamp_s(below ? 1.0f - v : v, k == 0 ? 0.0f : edge_v, 1.0f - edge_v), far - near, near);
    const float y = 1.0f - versine, r = sqrt_s(versine * (2.0f - versine));
    const float x_lon = sincos_turns_s(fabs(turn), &z_lon);
    const float x = r * copysign(x_lon, turn), z = r * z_lon, sine = lights[i].axis.x, cosine = lights[i].axis.y;
    return normalize_s((float3)(fma(cosine, x, sine * z), below ? -y : y, fma(cosine, z, -(sine * x))));
}
#endif

/// Radiance that a ray escaping along d finds, each environment weighted against next-event estimation (phase_pdf of the
/// scattering that made d; `camera`: the ray comes from the camera, only what is visible counts, unweighted).
static spectrum environment_radiance(float3 d, float phase_pdf, bool camera, __constant const RenderParams* params, __global const LightInfo* lights, __global const float4* texels, __global const AliasEntry* alias) {
    spectrum sum = (spectrum)0.0f;
#if LIGHT_ENVIRONMENTS
    for (uint i = 0; i < params->light_count; ++i) {
        const uint kind = lights[i].kind;
        if (!(kind & (LIGHT_CONSTANT | LIGHT_ENVMAP))) continue;
        if (camera ? !lights[i].visible : !(kind & CLUME_HITS)) continue;
        spectrum radiance = to_spectrum(lights[i].radiance);
        float pdf = CLUME_INV_4PI;
#if CLUME_LIGHTS & LIGHT_ENVMAP
        if (kind == LIGHT_ENVMAP) {
            const uint texel = envmap_texel(i, d, lights);
            radiance = to_spectrum(texels[texel]);
            pdf = alias[texel].pdf_texel;
        }
#endif
        const float other = (kind & CLUME_NEE) ? lights[i].select_pdf * pdf : 0.0f;
        sum += camera ? radiance : radiance * divide_s(phase_pdf, phase_pdf + other);
    }
#endif
    return sum;
}

/// A direction towards a light: value is radiance (or irradiance of a delta light) over the density of the choice, MIS not
/// yet applied; pdf (selection included) is 0 for delta lights.
typedef struct {
    float3 direction;
    float distance, pdf;
    spectrum value;
    uint light;
} LightSample;

#if CLUME_NEE
/// Chooses one light, then a direction; false if the choice cannot light o. `bits` and `more` are 8 words of their own.
/// direction error < 1e-6 absolute; its end on the light, end error < 3 ulp of the radius (of the distance if that is greater);
/// pdf error < 3e-6 relative, value error < 3e-6 relative, both for a rectangle seen at a cosine c over c, the value for a spot
/// to the unattenuated one; from a sphere a hundredth of its radius or more off it.
static bool light_sample(float3 o, uint4 bits, uint4 more, LightSample* s, __constant const RenderParams* params, __global const LightInfo* lights, __global const float4* texels, __global const AliasEntry* alias) {
    const float choice = uniform_s(bits.x);
    uint i = NO_LIGHT;
    for (uint k = 0; k < params->light_count; ++k) {
        if (!(lights[k].select_pdf > 0.0f)) continue;
        i = k;
        if (choice < lights[k].radiance.w) break;
    }
    if (i == NO_LIGHT) return false;
    const float select_pdf = lights[i].select_pdf, inverse_select = rcp_s(select_pdf);
    s->light = i;
    s->distance = CLUME_INFINITY;
    s->pdf = 0.0f;
    s->value = to_spectrum(lights[i].radiance) * inverse_select;
    const uint kind = lights[i].kind;
#if CLUME_NEE & (LIGHT_POINT | LIGHT_SPOT)
    if (kind & (LIGHT_POINT | LIGHT_SPOT)) {
        const float3 v = lights[i].position.xyz - o;
        const float r2 = max_s(dot_s(v, v), 0x1p-90f), inverse_r = rsqrt_s(r2);
        s->direction = v * inverse_r;
        s->distance = r2 * inverse_r;
        s->value *= inverse_r * inverse_r;
#if CLUME_NEE & LIGHT_SPOT
        if (kind == LIGHT_SPOT) {
            const float3 axis = lights[i].axis.xyz, across = cross_s(s->direction, axis);
            const float angle = atan2_s(sqrt_s(dot_s(across, across)), -dot_s(s->direction, axis));
            const float falloff = clamp_s((lights[i].axis.w - angle) * lights[i].edge_u.x, 0.0f, 1.0f);
            if (!(falloff > 0.0f)) return false;
            s->value *= falloff;
        }
#endif
        return true;
    }
#endif
#if CLUME_NEE & LIGHT_DIRECTIONAL
    if (kind == LIGHT_DIRECTIONAL) {
        s->direction = -lights[i].position.xyz;
        return true;
    }
#endif
#if CLUME_NEE & LIGHT_CONSTANT
    if (kind == LIGHT_CONSTANT) {
        s->direction = sphere_uniform(uniform_s(bits.y), uniform_s(bits.z));
        s->pdf = select_pdf * CLUME_INV_4PI;
        s->value *= 4.0f * CLUME_PI;
        return true;
    }
#endif
#if CLUME_NEE & LIGHT_ENVMAP
    if (kind == LIGHT_ENVMAP) {
        uint texel;
        s->direction = envmap_sample(i, bits, more, &texel, lights, alias);
        s->pdf = select_pdf * alias[texel].pdf_texel;
        s->value = to_spectrum(texels[texel]) * rcp_s(s->pdf);
        return true;
    }
#endif
#if CLUME_NEE & LIGHT_SPHERE
    if (kind == LIGHT_SPHERE) {
        const float3 v = lights[i].position.xyz - o;
        const float r = lights[i].position.w, q2 = dot_s(v, v);
        if (!(q2 > r * r)) return false;
        const float cap = sphere_cap(r, q2), u = uniform_s(bits.y);
        const float versine = u * cap;
        s->direction = around(v * rsqrt_s(q2), 1.0f - versine, sqrt_s(versine * (2.0f - versine)), uniform_s(bits.z));
        s->distance = surface_hit(i, o, s->direction, CLUME_INFINITY, lights);
        // A direction that rounding moved past the limb: the surface is where it is nearest.
        if (!(s->distance < CLUME_INFINITY)) s->distance = dot_s(v, s->direction);
        s->pdf = divide_s(select_pdf * CLUME_INV_2PI, max_s(cap, 0x1p-90f));
        s->value = to_spectrum(lights[i].radiance) * rcp_s(s->pdf);
        return true;
    }
#endif
#if CLUME_NEE & LIGHT_RECTANGLE
    if (kind == LIGHT_RECTANGLE) {
        const float3 v = lights[i].position.xyz + uniform_s(bits.y) * lights[i].edge_u.xyz + uniform_s(bits.z) * lights[i].edge_v.xyz - o;
        const float r2 = max_s(dot_s(v, v), 0x1p-90f), inverse_r = rsqrt_s(r2);
        s->direction = v * inverse_r;
        s->distance = r2 * inverse_r;
        const float cosine = -dot_s(s->direction, lights[i].axis.xyz);
        if (!(cosine > 0x1p-40f)) return false;
        s->pdf = divide_s(select_pdf * r2, cosine * lights[i].position.w);
        s->value = to_spectrum(lights[i].radiance) * rcp_s(s->pdf);
        return true;
    }
#endif
    return false;
}
#endif
