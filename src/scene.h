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
    std::string bound = "auto";           ///< of null collisions: scene, grid, tree
    std::optional<int> majorant_grid;     ///< cells along the longest axis of the `grid` bound and of `progressive`
    std::string root_finding = "newton";  ///< of regular tracking among several primitives: newton, bisection
    bool sobol = false;                   ///< random numbers spread evenly over a pixel's samples, not independent
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

enum class Interpolation { trilinear, nearest };

/// Scalar samples at the integer points of a lattice, sparse: bricks of 8 × 8 × 8 samples; those not stored hold 0 in a dense
/// grid, `background` in a sparse one. Finite, ≥ 0. The medium fills, in lattice coordinates,
///   dense: [lo − ½, hi − ½], samples beyond the border being those on it (clamped);
///   sparse: [lo − 1, hi] (trilinear) or [lo − ½, hi − ½] (nearest), samples beyond [lo, hi) being `background`.
struct VoxelGrid {
    static constexpr int brick = 8;
    glm::ivec3 lo{0}, hi{0};                   ///< samples lo ≤ i < hi are the grid's own
    bool sparse = false;
    float background = 0;
    glm::dmat3 axes{1};                        ///< world = origin + axes · lattice; transform and `bounds` applied
    glm::dvec3 origin{0};
    std::vector<glm::ivec3> brick_origins;     ///< multiples of 8, ascending by (z, y, x), no two equal
    std::vector<float> values;                 ///< 512 per brick, x fastest; 0 or background outside [lo, hi)
    std::size_t negative = 0;                  ///< samples below 0 in the file, taken as 0
};

/// A voxel medium: σ_t = density_scale · density(x), one albedo, emission and phase function for all of it.
struct GridMedium {
    VoxelGrid density;
    std::optional<VoxelGrid> emission_grid;    ///< times `emission`: radiance per unit length [W/m³/sr], wherever density is
    Interpolation interpolation = Interpolation::trilinear;
    double density_scale = 1;
    Phase phase;
    glm::dvec3 albedo{0.9};
    glm::dvec3 emission{0};                    ///< source radiance L_e; with an emission_grid its factor
    std::string source, grid_name;             ///< file, and the grid's name in it (empty where files have one grid)
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
    std::vector<GridMedium> grids;  ///< media of type `grid`
    std::vector<Light> lights;
};

}  // namespace clume
