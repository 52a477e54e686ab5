// SPDX-License-Identifier: MIT
// OpenVDB files, version 224, with one float grid: no compression but leaving out inactive values. The format is described in
// vdb_file.cpp and vdb_tree.cpp, which read it.
#include <array>
#include <cstring>
#include <map>
#include <tuple>

#include "src/vdb_tree.h"
#include "src/voxel_grid.h"
#include "src/voxel_writer.h"

namespace clume {

namespace {

/// Orders nodes as the library does, by x first.
using Coord = std::tuple<int, int, int>;
using Leaves = std::map<Coord, std::size_t>;  ///< bricks by origin
using Lower = std::map<Coord, Leaves>;
using Upper = std::map<Coord, Lower>;

Coord node_of(const glm::ivec3& i, int side) { return {i.x & -side, i.y & -side, i.z & -side}; }

class Writer {
  public:
    explicit Writer(const VoxelGrid& grid) : grid_(grid), background_(grid.sparse ? grid.background : 0) {}

    std::string run() {
        put<std::uint64_t>(0x56444220);
        put<std::uint32_t>(224);
        put<std::uint32_t>(10), put<std::uint32_t>(0);  // the library of that format
        put<std::uint8_t>(1);                           // grids have offsets
        out_ += "00000000-0000-0000-0000-000000000000";
        put<std::uint32_t>(0);  // no metadata of the file
        put<std::int32_t>(1);
        text("density"), text("Tree_float_5_4_3"), text("");
        const std::size_t offsets = out_.size();
        for (int i = 0; i < 3; ++i) put<std::int64_t>(0);
        patch(offsets, out_.size());
        put<std::uint32_t>(vdb_active_mask);
        put<std::uint32_t>(2);
        text("class"), text("string"), text("fog volume");
        text("name"), text("string"), text("density");
        text("AffineMap");
        for (int row = 0; row < 4; ++row) {
            const glm::dvec3 v = row < 3 ? grid_.axes[row] : grid_.origin;
            put(v.x), put(v.y), put(v.z), put(row < 3 ? 0.0 : 1.0);
        }
        put<std::int32_t>(1);  // buffer per leaf
        put(background_);
        Upper roots;
        for (std::size_t b = 0; b < grid_.brick_origins.size(); ++b) {
            const glm::ivec3 o = grid_.brick_origins[b];
            roots[node_of(o, 4096)][node_of(o, 128)][node_of(o, 8)] = b;
        }
        put<std::uint32_t>(0), put<std::uint32_t>(static_cast<std::uint32_t>(roots.size()));
        for (const auto& [origin, lowers] : roots) {
            const auto& [x, y, z] = origin;
            put<std::int32_t>(x), put<std::int32_t>(y), put<std::int32_t>(z);
            node_head<5>(lowers, 128);
            for (const auto& [where, leaves] : lowers) {
                node_head<4>(leaves, 8);
                for (const auto& [at, brick] : leaves) put(mask_of(brick));
            }
        }
        patch(offsets + 8, out_.size());
        for (const auto& [origin, lowers] : roots)
            for (const auto& [where, leaves] : lowers)
                for (const auto& [at, brick] : leaves) samples(brick);
        patch(offsets + 16, out_.size());
        return std::move(out_);
    }

  private:
    template <class Value>
    void put(const Value& value) {
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        out_.append(bytes, sizeof value);
    }
    void text(std::string_view words) {
        put(static_cast<std::uint32_t>(words.size()));
        out_ += words;
    }
    void patch(std::size_t at, std::size_t value) {
        const auto v = static_cast<std::int64_t>(value);
        std::memcpy(out_.data() + at, &v, sizeof v);
    }

    /// Masks of a node without active tiles; inactive ones are background.
    template <int log2, class Children>
    void node_head(const Children& children, int child_side) {
        std::array<std::uint64_t, (1 << (3 * log2)) / 64> child{}, active{};
        for (const auto& [where, ignored] : children) {
            constexpr int low = (1 << log2) - 1;
            const auto& [x, y, z] = where;
            const auto n = static_cast<std::size_t>((x / child_side & low) << (2 * log2) | (y / child_side & low) << log2 |
                                                    (z / child_side & low));
            child[n / 64] |= std::uint64_t{1} << (n % 64);
        }
        put(child), put(active);
        put<std::uint8_t>(0);
    }

    float sample(std::size_t brick, int n) const {
        return grid_.values[brick * brick_samples + static_cast<std::size_t>(n / 64 + n / 8 % 8 * 8 + n % 8 * 64)];
    }
    std::array<std::uint64_t, 8> mask_of(std::size_t brick) const {
        std::array<std::uint64_t, 8> mask{};
        for (int n = 0; n < 512; ++n)
            if (sample(brick, n) != background_) mask[static_cast<std::size_t>(n / 64)] |= std::uint64_t{1} << (n % 64);
        return mask;
    }
    void samples(std::size_t brick) {
        put(mask_of(brick));
        put<std::uint8_t>(0);
        for (int n = 0; n < 512; ++n)
            if (sample(brick, n) != background_) put(sample(brick, n));
    }

    const VoxelGrid& grid_;
    float background_;
    std::string out_;
};

}  // namespace

std::string vdb_bytes(const VoxelGrid& grid) { return Writer(grid).run(); }

}  // namespace clume
