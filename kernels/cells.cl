// SPDX-License-Identifier: MIT
// Walk of a ray through the spatial cells: a uniform root grid whose crowded cells are octrees. Positions in the grid are
// integers at the finest level, so stepping to a neighbour is exact and no cell is left twice; every primitive is listed in
// each cell that its (slightly dilated) support meets, so rounding at cell borders can't lose one.
#include "ellipsoid.cl"

#ifndef CLUME_CELL_LEVELS  // octree levels of the mixture's cells below their roots; 0: a plain grid
#define CLUME_CELL_LEVELS 8
#endif

// `levels` of a table of cells is a constant wherever these functions are called; all of them are inlined there.
#define CELL_UNIT(levels) (1.0f / (float)(1 << (levels)))  // edge of a finest cell, in root cells: an exact power of two
#define CELL_IS_INNER(link, levels) ((levels) > 0 && ((link) & CELL_INNER) != 0u)

/// Positions in root cells, as floats that are exact: multiples of CELL_UNIT below 2^24 of them. Lane w is unused.
typedef struct {
    float4 origin, direction, inverse, offset;  // t of the plane at position p: fma(p, inverse, offset)
    float4 step;                                // +1 or −1 per axis
    float4 plane, t_plane;                      // present cell's far planes, and when the ray crosses them
    int4 stride;                                // of the root's index per step
    float t, t_exit, t_end;                     // entry and exit of the present cell, end of the ray
    float t_cross;                              // smallest of t_plane
    float size;                                 // present cell's edge
    int root;                                   // index of its root
    CellEntry entry;                            // of the present cell
    float size_x, size_y, size_z;               // of the table, in root cells
} CellWalk;

static void cells_exit(CellWalk* w) {
    w->t_plane = fma(w->plane, w->inverse, w->offset);
    w->t_cross = min_s(w->t_plane.x, min_s(w->t_plane.y, w->t_plane.z));
    w->t_exit = max_s(w->t, w->t_cross);
}

/// The cell below root cell `root` that holds finest-level position `at`; its edge is 2^*shift finest cells.
static CellEntry cells_descend(int root, int4 at, int* shift, const int levels, __global const CellEntry* cells) {
    CellEntry entry = cells[root];
    *shift = levels;
    while (CELL_IS_INNER(entry.link, levels)) {
        *shift -= 1;
        const int4 bit = (at >> (int4)*shift) & (int4)1;
        entry = cells[(entry.link & ~CELL_INNER) + (uint)(bit.x + 2 * bit.y + 4 * bit.z)];
    }
    return entry;
}

/// Sets the cell that holds finest-level position `at`, inside the table, and when the ray leaves it.
static void cells_locate(CellWalk* w, int4 at, const int levels, __global const CellEntry* cells) {
    const int4 root = at >> (int4)levels;
    w->root = root.x * (int)abs(w->stride.x) + root.y * (int)abs(w->stride.y) + root.z * (int)abs(w->stride.z);
    int shift;
    const CellEntry entry = cells_descend(w->root, at, &shift, levels, cells);
    int size = 1 << shift;
    int4 low = (at >> (int4)shift) << (int4)shift;
    // An empty root cell knows how far around it all is empty: leave that whole block at once.
    if (entry.link < CELL_EMPTY_MAX && entry.link > 1u) {
        const int border = (int)(entry.link - 1u) << levels;
        low -= (int4)border;
        size += 2 * border;
    }
    w->entry = entry;
    w->size = (float)size * CELL_UNIT(levels);
    w->plane = (float4)((float)low.x, (float)low.y, (float)low.z, 0.0f) * CELL_UNIT(levels) + select((float4)0.0f, (float4)w->size, w->step > (float4)0.0f);
    cells_exit(w);
}

/// Finest-level position of coordinate q (root cells), kept in [low, low + size) and in the table's [0, count).
static int cells_position(float q, float low, float size, float count, const int levels) {
    const float last = min_s(low + size, count) - CELL_UNIT(levels);
    return (int)(min_s(max_s(q, max_s(low, 0.0f)), last) * (float)(1 << levels));
}

/// Enters a table of count_x × count_y × count_z roots at the first t in [t_begin, t_end) inside it; false if the ray misses
/// it. Origin and direction are in root cells, and no component of the direction may be 0.
static bool cells_begin(CellWalk* w, float4 origin, float4 direction, float t_begin, float t_end, uint count_x, uint count_y, uint count_z, const int levels, __global const CellEntry* cells) {
    w->origin = origin;
    w->direction = direction;
    w->inverse = (float4)(rcp_s(direction.x), rcp_s(direction.y), rcp_s(direction.z), 0.0f);
    w->offset = -w->origin * w->inverse;
    w->step = copysign((float4)1.0f, direction);
    const float4 count = (float4)((float)count_x, (float)count_y, (float)count_z, 0.0f);
    w->size_x = count.x;
    w->size_y = count.y;
    w->size_z = count.z;
    const int4 forward = w->step > (float4)0.0f;
    w->stride = (int4)(1, (int)count_x, (int)(count_x * count_y), 0);
    w->stride = select(-w->stride, w->stride, forward);
    // The table's own planes, by the formula that every cell uses: crossing the last one ends the walk, so no position is
    // ever looked up outside.
    const float4 a = fma(select(count, (float4)0.0f, forward), w->inverse, w->offset);
    const float4 b = fma(select((float4)0.0f, count, forward), w->inverse, w->offset);
    w->t = max_s(t_begin, max_s(a.x, max_s(a.y, a.z)));
    w->t_end = min_s(t_end, min_s(b.x, min_s(b.y, b.z)));
    if (!(w->t < w->t_end)) return false;
    const float4 q = fma((float4)w->t, w->direction, w->origin);
    cells_locate(w, (int4)(cells_position(q.x, 0.0f, count.x, count.x, levels), cells_position(q.y, 0.0f, count.y, count.y, levels),
                           cells_position(q.z, 0.0f, count.z, count.z, levels), 0), levels, cells);
    return true;
}

/// A direction in root cells that cells_begin takes: an axis along which the ray does not move is given a step of 2^-60
/// times `scale`: its planes are never the next ones.
static float4 cells_direction(float3 d, float scale) {
    const float4 magnitude = fabs((float4)(d, 1.0f));
    return copysign(select(magnitude, (float4)0x1p-60f, magnitude < (float4)0x1p-60f), (float4)(d, 1.0f)) * scale;
}

/// cells_begin for the mixture's cells and a ray in normalised coordinates, |d| = 1.
static bool cells_enter(CellWalk* w, float3 o, float3 d, float t_begin, float t_end, __constant const RenderParams* params, __global const CellEntry* cells) {
    const float scale = params->cells_origin.w;
    const float4 origin = ((float4)(o, 0.0f) - (float4)(params->cells_origin.xyz, 0.0f)) * scale;
    return cells_begin(w, origin, cells_direction(d, scale), t_begin, t_end, params->cells_x, params->cells_y, params->cells_z, CLUME_CELL_LEVELS, cells);
}

/// Steps to the next cell; false when the ray ends or leaves the table.
static bool cells_next(CellWalk* w, const int levels, __global const CellEntry* cells) {
    w->t = w->t_exit;
    if (!(w->t < w->t_end)) return false;
    // Axes whose plane is crossed (two or three at an edge or corner): no branch, which comes next can't be predicted.
    const int4 crossed = w->t_plane == (float4)w->t_cross;
    if (w->size == 1.0f) {
        const int4 jump = w->stride & crossed;
        const int root = w->root + jump.x + jump.y + jump.z;
        const CellEntry entry = cells[root];
        if ((entry.link - 2u >= CELL_EMPTY_MAX - 2u) & !CELL_IS_INNER(entry.link, levels)) {
            w->plane += select((float4)0.0f, w->step, crossed);
            w->root = root;
            w->entry = entry;
            cells_exit(w);
            return true;
        }
    }
    // Along the axes crossed the position is the first beyond the plane; along the others the ray stays within the cell.
    const int4 forward = w->step > (float4)0.0f;
    const float4 low = w->plane - select((float4)0.0f, (float4)w->size, forward);
    const float4 q = fma((float4)w->t, w->direction, w->origin);
    const float4 beyond = (w->plane - select((float4)CELL_UNIT(levels), (float4)0.0f, forward)) * (float)(1 << levels);
    int4 at;
    at.x = crossed.x ? (int)beyond.x : cells_position(q.x, low.x, w->size, w->size_x, levels);
    at.y = crossed.y ? (int)beyond.y : cells_position(q.y, low.y, w->size, w->size_y, levels);
    at.z = crossed.z ? (int)beyond.z : cells_position(q.z, low.z, w->size, w->size_z, levels);
    at.w = 0;
    cells_locate(w, at, levels, cells);
    return true;
}

/// The mixture's cell at p, a point of the table (or just outside it: the nearest cell).
static CellEntry cells_at(float3 p, __constant const RenderParams* params, __global const CellEntry* cells) {
    const float scale = params->cells_origin.w;
    const float3 q = (p - params->cells_origin.xyz) * scale;
    const float x = (float)params->cells_x, y = (float)params->cells_y, z = (float)params->cells_z;
    const int4 at = (int4)(cells_position(q.x, 0.0f, x, x, CLUME_CELL_LEVELS), cells_position(q.y, 0.0f, y, y, CLUME_CELL_LEVELS), cells_position(q.z, 0.0f, z, z, CLUME_CELL_LEVELS), 0);
    const int4 root = at >> (int4)CLUME_CELL_LEVELS;
    int shift;
    return cells_descend(root.x + (int)params->cells_x * (root.y + (int)params->cells_y * root.z), at, &shift, CLUME_CELL_LEVELS, cells);
}
