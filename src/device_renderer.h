// SPDX-License-Identifier: MIT
// One device's part in a render: program, scene buffers, and batches of (tile, sample range) run to their end.
#pragma once

#include <memory>
#include <vector>

#include "runtime/buffer.h"
#include "runtime/dispatcher.h"
#include "runtime/kernel.h"
#include "runtime/queue.h"
#include "src/device_scene.h"
#include "src/film.h"
#include "src/scene_buffers.h"

namespace clume {

/// Half-open range of the list of active pixels.
struct Tile {
    std::uint32_t first = 0, count = 0;
};

class DeviceRenderer : public Worker {
public:
    /// Builds the program (width 0: the device's own; not `optimised`: sooner), uploads the scene, warms up. Throws DeviceError.
    DeviceRenderer(const DeviceInfo& info, const DeviceScene& scene, const std::vector<device::uint>& pixels, const std::vector<Tile>& tiles,
                   int vector_width, bool optimised = true);

    /// Batches from now on use `seed` and add to `film`, which must outlive them. Throws DeviceError.
    void aim(FilmSums& film, std::uint64_t seed);

    /// Bounds of `progressive` for the batches from the next `aim` on, one per leaf, and whether rays look into every cell that
    /// they cross; and the highest densities found above the bounds so far.
    void set_learned(std::span<const float> bounds, bool explore) {
        scene_.learned.upload(bounds);
        params_.explore = explore;
    }
    std::vector<float> raised() const;

    std::string name() const override { return queue_.label(); }
    void run(const Batch& batch) override;

private:
    /// Renders samples [begin, end) of a tile into `host_sums_`; returns the splits used.
    std::size_t render(const Tile& tile, std::uint32_t begin, std::uint32_t end);

    Queue queue_;
    const std::vector<Tile>& tiles_;
    FilmSums* film_ = nullptr;
    device::RenderParams params_;
    SceneBuffers scene_;
    Buffer<device::uint> pixels_;
    Buffer<device::PathState> states_;
    Buffer<std::uint64_t> sums_;
    Buffer<device::uint> unfinished_;
    cl::Kernel kernel_;
    std::vector<std::uint64_t> host_sums_;
    std::size_t wanted_items_;  ///< work-items that keep the device busy
};

/// Width of the vectors of primitives on a device: its own native width, unless told otherwise.
int vector_width_of(const DeviceInfo& info, int wanted);

}  // namespace clume
