// SPDX-License-Identifier: MIT
// The scene model: what a scene file says, after reading, in double precision and world units.
// Plain data; readers fill it, the accelerator and the device layout read it. Angles are radians here (degrees end at the
// reader). `transform`, `normalization`, encodings and the media's own overrides have been applied: what stands here is
// what is rendered, except `density_scale`, which stays a factor so that `info` can print it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

namespace clume {

enum class KernelFamily { gaussian, epanechnikov, uniform };
enum class PhaseKind { isotropic, henyey_greenstein, rayleigh };
enum class CameraKind { perspective, orthographic };
enum class LightKind { constant, envmap, point, spot, directional, sphere, rectangle };
enum class LightSampling { mis, nee, phase };

/// Film point to ray exactly as scene.md's *camera* section says.
struct Camera {
    CameraKind kind = CameraKind::perspective;
    glm::dvec3 origin{0}, target{0}, up{0, 1, 0};
    double fov_rad = 0.6981317007977318;  ///< full horizontal angle, perspective only
    double width = 0;                     ///< world units across the image, orthographic only
};

struct Film {
    int width = 512, height = 512;
};

struct RenderSettings {
    std::uint32_t spp = 64;
    std::uint64_t seed = 0;
    int max_depth = -1;  ///< most scattering events on a path; −1: no limit
    int rr_depth = 16;   ///< scattering events before roulette may act
    std::string strategy = "auto";
    std::string transmittance = "auto";
    LightSampling light_sampling = LightSampling::mis;
    std::optional<double> step;  ///< marching only, world units; default: smallest kernel scale / 4
};

struct Phase {
    PhaseKind kind = PhaseKind::isotropic;
    double g = 0;  ///< −1 < g < 1, Henyey-Greenstein only
};

/// One ellipsoid. `axes` maps whitened to world coordinates: x = center + axes · z with |z| = r, so Σ = axes · axesᵀ.
/// It is R·S with the medium's transform applied on the left (a mirror leaves a negative determinant: harmless).
struct Primitive {
    glm::dvec3 center;
    glm::dmat3 axes;
    double sigma_t = 0;         ///< peak extinction [1/world unit], before density_scale, > 0
    glm::dvec3 albedo{0.9};     ///< single-scattering albedo, 0..1
    glm::dvec3 emission{0};     ///< source radiance L_e, ≥ 0
    float g = 0;                ///< own Henyey-Greenstein parameter, meaningful if `has_g`
    bool has_g = false;
};

struct EllipsoidMedium {
    KernelFamily kernel = KernelFamily::gaussian;
    double extent = 3;  ///< support radius E, in scales
    double density_scale = 1;
    Phase phase;
    std::vector<Primitive> primitives;
    std::size_t dropped = 0;  ///< zero-density primitives left out
    std::string source;       ///< file path as found, or "scene" for a list in the scene file
};

/// An environment image, row 0 on top, RGB interleaved, width·height·3 floats, linear Rec.709, finite and ≥ 0.
struct EnvironmentImage {
    int width = 0, height = 0;
    std::vector<float> rgb;
};

/// One light; the keys of scene.md's table that belong to its kind are set.
struct Light {
    LightKind kind = LightKind::constant;
    glm::dvec3 radiance{0};    ///< constant, sphere, rectangle [W/m²/sr]
    glm::dvec3 intensity{0};   ///< point, spot [W/sr]
    glm::dvec3 irradiance{0};  ///< directional [W/m²]
    glm::dvec3 position{0}, target{0}, direction{0};
    double beam_rad = 0, cutoff_rad = 0;  ///< spot half angles
    glm::dvec3 center{0};
    double radius = 0;
    glm::dvec3 corner{0}, edge_u{0}, edge_v{0};
    EnvironmentImage image;  ///< envmap; radiance before `scale`
    double scale = 1, rotate_y_rad = 0;
    bool visible_to_camera = false;  ///< constant, envmap
};

struct Scene {
    std::string path;  ///< of the scene file
    Camera camera;
    Film film;
    RenderSettings render;
    std::vector<EllipsoidMedium> media;
    std::vector<Light> lights;
};

}  // namespace clume
