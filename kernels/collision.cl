// SPDX-License-Identifier: MIT
// What scatters: the primitive (or voxel medium) that a collision belongs to, the properties it has there, and the density at a
// point where no flight has collided.
#include "film.cl"
#include "flight.cl"

/// Albedo, emission and phase function at a collision with `primitive`.
static void collision_properties(uint primitive, spectrum* albedo, spectrum* emission, uint* phase, float* g, SCENE_ARGS) {
    *albedo = to_spectrum(params->albedo);
    *emission = to_spectrum(params->emission);
    *g = params->albedo.w;
    *phase = CLUME_PHASES;
#if CLUME_PER_PRIMITIVE
    const float4 a = shading[2 * (size_t)primitive];
#if !CLUME_UNIFORM_ALBEDO
    *albedo = to_spectrum(a);
#endif
#if !CLUME_UNIFORM_G
    *g = a.w;
#endif
#if CLUME_EMISSION == 2 || !CLUME_ONE_MEDIUM
    const float4 e = shading[2 * (size_t)primitive + 1];
#if CLUME_EMISSION == 2
    *emission = to_spectrum(e);
#endif
#if !CLUME_ONE_MEDIUM
    *phase = media[as_uint(e.w)].phase;
#endif
#endif
#endif
}

#if CLUME_LAMPS
/// Extinction at p, and one primitive of it, chosen by its share with the uniform numbers u and v.
static float medium_density(float3 p, float u, float v, uint* primitive, Work* work, SCENE_ARGS) {
    float sum = 0.0f;
#if CLUME_MIXTURE && CLUME_ACCEL == ACCEL_CELLS
    CellEntry cell;
    sum = point_density(p, &cell, work, SCENE);
#if CLUME_PER_PRIMITIVE
    if (sum > 0.0f) {
        const CellLeaf leaf = leaves[cell.link - CELL_EMPTY_MAX];
        *primitive = groups_pick(leaf.first_group, leaf.group_count, p, u * sum, SCENE);
    }
#endif
#elif CLUME_MIXTURE
    sum = bvh_density(p, primitive, u, work, SCENE);
#endif
#if CLUME_GRIDS
    for (uint g = 0; g < CLUME_GRIDS; ++g) {
        COUNT(work, WORK_VOXELS, 1);
        COUNT(work, WORK_DENSITIES, 1);
        const float part = grid_density(grids + g, p, grid_cells, grid_values);
        if (!(part > 0.0f)) continue;
        // The newcomer wins with its share, v is stretched back to (0, 1).
        sum += part;
        const float share = divide_s(part, sum);
        const bool wins = v < share;
        *primitive = wins ? grids[g].primitive : *primitive;
        v = wins ? divide_s(v, share) : divide_s(v - share, max_s(1.0f - share, 0x1p-24f));
    }
#endif
    return sum;
}
#endif
