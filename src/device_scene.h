// SPDX-License-Identifier: MIT
// The scene as the device gets it: normalised, packed into layout.h's buffers, and the list of defines that specialises the
// program to what the scene uses. Same bytes on every host (no contraction, no -march).
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "kernels/layout.h"
#include "runtime/host_array.h"
#include "src/ellipsoid.h"
#include "src/renderer.h"
#include "src/scene.h"

namespace clume {

struct DeviceScene {
    Normalization normalization;
    device::RenderParams params{};
    SharedArray<device::CellEntry> cells;
    SharedArray<device::CellLeaf> leaves;
    SharedArray<device::Reference> references;
    std::vector<float> learned;  ///< first bounds of `progressive`, per leaf
    SharedArray<device::Primitive> primitives;
    SharedArray<device::BvhNode> nodes;
    SharedArray<float> groups;
    SharedArray<device::uint> group_medium;
    std::vector<device::MediumInfo> media;
    HostArray<device::float4> shading;
    std::vector<device::LightInfo> lights;
    HostArray<device::float4> texels;
    HostArray<device::AliasEntry> alias;
    std::vector<device::GridInfo> grids;
    HostArray<device::CellEntry> grid_cells;
    HostArray<float> grid_values;

    std::vector<std::pair<std::string, std::string>> defines;  ///< of the render program, but CLUME_WIDTH
    std::vector<std::pair<std::string, std::string>> explain;  ///< feature → what the program does about it
    std::string strategy, transmittance, bound;                ///< what `auto` became
    bool lanes = false;                                        ///< a work-item follows as many paths as vectors are wide
    std::uint32_t bvh_stack = 0;                               ///< entries of a traversal's stack
    SharedArray<Ellipsoid> ellipsoids;
    std::vector<std::array<glm::dvec3, 8>> grid_boxes;         ///< per grid that holds anything: corners around it, world units
    double accelerator_s = 0;                                  ///< seconds to build it

    std::uint64_t byte_size() const;
    std::string hash() const;  ///< SHA-256 over all buffers, the seed left out
};

/// Throws SceneError for what no strategy can render, RenderError for an impossible combination of options.
DeviceScene make_device_scene(const Scene& scene, const RenderOptions& options);

/// SHA-256 of what any strategy's image of the scene depends on, the seed left out: nothing that strategies look things up in is
/// built for it. Throws what make_device_scene throws for a scene.
std::string scene_hash(const Scene& scene, const RenderOptions& options);

/// Sphere about media and area lights, recentred and scaled (src/ellipsoid.h).
Normalization normalize(const Scene& scene);

}  // namespace clume
