// SPDX-License-Identifier: MIT
// The keys that media of every type share: transform, phase, and the files that a scene names. Part of scene_reader.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>

#include "src/scene.h"
#include "src/scene_schema.h"

namespace clume {

/// x ↦ linear · x + translate, from a medium's own coordinates to the world's.
struct Transform {
    glm::dmat3 linear{1};
    glm::dvec3 translate{0};
};

/// Singular up to rounding, by its columns' lengths; or not finite.
bool is_singular(const glm::dmat3& m);

/// A medium's `transform`; the identity without one. Never singular.
Transform read_transform(const SectionReader& medium);

/// A medium's `phase`; isotropic without one.
Phase read_phase(const SectionReader& medium);

/// The file that `key` names, found from `folder`; a SceneError there if it isn't a file.
std::filesystem::path find_asset(const SectionReader& section, std::string_view key, const std::filesystem::path& folder);

}  // namespace clume
