// SPDX-License-Identifier: MIT
#include "bench/operations.h"

#include <stdexcept>
#include <string>

namespace clume::bench {
namespace {

// Name, operations and multiplications among them, lanes, defines, code.
constexpr Block block_table[] = {
    {"rcp", {7, 6}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = rcp_v(x);"},
    {"rsqrt", {12, 10}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = rsqrt_v(x);"},
    {"sqrt", {19, 14}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = sqrt_v(x);"},
    {"exp", {15, 9}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = exp_v(x);"},
    {"log", {19, 12}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = log_v(x);"},
    {"erfc", {37, 30}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = erfc_v(x);"},
    {"erfc_inverse", {35, 24}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = erfc_inverse_v(x);"},
    {"epanechnikov_inverse", {30, 25}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = epanechnikov_inverse_v(x);"},
    {"divide", {10, 9}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = divide_v(x, y);"},
    {"exponential", {36, 14}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = exponential_v(as_vuint(x));"},
    {"from_uint", {6, 0}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = from_uint_v(as_vuint(x));"},
    {"erf_between", {88, 62}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = erf_between(x, y, y - x);"},
    {"asin", {15, 9}, 1, "", "const float x = a[0], y = a[1]; out[0] = asin_s(x);"},
    {"acos", {16, 9}, 1, "", "const float x = a[0], y = a[1]; out[0] = acos_s(x);"},
    {"atan2", {22, 10}, 1, "", "const float x = a[0], y = a[1]; out[0] = atan2_s(x, y);"},
    {"sin", {20, 11}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = sine_of_turns(x);"},
    {"cos", {21, 11}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = cosine_of_turns(x);"},
    {"uniform", {10, 1}, 16, "", "const vfloat x = vload_row(a), y = vload_row(a + 16); *(__global vfloat*)out = uniform_v(as_vuint(x));"},
    {"normalize", {16, 14}, 1, "", "const float x = a[0], y = a[1]; out[0] = normalize_s((float3)(x, y, y)).x;"},
    {"intersect_whitened", {66, 53}, 16, "", "Chord c; const vint hit = intersect(a, o, d, a[206], &c); *(__global vint*)(out + 112) = hit; *(__global Chord*)out = c;"},
    {"intersect_quadratic", {71, 58}, 16, "", "Chord c; const vint hit = intersect_quadratic(a, o, d, a[206], &c); *(__global vint*)(out + 112) = hit; *(__global Chord*)out = c;"},
    {"proxy_mesh", {943, 443}, 16, "", "*(__global vint*)out = line_meets_mesh(a, faces, o, d);"},
    {"proxy_instance", {276, 152}, 16, "", "*(__global vint*)out = line_meets_instance(a, normals, o, d, a[206]);"},
    {"density/gaussian", {31, 20}, 16, "-DCLUME_FAMILIES=FAMILY_GAUSSIAN -DCLUME_ONE_MEDIUM=1", "*(__global vfloat*)out = density_part(a, o, FAMILY_GAUSSIAN, (vfloat)9.0f);"},
    {"depth/gaussian", {134, 90}, 16, "-DCLUME_FAMILIES=FAMILY_GAUSSIAN -DCLUME_ONE_MEDIUM=1", "const Chord c = *(__global const Chord*)a; const vfloat s = vload_row(a + 112), t0 = vload_row(a + 128), t1 = vload_row(a + 144); *(__global vfloat*)out = depth_part(&c, s, t0, t1, FAMILY_GAUSSIAN, (vfloat)9.0f);"},
    {"inverse/gaussian", {131, 80}, 16, "-DCLUME_FAMILIES=FAMILY_GAUSSIAN -DCLUME_ONE_MEDIUM=1", "const Chord c = *(__global const Chord*)a; const vfloat s = vload_row(a + 112), t0 = vload_row(a + 128), t1 = vload_row(a + 144); *(__global vfloat*)out = flight_part(&c, s, t0, t1, FAMILY_GAUSSIAN, (vfloat)9.0f);"},
    {"kernel/gaussian", {30, 19}, 1, "-DCLUME_FAMILIES=FAMILY_GAUSSIAN -DCLUME_ONE_MEDIUM=1", "out[0] = primitive_kernel(primitives, a[0], a[1], a[2]);"},
    {"density/epanechnikov", {16, 11}, 16, "-DCLUME_FAMILIES=FAMILY_EPANECHNIKOV -DCLUME_ONE_MEDIUM=1", "*(__global vfloat*)out = density_part(a, o, FAMILY_EPANECHNIKOV, (vfloat)9.0f);"},
    {"depth/epanechnikov", {40, 21}, 16, "-DCLUME_FAMILIES=FAMILY_EPANECHNIKOV -DCLUME_ONE_MEDIUM=1", "const Chord c = *(__global const Chord*)a; const vfloat s = vload_row(a + 112), t0 = vload_row(a + 128), t1 = vload_row(a + 144); *(__global vfloat*)out = depth_part(&c, s, t0, t1, FAMILY_EPANECHNIKOV, (vfloat)9.0f);"},
    {"inverse/epanechnikov", {86, 51}, 16, "-DCLUME_FAMILIES=FAMILY_EPANECHNIKOV -DCLUME_ONE_MEDIUM=1", "const Chord c = *(__global const Chord*)a; const vfloat s = vload_row(a + 112), t0 = vload_row(a + 128), t1 = vload_row(a + 144); *(__global vfloat*)out = flight_part(&c, s, t0, t1, FAMILY_EPANECHNIKOV, (vfloat)9.0f);"},
    {"kernel/epanechnikov", {15, 10}, 1, "-DCLUME_FAMILIES=FAMILY_EPANECHNIKOV -DCLUME_ONE_MEDIUM=1", "out[0] = primitive_kernel(primitives, a[0], a[1], a[2]);"},
    {"density/uniform", {14, 9}, 16, "-DCLUME_FAMILIES=FAMILY_UNIFORM -DCLUME_ONE_MEDIUM=1", "*(__global vfloat*)out = density_part(a, o, FAMILY_UNIFORM, (vfloat)9.0f);"},
    {"depth/uniform", {4, 1}, 16, "-DCLUME_FAMILIES=FAMILY_UNIFORM -DCLUME_ONE_MEDIUM=1", "const Chord c = *(__global const Chord*)a; const vfloat s = vload_row(a + 112), t0 = vload_row(a + 128), t1 = vload_row(a + 144); *(__global vfloat*)out = depth_part(&c, s, t0, t1, FAMILY_UNIFORM, (vfloat)9.0f);"},
    {"inverse/uniform", {17, 7}, 16, "-DCLUME_FAMILIES=FAMILY_UNIFORM -DCLUME_ONE_MEDIUM=1", "const Chord c = *(__global const Chord*)a; const vfloat s = vload_row(a + 112), t0 = vload_row(a + 128), t1 = vload_row(a + 144); *(__global vfloat*)out = flight_part(&c, s, t0, t1, FAMILY_UNIFORM, (vfloat)9.0f);"},
    {"kernel/uniform", {14, 9}, 1, "-DCLUME_FAMILIES=FAMILY_UNIFORM -DCLUME_ONE_MEDIUM=1", "out[0] = primitive_kernel(primitives, a[0], a[1], a[2]);"},
    {"node", {35, 6}, 8, "", "*(__global float8*)out = bvh_test(nodes, o, d, a[206], a[207]);"},
    {"philox", {57, 14}, 16, "", "vuint w[4] = {as_vuint(vload_row(a)), as_vuint(vload_row(a + 16)), as_vuint(vload_row(a + 32)), as_vuint(vload_row(a + 48))}; philox_v(w, w + 1, w + 2, w + 3, (uint2)(as_uint(a[64]), as_uint(a[65]))); for (int k = 0; k < 4; ++k) ((__global vuint*)out)[k] = w[k];"},
    {"sobol", {66, 13}, 16, "-DCLUME_SOBOL=1", "vuint w[4] = {as_vuint(vload_row(a)), as_vuint(vload_row(a + 16)), as_vuint(vload_row(a + 32)), as_vuint(vload_row(a + 48))}; sobol_v(as_vuint(vload_row(a + 80)), as_vuint(vload_row(a + 96)), as_vuint(vload_row(a + 112)), as_vuint(vload_row(a + 128)), (uint2)(as_uint(a[64]), as_uint(a[65])), w, w + 1, w + 2, w + 3); for (int k = 0; k < 4; ++k) ((__global vuint*)out)[k] = w[k];"},
    {"primitive_bits", {14, 4}, 16, "", "*(__global vuint*)out = primitive_bits(as_vuint(vload_row(a)), (uint2)(as_uint(a[16]), as_uint(a[17])));"},
    {"phase_sample/isotropic", {72, 32}, 1, "", "float pdf; const float3 s = phase_sample(PHASE_ISOTROPIC, a[0], d, *(__global const uint4*)(a + 4), &pdf); *(__global float4*)out = (float4)(s, pdf);"},
    {"phase_sample/henyey_greenstein", {169, 108}, 1, "", "float pdf; const float3 s = phase_sample(PHASE_HENYEY_GREENSTEIN, a[0], d, *(__global const uint4*)(a + 4), &pdf); *(__global float4*)out = (float4)(s, pdf);"},
    {"phase_value/henyey_greenstein", {22, 18}, 1, "", "out[0] = phase_value_s(PHASE_HENYEY_GREENSTEIN, a[0], a[1]);"},
    {"phase_sample/rayleigh", {150, 76}, 1, "", "float pdf; const float3 s = phase_sample(PHASE_RAYLEIGH, a[0], d, *(__global const uint4*)(a + 4), &pdf); *(__global float4*)out = (float4)(s, pdf);"},
    {"phase_value/rayleigh", {3, 2}, 1, "", "out[0] = phase_value_s(PHASE_RAYLEIGH, a[0], a[1]);"},
    {"light/point", {58, 33}, 1, "-DCLUME_NEE=LIGHT_POINT", "LightSample s; if (light_sample(o, *(__global const uint4*)a, *(__global const uint4*)(a + 4), &s, params, lights, texels, alias)) *(__global LightSample*)out = s;", true},
    {"light/spot", {132, 82}, 1, "-DCLUME_NEE=LIGHT_SPOT", "LightSample s; if (light_sample(o, *(__global const uint4*)a, *(__global const uint4*)(a + 4), &s, params, lights, texels, alias)) *(__global LightSample*)out = s;", true},
    {"light/directional", {27, 10}, 1, "-DCLUME_NEE=LIGHT_DIRECTIONAL", "LightSample s; if (light_sample(o, *(__global const uint4*)a, *(__global const uint4*)(a + 4), &s, params, lights, texels, alias)) *(__global LightSample*)out = s;", true},
    {"light/sphere", {269, 167}, 1, "-DCLUME_NEE=LIGHT_SPHERE", "LightSample s; if (light_sample(o, *(__global const uint4*)a, *(__global const uint4*)(a + 4), &s, params, lights, texels, alias)) *(__global LightSample*)out = s;", true},
    {"light/rectangle", {101, 51}, 1, "-DCLUME_NEE=LIGHT_RECTANGLE", "LightSample s; if (light_sample(o, *(__global const uint4*)a, *(__global const uint4*)(a + 4), &s, params, lights, texels, alias)) *(__global LightSample*)out = s;", true},
    {"light/envmap", {238, 116}, 1, "-DCLUME_NEE=LIGHT_ENVMAP", "LightSample s; if (light_sample(o, *(__global const uint4*)a, *(__global const uint4*)(a + 4), &s, params, lights, texels, alias)) *(__global LightSample*)out = s;", true},
    {"light/constant", {103, 46}, 1, "-DCLUME_NEE=LIGHT_CONSTANT", "LightSample s; if (light_sample(o, *(__global const uint4*)a, *(__global const uint4*)(a + 4), &s, params, lights, texels, alias)) *(__global LightSample*)out = s;", true},
    {"environment/constant", {23, 13}, 1, "-DCLUME_LIGHTS=LIGHT_CONSTANT -DCLUME_NEE=LIGHT_CONSTANT -DCLUME_HITS=LIGHT_CONSTANT", "*(__global spectrum*)out = environment_radiance(d, a[0], false, params, lights, texels, alias);", true},
    {"environment/envmap", {138, 77}, 1, "-DCLUME_LIGHTS=LIGHT_ENVMAP -DCLUME_NEE=LIGHT_ENVMAP -DCLUME_HITS=LIGHT_ENVMAP", "*(__global spectrum*)out = environment_radiance(d, a[0], false, params, lights, texels, alias);", true},
    {"film", {120, 7}, 1, "", "ulong sums[FILM_WORDS]; for (int i = 0; i < FILM_WORDS; ++i) sums[i] = ((__global const ulong*)a)[i]; film_sample(sums, (float3)(a[100], a[101], a[102]), a[103]); for (int i = 0; i < FILM_WORDS; ++i) ((__global ulong*)out)[i] = sums[i];", true},
    {"compare_exchange", {9, 0}, 1, "", "float t[2] = {a[0], a[1]}; uint id[2] = {as_uint(a[2]), as_uint(a[3])}; compare_exchange(t, id, 0, 1); out[0] = t[0]; out[1] = t[1]; out[2] = as_float(id[0]); out[3] = as_float(id[1]);"},
};

}  // namespace

std::span<const Block> blocks() { return block_table; }

Operations operations(std::string_view block) {
    for (const Block& b : block_table)
        if (block == b.name) return b.operations;
    throw std::logic_error("no block of code is called " + std::string(block));
}

}  // namespace clume::bench
