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

/// Thrown where work is limited.
struct TooMuchWork {};

/// Half-open range of the list of active pixels, or of an order of them.
struct Tile {
    std::uint32_t first = 0, count = 0;
};

/// A device short of memory for a batch takes it in pieces; all pieces count, or none.
class DeviceRenderer : public Worker {
public:
    /// Builds the program (width 0: the device's own; not `optimised`: sooner), uploads the scene, warms up. Throws DeviceError.
    DeviceRenderer(const DeviceInfo& info, const std::shared_ptr<const DeviceScene>& scene, const std::vector<device::uint>& pixels, const std::vector<Tile>& tiles,
                   int vector_width, bool optimised = true);

    /// Most bytes that one batch takes on the device and, as much of it as comes back, on the host.
    static std::uint64_t batch_bytes(const DeviceInfo& info, const std::vector<Tile>& tiles);

    /// Batches from now on use `seed` and add to `film`, which must outlive them.
    void aim(FilmSums& film, std::uint64_t seed);

    /// Batches from now on are of these tiles, ranges of `order`: places in the list of active pixels, none twice.
    void choose(std::vector<std::uint32_t> order, std::vector<Tile> tiles);

    /// Bounds of `progressive` for the batches from now on, one per leaf, and whether rays look into every cell that they cross;
    /// and the highest densities that batches have found above those bounds since.
    void set_learned(std::span<const float> bounds, bool explore);
    std::span<const float> raised() const { return raised_; }

    /// Paths of the batches that it has added to the film that it was last aimed at.
    std::uint64_t paths() const { return paths_; }

    /// From now on run() throws TooMuchWork once paths have cost more, of a program that counts its work.
    void limit_work(const WorkLimit& limit) { work_limit_ = limit; }

    /// Work-items that fitted into the device's memory when a batch did not; 0 if all did.
    std::size_t short_of_memory() const { return short_of_memory_; }

    std::string name() const override { return queue_.label(); }
    std::string doing() const override { return "kernel render"; }
    void run(const Batch& batch) override;
    void commit(const Batch& batch) override;

private:
    /// Sums of the pixels [first, first + count) of the order.
    struct Piece {
        std::size_t first, count, splits;
        std::vector<std::uint64_t> sums;
    };
    /// Renders samples [begin, end) of the pixels.
    Piece render(std::size_t first, std::size_t count, std::uint32_t begin, std::uint32_t end);
    void launch(std::size_t items);
    double work_of(std::span<const std::uint64_t> sums) const;
    /// What the batches so far and the rows of this one have cost, against the limit.
    void check_work(std::size_t rows);
    /// Rows of sums that a work-item fills, of so many with so many samples each.
    std::size_t rows_per_item(std::size_t rows, std::size_t samples) const;
    /// Uploads what aim() and set_learned() have left to do: all calls that may fail or hang are made inside run().
    void upload_changes();

    Queue queue_;
    const std::vector<device::uint> active_;  ///< film index of each active pixel
    std::vector<std::uint32_t> order_;
    std::vector<Tile> tiles_;
    FilmSums* film_ = nullptr;
    device::RenderParams params_;
    SceneBuffers scene_;
    Buffer<device::uint> pixels_;
    Buffer<device::PathState> states_;
    Buffer<std::uint64_t> sums_;
    Buffer<device::uint> progress_;  ///< unfinished work-items, paths of the pool that have been begun
    cl::Kernel kernel_;
    std::vector<Piece> pieces_;              ///< of the batch last run
    std::vector<float> learned_;             ///< to be uploaded
    std::vector<device::uint> found_;        ///< raised bounds after the batch last run
    std::vector<float> raised_;
    bool aimed_ = false;                     ///< params_ are on the device
    bool chosen_ = true;                     ///< so are the pixels in their order
    bool pool_;                              ///< work-items take their paths from a pool
    std::size_t lanes_;                      ///< paths that a work-item has side by side
    std::size_t wanted_items_;               ///< rows that keep the device busy
    std::size_t units_;                      ///< compute units
    std::size_t most_items_ = SIZE_MAX;      ///< work-items that fit its memory, as far as known
    std::size_t short_of_memory_ = 0;
    WorkLimit work_limit_;
    double work_ns_ = 0;                     ///< of the batches committed, if there is a limit
    std::uint64_t paths_ = 0;
};

/// Width of the vectors of primitives on a device: its own native width, unless told otherwise.
int vector_width_of(const DeviceInfo& info, int wanted);

}  // namespace clume
