// SPDX-License-Identifier: MIT
// NanoVDB by its own grid builder, compressed with Blosc.
#define NANOVDB_USE_BLOSC
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/IO.h>

#include <sstream>

#include "src/voxel_grid.h"
#include "src/voxel_writer.h"

namespace clume {

namespace {

struct alignas(NANOVDB_DATA_ALIGNMENT) Chunk {
    std::uint8_t bytes[NANOVDB_DATA_ALIGNMENT] = {};
};

/// The library's own buffers aren't cleared: what lay in memory would get into the file, between its nodes.
class ClearedBuffer {
  public:
    static ClearedBuffer create(std::uint64_t byte_size, const ClearedBuffer* = nullptr) {
        ClearedBuffer out;
        out.chunks_.resize((byte_size + sizeof(Chunk) - 1) / sizeof(Chunk));
        out.size_ = byte_size;
        return out;
    }
    std::uint8_t* data() { return chunks_.empty() ? nullptr : chunks_.data()->bytes; }
    const std::uint8_t* data() const { return chunks_.empty() ? nullptr : chunks_.data()->bytes; }
    std::uint64_t size() const { return size_; }
    void clear() { chunks_.clear(), size_ = 0; }

  private:
    std::vector<Chunk> chunks_;
    std::uint64_t size_ = 0;
};

}  // namespace

std::string nvdb_bytes(const VoxelGrid& grid) {
    const float background = grid.sparse ? grid.background : 0;
    nanovdb::GridBuilder<float> builder(background, nanovdb::GridClass::FogVolume);
    auto accessor = builder.getAccessor();
    for (std::size_t b = 0; b < grid.brick_origins.size(); ++b) {
        const float* values = grid.values.data() + b * brick_samples;
        for (int i = 0; i < static_cast<int>(brick_samples); ++i) {
            if (values[i] == background) continue;
            const glm::ivec3 at = grid.brick_origins[b] + glm::ivec3(i % 8, i / 8 % 8, i / 64);
            accessor.setValue(nanovdb::Coord(at.x, at.y, at.z), values[i]);
        }
    }
    nanovdb::Map map;
    map.set(grid.axes, glm::inverse(grid.axes), grid.origin, 1.0);
    const auto handle = builder.getHandle<nanovdb::AbsDiff, ClearedBuffer>(map, "density");
    // The library writes the grid before its header, and a stream can't be moved beyond what it holds.
    nanovdb::io::Segment segment(nanovdb::io::Codec::BLOSC);
    segment.add(handle);
    std::ostringstream out(std::string(segment.memUsage(), '\0'));
    nanovdb::io::writeGrid(out, handle, nanovdb::io::Codec::BLOSC);
    return std::move(out).str();
}

}  // namespace clume
