// SPDX-License-Identifier: MIT
// The other accelerator: an 8-wide bounding volume hierarchy whose leaves are groups of at most 16 primitives, for
// decomposition flights, optical depth and point density. Kept or dropped by measurement (docs/design.md).
#include "medium.cl"

/// Entry distances of the ray into the node's boxes; CLUME_INFINITY where it misses or enters beyond t_end.
static float8 bvh_test(__global const BvhNode* node, float3 o, float3 inverse, float t_begin, float t_end) {
    const float8 ax = (*(__global const float8*)node->lo_x - o.x) * inverse.x, bx = (*(__global const float8*)node->hi_x - o.x) * inverse.x;
    const float8 ay = (*(__global const float8*)node->lo_y - o.y) * inverse.y, by = (*(__global const float8*)node->hi_y - o.y) * inverse.y;
    const float8 az = (*(__global const float8*)node->lo_z - o.z) * inverse.z, bz = (*(__global const float8*)node->hi_z - o.z) * inverse.z;
    float8 near = select(ax, bx, bx < ax), far = select(bx, ax, bx < ax);
    const float8 ny = select(ay, by, by < ay), fy = select(by, ay, by < ay);
    const float8 nz = select(az, bz, bz < az), fz = select(bz, az, bz < az);
    near = select(near, ny, ny > near);
    near = select(near, nz, nz > near);
    near = select(near, (float8)t_begin, near < (float8)t_begin);
    far = select(far, fy, fy < far);
    far = select(far, fz, fz < far);
    return select((float8)CLUME_INFINITY, near, (near <= far) & (near < (float8)t_end));
}

/// Pushes the node's children that the ray enters before t_end, nearest on top; returns the new stack height.
static int bvh_push(__global const BvhNode* node, float8 entry, float t_end, uint* stack, float* distance, int height) {
    const float* near = (const float*)&entry;
    const int base = height;
    for (int i = 0; i < BVH_ARITY; ++i) {
        if (node->child[i] == BVH_NONE || !(near[i] < t_end)) continue;
        int j = height++;
        for (; j > base && distance[j - 1] < near[i]; --j) {
            distance[j] = distance[j - 1];
            stack[j] = stack[j - 1];
        }
        distance[j] = near[i];
        stack[j] = node->child[i];
    }
    return height;
}

static void bvh_decompose(float3 o, float3 d, float t_begin, uint2 key, float* best, uint* primitive, Work* work, SCENE_ARGS) {
    uint stack[CLUME_BVH_STACK];
    float distance[CLUME_BVH_STACK];
    const float3 inverse = ray_inverse(d);
    int height = bvh_push(nodes, bvh_test(nodes, o, inverse, t_begin, *best), *best, stack, distance, 0);
    while (height > 0) {
        height -= 1;
        if (!(distance[height] < *best)) continue;
        const uint child = stack[height];
        if (child & BVH_LEAF) {
            COUNT(work, WORK_GROUPS, 1);
            group_decompose(child & ~BVH_LEAF, o, d, t_begin, -CLUME_INFINITY, CLUME_INFINITY, key, best, primitive, SCENE);
        } else {
            COUNT(work, WORK_NODES, 1);
            height = bvh_push(nodes + child, bvh_test(nodes + child, o, inverse, t_begin, *best), *best, stack, distance, height);
        }
    }
}

/// Where a walk over the groups of the bvh stands; its stack is the caller's, so that this can stay in registers.
typedef struct {
    uint node;    // that is open
    uint child;   // next one of it
    uint met;     // bits: which ones the ray meets, from there on
    int height;   // of the stack
} BvhWalk;

static void bvh_begin(BvhWalk* w, uint* stack) {
    stack[0] = 0;
    w->height = 1;
    w->met = 0;
}

/// Bits of the node's boxes that the ray meets between t_begin and t_end.
static uint bvh_met(__global const BvhNode* node, float3 o, float3 inverse, float t_begin, float t_end) {
    const int8 bits = (bvh_test(node, o, inverse, t_begin, t_end) < (float8)t_end) & (int8)(1, 2, 4, 8, 16, 32, 64, 128);
    const int4 b4 = bits.lo | bits.hi;
    const int2 b2 = b4.lo | b4.hi;
    return (uint)(b2.x | b2.y);
}

/// The next group that the ray may meet between t_begin and t_end, in no order of distance; BVH_NONE when there is none left.
static uint bvh_next(BvhWalk* w, uint* stack, float3 o, float3 inverse, float t_begin, float t_end, Work* work, __global const BvhNode* nodes) {
    for (;;) {
        while (w->met != 0) {
            const uint i = w->child++, met = w->met & 1u;
            w->met >>= 1;
            if (!met) continue;
            const uint child = nodes[w->node].child[i];
            if (child == BVH_NONE) continue;
            if (child & BVH_LEAF) {
                COUNT(work, WORK_GROUPS, 1);
                return child & ~BVH_LEAF;
            }
            stack[w->height++] = child;
        }
        if (w->height == 0) return BVH_NONE;
        COUNT(work, WORK_NODES, 1);
        w->node = stack[--w->height];
        w->met = bvh_met(nodes + w->node, o, inverse, t_begin, t_end);
        w->child = 0;
    }
}

/// Optical depth between t_begin and t_end, or any partial sum that has reached `limit`.
static ulong bvh_depth(float3 o, float3 d, float t_begin, float t_end, ulong limit, Work* work, SCENE_ARGS) {
    uint stack[CLUME_BVH_STACK];
    BvhWalk w;
    const float3 inverse = ray_inverse(d);
    ulong depth = 0;
    bvh_begin(&w, stack);
    for (uint group; depth < limit && (group = bvh_next(&w, stack, o, inverse, t_begin, t_end, work, nodes)) != BVH_NONE;)
        depth += group_depth(group, o, d, t_begin, t_end, -CLUME_INFINITY, CLUME_INFINITY, SCENE);
    return depth;
}

static float bvh_density(float3 p, uint* primitive, float u, Work* work, SCENE_ARGS) {
    uint stack[CLUME_BVH_STACK];
    float sum = 0.0f;
    int height = 0;
    uint node = 0;
    COUNT(work, WORK_DENSITIES, 1);
    for (;;) {
        COUNT(work, WORK_NODES, 1);
        for (int i = 0; i < BVH_ARITY; ++i) {
            __global const BvhNode* n = nodes + node;
            const uint child = n->child[i];
            if (child == BVH_NONE || !(p.x >= n->lo_x[i] && p.x <= n->hi_x[i] && p.y >= n->lo_y[i] && p.y <= n->hi_y[i] &&
                                       p.z >= n->lo_z[i] && p.z <= n->hi_z[i]))
                continue;
            if (child & BVH_LEAF) {
                COUNT(work, WORK_GROUPS, 1);
                const float part = groups_density(child & ~BVH_LEAF, 1, p, SCENE);
                // Reservoir over the leaves: the newcomer wins with its share, u is stretched back to (0, 1).
                if (part > 0.0f) {
                    sum += part;
                    const float share = divide_s(part, sum);
                    if (u < share) {
                        u = divide_s(u, share);
                        *primitive = groups_pick(child & ~BVH_LEAF, 1, p, u * part, SCENE);
                    } else {
                        u = divide_s(u - share, max_s(1.0f - share, 0x1p-24f));
                    }
                }
            } else {
                stack[height++] = child;
            }
        }
        if (height == 0) return sum;
        node = stack[--height];
    }
}
