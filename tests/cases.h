// SPDX-License-Identifier: MIT
// What tests and benchmarks go through: vector widths, kernel families, phase functions, elementary functions with their
// arguments. Strategies and estimators are in src/strategies.h.
#pragma once

#include <array>

#include "src/probe.h"
#include "src/scene.h"

namespace clume::cases {

inline constexpr std::array vector_widths = {16, 8, 4, 1};

struct FamilyCase {
    KernelFamily kernel;
    device::uint bit;
    float e2;  ///< squared extent
    const char* name;
};
inline constexpr FamilyCase families[] = {{KernelFamily::gaussian, FAMILY_GAUSSIAN, 9.0f, "gaussian"},
                                          {KernelFamily::epanechnikov, FAMILY_EPANECHNIKOV, 7.0f, "epanechnikov"},
                                          {KernelFamily::uniform, FAMILY_UNIFORM, 5.0f, "uniform"}};

struct PhaseCase {
    device::uint kind;
    const char* name;
};
inline constexpr PhaseCase phases[] = {{PHASE_ISOTROPIC, "isotropic"}, {PHASE_HENYEY_GREENSTEIN, "henyey_greenstein"}, {PHASE_RAYLEIGH, "rayleigh"}};

struct LightCase {
    LightKind kind;
    const char* name;
};
inline constexpr LightCase lights[] = {{LightKind::constant, "constant"}, {LightKind::envmap, "envmap"}, {LightKind::point, "point"}, {LightKind::spot, "spot"},
                                       {LightKind::directional, "directional"}, {LightKind::sphere, "sphere"}, {LightKind::rectangle, "rectangle"}};

/// One of each kind, just outside the unit ball.
inline Light light(LightKind kind) {
    Light l;
    l.kind = kind;
    switch (kind) {
        case LightKind::constant:
            l.radiance = {0.2, 0.3, 0.4};
            l.visible_to_camera = true;
            break;
        case LightKind::envmap:  // 8 × 4 texels of uneven colours, none so bright that few samples make the image
            l.image.width = 8;
            l.image.height = 4;
            for (int i = 0; i < 32; ++i)
                for (int c = 0; c < 3; ++c) l.image.rgb.push_back(0.1f * static_cast<float>((i * (3 + 2 * c) + 5 * c) % 11));
            l.rotate_y_rad = 0.3;
            break;
        case LightKind::point:
            l.position = {1.4, 1.1, -0.6};
            l.intensity = {2, 1, 1.5};
            break;
        case LightKind::spot:
            l.position = {-1.5, 0.8, -1};
            l.target = {0.1, 0, 0};
            l.intensity = {6, 7, 8};
            l.beam_rad = 0.2;
            l.cutoff_rad = 0.5;
            break;
        case LightKind::directional:
            l.direction = {-0.4, -1, 0.5};
            l.irradiance = {4, 3, 2};
            break;
        case LightKind::sphere:
            l.center = {0.3, -1.5, 0.2};
            l.radius = 0.15;
            l.radiance = {9, 5, 4};
            break;
        case LightKind::rectangle:
            l.corner = {-1.2, 1.3, 0.4};
            l.edge_u = {0.5, 0.1, 0};
            l.edge_v = {0, 0.2, 0.6};
            l.radiance = {3, 4, 5};
            break;
    }
    return l;
}

/// Arguments x of a function lie between lo and hi, even or log-spaced; some outside of its domain.
struct MathCase {
    const char* name;
    MathFunction f;
    float lo, hi;
    bool log_spaced;
};
inline constexpr MathCase math_functions[] = {
    {"rcp", MathFunction::rcp, 1e-18f, 1e18f, true},
    {"divide", MathFunction::divide, 1e-9f, 1e9f, true},
    {"rsqrt", MathFunction::rsqrt, 1e-18f, 1e18f, true},
    {"sqrt", MathFunction::sqrt, 1e-18f, 1e18f, true},
    {"exp", MathFunction::exp, -80, 20, false},
    {"log", MathFunction::log, 1e-30f, 1e30f, true},
    {"exponential", MathFunction::exponential, 1e-38f, 1e38f, true},
    {"erfc", MathFunction::erfc, -5, 9, false},
    {"erfc_inverse", MathFunction::erfc_inverse, 1e-30f, 1.99f, true},
    {"epanechnikov_inverse", MathFunction::epanechnikov_inverse, 0, 1, false},
    {"asin", MathFunction::asin, -1, 1, false},
    {"acos", MathFunction::acos, -1, 1, false},
    {"atan2", MathFunction::atan2, -3, 3, false},
    {"sin", MathFunction::sin_turns, 0, 1, false},
    {"cos", MathFunction::cos_turns, 0, 1, false},
    {"erf_between", MathFunction::erf_between, -4, 2, false},
    {"uniform", MathFunction::uniform, 1e-38f, 1e38f, true},
    {"from_uint", MathFunction::from_uint, 1e-38f, 1e38f, true},
    {"normalize", MathFunction::normalize_x, 1e-6f, 1e6f, true},
};

}  // namespace clume::cases
