// SPDX-License-Identifier: MIT
// A DeviceScene's buffers on one device, as the first arguments (SCENE_ARGS of kernels/medium.cl) of every kernel that sees
// the scene.
#pragma once

#include <memory>
#include <utility>

#include "runtime/buffer.h"
#include "runtime/kernel.h"
#include "runtime/queue.h"
#include "src/device_scene.h"

namespace clume {

struct SceneBuffers {
    /// Uploads what the device can't use where it is. Throws DeviceError.
    SceneBuffers(Queue& queue, const std::shared_ptr<const DeviceScene>& shared) : SceneBuffers(queue, *shared, shared) {}
    /// Of a copy.
    SceneBuffers(Queue& queue, const DeviceScene& scene) : SceneBuffers(queue, std::make_shared<const DeviceScene>(scene)) {}

    static constexpr unsigned kArgs = 18;  ///< arguments that `bind` sets

    /// Sets arguments 0 to kArgs − 1.
    void bind(Queue& queue, cl::Kernel& kernel) const {
        set_args(queue, kernel, 0, params, cells, leaves, references, primitives, nodes, groups, group_medium, media, shading, lights, texels, alias, learned, raised, grids,
                 grid_cells, grid_values);
    }

    std::shared_ptr<const DeviceScene> owner;  ///< of memory that buffers use: it goes last
    Buffer<device::RenderParams> params;
    Buffer<device::CellEntry> cells;
    Buffer<device::CellLeaf> leaves;
    Buffer<device::Reference> references;
    Buffer<device::Primitive> primitives;
    Buffer<device::BvhNode> nodes;
    Buffer<float> groups;
    Buffer<device::uint> group_medium;
    Buffer<device::MediumInfo> media;
    Buffer<device::float4> shading;
    Buffer<device::LightInfo> lights;
    Buffer<device::float4> texels;
    Buffer<device::AliasEntry> alias;
    Buffer<float> learned;
    Buffer<device::uint> raised;
    Buffer<device::GridInfo> grids;
    Buffer<device::CellEntry> grid_cells;
    Buffer<float> grid_values;

private:
    SceneBuffers(Queue& queue, const DeviceScene& scene, std::shared_ptr<const DeviceScene> shared)
        : owner(std::move(shared)),
          params(queue, std::span(&scene.params, 1)),
          cells(queue, scene.cells),
          leaves(queue, scene.leaves),
          references(queue, scene.references),
          primitives(queue, scene.primitives),
          nodes(queue, scene.nodes),
          groups(queue, scene.groups),
          group_medium(queue, scene.group_medium),
          media(queue, scene.media),
          shading(queue, scene.shading),
          lights(queue, scene.lights),
          texels(queue, scene.texels),
          alias(queue, scene.alias),
          learned(queue, scene.learned),
          raised(queue, std::vector<device::uint>(scene.learned.size()), CL_MEM_READ_WRITE),
          grids(queue, scene.grids),
          grid_cells(queue, scene.grid_cells),
          grid_values(queue, scene.grid_values) {}
};

}  // namespace clume
