// SPDX-License-Identifier: MIT
// Walk of a ray through the spatial cells: a uniform root grid whose crowded cells are octrees. Positions in the grid are
// integers at the finest level, so stepping to a neighbour is exact and no cell is left twice; every primitive is listed in
// each cell that its (slightly dilated) support meets, so rounding at cell borders can't lose one.
#include "ellipsoid.cl"

#ifndef CLUME_CELL_LEVELS  // octree levels below the roots; 0: a plain grid
#define CLUME_CELL_LEVELS 8
#endif

/// Scalars only, all in units of the finest level; t stays the ray's own.
typedef struct {
    float ox, oy, oz, dx, dy, dz, ix, iy, iz;  // origin, direction, 1 / direction
    float tx, ty, tz;                          // t of the present cell's far planes
    float t, t_exit, t_end;                    // entry and exit of the present cell, end of the ray
    int x, y, z, size;                         // present cell's lower corner and edge
    int nx, ny, nz;                            // extent of the grid
    uint entry;
} CellWalk;

/// Sets the cell that holds position (x, y, z), inside the grid, and when the ray leaves it.
static void cells_locate(CellWalk* w, int x, int y, int z, __global const uint* cells) {
    const int columns = w->nx >> CLUME_CELL_LEVELS, rows = w->ny >> CLUME_CELL_LEVELS;
    uint entry = cells[(x >> CLUME_CELL_LEVELS) + columns * ((y >> CLUME_CELL_LEVELS) + rows * (z >> CLUME_CELL_LEVELS))];
    int shift = CLUME_CELL_LEVELS;
#if CLUME_CELL_LEVELS > 0
    while (entry & CELL_INNER) {
        shift -= 1;
        entry = cells[(entry & ~CELL_INNER) + (uint)(((x >> shift) & 1) + 2 * ((y >> shift) & 1) + 4 * ((z >> shift) & 1))];
    }
#endif
    int size = 1 << shift;
    x = (x >> shift) << shift;
    y = (y >> shift) << shift;
    z = (z >> shift) << shift;
    // An empty root cell knows how far around it all is empty: leave that whole block at once.
    if (entry < CELL_EMPTY_MAX && entry > 1u) {
        const int border = (int)(entry - 1u) << CLUME_CELL_LEVELS;
        x -= border;
        y -= border;
        z -= border;
        size += 2 * border;
    }
    w->entry = entry;
    w->x = x;
    w->y = y;
    w->z = z;
    w->size = size;
    w->tx = ((float)(w->dx > 0.0f ? x + size : x) - w->ox) * w->ix;
    w->ty = ((float)(w->dy > 0.0f ? y + size : y) - w->oy) * w->iy;
    w->tz = ((float)(w->dz > 0.0f ? z + size : z) - w->oz) * w->iz;
    w->t_exit = max_s(w->t, min_s(w->tx, min_s(w->ty, w->tz)));
}

/// Integer position of coordinate q, kept in [low, low + size) and in the grid's [0, n).
static int cells_position(float q, int low, int size, int n) {
    const float last = (float)(low + size < n ? low + size - 1 : n - 1);
    return (int)min_s(max_s(q, (float)(low > 0 ? low : 0)), last);
}

/// Enters the grid at the first t in [t_begin, t_end) inside it; false if the ray misses it. |d| = 1.
static bool cells_enter(CellWalk* w, float3 o, float3 d, float t_begin, float t_end, __constant const RenderParams* params, __global const uint* cells) {
    const float scale = params->cells_origin.w * (float)(1 << CLUME_CELL_LEVELS);
    w->ox = (o.x - params->cells_origin.x) * scale;
    w->oy = (o.y - params->cells_origin.y) * scale;
    w->oz = (o.z - params->cells_origin.z) * scale;
    // An axis along which the ray does not move is given a step of 2^-60: its planes are never the next ones.
    w->dx = copysign(max_s(fabs(d.x), 0x1p-60f), d.x) * scale;
    w->dy = copysign(max_s(fabs(d.y), 0x1p-60f), d.y) * scale;
    w->dz = copysign(max_s(fabs(d.z), 0x1p-60f), d.z) * scale;
    w->ix = rcp_s(w->dx);
    w->iy = rcp_s(w->dy);
    w->iz = rcp_s(w->dz);
    w->nx = (int)params->cells_x << CLUME_CELL_LEVELS;
    w->ny = (int)params->cells_y << CLUME_CELL_LEVELS;
    w->nz = (int)params->cells_z << CLUME_CELL_LEVELS;
    const float ax = -w->ox * w->ix, ay = -w->oy * w->iy, az = -w->oz * w->iz;
    const float bx = ((float)w->nx - w->ox) * w->ix, by = ((float)w->ny - w->oy) * w->iy, bz = ((float)w->nz - w->oz) * w->iz;
    const float near = max_s(t_begin, max_s(min_s(ax, bx), max_s(min_s(ay, by), min_s(az, bz))));
    const float far = min_s(t_end, min_s(max_s(ax, bx), min_s(max_s(ay, by), max_s(az, bz))));
    if (!(near < far)) return false;
    w->t = near;
    w->t_end = far;
    cells_locate(w, cells_position(fma(near, w->dx, w->ox), 0, w->nx, w->nx), cells_position(fma(near, w->dy, w->oy), 0, w->ny, w->ny),
                 cells_position(fma(near, w->dz, w->oz), 0, w->nz, w->nz), cells);
    return true;
}

/// Steps to the next cell; false when the ray ends or leaves the grid.
static bool cells_next(CellWalk* w, __global const uint* cells) {
    w->t = w->t_exit;
    if (!(w->t < w->t_end)) return false;
    const bool is_x = w->tx <= w->ty && w->tx <= w->tz, is_y = !is_x && w->ty <= w->tz;
    // The axis of the plane crossed moves on exactly; along the others the ray stays within the cell.
    const int next = is_x ? (w->dx > 0.0f ? w->x + w->size : w->x - 1) : is_y ? (w->dy > 0.0f ? w->y + w->size : w->y - 1) : (w->dz > 0.0f ? w->z + w->size : w->z - 1);
    if (next < 0 || next >= (is_x ? w->nx : is_y ? w->ny : w->nz)) return false;
    int x = w->x, y = w->y, z = w->z;
    if (w->size > 1) {
        x = cells_position(fma(w->t, w->dx, w->ox), x, w->size, w->nx);
        y = cells_position(fma(w->t, w->dy, w->oy), y, w->size, w->ny);
        z = cells_position(fma(w->t, w->dz, w->oz), z, w->size, w->nz);
    }
    cells_locate(w, is_x ? next : x, is_y ? next : y, is_x || is_y ? z : next, cells);
    return true;
}
