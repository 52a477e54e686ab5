// SPDX-License-Identifier: MIT
// What voxel grids take from light: exact optical depth, estimates of transmittance [Novak14, doi 10.1145/2661229.2661292],
// and the light that an emission grid adds along a flight.
#include "grid_flight.cl"
#if CLUME_GRIDS

/// Integral of grid g's values from t_begin to t_end, fixed point with 40 fraction bits, clamped to 2^8 a brick; any partial
/// sum that has reached `limit` may be returned.
static ulong grid_depth(uint g, float3 o, float3 d, float t_end, ulong limit, Work* work, SCENE_ARGS) {
    __global const GridInfo* grid = grids + g;
    const bool nearest = grid_is_nearest(grid);
    CellWalk w;
    ulong sum = 0;
    if (!grid_enter(&w, grid, o, d, 0.0f, t_end, grid_cells)) return 0;
    do {
        COUNT(work, WORK_CELLS, 1);
        if (w.entry.link < CELL_EMPTY_MAX) continue;
        const float end = min_s(w.t_exit, w.t_end);
        float depth = 0.0f;
        if (w.entry.count) {
            depth = as_float(w.entry.reference) * (end - w.t);
        } else {
            BrickWalk b;
            brick_enter(&b, &w, grid_brick(grid, w.entry.link, grid_values), end);
            do {
                COUNT(work, WORK_VOXELS, 1);
                depth += brick_integral(&b, nearest);
            } while (brick_next(&b, &w));
        }
        sum += convert_ulong_rtz(min_s(depth, 256.0f) * 0x1p40f);
    } while (sum < limit && grid_next(&w, grid, grid_cells));
    return sum;
}

/// Of all grids, added to `depth` as long as that is below `limit`.
static ulong grids_depth(ulong depth, float3 o, float3 d, float t_end, ulong limit, Work* work, SCENE_ARGS) {
    for (uint g = 0; g < CLUME_GRIDS; ++g) {
        if (depth >= limit) break;
        depth += grid_depth(g, o, d, t_end, limit - depth, work, SCENE);
    }
    return depth;
}

/// `march`: steps from the ray's origin as grid_flight_march has them; biased.
static float grid_march(uint g, float3 o, float3 d, float t_end, Work* work, SCENE_ARGS) {
    __global const GridInfo* grid = grids + g;
    const float step = params->march_step;
    CellWalk w;
    float sum = 0.0f;
    if (!grid_enter(&w, grid, o, d, 0.0f, t_end, grid_cells)) return 1.0f;
    for (float k = floor(divide_s(w.t, step)); k * step < w.t_end && sum < 100.0f; k += 1.0f) {
        const float begin = k * step, middle = fma(0.5f, step, begin);
        bool more = true;
        while (more && w.t_exit <= middle) {
            COUNT(work, WORK_CELLS, 1);
            more = grid_next(&w, grid, grid_cells);
        }
        if (!more) break;
        if (w.entry.link < CELL_EMPTY_MAX) {
            k = max_s(k, floor(divide_s(w.t_exit, step) - 0.5f) - 1.0f);
            continue;
        }
        COUNT(work, WORK_VOXELS, 1);
        COUNT(work, WORK_DENSITIES, 1);
        if (!(middle < w.t)) sum = fma(walk_value(&w, grid, middle, grid_values), min_s(step, t_end - begin), sum);
    }
    return sum < 100.0f ? exp_s(-sum) : 0.0f;
}

/// `ratio`: every tentative collision multiplies the estimate by the chance that it is not real. `residual`: a brick's least
/// density is taken out and known exactly. Small estimates go on by roulette.
static float grid_ratio(const bool residual, uint g, float3 o, float3 d, float t_end, const Draws* r, Flight* f, SCENE_ARGS) {
    __global const GridInfo* grid = grids + g;
    CellWalk w;
    if (!bounds_enter(&w, grid, o, d, t_end, grid_cells)) return 1.0f;
    uint draw = 0;
    uint4 bits = grid_bits(r, DRAW_GRID_SHADOW, g, draw);
    float tau = exponential_s(bits.x), weight = 1.0f, known = 0.0f;
    COUNT(&f->work, WORK_DRAWS, 1);
    do {
        COUNT(&f->work, WORK_CELLS, 1);
        if (w.entry.link < CELL_EMPTY_MAX) continue;
        float t = w.t;
        const float end = min_s(w.t_exit, w.t_end), majorant = w.entry.majorant, control = residual ? as_float(w.entry.reference) : 0.0f;
        known = fma(control, end - t, known);
        if (residual && w.entry.count) continue;
        const float rate = majorant - control, inverse = rcp_s(rate);
        for (;;) {
            const float depth = rate * (end - t);
            if (!(tau < depth)) {
                tau -= depth;
                break;
            }
            t = min_s(fma(tau, inverse, t), end);
            const float sigma = bounds_look_up(bounds_value(&w, grid, t, grid_cells, grid_values), majorant, f);
            COUNT(&f->work, WORK_VOXELS, 1);
            COUNT(&f->work, WORK_DENSITIES, 1);
            f->tentative += 1;
            // Rounding must not take a value below the brick's least one, nor the share above 1.
            weight *= max_s(fma(-max_s(sigma - control, 0.0f), inverse, 1.0f), 0.0f);
            if (!weight_roulette(&weight, draw & 1u ? bits.y : bits.w)) return 0.0f;
            draw += 1;
            if (draw == CLUME_PATIENCE) {  // as in cell_rest.cl: the rest of the ray as it is
                known = fma(-control, end - t, known);
                weight *= depth_transmittance(grid_depth(g, along_s(o, d, t), d, t_end - t, (ulong)128 << 40, &f->work, SCENE));
                return residual ? weight * exp_s(-known) : weight;
            }
            if (draw & 1u) {
                tau = exponential_s(bits.z);
            } else {
                bits = grid_bits(r, DRAW_GRID_SHADOW, g, draw >> 1);
                tau = exponential_s(bits.x);
                COUNT(&f->work, WORK_DRAWS, 1);
            }
        }
    } while (bounds_next(&w, grid, grid_cells));
    return residual ? weight * exp_s(-known) : weight;
}

/// What the program's estimator, other than `analytic`, has for all grids: a factor of the mixture's.
static float grids_transmittance(float3 o, float3 d, float t_end, const Draws* r, Flight* f, SCENE_ARGS) {
    float weight = 1.0f;
    for (uint g = 0; g < CLUME_GRIDS; ++g) {
#if CLUME_TRANSMITTANCE == TRANSMITTANCE_MARCH
        weight *= grid_march(g, o, d, t_end, &f->work, SCENE);
#elif CLUME_TRANSMITTANCE == TRANSMITTANCE_BINARY
        if (grid_flight(g, o, d, t_end, DRAW_GRID_SHADOW, r, f, SCENE) < CLUME_INFINITY) weight = 0.0f;
#else
        weight *= grid_ratio(CLUME_TRANSMITTANCE == TRANSMITTANCE_RESIDUAL_RATIO, g, o, d, t_end, r, f, SCENE);
#endif
        if (!(weight > 0.0f)) break;
    }
    return weight;
}

#if CLUME_GRID_EMISSION
/// Light that emission grids add to a flight from o that ends at t_end: ∫ j dt over all of it, since a flight reaches t with
/// the transmittance up to there as its probability.
static float4 grids_emission(float3 o, float3 d, float t_end, Work* work, SCENE_ARGS) {
    float4 light = (float4)0.0f;
    for (uint g = 0; g < CLUME_GRIDS; ++g) {
        if (grids[g].emission_grid == GRID_NONE) continue;
        __global const GridInfo* grid = grids + grids[g].emission_grid;
        const bool nearest = grid_is_nearest(grid);
        CellWalk w;
        float sum = 0.0f;
        if (!grid_enter(&w, grid, o, d, 0.0f, t_end, grid_cells)) continue;
        do {
            COUNT(work, WORK_CELLS, 1);
            if (w.entry.link < CELL_EMPTY_MAX) continue;
            const float end = min_s(w.t_exit, w.t_end);
            if (w.entry.count) {
                sum = fma(as_float(w.entry.reference), end - w.t, sum);
                continue;
            }
            BrickWalk b;
            brick_enter(&b, &w, grid_brick(grid, w.entry.link, grid_values), end);
            do {
                COUNT(work, WORK_VOXELS, 1);
                sum += brick_integral(&b, nearest);
            } while (brick_next(&b, &w));
        } while (grid_next(&w, grid, grid_cells));
        light += grids[g].emission * sum;
    }
    return light;
}
#endif
#endif
