// SPDX-License-Identifier: MIT
// Free flights through voxel grids, each grid with random numbers of its own. A strategy gives the t of a collision, or
// CLUME_INFINITY. `regular`: cell by cell, exact depths, inverted in the last. `march`: fixed steps from the ray's origin.
// `delta`: null collisions under the bounds of the bricks, of a table of the grid's own, or one for all of it.
// `progressive`: the same under bounds of the bricks that are learned.
#include "cell_rest.cl"
#include "grid_bounds.cl"
#include "strategy_progressive.cl"
#if CLUME_GRIDS

#ifndef CLUME_GRID_STRATEGY  // what flies through voxel media: the program's own strategy, or `regular` for those of ellipsoids alone
#define CLUME_GRID_STRATEGY STRATEGY_REGULAR
#endif

/// Where the optical depth of grid g reaches tau, CLUME_INFINITY if not before t_end: through bricks, then cells.
static float grid_invert(uint g, float3 o, float3 d, float t_end, float tau, Work* work, SCENE_ARGS) {
    __global const GridInfo* grid = grids + g;
    const bool nearest = grid_is_nearest(grid);
    CellWalk w;
    if (!grid_enter(&w, grid, o, d, 0.0f, t_end, grid_cells)) return CLUME_INFINITY;
    do {
        COUNT(work, WORK_CELLS, 1);
        if (w.entry.link < CELL_EMPTY_MAX) continue;
        const float end = min_s(w.t_exit, w.t_end);
        if (w.entry.count) {
            // The same density all over.
            const float sigma = as_float(w.entry.reference), depth = sigma * (end - w.t);
            if (tau < depth) return min_s(fma(tau, rcp_s(sigma), w.t), end);
            tau -= depth;
            continue;
        }
        BrickWalk b;
        brick_enter(&b, &w, grid_brick(grid, w.entry.link, grid_values), end);
        do {
            COUNT(work, WORK_VOXELS, 1);
            const float depth = brick_integral(&b, nearest);
            if (tau < depth) return brick_invert(&b, nearest, tau, depth, work);
            tau -= depth;
        } while (brick_next(&b, &w));
    } while (grid_next(&w, grid, grid_cells));
    return CLUME_INFINITY;
}

#define GRID_REST 0x80000u  // number of the draw for the rest of a flight that null collisions give up

/// `regular`.
static float grid_flight_regular(uint g, float3 o, float3 d, float t_end, uint range, const Draws* r, Work* work, SCENE_ARGS) {
    COUNT(work, WORK_DRAWS, 1);
    return grid_invert(g, o, d, t_end, exponential_s(grid_bits(r, range, g, 0).x), work, SCENE);
}

/// `march`: the value at a step's middle holds for all of it; bricks that are empty there are skipped.
static float grid_flight_march(uint g, float3 o, float3 d, float t_end, uint range, const Draws* r, Work* work, SCENE_ARGS) {
    __global const GridInfo* grid = grids + g;
    const float step = params->march_step;
    CellWalk w;
    if (!grid_enter(&w, grid, o, d, 0.0f, t_end, grid_cells)) return CLUME_INFINITY;
    float tau = exponential_s(grid_bits(r, range, g, 0).x);
    COUNT(work, WORK_DRAWS, 1);
    float k = floor(divide_s(w.t, step));
    for (;;) {
        const float begin = k * step, middle = fma(0.5f, step, begin);
        if (!(begin < w.t_end)) return CLUME_INFINITY;
        while (w.t_exit <= middle) {
            COUNT(work, WORK_CELLS, 1);
            if (!grid_next(&w, grid, grid_cells)) return CLUME_INFINITY;
        }
        if (w.entry.link < CELL_EMPTY_MAX) {
            k = max_s(k + 1.0f, floor(divide_s(w.t_exit, step) - 0.5f));
            continue;
        }
        // A step whose middle lies before the support has nothing there.
        const float sigma = middle < w.t ? 0.0f : walk_value(&w, grid, middle, grid_values);
        COUNT(work, WORK_VOXELS, 1);
        COUNT(work, WORK_DENSITIES, 1);
        const float depth = sigma * min_s(step, t_end - begin);
        if (tau < depth) return min_s(fma(tau, rcp_s(sigma), begin), t_end);
        tau -= depth;
        k += 1.0f;
    }
}

/// `delta` [Novak18]: the residual optical depth is carried from cell to cell.
static float grid_flight_delta(uint g, float3 o, float3 d, float t_end, uint range, const Draws* r, Flight* f, SCENE_ARGS) {
    __global const GridInfo* grid = grids + g;
    CellWalk w;
    if (!bounds_enter(&w, grid, o, d, t_end, grid_cells)) return CLUME_INFINITY;
    uint draw = 0;
    uint4 bits = grid_bits(r, range, g, draw);
    float tau = exponential_s(bits.x);
    COUNT(&f->work, WORK_DRAWS, 1);
    do {
        COUNT(&f->work, WORK_CELLS, 1);
        if (w.entry.link < CELL_EMPTY_MAX) continue;
        float t = w.t;
#if CLUME_STRATEGY == STRATEGY_PROGRESSIVE
        const uint index = bounds_learned(&w, grid);
        const float majorant = learned[index];
        if (params->explore) {
            const float place = progressive_place(bits.y, w.entry.link, t, min_s(w.t_exit, w.t_end));
            const float sigma = bounds_value(&w, grid, place, grid_cells, grid_values);
            if (sigma > majorant) atomic_max(raised + index, as_uint(sigma));
        }
#else
        const float majorant = w.entry.majorant;
#endif
        const float end = min_s(w.t_exit, w.t_end), inverse = rcp_s(majorant);
        for (;;) {
            const float depth = majorant * (end - t);
            if (!(tau < depth)) {
                tau -= depth;
                break;
            }
            t = min_s(fma(tau, inverse, t), end);
            const float value = bounds_value(&w, grid, t, grid_cells, grid_values);
#if CLUME_STRATEGY == STRATEGY_PROGRESSIVE
            const float sigma = progressive_clamp(value, majorant, raised + index, f);
#else
            const float sigma = bounds_look_up(value, majorant, f);
#endif
            COUNT(&f->work, WORK_VOXELS, 1);
            COUNT(&f->work, WORK_DENSITIES, 1);
            // Two tentative collisions a block of random numbers.
            const uint accept = draw & 1u ? bits.y : bits.w;
            f->tentative += 1;
            if (uniform_s(accept) * majorant < sigma) return t;
            draw += 1;
#if CLUME_STRATEGY != STRATEGY_PROGRESSIVE
            if (draw == CLUME_PATIENCE) {  // as in cell_rest.cl: the rest of the flight, exactly
                t += grid_flight_regular(g, along_s(o, d, t), d, t_end - t, range + GRID_REST, r, &f->work, SCENE);
                return t < CLUME_INFINITY ? t : CLUME_INFINITY;
            }
#endif
            if (draw & 1u) {
                tau = exponential_s(bits.z);
            } else {
                bits = grid_bits(r, range, g, draw >> 1);
                tau = exponential_s(bits.x);
                COUNT(&f->work, WORK_DRAWS, 1);
            }
        }
    } while (bounds_next(&w, grid, grid_cells));
    return CLUME_INFINITY;
}

/// By CLUME_GRID_STRATEGY.
static float grid_flight(uint g, float3 o, float3 d, float t_end, uint range, const Draws* r, Flight* f, SCENE_ARGS) {
#if CLUME_GRID_STRATEGY == STRATEGY_DELTA || CLUME_GRID_STRATEGY == STRATEGY_PROGRESSIVE
    return grid_flight_delta(g, o, d, t_end, range, r, f, SCENE);
#elif CLUME_GRID_STRATEGY == STRATEGY_MARCH
    return grid_flight_march(g, o, d, t_end, range, r, &f->work, SCENE);
#else
    return grid_flight_regular(g, o, d, t_end, range, r, &f->work, SCENE);
#endif
}

/// Lets every grid compete with a mixture's flight that gave `result`: the smallest t wins.
static int grids_fly(int result, float3 o, float3 d, float t_end, Flight* f, const Draws* r, SCENE_ARGS) {
    float best = result == FLIGHT_COLLIDED ? f->t : t_end;
    for (uint g = 0; g < CLUME_GRIDS; ++g) {
        const float t = grid_flight(g, o, d, best, DRAW_GRID_FLIGHT, r, f, SCENE);
        if (!(t < CLUME_INFINITY)) continue;
        best = t;
        f->t = t;
        f->primitive = grids[g].primitive;
        result = FLIGHT_COLLIDED;
    }
    return result;
}
#endif
