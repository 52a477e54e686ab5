// SPDX-License-Identifier: MIT
// Walk of a ray through the spatial cells: a uniform root grid whose crowded cells are octrees. Positions in the grid are
// integers at the finest level, so stepping to a neighbour is exact and no cell is left twice; every primitive is listed in
// each cell that its (slightly dilated) support meets, so rounding at cell borders can't lose one.
#include "ellipsoid.cl"

#ifndef CLUME_CELL_LEVELS  // octree levels below the roots; 0: a plain grid
#define CLUME_CELL_LEVELS 8
#endif
#define CELL_UNIT (1.0f / (float)(1 << CLUME_CELL_LEVELS))  // edge of a finest cell, in root cells: an exact power of two

#if CLUME_CELL_LEVELS > 0
#define CELL_IS_INNER(link) (((link) & CELL_INNER) != 0u)
#else
#define CELL_IS_INNER(link) 0
#endif

/// Positions in root cells, as floats that are exact: multiples of 2^-CLUME_CELL_LEVELS below 2^24 of them. Lane w is unused.
typedef struct {
    float4 origin, direction, inverse, offset;  // t of the plane at position p: fma(p, inverse, offset)
    float4 step;                                // +1 or −1 per axis
    float4 plane, t_plane;                      // present cell's far planes, and when the ray crosses them
    int4 stride;                                // of the root's index per step
    float t, t_exit, t_end;                     // entry and exit of the present cell, end of the ray
    float t_cross;                              // smallest of t_plane
    float size;                                 // present cell's edge
    int root;                                   // index of its root
    uint link;
    float majorant;
} CellWalk;

static void cells_exit(CellWalk* w) {
    w->t_plane = fma(w->plane, w->inverse, w->offset);
    w->t_cross = min_s(w->t_plane.x, min_s(w->t_plane.y, w->t_plane.z));
    w->t_exit = max_s(w->t, w->t_cross);
}

/// Sets the cell that holds finest-level position `at`, inside the grid, and when the ray leaves it.
static void cells_locate(CellWalk* w, int4 at, __global const CellEntry* cells) {
    const int4 root = at >> (int4)CLUME_CELL_LEVELS;
    w->root = root.x * (int)abs(w->stride.x) + root.y * (int)abs(w->stride.y) + root.z * (int)abs(w->stride.z);
    CellEntry entry = cells[w->root];
    int shift = CLUME_CELL_LEVELS;
#if CLUME_CELL_LEVELS > 0
    while (CELL_IS_INNER(entry.link)) {
        shift -= 1;
        const int4 bit = (at >> (int4)shift) & (int4)1;
        entry = cells[(entry.link & ~CELL_INNER) + (uint)(bit.x + 2 * bit.y + 4 * bit.z)];
    }
#endif
    int size = 1 << shift;
    int4 low = (at >> (int4)shift) << (int4)shift;
    // An empty root cell knows how far around it all is empty: leave that whole block at once.
    if (entry.link < CELL_EMPTY_MAX && entry.link > 1u) {
        const int border = (int)(entry.link - 1u) << CLUME_CELL_LEVELS;
        low -= (int4)border;
        size += 2 * border;
    }
    w->link = entry.link;
    w->majorant = entry.majorant;
    w->size = (float)size * CELL_UNIT;
    w->plane = (float4)((float)low.x, (float)low.y, (float)low.z, 0.0f) * CELL_UNIT + select((float4)0.0f, (float4)w->size, w->step > (float4)0.0f);
    cells_exit(w);
}

/// Finest-level position of coordinate q (root cells), kept in [low, low + size) and in the grid's [0, n).
static int cells_position(float q, float low, float size, uint n) {
    const float last = min_s(low + size, (float)n) - CELL_UNIT;
    return (int)(min_s(max_s(q, max_s(low, 0.0f)), last) * (float)(1 << CLUME_CELL_LEVELS));
}

/// Enters the grid at the first t in [t_begin, t_end) inside it; false if the ray misses it. |d| = 1.
static bool cells_enter(CellWalk* w, float3 o, float3 d, float t_begin, float t_end, __constant const RenderParams* params, __global const CellEntry* cells) {
    const float scale = params->cells_origin.w;
    w->origin = ((float4)(o, 0.0f) - (float4)(params->cells_origin.xyz, 0.0f)) * scale;
    // An axis along which the ray does not move is given a step of 2^-60: its planes are never the next ones.
    const float4 magnitude = fabs((float4)(d, 1.0f));
    w->direction = copysign(select(magnitude, (float4)0x1p-60f, magnitude < (float4)0x1p-60f), (float4)(d, 1.0f)) * scale;
    w->inverse = (float4)(rcp_s(w->direction.x), rcp_s(w->direction.y), rcp_s(w->direction.z), 0.0f);
    w->offset = -w->origin * w->inverse;
    w->step = copysign((float4)1.0f, w->direction);
    const float4 count = (float4)((float)params->cells_x, (float)params->cells_y, (float)params->cells_z, 0.0f);
    const int4 forward = w->step > (float4)0.0f;
    w->stride = (int4)(1, (int)params->cells_x, (int)(params->cells_x * params->cells_y), 0);
    w->stride = select(-w->stride, w->stride, forward);
    // The grid's own planes, by the formula that every cell uses: crossing the last one ends the walk, so no position is
    // ever looked up outside.
    const float4 a = fma(select(count, (float4)0.0f, forward), w->inverse, w->offset);
    const float4 b = fma(select((float4)0.0f, count, forward), w->inverse, w->offset);
    w->t = max_s(t_begin, max_s(a.x, max_s(a.y, a.z)));
    w->t_end = min_s(t_end, min_s(b.x, min_s(b.y, b.z)));
    if (!(w->t < w->t_end)) return false;
    const float4 q = fma((float4)w->t, w->direction, w->origin);
    cells_locate(w, (int4)(cells_position(q.x, 0.0f, count.x, params->cells_x), cells_position(q.y, 0.0f, count.y, params->cells_y),
                           cells_position(q.z, 0.0f, count.z, params->cells_z), 0), cells);
    return true;
}

/// Steps to the next cell; false when the ray ends or leaves the grid.
static bool cells_next(CellWalk* w, __constant const RenderParams* params, __global const CellEntry* cells) {
    w->t = w->t_exit;
    if (!(w->t < w->t_end)) return false;
    // Axes whose plane is crossed (two or three at an edge or corner): no branch, which comes next can't be predicted.
    const int4 crossed = w->t_plane == (float4)w->t_cross;
    if (w->size == 1.0f) {
        const int4 jump = w->stride & crossed;
        const int root = w->root + jump.x + jump.y + jump.z;
        const CellEntry entry = cells[root];
        if ((entry.link - 2u >= CELL_EMPTY_MAX - 2u) & !CELL_IS_INNER(entry.link)) {
            w->plane += select((float4)0.0f, w->step, crossed);
            w->root = root;
            w->link = entry.link;
            w->majorant = entry.majorant;
            cells_exit(w);
            return true;
        }
    }
    // Along the axes crossed the position is the first beyond the plane; along the others the ray stays within the cell.
    const int4 forward = w->step > (float4)0.0f;
    const float4 low = w->plane - select((float4)0.0f, (float4)w->size, forward);
    const float4 q = fma((float4)w->t, w->direction, w->origin);
    const float4 beyond = (w->plane - select((float4)CELL_UNIT, (float4)0.0f, forward)) * (float)(1 << CLUME_CELL_LEVELS);
    int4 at;
    at.x = crossed.x ? (int)beyond.x : cells_position(q.x, low.x, w->size, params->cells_x);
    at.y = crossed.y ? (int)beyond.y : cells_position(q.y, low.y, w->size, params->cells_y);
    at.z = crossed.z ? (int)beyond.z : cells_position(q.z, low.z, w->size, params->cells_z);
    at.w = 0;
    cells_locate(w, at, cells);
    return true;
}
