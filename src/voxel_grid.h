// SPDX-License-Identifier: MIT
// What every reader of voxel files does with its samples: checks them, takes negative ones for 0, cuts them into bricks and
// leaves out the bricks that hold nothing. Lattice, bricks and support are as VoxelGrid says (scene.h).
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "src/scene.h"

namespace clume {

constexpr std::size_t brick_samples = 512;
/// Lattice coordinates stay within ± this, so that sums of two of them fit into 32 bits.
constexpr int largest_lattice_coordinate = 1 << 29;

/// Throws SceneError "name: ..." with both figures if `bricks` stored bricks take more than half of this machine's memory (the
/// device's copy needs room as well).
void check_brick_memory(const std::string& name, std::uint64_t bricks);

/// Fills `row` with the samples (0..size.x, y, z) of a dense grid; called from several threads, each row more than once.
using RowSource = std::function<void(int y, int z, float* row)>;

/// A dense grid with lo = 0, hi = size, placed at the lattice itself. Throws SceneError "name: sample (x, y, z) is ..." for the
/// first sample (x fastest) that isn't finite, or if it doesn't fit in memory.
VoxelGrid make_dense_grid(const std::string& name, const glm::ivec3& size, const RowSource& rows);

/// Bricks of a sparse grid, gathered in any order.
class BrickSet {
  public:
    /// Messages begin with `name`. Samples are `background`, clamped to 0, where nothing is set. Throws if it isn't finite.
    /// Bricks are limited by the size of the file that they come from [memory_bound.h].
    BrickSet(std::string name, double background, std::uint64_t file_bytes);

    /// A brick of samples that build() asks for.
    void add_leaf(const glm::ivec3& origin, std::uint32_t source) { entries_.push_back({origin, 0, source}); }
    /// An active cube at `lo`, a multiple of 8, all `value`; its bricks aren't made if that is the background.
    void add_tile(const glm::ivec3& lo, int side, double value);
    float background() const { return background_; }

    /// Fills the 512 samples of a source and says which are active (bit n % 64 of active[n / 64]); the others become background.
    /// In the order of VDB leaves: sample (x, y, z) is n = 64 x + 8 y + z.
    using LeafSource = std::function<void(std::uint32_t source, float* samples, std::uint64_t active[8])>;
    /// The grid, placed at the lattice itself; lo and hi bound the active samples. Throws SceneError if two bricks are in one
    /// place, if an active sample isn't finite, or if it doesn't fit in memory.
    VoxelGrid build(const LeafSource& leaves);

  private:
    static constexpr std::uint32_t no_source = 0xFFFFFFFF;
    struct Entry {
        glm::ivec3 origin;
        float value;           ///< of all samples, without a source
        std::uint32_t source;  ///< the caller's number of where the samples are
    };

    [[noreturn]] void fail(const std::string& why) const;
    void check_count(std::uint64_t bricks) const;
    float admit(float value, const glm::ivec3& at);
    void grow(const glm::ivec3& lo, const glm::ivec3& hi);

    std::string name_;
    float background_ = 0;
    std::uint64_t file_bytes_;
    std::vector<Entry> entries_;
    glm::ivec3 lo_{largest_lattice_coordinate}, hi_{-largest_lattice_coordinate};
    std::size_t negative_ = 0;
};

/// Lattice to world so that the support of a dense grid, or the active box grown by half a voxel of a sparse one, fills the box.
void place_in_box(VoxelGrid& grid, const glm::dvec3& min, const glm::dvec3& max);

/// False unless the lattice is placed by finite numbers with a volume.
bool is_placed(const VoxelGrid& grid);

/// The sample at lattice point i: stored, or what VoxelGrid says stands in its stead (clamped at a dense grid's border).
float sample_at(const VoxelGrid& grid, glm::ivec3 i);

/// Least and greatest of the grid's own samples, background within [lo, hi) included; 0, 0 for an empty grid.
std::pair<float, float> sample_range(const VoxelGrid& grid);

/// World box of the lattice box [lo − ½, hi − ½].
std::pair<glm::dvec3, glm::dvec3> world_box(const VoxelGrid& grid);

/// Bricks that [lo, hi) touches, stored or not; a sparse grid's may be more than 64 bits count.
double brick_count(const VoxelGrid& grid);

/// Bytes of the stored bricks.
std::uint64_t byte_size(const VoxelGrid& grid);

}  // namespace clume
