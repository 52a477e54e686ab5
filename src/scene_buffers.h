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
    SceneBuffers(Queue& queue, std::shared_ptr<const DeviceScene> scene)
        : owner(std::move(scene)),
          params(queue, std::span(&owner->params, 1)),
          cells(queue, owner->cells),
          leaves(queue, owner->leaves),
          references(queue, owner->references),
          primitives(queue, owner->primitives),
          nodes(queue, owner->nodes),
          groups(queue, owner->groups),
          group_medium(queue, owner->group_medium),
          media(queue, owner->media),
          shading(queue, owner->shading),
          lights(queue, owner->lights),
          texels(queue, owner->texels),
          alias(queue, owner->alias),
          learned(queue, owner->learned),
          raised(queue, std::vector<device::uint>(owner->learned.size()), CL_MEM_READ_WRITE),
          grids(queue, owner->grids),
          grid_cells(queue, owner->grid_cells),
          grid_values(queue, owner->grid_values) {}
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
};

}  // namespace clume
