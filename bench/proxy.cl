// SPDX-License-Identifier: MIT
// What a bounding proxy costs: a line against ellipsoids behind circumscribed icosahedra, as meshes (12 vertices each, 20
// triangles tested by Möller and Trumbore's signed volumes, without their division) or as one shared unit icosahedron under each
// ellipsoid's own transform (10 slabs), against the analytic test alone. Only measured, never rendered with.
#include "ellipsoid.cl"
#include "lanes.cl"

#define PROXY_ANALYTIC 0
#define PROXY_MESH 1
#define PROXY_INSTANCED 2
#define PROXY_CHECK 3
#define MESH_FLOATS (12 * 3 * CLUME_GROUP_SIZE)

/// Lanes whose mesh the whole line meets: of a closed convex mesh seen from outside, some front face. `vertices`: 12 times 3 rows
/// of the lanes' coordinates; `faces`: 20 times 3 indices, counter-clockwise from outside.
static vint line_meets_mesh(__global const float* vertices, __constant const uint* faces, float3 o, float3 d) {
    vint met = (vfloat)0.0f > (vfloat)1.0f;
    for (int f = 0; f < 20; ++f) {
        __global const float *a = vertices + 48 * faces[3 * f], *b = vertices + 48 * faces[3 * f + 1], *c = vertices + 48 * faces[3 * f + 2];
        const vfloat ax = vload_row(a), ay = vload_row(a + 16), az = vload_row(a + 32);
        const vfloat e1x = vload_row(b) - ax, e1y = vload_row(b + 16) - ay, e1z = vload_row(b + 32) - az;
        const vfloat e2x = vload_row(c) - ax, e2y = vload_row(c + 16) - ay, e2z = vload_row(c + 32) - az;
        const vfloat px = d.y * e2z - d.z * e2y, py = d.z * e2x - d.x * e2z, pz = d.x * e2y - d.y * e2x;
        const vfloat det = fma(e1x, px, fma(e1y, py, e1z * pz));
        const vfloat sx = o.x - ax, sy = o.y - ay, sz = o.z - az;
        const vfloat u = fma(sx, px, fma(sy, py, sz * pz));
        const vfloat qx = sy * e1z - sz * e1y, qy = sz * e1x - sx * e1z, qz = sx * e1y - sy * e1x;
        const vfloat v = fma(qx, (vfloat)d.x, fma(qy, (vfloat)d.y, qz * d.z));
        // Widened by a hair, so that no line slips through between two faces.
        const vfloat slack = 1e-4f * det;
        met |= (det > (vfloat)0.0f) & (u >= -slack) & (v >= -slack) & (u + v <= det + slack);
    }
    return met;
}

/// The same for the unit sphere's icosahedron under the lanes' whitening: the line's interval within 10 pairs of faces, whose
/// normals are given; `reach`: distance of the faces from the centre.
static vint line_meets_instance(__global const float* part, __constant const float4* normals, float3 o, float3 d, float reach) {
    const vfloat x = o.x - vload_row(part), y = o.y - vload_row(part + 16), z = o.z - vload_row(part + 32);
    const vfloat w00 = vload_row(part + 48), w01 = vload_row(part + 64), w02 = vload_row(part + 80);
    const vfloat w11 = vload_row(part + 96), w12 = vload_row(part + 112), w22 = vload_row(part + 128);
    const vfloat a0 = fma(w00, x, fma(w01, y, w02 * z)), a1 = fma(w11, y, w12 * z), a2 = w22 * z;
    const vfloat b0 = fma(w00, (vfloat)d.x, fma(w01, (vfloat)d.y, w02 * d.z)), b1 = fma(w11, (vfloat)d.y, w12 * d.z), b2 = w22 * d.z;
    vfloat t_in = (vfloat)-1e30f, t_out = (vfloat)1e30f;
    for (int k = 0; k < 10; ++k) {
        const float4 n = normals[k];
        const vfloat at = fma((vfloat)n.x, a0, fma((vfloat)n.y, a1, n.z * a2)), along = fma((vfloat)n.x, b0, fma((vfloat)n.y, b1, n.z * b2));
        const vfloat inverse = rcp_v(vselect(along, (vfloat)1e-30f, fabs(along) < (vfloat)1e-30f));
        const vfloat t0 = (-reach - at) * inverse, t1 = (reach - at) * inverse;
        const vint swap = t1 < t0;
        const vfloat low = vselect(t0, t1, swap), high = vselect(t1, t0, swap);
        t_in = vselect(t_in, low, low > t_in);
        t_out = vselect(t_out, high, high < t_out);
    }
    return t_in <= t_out;
}

/// Every line against every group. out, per line: x summed lengths of chords; PROXY_CHECK: ellipsoids, meshes and instances met,
/// ellipsoids met outside their mesh or instance.
static float4 proxy_work(const uint what, __global const float* groups, __global const float* meshes, __constant const uint* faces, __constant const float4* normals, float reach,
                         uint group_count, float3 o, float3 d, float e2) {
    const vfloat none = (vfloat)0.0f, one = (vfloat)1.0f;
    vfloat chords = none, mesh_count = none, instance_count = none, lost = none;
    for (uint part = 0; part < group_count * CLUME_PARTS; ++part) {
        const size_t group = part / CLUME_PARTS, lane = (part % CLUME_PARTS) * CLUME_WIDTH;
        __global const float *lanes = groups + group * CLUME_GROUP_FLOATS + lane, *mesh = meshes + group * MESH_FLOATS + lane;
        vint met = one > none;
        if (what == PROXY_MESH) met = line_meets_mesh(mesh, faces, o, d);
        if (what == PROXY_INSTANCED) met = line_meets_instance(lanes, normals, o, d, reach);
        if (!vany(met)) continue;
        Chord c;
        const vint hit = met & intersect(lanes, o, d, e2, &c);
        if (what == PROXY_CHECK) {
            const vint by_mesh = line_meets_mesh(mesh, faces, o, d), by_instance = line_meets_instance(lanes, normals, o, d, reach);
            chords += vselect(none, one, hit);
            mesh_count += vselect(none, one, by_mesh);
            instance_count += vselect(none, one, by_instance);
            lost += vselect(none, vselect(one, none, by_mesh & by_instance), hit);
        } else {
            chords += vselect(none, c.t_out - c.t_in, hit);
        }
    }
    return (float4)(lanes_sum(chords), lanes_sum(mesh_count), lanes_sum(instance_count), lanes_sum(lost));
}

__kernel void proxy_lines(__global const float* groups, __global const float* meshes, __constant const uint* faces, __constant const float4* normals, __global const float4* lines,
                          __global float4* out, float reach, uint count, uint group_count, float e2, uint what) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const float3 o = lines[2 * i].xyz, d = lines[2 * i + 1].xyz;
    if (what == PROXY_ANALYTIC) out[i] = proxy_work(PROXY_ANALYTIC, groups, meshes, faces, normals, reach, group_count, o, d, e2);
    if (what == PROXY_MESH) out[i] = proxy_work(PROXY_MESH, groups, meshes, faces, normals, reach, group_count, o, d, e2);
    if (what == PROXY_INSTANCED) out[i] = proxy_work(PROXY_INSTANCED, groups, meshes, faces, normals, reach, group_count, o, d, e2);
    if (what == PROXY_CHECK) out[i] = proxy_work(PROXY_CHECK, groups, meshes, faces, normals, reach, group_count, o, d, e2);
}
