// SPDX-License-Identifier: MIT
// One path, event by event: a flight to the next collision or surface, emission there, roulette, next-event estimation with
// MIS (balance heuristic), scattering. A path lives in PathState between launches.
#include "lamp.cl"

#ifndef CLUME_LIGHT_ROULETTE  // light of less than this share of what an isotropic phase function would leave goes on by roulette
#define CLUME_LIGHT_ROULETTE 0.5f
#endif

#define PATH_ALIVE 1u
#define PATH_ALPHA 2u  // the camera ray met something

// Whether a path may scatter at `depth`.
#if CLUME_DEPTH_LIMIT
#define LAMP_DEPTH(depth) ((depth) < (uint)params->max_depth)  // a negative one is none
#else
#define LAMP_DEPTH(depth) true
#endif

typedef struct {
    float3 o, d;
    float phase_pdf;
    spectrum beta, radiance;
    uint sample, depth, flags;
    Flight flight;
} Path;

static void path_begin(Path* p, uint pixel, uint sample, __constant const RenderParams* params) {
    const Draws r = {sample_number_s(sample), pixel, 0, (uint2)(params->seed_lo, params->seed_hi)};
    const uint4 bits = draw_bits(&r, DRAW_CAMERA);
    camera_ray(params, pixel % params->film_width, pixel / params->film_width, uniform_s(bits.x), uniform_s(bits.w), &p->o, &p->d);
    p->phase_pdf = 0.0f;
    p->beta = (spectrum)1.0f;
    p->radiance = (spectrum)0.0f;
    p->sample = sample;
    p->depth = 0;
    p->flags = PATH_ALIVE;
    p->flight.t = 0.0f;
    p->flight.draw = 0;
}

#if CLUME_NEE
/// A light that x sees past all surfaces: *value is what it adds there for a path that came along d, before beta and transmittance;
/// *bits a word for the latter. False if none is.
static bool path_light_sample(float3 x, float3 d, uint phase, float g, const Draws* r, LightSample* s, spectrum* value, uint* word, SCENE_ARGS) {
#if CLUME_NEE & LIGHT_ENVMAP
    const uint4 more = draw_bits(r, DRAW_LIGHT_MORE);
#else
    const uint4 more = (uint4)0u;
#endif
    const uint4 bits = draw_bits(r, DRAW_LIGHT);
    if (!light_sample(x, bits, more, s, params, lights, texels, alias)) return false;
    uint blocker;
    surfaces_nearest(x, s->direction, s->distance, s->light, &blocker, params, lights);
    if (blocker != NO_LIGHT) return false;
    const float scattered = phase_value_s(phase, g, phase_versine(g, d, s->direction));
    const float weight = (lights[s->light].kind & CLUME_HITS) ? divide_s(s->pdf, s->pdf + scattered) : 1.0f;
    *value = s->value * (scattered * weight);
#if CLUME_PHASES & PHASE_HENYEY_GREENSTEIN
    // A shadow ray costs the same whatever it brings.
    const float chance = scattered * weight * (4.0f * CLUME_PI / CLUME_LIGHT_ROULETTE);
    if (chance < 1.0f) {
        if (uniform_s(draw_bits(r, DRAW_LIGHT_MORE).z) >= chance) return false;
        *value *= rcp_s(chance);
    }
#endif
    *word = bits.w;
    return true;
}
#endif

/// What a light adds at x, where the path's flight towards t_end has ended, before beta.
static spectrum path_light(const Path* p, float3 x, float t_end, uint phase, float g, const Draws* r, Flight* flight, SCENE_ARGS) {
#if CLUME_NEE
    LightSample s;
    spectrum value;
    uint word;
    if (path_light_sample(x, p->d, phase, g, r, &s, &value, &word, SCENE)) {
#if CLUME_LAMPS
        if (lights[s.light].lamp_sigma > 0.0f)
            value *= lamp_weight(s.light, p->o, p->d, p->flight.t, t_end, p->depth == 0, p->phase_pdf, s.distance * s.distance, params, lights);
#endif
        return value * transmittance_estimate(x, s.direction, s.distance, word, r, flight, SCENE);
    }
#endif
    return (spectrum)0.0f;
}

/// What a ray that escapes finds.
static spectrum path_background(float3 d, float phase_pdf, uint depth, __constant const RenderParams* params, __global const LightInfo* lights, __global const float4* texels, __global const AliasEntry* alias) {
#if LIGHT_ENVIRONMENTS && ((CLUME_LIGHTS & CLUME_HITS) || CLUME_VISIBLE_BACKGROUND)
    return environment_radiance(d, phase_pdf, depth == 0, params, lights, texels, alias);
#else
    return (spectrum)0.0f;
#endif
}

/// What a ray that ends at t on an opaque surface finds, weighted against next-event estimation.
static spectrum path_surface(uint surface, float3 o, float3 d, float t, float phase_pdf, uint depth, __global const LightInfo* lights) {
#if LIGHT_SURFACES
    const uint kind = lights[surface].kind;
    if ((depth == 0 || (kind & CLUME_HITS)) && surface_emits(surface, o, d, lights)) {
        const float other = depth > 0 && (kind & CLUME_NEE) ? surface_pdf(surface, o, d, t, lights) : 0.0f;
        const float weight = depth > 0 ? divide_s(phase_pdf, phase_pdf + other) : 1.0f;
        return to_spectrum(lights[surface].radiance) * weight;
    }
#endif
    return (spectrum)0.0f;
}

/// One event; afterwards the path is alive, paused in its flight (still alive), or ended with its radiance complete.
static void path_event(Path* p, uint pixel, SCENE_ARGS) {
    const Draws r = {sample_number_s(p->sample), pixel, p->depth, (uint2)(params->seed_lo, params->seed_hi)};
    uint surface;
    const float t_end = surfaces_nearest(p->o, p->d, CLUME_INFINITY, NO_LIGHT, &surface, params, lights);
    const int result = flight_sample(p->o, p->d, t_end, &p->flight, &r, SCENE);
    if (result == FLIGHT_PAUSED) return;
    COUNT(&p->flight.work, WORK_EVENTS, 1);
#if CLUME_GRID_EMISSION
    p->radiance += p->beta * to_spectrum(grids_emission(p->o, p->d, result == FLIGHT_COLLIDED ? p->flight.t : t_end, &p->flight.work, SCENE));
#endif
#if CLUME_LAMPS
    if (p->depth == 0 && LAMP_DEPTH(0))
        p->radiance += lamp_light(true, p->o, p->d, 0, 0.0f, 1.0f, &r, &p->flight, SCENE);
#endif
    if (result == FLIGHT_ESCAPED) {
        p->flags &= ~PATH_ALIVE;
        if (surface == NO_LIGHT) {
            p->radiance += p->beta * path_background(p->d, p->phase_pdf, p->depth, params, lights, texels, alias);
        } else {
            if (p->depth == 0) p->flags |= PATH_ALPHA;
            p->radiance += p->beta * path_surface(surface, p->o, p->d, t_end, p->phase_pdf, p->depth, lights);
        }
        return;
    }
    if (p->depth == 0) p->flags |= PATH_ALPHA;
    spectrum albedo, emission;
    uint phase;
    float g;
    collision_properties(p->flight.primitive, &albedo, &emission, &phase, &g, SCENE);
#if CLUME_EMISSION
    p->radiance += p->beta * ((spectrum)1.0f - albedo) * emission;
#endif
#if CLUME_DEPTH_LIMIT
    if ((int)p->depth == params->max_depth) {
        p->flags &= ~PATH_ALIVE;
        return;
    }
#endif
    p->beta *= albedo;
    const float most = spectrum_max(p->beta);
    if (!(most > 0.0f)) {
        p->flags &= ~PATH_ALIVE;
        return;
    }
    if ((int)p->depth >= params->rr_depth && most < 1.0f) {
        if (uniform_s(draw_bits(&r, DRAW_ROULETTE).x) >= most) {
            p->flags &= ~PATH_ALIVE;
            return;
        }
        p->beta *= rcp_s(most);
    }
    const float3 x = along_s(p->o, p->d, p->flight.t);
#if CLUME_NEE
    p->radiance += p->beta * path_light(p, x, t_end, phase, g, &r, &p->flight, SCENE);
#endif
#if CLUME_LAMPS
    if (LAMP_DEPTH(p->depth + 1))
        p->radiance += p->beta * lamp_light(false, x, p->d, phase, g, spectrum_max(p->beta), &r, &p->flight, SCENE);
#endif
    p->d = phase_sample(phase, g, p->d, draw_bits(&r, DRAW_PHASE).xwyz, &p->phase_pdf);
    p->o = x;
    p->depth += 1;
    p->flight.t = 0.0f;
    p->flight.draw = 0;
}

static void path_resume(Path* p, __global const PathState* s) {
    p->o = s->origin.xyz;
    p->flight.t = s->origin.w;
    p->d = s->direction.xyz;
    p->phase_pdf = s->direction.w;
    p->beta = to_spectrum(s->beta);
    p->radiance = to_spectrum(s->radiance);
    p->sample = s->sample;
    p->depth = s->depth;
    p->flight.draw = s->draw;
    p->flags = s->flags;
}

static void path_save(const Path* p, __global PathState* s) {
    // One by one: what pads them is nobody's.
    s->origin = (float4)(p->o, p->flight.t);
    s->direction = (float4)(p->d, p->phase_pdf);
#if CLUME_CHANNELS == 1
    s->beta = (float4)(p->beta);
    s->radiance = (float4)(p->radiance);
#else
    s->beta = (float4)(p->beta, 0.0f);
    s->radiance = (float4)(p->radiance, 0.0f);
#endif
    s->sample = p->sample;
    s->depth = p->depth;
    s->draw = p->flight.draw;
    s->flags = p->flags;
}
