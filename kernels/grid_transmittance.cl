// SPDX-License-Identifier: MIT
// What voxel grids take from light: exact optical depth, and the light that an emission grid adds along a flight.
#include "grid.cl"
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
