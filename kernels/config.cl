// SPDX-License-Identifier: MIT
// What a program is specialised to: every -D with its default, and the vector types of the chosen width.
// A vector of W primitives is `vfloat`; comparisons give `vint` masks, for `vselect(a, b, mask)` = mask ? b : a, `vany`, `vnot`, & and |.
#include "layout.h"

#pragma OPENCL FP_CONTRACT OFF
#ifdef __clang__  // a specialised program leaves functions unused: that is what it is for
#pragma clang diagnostic ignored "-Wunused-function"
#endif

#ifndef CLUME_WIDTH  // primitives per vector: 16, 8, 4 or 1
#define CLUME_WIDTH 8
#endif
#ifndef CLUME_FAMILIES  // kernel families in the scene, FAMILY_* bits
#define CLUME_FAMILIES (FAMILY_GAUSSIAN | FAMILY_EPANECHNIKOV | FAMILY_UNIFORM)
#endif
#ifndef CLUME_ONE_MEDIUM  // 1: a single medium (or media that differ in nothing a kernel looks at)
#define CLUME_ONE_MEDIUM 0
#endif
#ifndef CLUME_PHASES  // phase functions in the scene, PHASE_* bits
#define CLUME_PHASES (PHASE_ISOTROPIC | PHASE_HENYEY_GREENSTEIN | PHASE_RAYLEIGH)
#endif
#ifndef CLUME_UNIFORM_G  // 1: one g for all, in params
#define CLUME_UNIFORM_G 0
#endif
#ifndef CLUME_UNIFORM_ALBEDO  // 1: one albedo for all, in params
#define CLUME_UNIFORM_ALBEDO 0
#endif
#ifndef CLUME_EMISSION  // 0: nothing emits; 1: one emission, in params; 2: per primitive
#define CLUME_EMISSION 2
#endif
#ifndef CLUME_LIGHTS  // light kinds in the scene, LIGHT_* bits
#define CLUME_LIGHTS 127
#endif
#ifndef CLUME_NEE  // light kinds sampled by next-event estimation
#define CLUME_NEE 126
#endif
#ifndef CLUME_LAMPS  // 1: some point or spot light has medium around it
#define CLUME_LAMPS ((CLUME_NEE & (LIGHT_POINT | LIGHT_SPOT)) != 0)
#endif
#ifndef CLUME_HITS  // light kinds that count when a scattered path finds them
#define CLUME_HITS 99
#endif
#ifndef CLUME_VISIBLE_BACKGROUND  // 1: some environment is visible to the camera
#define CLUME_VISIBLE_BACKGROUND 1
#endif
#ifndef CLUME_CHANNELS  // 1: everything is grey, one channel is carried; 3: RGB
#define CLUME_CHANNELS 3
#endif
#ifndef CLUME_DEPTH_LIMIT  // 1: params.max_depth holds; 0: no limit
#define CLUME_DEPTH_LIMIT 1
#endif
#ifndef CLUME_STRATEGY
#define CLUME_STRATEGY STRATEGY_DECOMPOSITION
#endif
#ifndef CLUME_TRANSMITTANCE
#define CLUME_TRANSMITTANCE TRANSMITTANCE_ANALYTIC
#endif
#ifndef CLUME_SCENE_BOUND  // 1: null collisions know one bound for the whole mixture; 0: one per cell
#define CLUME_SCENE_BOUND 0
#endif
#ifndef CLUME_BISECTION  // 1: root finding of regular tracking by bisection; 0: safeguarded Newton
#define CLUME_BISECTION 0
#endif
#ifndef CLUME_SOBOL  // 1: random numbers are spread evenly over a pixel's samples; 0: they are independent
#define CLUME_SOBOL 0
#endif
#ifndef CLUME_COUNT  // 1: operations are counted (WORK_*)
#define CLUME_COUNT 0
#endif
#ifndef CLUME_MIXTURE  // 0: the scene has no ellipsoids
#define CLUME_MIXTURE 1
#endif
#ifndef CLUME_GRIDS  // voxel media in the scene
#define CLUME_GRIDS 0
#endif
#ifndef CLUME_GRID_LEVELS  // octree levels of the grids' tables of bricks below their roots
#define CLUME_GRID_LEVELS 0
#endif
#ifndef CLUME_GRID_KINDS  // interpolations of the grids, GRID_* bits
#define CLUME_GRID_KINDS (GRID_TRILINEAR | GRID_NEAREST)
#endif
#ifndef CLUME_GRID_BOUNDS  // 1: null collisions in grids know bounds from a table of its own; 0: those of the bricks
#define CLUME_GRID_BOUNDS 0
#endif
#ifndef CLUME_GRID_EMISSION  // 1: some voxel medium has an emission grid
#define CLUME_GRID_EMISSION 0
#endif
#define ACCEL_CELLS 1
#define ACCEL_BVH 2
#ifndef CLUME_ACCEL
#define CLUME_ACCEL ACCEL_CELLS
#endif
#ifndef CLUME_BVH_STACK  // entries; the host gives the deepest that this tree can need
#define CLUME_BVH_STACK 256
#endif
#ifndef CLUME_LAUNCH_EVENTS  // flights a work-item does before it saves its state for the next launch; 16 tentative collisions count as one more
#define CLUME_LAUNCH_EVENTS 4096
#endif
#ifndef CLUME_FLIGHT_DRAWS  // tentative collisions a null-collision flight does before it pauses: a power of two
#define CLUME_FLIGHT_DRAWS 4096
#endif
#define TENTATIVE_EVENTS(n) ((n) >> 4)

#define CLUME_PARTS (CLUME_GROUP_SIZE / CLUME_WIDTH)
#define CLUME_PER_PRIMITIVE (!CLUME_UNIFORM_G || !CLUME_UNIFORM_ALBEDO || CLUME_EMISSION == 2 || \
                             (!CLUME_ONE_MEDIUM && CLUME_PHASES != PHASE_ISOTROPIC))

// 1: a work-item follows CLUME_WIDTH paths side by side, instead of one beside which it looks at CLUME_WIDTH primitives. On devices
// whose work-items go side by side themselves (CLUME_WIDTH 1) it follows one, and looks up often enough for its neighbours' sake.
#ifndef CLUME_LANES
#define CLUME_LANES 0
#endif
// 1: work-items take the next sample of any pixel from a pool that all share, instead of each having its own: on devices whose
// work-items go side by side, none of them idles before all have ended.
#ifndef CLUME_POOL
#define CLUME_POOL (CLUME_WIDTH == 1)
#endif
#ifndef CLUME_LANES_ENOUGH  // sixteenths of the flights under way that are left when those that ended are looked after
#define CLUME_LANES_ENOUGH 10
#endif
#ifndef CLUME_LANES_STEPPING  // sixteenths of the flights under way that may be between cells while the others collide
#define CLUME_LANES_STEPPING 7
#endif
#ifndef CLUME_LANES_STEPS  // of CLUME_WIDTH 1: steps between cells before its neighbours' collisions are looked after
#define CLUME_LANES_STEPS 2
#endif
#ifndef CLUME_LANES_ROUNDS  // of CLUME_WIDTH 1: collisions before its neighbours' flights that ended are looked after
#define CLUME_LANES_ROUNDS 4
#endif
#ifndef CLUME_LANES_GROUPS  // of CLUME_WIDTH 1: groups of primitives that an analytic shadow ray looks at likewise
#define CLUME_LANES_GROUPS 1
#endif

#define CONCAT_(a, b) a##b
#define CONCAT(a, b) CONCAT_(a, b)

#if CLUME_WIDTH == 1
typedef float vfloat;
typedef int vint;
typedef uint vuint;
typedef ulong vulong;
#define vselect(a, b, mask) ((mask) ? (b) : (a))
#define vany(mask) (mask)
#define vnot(mask) (!(mask))
#define as_vint(x) as_int(x)
#define as_vuint(x) as_uint(x)
#define as_vfloat(x) as_float(x)
#define to_vfloat(x) ((float)(x))
#define to_vint(x) ((int)(x))
#define to_vuint(x) ((uint)(x))
#define to_vulong(x) ((ulong)(x))
#define vload_row(p) (*(p))
#else
typedef CONCAT(float, CLUME_WIDTH) vfloat;
typedef CONCAT(int, CLUME_WIDTH) vint;
typedef CONCAT(uint, CLUME_WIDTH) vuint;
typedef CONCAT(ulong, CLUME_WIDTH) vulong;
#if CLUME_WIDTH == 16
#define CLUME_HALF_WIDTH 8
#elif CLUME_WIDTH == 8
#define CLUME_HALF_WIDTH 4
#else
#define CLUME_HALF_WIDTH 2
#endif
typedef CONCAT(ulong, CLUME_HALF_WIDTH) vpairs;  // the bits of a vuint, two lanes each (even lanes: low words)
#define as_vpairs(x) CONCAT(as_ulong, CLUME_HALF_WIDTH)(x)
#define pairs_as_vuint(x) CONCAT(as_uint, CLUME_WIDTH)(x)
#define vselect(a, b, mask) select((a), (b), (mask))
#define vnot(mask) (~(mask))
#define as_vint(x) CONCAT(as_int, CLUME_WIDTH)(x)
#define as_vuint(x) CONCAT(as_uint, CLUME_WIDTH)(x)
#define as_vfloat(x) CONCAT(as_float, CLUME_WIDTH)(x)
#define to_vfloat(x) CONCAT(convert_float, CLUME_WIDTH)(x)
#define to_vint(x) CONCAT(convert_int, CLUME_WIDTH)(x)
#define to_vuint(x) CONCAT(convert_uint, CLUME_WIDTH)(x)
#define to_vulong(x) CONCAT(convert_ulong, CLUME_WIDTH)(x)
#define vload_row(p) (*(__global const vfloat*)(p))
/// Whether any lane of a comparison's result is set. By halves: `any` looks at one lane after the other on some devices.
static int vany(vint mask) {
#if CLUME_WIDTH == 16
    const int8 m8 = mask.lo | mask.hi;
    const int4 m4 = m8.lo | m8.hi;
#elif CLUME_WIDTH == 8
    const int4 m4 = mask.lo | mask.hi;
#else
    const int4 m4 = mask;
#endif
    const int2 m2 = m4.lo | m4.hi;
    return (m2.x | m2.y) != 0;
}
#endif

#define CLUME_INFINITY 1e30f  // "never" along a ray; finite, so that sums and products of it stay ordered
#define CLUME_PI 3.14159265f
#define CLUME_INV_4PI 0.0795774715f
#define CLUME_INV_2PI 0.159154943f
