// SPDX-License-Identifier: MIT
// CLUME_WIDTH rays walk through the mixture's cells side by side, each in its own place: cells.cl, lane by lane, with the same
// results to the bit. Records are loaded lane by lane and transposed.
#include "medium.cl"

#if CLUME_LANES

#define LANE_SET(to, value, mask) to = vselect(to, value, mask)
#define LANE_OF(type, v, i) (((const type*)&(v))[i])

// Elements of two vectors by their places, those of q counted on from those of p. Compilers know what to make of the built-in
// one; shuffle2 is a function to some, and vectors put together element by element are taken apart by all.
#ifdef __has_builtin
#if __has_builtin(__builtin_shufflevector)
#define LANES_PICK(p, q, places) __builtin_shufflevector(p, q, places)
#endif
#endif
#ifndef LANES_PICK
#define LANES_PICK(p, q, places) shuffle2(p, q, (vuint)(places))
#endif
#if CLUME_WIDTH == 16
#define LANES_LOW 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29
#define LANES_HIGH 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31
#elif CLUME_WIDTH == 8
#define LANES_LOW 0, 8, 1, 9, 4, 12, 5, 13
#define LANES_HIGH 2, 10, 3, 11, 6, 14, 7, 15
#else
#define LANES_LOW 0, 4, 1, 5
#define LANES_HIGH 2, 6, 3, 7
#endif

/// The four words of record `index` of each lane, a word a vector.
static void lanes_load(__global const uint4* records, vuint index, vuint* a, vuint* b, vuint* c, vuint* d) {
#if CLUME_WIDTH == 1
    const uint4 record = records[index];
    *a = record.x;
    *b = record.y;
    *c = record.z;
    *d = record.w;
#else
    const uint* i = (const uint*)&index;
    // Rows of four lanes' records beside each other, then 4 × 4 transposes in place: two rounds of interleaving.
#if CLUME_WIDTH == 16
    const uint16 r0 = (uint16)(records[i[0]], records[i[4]], records[i[8]], records[i[12]]);
    const uint16 r1 = (uint16)(records[i[1]], records[i[5]], records[i[9]], records[i[13]]);
    const uint16 r2 = (uint16)(records[i[2]], records[i[6]], records[i[10]], records[i[14]]);
    const uint16 r3 = (uint16)(records[i[3]], records[i[7]], records[i[11]], records[i[15]]);
#elif CLUME_WIDTH == 8
    const uint8 r0 = (uint8)(records[i[0]], records[i[4]]), r1 = (uint8)(records[i[1]], records[i[5]]);
    const uint8 r2 = (uint8)(records[i[2]], records[i[6]]), r3 = (uint8)(records[i[3]], records[i[7]]);
#else
    const uint4 r0 = records[i[0]], r1 = records[i[1]], r2 = records[i[2]], r3 = records[i[3]];
#endif
    const vuint lo02 = LANES_PICK(r0, r2, LANES_LOW), lo13 = LANES_PICK(r1, r3, LANES_LOW);
    const vuint hi02 = LANES_PICK(r0, r2, LANES_HIGH), hi13 = LANES_PICK(r1, r3, LANES_HIGH);
    *a = LANES_PICK(lo02, lo13, LANES_LOW);
    *b = LANES_PICK(lo02, lo13, LANES_HIGH);
    *c = LANES_PICK(hi02, hi13, LANES_LOW);
    *d = LANES_PICK(hi02, hi13, LANES_HIGH);
#endif
}

/// Where CLUME_WIDTH flights are: CellWalk, a vector a member, and the tentative collision that each waits for.
typedef struct {
    vfloat ox, oy, oz, dx, dy, dz;                        // rays, normalised
    vfloat from_x, from_y, from_z, to_x, to_y, to_z;      // the same in root cells, no component of `to` being 0
    vfloat inverse_x, inverse_y, inverse_z, offset_x, offset_y, offset_z;
    vfloat plane_x, plane_y, plane_z, size;               // far planes and edge of the present cell
    vfloat t, t_cross, t_exit, t_end;
    vuint link, reference, count;
    vfloat majorant;
    vfloat tau;                                           // depth left to the next tentative collision
    vuint slot, threshold, accept;                        // its random words
    vuint draw, primitive;
} LaneFlights;

static float3 lane_origin(const LaneFlights* f, int i) { return (float3)(LANE_OF(float, f->ox, i), LANE_OF(float, f->oy, i), LANE_OF(float, f->oz, i)); }
static float3 lane_direction(const LaneFlights* f, int i) { return (float3)(LANE_OF(float, f->dx, i), LANE_OF(float, f->dy, i), LANE_OF(float, f->dz, i)); }

static vint lanes_position(vfloat q, vfloat low, vfloat size, float count) {
    const vfloat last = min_v(low + size, (vfloat)count) - CELL_UNIT(CLUME_CELL_LEVELS);
    return to_vint(min_v(max_v(q, max_v(low, (vfloat)0.0f)), last) * (float)(1 << CLUME_CELL_LEVELS));
}

/// cells_locate and cells_exit.
static void lanes_locate(LaneFlights* f, vint x, vint y, vint z, vint mask, __constant const RenderParams* params, __global const CellEntry* cells) {
    const vint levels = (vint)CLUME_CELL_LEVELS;
    const int stride_y = (int)params->cells_x, stride_z = stride_y * (int)params->cells_y;
    const vint root = (x >> levels) + stride_y * (y >> levels) + stride_z * (z >> levels);
    __global const uint4* records = (__global const uint4*)cells;
    vuint link, majorant, reference, count;
    lanes_load(records, as_vuint(vselect((vint)0, root, mask)), &link, &majorant, &reference, &count);
    vint shift = levels;
#if CLUME_CELL_LEVELS > 0
    for (;;) {
        const vint inner = mask & ((link & (vuint)CELL_INNER) != (vuint)0u);
        if (!vany(inner)) break;
        LANE_SET(shift, shift - 1, inner);
        const vint child = ((x >> shift) & 1) + 2 * ((y >> shift) & 1) + 4 * ((z >> shift) & 1);
        vuint below[4];
        lanes_load(records, vselect((vuint)0u, (link & (vuint)~CELL_INNER) + as_vuint(child), inner), below, below + 1, below + 2, below + 3);
        LANE_SET(link, below[0], inner);
        LANE_SET(majorant, below[1], inner);
        LANE_SET(reference, below[2], inner);
        LANE_SET(count, below[3], inner);
    }
#endif
    // An empty root cell knows how far around it all is empty: leave that whole block at once.
    const vint border = vselect((vint)0, (as_vint(link) - 1) << levels, (link < (vuint)CELL_EMPTY_MAX) & (link > (vuint)1u));
    const vfloat size = to_vfloat(((vint)1 << shift) + 2 * border) * CELL_UNIT(CLUME_CELL_LEVELS), none = (vfloat)0.0f;
    const vfloat px = to_vfloat(((x >> shift) << shift) - border) * CELL_UNIT(CLUME_CELL_LEVELS) + vselect(none, size, f->to_x > none);
    const vfloat py = to_vfloat(((y >> shift) << shift) - border) * CELL_UNIT(CLUME_CELL_LEVELS) + vselect(none, size, f->to_y > none);
    const vfloat pz = to_vfloat(((z >> shift) << shift) - border) * CELL_UNIT(CLUME_CELL_LEVELS) + vselect(none, size, f->to_z > none);
    LANE_SET(f->plane_x, px, mask);
    LANE_SET(f->plane_y, py, mask);
    LANE_SET(f->plane_z, pz, mask);
    LANE_SET(f->size, size, mask);
    LANE_SET(f->link, link, mask);
    LANE_SET(f->majorant, as_vfloat(majorant), mask);
    LANE_SET(f->reference, reference, mask);
    LANE_SET(f->count, count, mask);
    f->t_cross = min_v(fma(f->plane_x, f->inverse_x, f->offset_x), min_v(fma(f->plane_y, f->inverse_y, f->offset_y), fma(f->plane_z, f->inverse_z, f->offset_z)));
    LANE_SET(f->t_exit, max_v(f->t, f->t_cross), mask);
}

/// cells_enter at f->t of the lanes in `mask`: returns those that the table holds a part of.
static vint lanes_enter(LaneFlights* f, vfloat t_end, vint mask, __constant const RenderParams* params, __global const CellEntry* cells) {
    const float scale = params->cells_origin.w, cx = (float)params->cells_x, cy = (float)params->cells_y, cz = (float)params->cells_z;
    const vfloat none = (vfloat)0.0f, least = (vfloat)0x1p-60f;
    LANE_SET(f->from_x, (f->ox - params->cells_origin.x) * scale, mask);
    LANE_SET(f->from_y, (f->oy - params->cells_origin.y) * scale, mask);
    LANE_SET(f->from_z, (f->oz - params->cells_origin.z) * scale, mask);
    LANE_SET(f->to_x, copysign(max_v(fabs(f->dx), least), f->dx) * scale, mask);
    LANE_SET(f->to_y, copysign(max_v(fabs(f->dy), least), f->dy) * scale, mask);
    LANE_SET(f->to_z, copysign(max_v(fabs(f->dz), least), f->dz) * scale, mask);
    LANE_SET(f->inverse_x, rcp_v(f->to_x), mask);
    LANE_SET(f->inverse_y, rcp_v(f->to_y), mask);
    LANE_SET(f->inverse_z, rcp_v(f->to_z), mask);
    LANE_SET(f->offset_x, -f->from_x * f->inverse_x, mask);
    LANE_SET(f->offset_y, -f->from_y * f->inverse_y, mask);
    LANE_SET(f->offset_z, -f->from_z * f->inverse_z, mask);
    const vint forward_x = f->to_x > none, forward_y = f->to_y > none, forward_z = f->to_z > none;
    const vfloat ax = fma(vselect((vfloat)cx, none, forward_x), f->inverse_x, f->offset_x), bx = fma(vselect(none, (vfloat)cx, forward_x), f->inverse_x, f->offset_x);
    const vfloat ay = fma(vselect((vfloat)cy, none, forward_y), f->inverse_y, f->offset_y), by = fma(vselect(none, (vfloat)cy, forward_y), f->inverse_y, f->offset_y);
    const vfloat az = fma(vselect((vfloat)cz, none, forward_z), f->inverse_z, f->offset_z), bz = fma(vselect(none, (vfloat)cz, forward_z), f->inverse_z, f->offset_z);
    LANE_SET(f->t, max_v(f->t, max_v(ax, max_v(ay, az))), mask);
    LANE_SET(f->t_end, min_v(t_end, min_v(bx, min_v(by, bz))), mask);
    mask &= f->t < f->t_end;
    if (!vany(mask)) return mask;
    const vint x = lanes_position(fma(f->t, f->to_x, f->from_x), none, (vfloat)cx, cx);
    const vint y = lanes_position(fma(f->t, f->to_y, f->from_y), none, (vfloat)cy, cy);
    const vint z = lanes_position(fma(f->t, f->to_z, f->from_z), none, (vfloat)cz, cz);
    lanes_locate(f, x, y, z, mask, params, cells);
    return mask;
}

/// Finest-level position along one axis in the cell that comes next: the first beyond a plane that is crossed, else as near
/// the ray as the present cell allows.
static vint lanes_beyond(vfloat plane, vfloat inverse, vfloat offset, vfloat to, vfloat from, float count, const LaneFlights* f) {
    const vfloat none = (vfloat)0.0f;
    const vint forward = to > none, crossed = fma(plane, inverse, offset) == f->t_cross;
    const vfloat low = plane - vselect(none, f->size, forward);
    const vfloat beyond = (plane - vselect((vfloat)CELL_UNIT(CLUME_CELL_LEVELS), none, forward)) * (float)(1 << CLUME_CELL_LEVELS);
    return vselect(lanes_position(fma(f->t, to, from), low, f->size, count), to_vint(beyond), crossed);
}

/// cells_next of the lanes in `mask`: returns those whose ray goes on.
static vint lanes_next(LaneFlights* f, vint mask, __constant const RenderParams* params, __global const CellEntry* cells) {
    LANE_SET(f->t, f->t_exit, mask);
    mask &= f->t < f->t_end;
    if (!vany(mask)) return mask;
    const vint x = lanes_beyond(f->plane_x, f->inverse_x, f->offset_x, f->to_x, f->from_x, (float)params->cells_x, f);
    const vint y = lanes_beyond(f->plane_y, f->inverse_y, f->offset_y, f->to_y, f->from_y, (float)params->cells_y, f);
    const vint z = lanes_beyond(f->plane_z, f->inverse_z, f->offset_z, f->to_z, f->from_z, (float)params->cells_z, f);
    lanes_locate(f, x, y, z, mask, params, cells);
    return mask;
}

#endif
