// SPDX-License-Identifier: MIT
// Voxel grids: walk of a ray through the table of bricks and through the cells of a brick, and the density along it. Inside a
// trilinear cell the density on a ray is a cubic: Gauss's rule with two points integrates it exactly, and its Bernstein
// coefficients (averages of the density at the corners of the box that the segment spans [Seidel's polar form]) invert it.
// Both are sums of non-negative terms. Every file of a program sees these functions only where the scene has a grid.
#include "medium.cl"
#if CLUME_GRIDS

#define GRID_CELLS ((float)(GRID_BRICK << CLUME_GRID_LEVELS))  // per root cell: an exact power of two
#if CLUME_GRID_KINDS == GRID_TRILINEAR
#define grid_is_nearest(grid) false
#elif CLUME_GRID_KINDS == GRID_NEAREST
#define grid_is_nearest(grid) true
#else
#define grid_is_nearest(grid) ((grid)->interpolation == GRID_NEAREST)
#endif

/// Random bits of grid g, number n of its own sequence; `range` is DRAW_GRID_*. Past 2^20 the depth's upper bits tell apart.
static uint4 grid_bits(const Draws* r, uint range, uint g, uint n) {
    return draw_words(r->number, r->pixel, r->depth ^ ((n >> 20) << 24), range + (g << 20) + (n & 0xfffffu), r->seed);
}

/// Position (`point` 1) or direction (0) in root cells of the grid's table.
static float4 grid_coordinates(__global const GridInfo* grid, float3 v, float point) {
    const float4 x = grid->to_x, y = grid->to_y, z = grid->to_z;
    return (float4)(fma(point, x.w, dot_s(x.xyz, v)), fma(point, y.w, dot_s(y.xyz, v)), fma(point, z.w, dot_s(z.xyz, v)), 0.0f);
}

/// The part of [*t_begin, *t_end] inside the support; false if there is none. Sets the ray in root cells.
static bool grid_clip(__global const GridInfo* grid, float3 o, float3 d, float4* origin, float4* direction, float* t_begin, float* t_end) {
    const float4 c = grid->center;
    *origin = grid_coordinates(grid, o - c.xyz, 1.0f);
    *direction = cells_direction(grid_coordinates(grid, d, 0.0f).xyz, 1.0f);
    const float4 inverse = (float4)(rcp_s(direction->x), rcp_s(direction->y), rcp_s(direction->z), 0.0f);
    const float4 offset = -*origin * inverse;
    const int4 forward = *direction > (float4)0.0f;
    const float4 a = fma(select(grid->upper, grid->lower, forward), inverse, offset), b = fma(select(grid->lower, grid->upper, forward), inverse, offset);
    *t_begin = max_s(*t_begin, max_s(a.x, max_s(a.y, a.z)));
    *t_end = min_s(*t_end, min_s(b.x, min_s(b.y, b.z)));
    return *t_begin < *t_end;
}

/// Enters the table of bricks; false if [t_begin, t_end] misses the support.
static bool grid_enter(CellWalk* w, __global const GridInfo* grid, float3 o, float3 d, float t_begin, float t_end, __global const CellEntry* grid_cells) {
    float4 origin, direction;
    if (!grid_clip(grid, o, d, &origin, &direction, &t_begin, &t_end)) return false;
    return cells_begin(w, origin, direction, t_begin, t_end, grid->roots_x, grid->roots_y, grid->roots_z, CLUME_GRID_LEVELS, grid_cells + grid->first_entry);
}

#define grid_next(w, grid, grid_cells) cells_next(w, CLUME_GRID_LEVELS, (grid_cells) + (grid)->first_entry)

/// Samples of the brick that a leaf's entry links.
static __global const float* grid_brick(__global const GridInfo* grid, uint link, __global const float* grid_values) {
    return grid_values + (size_t)(grid->first_brick + (link - CELL_EMPTY_MAX)) * GRID_BRICK_VALUES;
}

/// Lower corner of the present cell of the table, in cells.
static float4 grid_base(const CellWalk* w) {
    return (w->plane - select((float4)0.0f, (float4)w->size, w->step > (float4)0.0f)) * GRID_CELLS;
}

/// Trilinear value of the cell whose first sample is p[0], at u in [0, 1]³.
static float cell_value(__global const float* p, float4 u) {
    const float2 a = vload2(0, p), b = vload2(0, p + GRID_ROW), c = vload2(0, p + GRID_SLICE), d = vload2(0, p + GRID_SLICE + GRID_ROW);
    const float4 low = (float4)(a.x, b.x, c.x, d.x), high = (float4)(a.y, b.y, c.y, d.y);
    const float4 x = fma((float4)u.x, high - low, low);
    const float2 y = fma((float2)u.y, x.yw - x.xz, x.xz);
    return fma(u.z, y.y - y.x, y.x);
}

/// Value at `place` (cells from the brick's corner; kept inside the brick).
static float brick_value(__global const float* brick, float4 place, bool nearest) {
    const float4 last = (float4)(GRID_BRICK - 0x1p-20f);
    const float4 q = select(select(place, (float4)0.0f, place < (float4)0.0f), last, place > last);
    const int4 at = convert_int4_rtz(q);
    __global const float* p = brick + at.x + GRID_ROW * at.y + GRID_SLICE * at.z;
    if (nearest) return p[0];
    return cell_value(p, q - (float4)((float)at.x, (float)at.y, (float)at.z, 0.0f));
}

/// Value at t of the walk's ray, which is in the present brick.
static float walk_value(const CellWalk* w, __global const GridInfo* grid, float t, __global const float* grid_values) {
    const float4 place = fma((float4)t, w->direction * GRID_CELLS, w->origin * GRID_CELLS) - grid_base(w);
    return brick_value(grid_brick(grid, w->entry.link, grid_values), place, grid_is_nearest(grid));
}

/// Value at q, in root cells and inside the support: the brick is looked up from the roots down.
static float grid_value(__global const GridInfo* grid, float4 q, __global const CellEntry* grid_cells, __global const float* grid_values) {
    const float4 bricks = (float4)((float)grid->roots_x, (float)grid->roots_y, (float)grid->roots_z, 0.0f) * (float)(1 << CLUME_GRID_LEVELS) - 1.0f;
    float4 b = q * (float)(1 << CLUME_GRID_LEVELS);
    b = select(b, (float4)0.0f, b < (float4)0.0f);
    const int4 at = convert_int4_rtz(select(b, bricks, b > bricks));
    const int4 root = at >> (int4)CLUME_GRID_LEVELS;
    __global const CellEntry* table = grid_cells + grid->first_entry;
    uint link = table[(uint)root.x + grid->roots_x * ((uint)root.y + grid->roots_y * (uint)root.z)].link;
    int shift = CLUME_GRID_LEVELS;
    while (CELL_IS_INNER(link, CLUME_GRID_LEVELS)) {
        shift -= 1;
        const int4 bit = (at >> (int4)shift) & (int4)1;
        link = table[(link & ~CELL_INNER) + (uint)(bit.x + 2 * bit.y + 4 * bit.z)].link;
    }
    if (link < CELL_EMPTY_MAX) return 0.0f;
    const float4 place = q * GRID_CELLS - (float4)((float)at.x, (float)at.y, (float)at.z, 0.0f) * (float)GRID_BRICK;
    return brick_value(grid_brick(grid, link, grid_values), place, grid_is_nearest(grid));
}

/// Value at p, 0 outside the support.
static float grid_density(__global const GridInfo* grid, float3 p, __global const CellEntry* grid_cells, __global const float* grid_values) {
    const float4 q = grid_coordinates(grid, p - grid->center.xyz, 1.0f), lower = grid->lower, upper = grid->upper;
    const bool inside = q.x >= lower.x && q.x <= upper.x && q.y >= lower.y && q.y <= upper.y && q.z >= lower.z && q.z <= upper.z;
    return inside ? grid_value(grid, q, grid_cells, grid_values) : 0.0f;
}

/// A ray's way through the cells of one brick. Planes are those of the table's walk, by the same formula, so that the last
/// cell ends exactly where the brick does.
typedef struct {
    float4 origin, direction;  // in cells
    float4 inverse, offset;    // t of the plane at cell p: fma(p, inverse, offset), as the table's walk has it
    float4 base, plane;        // present cell's lower corner, its far planes
    float4 t_plane;
    float t, t_next, t_end;    // present segment, end of the way
    __global const float* p;   // the cell's first sample
} BrickWalk;

static void brick_segment(BrickWalk* b) {
    b->t_plane = fma(b->plane, b->inverse, b->offset);
    b->t_next = max_s(b->t, min_s(b->t_end, min_s(b->t_plane.x, min_s(b->t_plane.y, b->t_plane.z))));
}

/// The ray between w->t and t_end, in the present brick, whose samples are at `brick`.
static void brick_enter(BrickWalk* b, const CellWalk* w, __global const float* brick, float t_end) {
    b->origin = w->origin * GRID_CELLS;
    b->direction = w->direction * GRID_CELLS;
    b->inverse = w->inverse * (1.0f / GRID_CELLS);
    b->offset = w->offset;
    b->t = w->t;
    b->t_end = t_end;
    const float4 corner = grid_base(w), place = fma((float4)w->t, b->direction, b->origin) - corner, last = (float4)(GRID_BRICK - 1.0f);
    const float4 q = select(select(place, (float4)0.0f, place < (float4)0.0f), last, place > last);
    const int4 at = convert_int4_rtz(q);
    b->p = brick + at.x + GRID_ROW * at.y + GRID_SLICE * at.z;
    b->base = corner + (float4)((float)at.x, (float)at.y, (float)at.z, 0.0f);
    b->plane = b->base + select((float4)0.0f, (float4)1.0f, w->step > (float4)0.0f);
    brick_segment(b);
}

/// Steps to the next cell; false at the end of the way.
static bool brick_next(BrickWalk* b, const CellWalk* w) {
    if (!(b->t_next < b->t_end)) return false;
    b->t = b->t_next;
    const int4 crossed = b->t_plane <= (float4)b->t_next;
    const int4 stride = convert_int4_rtz(w->step) * (int4)(1, GRID_ROW, GRID_SLICE, 0) & crossed;
    const float4 move = crossed ? w->step : (float4)0.0f;
    b->p += stride.x + stride.y + stride.z;
    b->base += move;
    b->plane += move;
    brick_segment(b);
    return true;
}

/// Position at t within the present cell, kept in [0, 1].
static float4 brick_local(const BrickWalk* b, float t) {
    const float4 u = fma((float4)t, b->direction, b->origin) - b->base, zero = (float4)0.0f, one = (float4)1.0f;
    const float4 v = u < zero ? zero : u;
    return v > one ? one : v;
}

/// Integral over the present segment; relative error of the quadrature's sum < 1e-6.
static float brick_integral(const BrickWalk* b, bool nearest) {
    const float length = b->t_next - b->t;
    if (nearest) return b->p[0] * length;
    const float4 u = brick_local(b, fma(0.211324865f, length, b->t)), v = brick_local(b, fma(0.788675135f, length, b->t));
    __global const float* p = b->p;
    const float2 a = vload2(0, p), c = vload2(0, p + GRID_ROW), d = vload2(0, p + GRID_SLICE), e = vload2(0, p + GRID_SLICE + GRID_ROW);
    const float4 low = (float4)(a.x, c.x, d.x, e.x), rise = (float4)(a.y, c.y, d.y, e.y) - low;
    const float4 x = fma((float4)u.x, rise, low), y = fma((float4)v.x, rise, low);
    const float4 first = (float4)(x.x, x.z, y.x, y.z), second = (float4)(x.y, x.w, y.y, y.w);  // by component: Oclgrind 21.10 falls over (x.xz, y.xz)
    const float4 z = fma((float4)(u.y, u.y, v.y, v.y), second - first, first);
    const float2 value = fma((float2)(u.z, v.z), z.yw - z.xz, z.xz);
    return 0.5f * length * (value.x + value.y);
}

/// Where in the present segment its integral reaches `target`, below `depth` = brick_integral: safeguarded Newton on the
/// cubic's integral, a quartic, or bisection; off by less than 1e-6 of the segment's own depth.
static float brick_invert(const BrickWalk* b, bool nearest, float target, float depth, Work* work) {
    const float length = b->t_next - b->t;
    float s = target * rcp_s(depth);
    if (!nearest) {
        const float4 u = brick_local(b, b->t), v = brick_local(b, b->t_next);
        const float uuu = cell_value(b->p, u), vvv = cell_value(b->p, v);
        const float vuu = cell_value(b->p, (float4)(v.x, u.y, u.z, 0.0f)), uvu = cell_value(b->p, (float4)(u.x, v.y, u.z, 0.0f)), uuv = cell_value(b->p, (float4)(u.x, u.y, v.z, 0.0f));
        const float vvu = cell_value(b->p, (float4)(v.x, v.y, u.z, 0.0f)), vuv = cell_value(b->p, (float4)(v.x, u.y, v.z, 0.0f)), uvv = cell_value(b->p, (float4)(u.x, v.y, v.z, 0.0f));
        const float b1 = 0.333333333f * (vuu + uvu + uuv), b2 = 0.333333333f * (vvu + vuv + uvv);
        const float c1 = 3.0f * (b1 - uuu), c2 = 3.0f * (uuu - 2.0f * b1 + b2), c3 = 3.0f * (b1 - b2) + (vvv - uuu);
        const float level = target * rcp_s(length), tolerance = 0x1p-21f * depth * rcp_s(length);
        float lo = 0.0f, hi = 1.0f;
        for (int i = 0; i < 40; ++i) {
            COUNT(work, WORK_ROOTS, 1);
            const float excess = fma(s, fma(s, fma(s, fma(s, 0.25f * c3, 0.333333333f * c2), 0.5f * c1), uuu), -level);
            if (fabs(excess) <= tolerance) break;
#if !CLUME_BISECTION
            const float half_width = 0.5f * (hi - lo);
#endif
            lo = excess > 0.0f ? lo : s;
            hi = excess > 0.0f ? s : hi;
#if CLUME_BISECTION
            s = 0.5f * (lo + hi);
#else
            const float slope = fma(s, fma(s, fma(s, c3, c2), c1), uuu);
            const float newton = s - excess * rcp_s(max_s(slope, 0x1p-90f));
            // A step that leaves the bracket, or one that shrinks too slowly: halve it instead.
            s = newton > lo && newton < hi && (i < 3 || hi - lo < half_width) ? newton : 0.5f * (lo + hi);
#endif
        }
    }
    return min_s(fma(s, length, b->t), b->t_next);
}
#endif
