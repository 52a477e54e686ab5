// SPDX-License-Identifier: MIT
// Camera rays. The host gives a plane just in front of everything that can be seen, computed in double, as a point and two
// steps per pixel around the pixel where the scene's centre projects, so that float loses nothing to a far camera.
#include "rng.cl"

/// Ray through film point (x + u, y + v), u and v in (0, 1): origin on the plane, origin error < 2 ulp of the radius (of |o| if that is greater); direction of unit
/// length, direction error < 3e-7 absolute.
static void camera_ray(__constant const RenderParams* params, uint x, uint y, float u, float v, float3* o, float3* d) {
    const float fx = ((float)x - params->film_cx) + u, fy = ((float)y - params->film_cy) + v;
    o->x = fma(fx, params->plane_x.x, fma(fy, params->plane_y.x, params->plane_c.x));
    o->y = fma(fx, params->plane_x.y, fma(fy, params->plane_y.y, params->plane_c.y));
    o->z = fma(fx, params->plane_x.z, fma(fy, params->plane_y.z, params->plane_c.z));
    float3 w;
    w.x = fma(fx, params->dir_x.x, fma(fy, params->dir_y.x, params->dir_c.x));
    w.y = fma(fx, params->dir_x.y, fma(fy, params->dir_y.y, params->dir_c.y));
    w.z = fma(fx, params->dir_x.z, fma(fy, params->dir_y.z, params->dir_c.z));
    *d = normalize_s(w);
}
