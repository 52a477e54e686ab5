// SPDX-License-Identifier: MIT
// The one header shared by the host and the kernels: buffers and structs, made of float, float4 and uint only.
//
// All lengths are normalised: the host recentres the scene and scales it by a power of two so that its radius is in [1, 2).
//
//   params   RenderParams            one
//   groups   float[176]              per group of 16 primitives: 11 rows of 16 (CLUME_ROW_*), padded lanes far away with sigma 0
//   group_medium uint                per group: index into media
//   cells    CellEntry               root cells, x fastest, then blocks of 8 children
//   leaves   CellLeaf                per non-empty cell
//   references Reference             per (cell, primitive): an alias table over the cell's bounds, for null collisions
//   learned  float                   per non-empty cell, then per brick: the bound that `progressive` uses in this pass
//   raised   uint                    likewise: bits of the highest density above it that was found
//   primitives Primitive             per primitive, one cache line
//   nodes    BvhNode                 8-wide bounding volume hierarchy; leaves are groups
//   media    MediumInfo              per medium
//   shading  float4[2]               per primitive: albedo, g | emission, medium index (as_uint)
//   lights   LightInfo               per light
//   texels   float4                  environment images: radiance, unused
//   alias    AliasEntry              one per texel, importance sampling
//   grids    GridInfo                per voxel medium, then per emission grid
//   grid_cells CellEntry             per grid: its table of bricks (roots, then blocks of 8 children), its bounds' own table
//   grid_values float[729]           per brick: 9 × 9 × 9 samples, x fastest
//   pixels   uint                    film index (x + width * y) of each pixel that the batch renders
//   states   PathState               per row of sums, or per lane of a work-item; kept between launches
//   sums     ulong[FILM_WORDS]       per row: a share of one pixel's samples, 128-bit fixed point (film.cl); zeros at first
#ifndef CLUME_LAYOUT_H
#define CLUME_LAYOUT_H

#ifdef __cplusplus
#include <cstdint>
namespace clume::device {
using uint = std::uint32_t;
using ulong = std::uint64_t;
struct alignas(16) float4 {
    float x, y, z, w;
};
#endif

#define CLUME_GROUP_SIZE 16
#define CLUME_GROUP_ROWS 11
#define CLUME_GROUP_FLOATS (CLUME_GROUP_SIZE * CLUME_GROUP_ROWS)
// Rows: centre, upper triangle of the whitening W (row-major), peak extinction, primitive id (as_uint).
#define CLUME_ROW_MU 0
#define CLUME_ROW_W 3
#define CLUME_ROW_SIGMA 9
#define CLUME_ROW_ID 10
#define CLUME_NO_PRIMITIVE 0xffffffffu

// CellEntry.link: below CELL_EMPTY_MAX an empty cell, the number being the distance in root cells (Chebyshev) within which
// all is empty; with CELL_INNER set, the index of a block of 8 children; else CELL_EMPTY_MAX + the leaf's index.
#define CELL_EMPTY_MAX 64u
#define CELL_INNER 0x80000000u

// A brick of a voxel grid: 8 × 8 × 8 cells. A cell of a trilinear grid lies between 8 lattice points, so the brick stores 9
// samples along each axis; a cell of a nearest grid is a voxel (the ninth samples are there, unused). In a table of bricks a
// leaf's CellEntry has the bounds of σ_t per normalised length over the brick: majorant, and the lower one as a float's bits
// in `reference`; count is 1 where the density is the same all over.
#define GRID_BRICK 8
#define GRID_ROW 9
#define GRID_SLICE 81
#define GRID_BRICK_VALUES 729
#define GRID_TRILINEAR 1u
#define GRID_NEAREST 2u
#define GRID_NONE 0xffffffffu

#define FAMILY_GAUSSIAN 1u
#define FAMILY_EPANECHNIKOV 2u
#define FAMILY_UNIFORM 4u
#define PHASE_ISOTROPIC 1u
#define PHASE_HENYEY_GREENSTEIN 2u
#define PHASE_RAYLEIGH 4u

// Named in the tables of src/strategies.cpp.
#define STRATEGY_DECOMPOSITION 1
#define STRATEGY_DELTA 2
#define STRATEGY_MARCH 3
#define STRATEGY_MARCH_ANALYTIC 4
#define STRATEGY_REGULAR 5
#define STRATEGY_REGULAR_LINEAR 6
#define STRATEGY_PROGRESSIVE 7
#define TRANSMITTANCE_ANALYTIC 1
#define TRANSMITTANCE_MARCH 2
#define TRANSMITTANCE_RATIO 3
#define TRANSMITTANCE_RESIDUAL_RATIO 4
#define TRANSMITTANCE_BINARY 5

#define LIGHT_CONSTANT 1u
#define LIGHT_ENVMAP 2u
#define LIGHT_POINT 4u
#define LIGHT_SPOT 8u
#define LIGHT_DIRECTIONAL 16u
#define LIGHT_SPHERE 32u
#define LIGHT_RECTANGLE 64u

#define BVH_ARITY 8
#define BVH_LEAF 0x80000000u
#define BVH_NONE 0xffffffffu

// Operations counted where a program is built with CLUME_COUNT: the kinds of work that its time is made of.
#define WORK_CELLS 0       // steps from cell to cell
#define WORK_NODES 1       // nodes of the bvh opened (8 boxes each)
#define WORK_GROUPS 2      // groups of 16 primitives tested against a ray or a point
#define WORK_PRIMITIVES 3  // primitives evaluated one at a time
#define WORK_DENSITIES 4   // points at which a density was looked up
#define WORK_VOXELS 5      // voxels walked through, or looked up
#define WORK_SEGMENTS 6    // segments of regular tracking
#define WORK_ROOTS 7       // evaluations by root finding
#define WORK_DRAWS 8       // blocks of random numbers
#define WORK_EVENTS 9      // flights ended: collisions, with what is scattered and lit there, and escapes
#define WORK_KINDS 10

// Words of a work-item's film sums: per channel Σx and Σx² (lo, hi), then alpha count, non-finite samples, densities above
// their bound, the share of extinction lost by that (20 fraction bits), and the work of each kind.
#define FILM_CHANNELS_MAX 3
#define FILM_ALPHA (4 * FILM_CHANNELS_MAX)
#define FILM_NONFINITE (4 * FILM_CHANNELS_MAX + 1)
#define FILM_VIOLATIONS (4 * FILM_CHANNELS_MAX + 2)
#define FILM_EXCESS (4 * FILM_CHANNELS_MAX + 3)
#define FILM_WORK (4 * FILM_CHANNELS_MAX + 4)
#define FILM_WORDS (4 * FILM_CHANNELS_MAX + 4 + WORK_KINDS)

typedef struct RenderParams {
    // Camera: the point P = plane_c + (x − film_cx) plane_x + (y − film_cy) plane_y near the media; direction likewise.
    float4 plane_c, plane_x, plane_y;
    float4 dir_c, dir_x, dir_y;
    float4 cells_origin;  // lower corner; w: 1 / root cell size
    float4 bounds_min, bounds_max;
    float4 albedo;    // uniform albedo; w: uniform g
    float4 emission;  // uniform emission
    float film_cx, film_cy, film_scale, march_step;
    uint cells_x, cells_y, cells_z, cells_levels;
    uint film_width, seed_lo, seed_hi, light_count;
    int max_depth, rr_depth;
    float scene_bound;  // of the mixture's extinction, anywhere
    uint explore;       // 1: `progressive` also looks at one place in every cell that a ray crosses
} RenderParams;

typedef struct CellEntry {
    uint link;
    float majorant;         // sum of the references' bounds; 0 if empty
    uint reference, count;  // leaves: the first reference, and how many; 0 where no strategy needs them
} CellEntry;

typedef struct CellLeaf {
    uint first_group, group_count;  // 0 where no strategy visits groups by cell
    float control, pad0;            // lower bound of the extinction, for residual ratio tracking
} CellLeaf;

// One slot of a cell's alias table over its primitives' bounds, with both primitives that it may stand for: one cache line a
// tentative collision. A primitive collides at the rate bound · K(r²) · scale, scale = peak / bound having 8 significant bits
// (a bfloat16; the bound is what is rounded, upwards), so that K · scale <= 1 in this cell.
typedef struct Reference {
    uint threshold;   // `own` if a word is below it, else `other`
    uint own, other;  // primitives
    uint scales;      // upper halves of the floats: own's in the low 16 bits, other's in the high 16
} Reference;

typedef struct Primitive {
    float mu[3];
    float w[6];  // upper triangle of the whitening, row-major
    float sigma;
    float extent_squared;
    uint family;
    uint medium, pad0, pad1, pad2;
} Primitive;

typedef struct BvhNode {
    float lo_x[BVH_ARITY], lo_y[BVH_ARITY], lo_z[BVH_ARITY];
    float hi_x[BVH_ARITY], hi_y[BVH_ARITY], hi_z[BVH_ARITY];
    uint child[BVH_ARITY];  // BVH_LEAF | group, node index, or BVH_NONE
} BvhNode;

typedef struct MediumInfo {
    uint family, phase;
    float extent_squared, g;
} MediumInfo;

// Positions in a grid are in root cells of its table: (to_x · q + to_x.w, …) with q = p − center, p normalised.
typedef struct GridInfo {
    float4 center;
    float4 to_x, to_y, to_z;
    float4 lower, upper;  // support: beyond it the density is 0
    float4 emission;      // factor of its emission grid's values
    uint roots_x, roots_y, roots_z, first_entry;
    uint first_brick, interpolation;
    uint primitive;      // that a collision reports: the number of ellipsoids + the medium's index
    uint emission_grid;  // index into grids, or GRID_NONE
    uint bounds_x, bounds_y, bounds_z, first_bound;  // a table of bounds of its own (no levels), from `lower` on
    float bounds_scale;                              // its cells per root cell
    float bound;                                     // of all the grid
    uint first_learned;  // bounds of `progressive`: one per brick, or (CLUME_SCENE_BOUND) one
    float pad0;
} GridInfo;

typedef struct LightInfo {
    uint kind, visible, width, height;  // visible: to the camera
    uint texel_offset;
    float lamp_sigma, lamp_pdf;  // point and spot lights amid medium (lamp.cl): extinction about there, else 0; of being chosen among them
    float select_pdf;            // of being chosen for next-event estimation; 0: never
    float4 radiance;   // radiance, intensity or irradiance; w: cumulative selection probability
    float4 position;   // position, centre, corner or direction; w: radius, or rectangle area
    float4 axis;       // spot direction, rectangle normal, environment's sin and cos of rotate_y in x, y; w: spot cutoff angle
    float4 edge_u, edge_v;  // rectangle; spot: edge_u.x = 1 / (cutoff − beam); lamps: film point it projects to in edge_v.x, y
    float4 dual_u, dual_v;  // rectangle: edge_u · dual_u = 1, edge_v · dual_u = 0 and the other way round
} LightInfo;

typedef struct AliasEntry {
    uint threshold, other;
    float pdf_texel, pad0;  // probability of the texel / its solid angle [1/sr]
} AliasEntry;

typedef struct PathState {
    float4 origin;     // w: t reached in the present flight
    float4 direction;  // w: pdf of the phase sampling that made it
    float4 beta;
    float4 radiance;
    uint sample, depth, draw, flags;  // sample: the next one if no path is alive
    // Of lanes: the row that the path counts for; the one of which the next path will be, and its next sample; the work-item's
    // first row that is nobody's yet.
    uint row, next_row, next, fresh;
} PathState;

#ifdef __cplusplus
static_assert(sizeof(RenderParams) == 240 && sizeof(CellEntry) == 16 && sizeof(CellLeaf) == 16 && sizeof(Reference) == 16 && sizeof(Primitive) == 64 && sizeof(BvhNode) == 224 && sizeof(MediumInfo) == 16);
static_assert(sizeof(LightInfo) == 144 && sizeof(AliasEntry) == 16 && sizeof(GridInfo) == 176 && sizeof(PathState) == 96);
}  // namespace clume::device
#endif

#endif
