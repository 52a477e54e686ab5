// SPDX-License-Identifier: MIT
// Walk of a ray through the spatial cells: a uniform root grid whose crowded cells are octrees. Positions in the grid are
// integers at the finest level, so stepping to a neighbour is exact and no cell is left twice; every primitive is listed in
// each cell that its (slightly dilated) support meets, so rounding at cell borders can't lose one.
#include "ellipsoid.cl"

typedef struct {
    float3 origin, direction, inverse;  // in root cells; t stays the ray's own
    float t, t_exit, t_end;             // entry and exit of the present cell, end of the ray
    int3 low;                           // present cell's lower corner, finest-level units
    int size;                           // and its edge
    uint entry;
} CellWalk;

/// Sets the cell that holds the finest-level position `at` (inside the grid), and when the ray leaves it.
static void cells_locate(CellWalk* w, int3 at, __constant const RenderParams* params, __global const uint* cells) {
    const int levels = (int)params->cells_levels;
    const int3 root = at >> (int3)levels;
    uint entry = cells[root.x + (int)params->cells_x * (root.y + (int)params->cells_y * root.z)];
    int shift = levels;
    while (entry & CELL_INNER) {
        shift -= 1;
        const int3 bit = (at >> (int3)shift) & (int3)1;
        entry = cells[(entry & ~CELL_INNER) + (uint)(bit.x + 2 * bit.y + 4 * bit.z)];
    }
    w->entry = entry;
    w->size = 1 << shift;
    w->low = (at >> (int3)shift) << (int3)shift;
    // An empty root cell knows how far around it all is empty: leave that whole block at once.
    if (entry < CELL_EMPTY_MAX && entry > 1u) {
        w->low -= (int3)((int)(entry - 1u) << levels);
        w->size = (int)(2u * entry - 1u) << levels;
    }
    const float unit = as_float((uint)(127 - levels) << 23);
    const float x = (float)(w->direction.x > 0.0f ? w->low.x + w->size : w->low.x) * unit;
    const float y = (float)(w->direction.y > 0.0f ? w->low.y + w->size : w->low.y) * unit;
    const float z = (float)(w->direction.z > 0.0f ? w->low.z + w->size : w->low.z) * unit;
    const float tx = (x - w->origin.x) * w->inverse.x, ty = (y - w->origin.y) * w->inverse.y, tz = (z - w->origin.z) * w->inverse.z;
    w->t_exit = max_s(w->t, min_s(tx, min_s(ty, tz)));
}

/// Finest-level integer position of grid coordinate q, clamped to [low, low + size).
static int cells_position(float q, int low, int size, float scale) {
    const float f = clamp_s(floor(q * scale), -1.0f, 16777216.0f);
    const int i = (int)f;
    return i < low ? low : (i >= low + size ? low + size - 1 : i);
}

/// Enters the grid at the first t in [t_begin, t_end) inside it; false if the ray misses it. |d| = 1.
static bool cells_enter(CellWalk* w, float3 o, float3 d, float t_begin, float t_end, __constant const RenderParams* params, __global const uint* cells) {
    const float scale = params->cells_origin.w;
    w->origin = (o - (float3)(params->cells_origin.x, params->cells_origin.y, params->cells_origin.z)) * scale;
    // An axis along which the ray does not move is given a step of 2^-60: its planes are never the next ones.
    w->direction.x = copysign(max_s(fabs(d.x), 0x1p-60f), d.x) * scale;
    w->direction.y = copysign(max_s(fabs(d.y), 0x1p-60f), d.y) * scale;
    w->direction.z = copysign(max_s(fabs(d.z), 0x1p-60f), d.z) * scale;
    w->inverse = (float3)(rcp_s(w->direction.x), rcp_s(w->direction.y), rcp_s(w->direction.z));
    const int3 count = (int3)((int)params->cells_x, (int)params->cells_y, (int)params->cells_z);
    const float3 a = -w->origin * w->inverse;
    const float3 b = ((float3)((float)count.x, (float)count.y, (float)count.z) - w->origin) * w->inverse;
    const float near = max_s(t_begin, max_s(min_s(a.x, b.x), max_s(min_s(a.y, b.y), min_s(a.z, b.z))));
    const float far = min_s(t_end, min_s(max_s(a.x, b.x), min_s(max_s(a.y, b.y), max_s(a.z, b.z))));
    if (!(near < far)) return false;
    w->t = near;
    w->t_end = far;
    const int levels = (int)params->cells_levels;
    const float finest = (float)(1 << levels);
    int3 at;
    at.x = cells_position(fma(near, w->direction.x, w->origin.x), 0, count.x << levels, finest);
    at.y = cells_position(fma(near, w->direction.y, w->origin.y), 0, count.y << levels, finest);
    at.z = cells_position(fma(near, w->direction.z, w->origin.z), 0, count.z << levels, finest);
    cells_locate(w, at, params, cells);
    return true;
}

/// Steps to the next cell; false when the ray ends or leaves the grid.
static bool cells_next(CellWalk* w, __constant const RenderParams* params, __global const uint* cells) {
    w->t = w->t_exit;
    if (!(w->t < w->t_end)) return false;
    const int levels = (int)params->cells_levels;
    const float unit = as_float((uint)(127 - levels) << 23), finest = (float)(1 << levels);
    const int px = w->direction.x > 0.0f ? w->low.x + w->size : w->low.x;
    const int py = w->direction.y > 0.0f ? w->low.y + w->size : w->low.y;
    const int pz = w->direction.z > 0.0f ? w->low.z + w->size : w->low.z;
    const float tx = ((float)px * unit - w->origin.x) * w->inverse.x;
    const float ty = ((float)py * unit - w->origin.y) * w->inverse.y;
    const float tz = ((float)pz * unit - w->origin.z) * w->inverse.z;
    const int axis = tx <= ty ? (tx <= tz ? 0 : 2) : (ty <= tz ? 1 : 2);
    const int3 end = (int3)((int)params->cells_x << levels, (int)params->cells_y << levels, (int)params->cells_z << levels);
    const int next = axis == 0 ? (w->direction.x > 0.0f ? px : px - 1)
                   : axis == 1 ? (w->direction.y > 0.0f ? py : py - 1)
                               : (w->direction.z > 0.0f ? pz : pz - 1);
    if (next < 0 || next >= (axis == 0 ? end.x : axis == 1 ? end.y : end.z)) return false;
    int3 at;
    at.x = axis == 0 ? next : cells_position(fma(w->t, w->direction.x, w->origin.x), w->low.x, w->size, finest);
    at.y = axis == 1 ? next : cells_position(fma(w->t, w->direction.y, w->origin.y), w->low.y, w->size, finest);
    at.z = axis == 2 ? next : cells_position(fma(w->t, w->direction.z, w->origin.z), w->low.z, w->size, finest);
    at = clamp(at, (int3)0, end - (int3)1);  // an empty block may reach beyond the grid
    cells_locate(w, at, params, cells);
    return true;
}
