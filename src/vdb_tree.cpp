// SPDX-License-Identifier: MIT
// Read here rather than by the OpenVDB library, which trusts the sizes and counts that it finds in a file. Its sources are the
// description of the format (openvdb/tree/*.h and openvdb/io/Compression.h); the tests compare with the library.
#include "src/vdb_tree.h"

#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <bit>
#include <vector>

#include "src/decompress.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

/// How a node's inactive values are told [Compression.h]; values 0 to 2 have no mask.
enum InactiveValues : std::uint8_t {
    background_only,
    minus_background,
    one_value,
    mask_of_background,
    mask_of_one_value,
    mask_of_two_values,
    all_values
};

template <class Value>
class TreeReader {
  public:
    TreeReader(ByteReader in, const VdbTreeFormat& format) : in_(std::move(in)), format_(format) {}

    VoxelGrid run() {
        if (const int buffers = in_.get<std::int32_t>(); buffers != 1)
            in_.fail(fmt::format("corrupt or unsupported: a tree with {} buffers", buffers));
        const auto background = in_.get<Value>();
        BrickSet bricks(in_.name(), static_cast<double>(background), in_.size());
        const auto tiles = in_.get<std::uint32_t>(), children = in_.get<std::uint32_t>();
        for (std::uint32_t i = 0; i < tiles; ++i) {
            const glm::ivec3 origin = root_origin();
            const auto value = in_.get<Value>();
            if (in_.get<std::uint8_t>() != 0) bricks.add_tile(origin, 4096, static_cast<double>(value));
        }
        for (std::uint32_t i = 0; i < children; ++i) read_node<5>(bricks, root_origin(), 4096);
        for (Leaf& leaf : leaves_) skip_samples(leaf);
        return bricks.build([this](std::uint32_t source, float* samples, std::uint64_t active[8]) {
            read_samples(leaves_[source], samples, active);
        });
    }

  private:
    struct Leaf {
        std::uint64_t at = 0;  ///< of its samples' value mask
    };

    glm::ivec3 root_origin() {
        glm::ivec3 origin;
        for (int i = 0; i < 3; ++i) origin[i] = in_.get<std::int32_t>();
        for (int i = 0; i < 3; ++i)
            if (origin[i] % 4096 != 0 || origin[i] < -largest_lattice_coordinate ||
                origin[i] > largest_lattice_coordinate - 4096)
                in_.fail(fmt::format("corrupt, or beyond the lattice of ±2^29: a node at ({}, {}, {})", origin.x, origin.y,
                                     origin.z));
        return origin;
    }

    /// A node with 2^log2 children or tiles per side.
    template <int log2>
    void read_node(BrickSet& bricks, const glm::ivec3& origin, int side) {
        constexpr std::size_t count = std::size_t{1} << (3 * log2), words = count / 64;
        std::vector<std::uint64_t> child(words), active(words);
        get_words(child);
        get_words(active);
        std::vector<Value> values(count);
        read_values(values.data(), active);
        const int step = side >> log2;
        const auto at = [&](std::size_t n) {
            constexpr int low = (1 << log2) - 1;
            const auto i = static_cast<int>(n);
            return origin + step * glm::ivec3(i >> (2 * log2), (i >> log2) & low, i & low);
        };
        for (std::size_t w = 0; w < words; ++w)
            for (std::uint64_t left = active[w] & ~child[w]; left != 0; left &= left - 1) {
                const std::size_t n = 64 * w + static_cast<std::size_t>(std::countr_zero(left));
                bricks.add_tile(at(n), step, static_cast<double>(values[n]));
            }
        values = {};
        for (std::size_t w = 0; w < words; ++w)
            for (std::uint64_t left = child[w]; left != 0; left &= left - 1) {
                const std::size_t n = 64 * w + static_cast<std::size_t>(std::countr_zero(left));
                if constexpr (log2 == 5) {
                    read_node<4>(bricks, at(n), step);
                } else {
                    in_.take(64);  // a leaf's value mask, which stands before its samples again
                    bricks.add_leaf(at(n), static_cast<std::uint32_t>(leaves_.size()));
                    leaves_.emplace_back();
                }
            }
    }

    void get_words(std::vector<std::uint64_t>& words) {
        std::memcpy(words.data(), in_.take(words.size() * 8).data(), words.size() * 8);
    }

    /// What precedes a node's values: how many there are, and what stands in for the others.
    struct ValueHead {
        std::size_t stored = 0;
        std::uint8_t kind = all_values;
    };
    ValueHead read_head(const std::vector<std::uint64_t>& active) {
        ValueHead head;
        head.kind = in_.get<std::uint8_t>();
        if (head.kind > all_values) in_.fail(fmt::format("corrupt: values of unknown kind {}", head.kind));
        head.stored = active.size() * 64;
        // What inactive values are doesn't matter here: they count as background.
        if (head.kind == one_value || head.kind == mask_of_one_value) in_.take(sizeof(Value));
        if (head.kind == mask_of_two_values) in_.take(2 * sizeof(Value));
        if (head.kind == mask_of_background || head.kind == mask_of_one_value || head.kind == mask_of_two_values)
            in_.take(active.size() * 8);
        if ((format_.compression & vdb_active_mask) != 0 && head.kind != all_values) {
            head.stored = 0;
            for (const std::uint64_t word : active) head.stored += static_cast<std::size_t>(std::popcount(word));
        }
        return head;
    }

    std::size_t value_bytes() const { return format_.saved_as_half ? 2 : sizeof(Value); }

    /// The bytes of `count` values, compressed or not; `compressed` says which.
    std::string_view take_values(std::size_t count, bool& compressed) {
        const std::size_t byte_size = count * value_bytes();
        compressed = false;
        if ((format_.compression & (vdb_zip | vdb_blosc)) == 0) return in_.take(byte_size);
        if (format_.saved_as_half && count == 0) return {};
        const auto size = in_.get<std::int64_t>();
        if (size <= 0) {  // minus the size of what couldn't be made smaller
            if (size != -static_cast<std::int64_t>(byte_size))
                in_.fail(fmt::format("corrupt: {} bytes of values where {} are expected", size, byte_size));
            return in_.take(byte_size);
        }
        compressed = true;
        return in_.take(static_cast<std::uint64_t>(size));
    }

    /// `active.size()` · 64 values; those that aren't stored are left as they are.
    void read_values(Value* values, const std::vector<std::uint64_t>& active) {
        const ValueHead head = read_head(active);
        bool compressed = false;
        const std::string_view bytes = take_values(head.stored, compressed);
        if (head.stored == 0) return;
        const std::size_t byte_size = head.stored * value_bytes();
        scratch_.resize(byte_size);
        if (!compressed)
            std::memcpy(scratch_.data(), bytes.data(), byte_size);
        else if (!((format_.compression & vdb_blosc) != 0 ? unblosc(bytes, scratch_.data(), byte_size)
                                                          : unzip(bytes, scratch_.data(), byte_size)))
            in_.fail(fmt::format("corrupt: {} compressed bytes don't give the {} that are expected", bytes.size(), byte_size));
        const auto value = [&](std::size_t i) {
            if (format_.saved_as_half) {
                std::uint16_t bits;
                std::memcpy(&bits, scratch_.data() + 2 * i, 2);
                return static_cast<Value>(imath_half_to_float(bits));
            }
            Value out;
            std::memcpy(&out, scratch_.data() + sizeof(Value) * i, sizeof(Value));
            return out;
        };
        if (head.stored == active.size() * 64) {
            for (std::size_t i = 0; i < head.stored; ++i) values[i] = value(i);
            return;
        }
        std::size_t next = 0;
        for (std::size_t w = 0; w < active.size(); ++w)
            for (std::uint64_t left = active[w]; left != 0; left &= left - 1)
                values[64 * w + static_cast<std::size_t>(std::countr_zero(left))] = value(next++);
    }

    void skip_samples(Leaf& leaf) {
        leaf.at = in_.at();
        get_words(mask_);
        const ValueHead head = read_head(mask_);
        bool compressed = false;
        take_values(head.stored, compressed);
    }

    void read_samples(const Leaf& leaf, float* samples, std::uint64_t active[8]) {
        in_.seek(leaf.at);
        get_words(mask_);
        std::copy(mask_.begin(), mask_.end(), active);
        Value values[brick_samples] = {};
        read_values(values, mask_);
        for (std::size_t i = 0; i < brick_samples; ++i) samples[i] = static_cast<float>(values[i]);
    }

    ByteReader in_;
    VdbTreeFormat format_;
    std::vector<Leaf> leaves_;
    std::vector<std::uint64_t> mask_ = std::vector<std::uint64_t>(8);
    std::vector<char> scratch_;
};

}  // namespace

VoxelGrid read_vdb_tree(ByteReader in, const VdbTreeFormat& format) {
    if (format.is_double) return TreeReader<double>(std::move(in), format).run();
    return TreeReader<float>(std::move(in), format).run();
}

}  // namespace clume
