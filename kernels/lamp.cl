// SPDX-License-Identifier: MIT
// Lamps: point and spot lights with medium around them (the host says which: LightInfo.lamp_sigma > 0). What scatters near one is
// seen so brightly, 1/r², that light sampling at collisions alone has infinite variance. One more place of scattering is taken
// on the way to each collision: on the camera's ray equiangularly [Kulla12, doi 10.1111/j.1467-8659.2012.03148.x], from a
// scattering by a direction and a distance that make up for 1/r² together [Georgiev13, doi 10.1145/2508363.2508411]. Balance
// heuristic against a stand-in for the density of collisions: weights are functions of the place alone and add up to 1, so that
// no estimate of a transmittance enters them.
#include "camera.cl"
#include "collision.cl"
#include "light.cl"

#if CLUME_LAMPS

#ifndef CLUME_LAMP_EFFORT  // places whose expected part is below 1 / CLUME_LAMP_EFFORT of a typical sample are left to roulette
#define CLUME_LAMP_EFFORT 1.0f
#endif

/// A ray within the media's bounds as a lamp sees it; lengths along it are counted from the foot, the place nearest to the lamp.
typedef struct {
    float foot, gap;   // t of the foot, its distance from the lamp
    float begin, end;  // of the ray within the bounds, from the foot
    float span;        // angle between them at the lamp
} LampView;

/// The ray from t0 to t1 (t0 < t1).
static LampView lamp_view(float foot, float gap, float t0, float t1) {
    LampView v;
    v.foot = foot;
    v.gap = max_s(gap, 0x1p-40f);
    v.begin = t0 - foot;
    v.end = t1 - foot;
    v.span = atan2_s(v.gap * (t1 - t0), fma(v.begin, v.end, v.gap * v.gap));
    return v;
}

/// Equiangular place, from the foot: uniform in the angle at the lamp, density gap / (span (gap² + s²)). No digits are lost near
/// the lamp, since nothing is subtracted that isn't as small.
static float lamp_place(const LampView* v, float u) {
    float cosine;
    const float sine = sincos_turns_s(u * v->span * CLUME_INV_2PI, &cosine);
    const float along = fma(v->begin, cosine, v->gap * sine), across = fma(v->gap, cosine, -v->begin * sine);
    return clamp_s(v->gap * divide_s(along, max_s(across, 0x1p-80f)), v->begin, v->end);
}

/// How much likelier than by `lamp_light` the place s from the foot is found by a collision that chooses light i. `aim` times the
/// angle's density is the density of directions that the path has there over the one that `lamp_light` has.
static float lamp_odds(uint i, const LampView* v, float s, float r2, float aim, __global const LightInfo* lights) {
    const float sigma = lights[i].lamp_sigma;
    return divide_s(lights[i].select_pdf, lights[i].lamp_pdf) * sigma * exp_s(-sigma * (s - v->begin)) * v->span * r2 * aim;
}

/// On the camera's ray: of the equiangular density gap / r², gap is what `aim` holds.
static float lamp_aim_camera(float gap) { return rcp_s(max_s(gap, 0x1p-40f)); }

/// From a scattering whose phase function has the value `phase`: angles from the direction to the lamp, R away, are uniform.
static float lamp_aim_scattered(float phase, float inverse_r) { return 2.0f * CLUME_PI * CLUME_PI * phase * inverse_r; }

/// Weight of light sampling at a collision, r2 from lamp i, on the ray from o along d: the camera's, or one that a phase
/// function of density phase_pdf chose.
static float lamp_weight(uint i, float3 o, float3 d, float t, float t_end, bool camera, float phase_pdf, float r2, __constant const RenderParams* params, __global const LightInfo* lights) {
    const float3 to_lamp = lights[i].position.xyz - o;
    const float foot = dot_s(to_lamp, d);
    const float3 off = to_lamp - foot * d;
    const float gap = sqrt_s(dot_s(off, off));
    float t0, t1;
    if (!bounds_clip(o, d, 0.0f, t_end, &t0, &t1, params)) return 1.0f;
    const LampView v = lamp_view(foot, gap, t0, t1);
    const float aim = camera ? lamp_aim_camera(gap) : lamp_aim_scattered(phase_pdf, rsqrt_s(max_s(dot_s(to_lamp, to_lamp), 0x1p-90f)));
    const float odds = lamp_odds(i, &v, t - foot, r2, aim, lights);
    return divide_s(odds, 1.0f + odds);
}

/// The camera's ray on which a place near lamp i is looked for: the path's own, but in the pixel that the lamp projects to, where
/// radiance is as one over the distance to it, rays come as much denser there. Returns uniform density over this one's.
static float lamp_camera_ray(uint i, uint pixel, float u, float turn, float3* o, float3* d, __constant const RenderParams* params, __global const LightInfo* lights) {
    const uint x = pixel % params->film_width, y = pixel / params->film_width;
    const float at_x = lights[i].edge_v.x - (float)x, at_y = lights[i].edge_v.y - (float)y;
    if (!(at_x > 0.0f && at_x < 1.0f && at_y > 0.0f && at_y < 1.0f)) return 1.0f;
    // Uniform in the angle, and in the distance up to the pixel's edge.
    float cosine;
    const float sine = sincos_turns_s(turn, &cosine);
    const float to_x = divide_s(cosine > 0.0f ? 1.0f - at_x : at_x, max_s(fabs(cosine), 0x1p-20f)), to_y = divide_s(sine > 0.0f ? 1.0f - at_y : at_y, max_s(fabs(sine), 0x1p-20f));
    const float edge = min_s(to_x, to_y), distance = u * edge;
    camera_ray(params, x, y, clamp_s(fma(distance, cosine, at_x), 0.0f, 1.0f), clamp_s(fma(distance, sine, at_y), 0.0f, 1.0f), o, d);
    return 2.0f * CLUME_PI * distance * edge;
}

/// What a lamp adds by one more place of scattering, before beta. camera: on the ray from o along d, or another of its pixel; else on a
/// ray that a scattering at o, of light that came along d, sends out. `strength`: of beta.
static spectrum lamp_light(const bool camera, float3 o, float3 d, uint phase, float g, float strength, const Draws* r, Flight* flight, SCENE_ARGS) {
    const uint draw = camera ? DRAW_LAMP_CAMERA : DRAW_LAMP;
    const uint4 bits = draw_bits(r, draw), more = draw_bits(r, draw + 1u);
    COUNT(&flight->work, WORK_DRAWS, 2);
    uint i = NO_LIGHT;
    float choice = uniform_s(bits.x);
    for (uint k = 0; k < params->light_count; ++k) {
        if (!(lights[k].lamp_sigma > 0.0f)) continue;
        i = k;
        choice -= lights[k].lamp_pdf;
        if (choice < 0.0f) break;
    }
    if (i == NO_LIGHT) return (spectrum)0.0f;
    float aim, foot, gap, film = 1.0f;
    if (camera) {
        film = lamp_camera_ray(i, r->pixel, uniform_s(bits.y), uniform_s(bits.z), &o, &d, params, lights);
    }
    const float3 to_lamp = lights[i].position.xyz - o;
    float3 w = d;
    if (camera) {
        foot = dot_s(to_lamp, d);
        const float3 off = to_lamp - foot * d;
        gap = sqrt_s(dot_s(off, off));
        aim = lamp_aim_camera(gap);
    } else {
        const float square = max_s(dot_s(to_lamp, to_lamp), 0x1p-90f), inverse_r = rsqrt_s(square), distance = square * inverse_r;
        float cosine;
        const float sine = sincos_turns_s(0.5f * uniform_s(bits.y), &cosine);
        w = around(to_lamp * inverse_r, cosine, sine, uniform_s(bits.z));
        foot = distance * cosine;
        gap = distance * sine;
        aim = lamp_aim_scattered(phase_value_s(phase, g, phase_versine(g, d, w)), inverse_r);
    }
    uint blocker;
    const float t_end = surfaces_nearest(o, w, CLUME_INFINITY, NO_LIGHT, &blocker, params, lights);
    float t0, t1;
    if (!bounds_clip(o, w, 0.0f, t_end, &t0, &t1, params)) return (spectrum)0.0f;
    const LampView v = lamp_view(foot, gap, t0, t1);
    const float s = lamp_place(&v, uniform_s(bits.w)), t = foot + s, r2 = fma(s, s, v.gap * v.gap);
    const float sigma_lamp = lights[i].lamp_sigma, weight = rcp_s(1.0f + lamp_odds(i, &v, s, r2, aim, lights));
    float value = film * v.span * aim * weight;
    // Roulette on what the sample is expected to add, in units of what a light in a medium gives at one free path's distance. Half the
    // extinction: a depth guessed too large would cost more variance than one too small costs time.
    const float chance = CLUME_LAMP_EFFORT * strength * value * rcp_s(sigma_lamp) * exp_s(-0.5f * sigma_lamp * (s - v.begin + sqrt_s(r2)));
    if (chance < 1.0f) {
        if (uniform_s(more.x) >= chance) return (spectrum)0.0f;
        value *= rcp_s(chance);
    }
    const float3 x = along_s(o, w, t);
    uint primitive = CLUME_NO_PRIMITIVE;
    value *= medium_density(x, uniform_s(more.y), uniform_s(more.z), &primitive, &flight->work, SCENE);
    if (!(value > 0.0f)) return (spectrum)0.0f;
    const float3 rest = lights[i].position.xyz - x;
    const float square = max_s(dot_s(rest, rest), 0x1p-90f), inverse_rest = rsqrt_s(square);
    const float3 back = rest * inverse_rest;
#if CLUME_NEE & LIGHT_SPOT
    if (lights[i].kind == LIGHT_SPOT) value *= spot_falloff(i, back, lights);
    if (!(value > 0.0f)) return (spectrum)0.0f;
#endif
    surfaces_nearest(x, back, square * inverse_rest, i, &blocker, params, lights);
    if (blocker != NO_LIGHT) return (spectrum)0.0f;
    spectrum albedo, emission;
    uint next_phase;
    float next_g;
    collision_properties(primitive, &albedo, &emission, &next_phase, &next_g, SCENE);
    value *= divide_s(phase_value_s(next_phase, next_g, phase_versine(next_g, w, back)), lights[i].lamp_pdf);
    // To the place, then to the lamp, each with random numbers of its own.
    for (uint leg = 0; leg < 2u && value > 0.0f; ++leg) {
        const Draws own = {r->number, r->pixel, r->depth | (camera ? DRAWS_FROM_CAMERA : 0u) | (leg ? DRAWS_TO_LAMP : DRAWS_TO_PLACE), r->seed};
        value *= transmittance_estimate(leg ? x : o, leg ? back : w, leg ? square * inverse_rest : t, leg ? draw_bits(&own, DRAW_LIGHT).w : more.w, &own, flight, SCENE);
    }
    return to_spectrum(lights[i].radiance) * albedo * value;
}
#endif
