// SPDX-License-Identifier: MIT
// Upper bounds of a grid's density along a ray, for null collisions: those of the bricks, of a table of the grid's own
// (CLUME_GRID_BOUNDS), or one for all of it (CLUME_SCENE_BOUND); and the density looked up under them.
#include "grid.cl"
#if CLUME_GRIDS

/// The walk whose cells bound the density: over the bricks, the grid's own table, or (CLUME_SCENE_BOUND) one segment.
static bool bounds_enter(CellWalk* w, __global const GridInfo* grid, float3 o, float3 d, float t_end, __global const CellEntry* grid_cells) {
#if CLUME_SCENE_BOUND || CLUME_GRID_BOUNDS
    float4 origin, direction;
    float t_begin = 0.0f;
    if (!grid_clip(grid, o, d, &origin, &direction, &t_begin, &t_end)) return false;
#if CLUME_SCENE_BOUND
    w->origin = origin;
    w->direction = direction;
    w->t = t_begin;
    w->t_exit = t_end;
    w->t_end = t_end;
    w->entry.link = CELL_EMPTY_MAX;
    w->entry.majorant = grid->bound;
    w->entry.reference = 0u;
    w->entry.count = 0u;
    return grid->bound > 0.0f;
#else
    const float scale = grid->bounds_scale;
    return cells_begin(w, (origin - grid->lower) * scale, direction * scale, t_begin, t_end, grid->bounds_x, grid->bounds_y, grid->bounds_z, 0, grid_cells + grid->first_bound);
#endif
#else
    return grid_enter(w, grid, o, d, 0.0f, t_end, grid_cells);
#endif
}

static bool bounds_next(CellWalk* w, __global const GridInfo* grid, __global const CellEntry* grid_cells) {
#if CLUME_SCENE_BOUND
    return false;
#elif CLUME_GRID_BOUNDS
    return cells_next(w, 0, grid_cells + grid->first_bound);
#else
    return grid_next(w, grid, grid_cells);
#endif
}

/// Density at t, in the present cell of the bounds' walk.
static float bounds_value(const CellWalk* w, __global const GridInfo* grid, float t, __global const CellEntry* grid_cells, __global const float* grid_values) {
#if CLUME_SCENE_BOUND
    return grid_value(grid, fma((float4)t, w->direction, w->origin), grid_cells, grid_values);
#elif CLUME_GRID_BOUNDS
    const float scale = rcp_s(grid->bounds_scale);
    return grid_value(grid, fma(fma((float4)t, w->direction, w->origin), (float4)scale, grid->lower), grid_cells, grid_values);
#else
    return walk_value(w, grid, t, grid_values);
#endif
}

/// Density looked up under a bound, clamped; counted as a violation where it is above.
static float bounds_look_up(float sigma, float majorant, Flight* f) {
    f->violations += sigma > majorant ? 1u : 0u;
    return min_s(sigma, majorant);
}

/// Where `progressive` keeps the bound of the walk's present cell.
static uint bounds_learned(const CellWalk* w, __global const GridInfo* grid) { return grid->first_learned + (w->entry.link - CELL_EMPTY_MAX); }
#endif
