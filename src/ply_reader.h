// SPDX-License-Identifier: MIT
// Ellipsoids from PLY files, by property name: ascii and binary of either byte order, every scalar type. Other elements,
// lists and unused properties are skipped without being kept. Reads the encodings of Mitsuba's ellipsoids and of 3DGS
// captures. The counts in the header are checked against the file's size before anything is allocated by them; what is held
// stays within `ply_memory` (memory_bound.h).
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <optional>

namespace clume {

enum class ScaleEncoding { log, linear };
enum class DensityEncoding { extinction, opacity };

struct PlyOptions {
    ScaleEncoding scale = ScaleEncoding::log;
    std::optional<DensityEncoding> density;  ///< default: by the property's name, extinction first
    bool read_albedo = true;                 ///< false: albedo in the file is unused, hence not checked
    bool read_emission = true;
};

/// One vertex, decoded and valid: finite, scale > 0, density ≥ 0, albedo in [0,1], emission ≥ 0, |g| < 1.
struct PlyEllipsoid {
    glm::dvec3 center{0};
    glm::dvec3 scale{1};              ///< lengths
    glm::dvec4 rotation{1, 0, 0, 0};  ///< w, x, y, z, normalised
    double density = 0;               ///< as in the file, or softplus(opacity): the optical depth through the centre
    bool density_is_depth = false;    ///< it came from an opacity
    glm::dvec3 albedo{0.9};
    glm::dvec3 emission{0};
    std::optional<double> g;
};

/// Calls `sink(ellipsoid, index, count)` for every vertex in order; `count` is known to be held by the file.
/// Throws SceneError "file: why", or "file:line: why" in ascii, naming the primitive by its index from 0.
void read_ply(const std::filesystem::path& path, const PlyOptions& options,
              const std::function<void(const PlyEllipsoid&, std::size_t, std::size_t)>& sink);

}  // namespace clume
