// SPDX-License-Identifier: MIT
#include "src/voxel_writer.h"

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <cstring>

#include "src/output_file.h"
#include "src/voxel_grid.h"

namespace clume {

bool can_write_voxels(const std::filesystem::path& path) {
    const std::string extension = path.extension().string();
    return extension == ".vol" || extension == ".nvdb" || extension == ".vdb";
}

void write_voxel_file(const std::filesystem::path& path, const VoxelGrid& grid) {
    assert(can_write_voxels(path));
    OutputFile out(path);
    const std::string extension = path.extension().string();
    const std::string bytes = extension == ".vol" ? vol_bytes(grid) : extension == ".nvdb" ? nvdb_bytes(grid) : vdb_bytes(grid);
    std::fwrite(bytes.data(), 1, bytes.size(), out.stream());
    out.commit();
}

std::string vol_bytes(const VoxelGrid& grid) {
    const glm::ivec3 size = grid.hi - grid.lo;
    std::string out = "VOL\x03";
    const auto put = [&](auto value) {
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        out.append(bytes, sizeof value);
    };
    put(std::int32_t{1});  // float32
    for (int i = 0; i < 3; ++i) put(static_cast<std::int32_t>(size[i]));
    put(std::int32_t{1});  // channel
    const auto [min, max] = world_box(grid);
    for (const glm::dvec3& corner : {min, max})
        for (int i = 0; i < 3; ++i) put(static_cast<float>(corner[i]));
    const std::size_t head = out.size(), nx = static_cast<std::size_t>(size.x), ny = static_cast<std::size_t>(size.y);
    std::vector<float> values(nx * ny * static_cast<std::size_t>(size.z), grid.sparse ? grid.background : 0.0f);
    for (std::size_t b = 0; b < grid.brick_origins.size(); ++b) {
        const glm::ivec3 origin = grid.brick_origins[b];
        const glm::ivec3 lo = glm::max(grid.lo - origin, 0), hi = glm::min(grid.hi - origin, 8);
        for (int z = lo.z; z < hi.z; ++z)
            for (int y = lo.y; y < hi.y; ++y) {
                const glm::ivec3 at = origin + glm::ivec3(lo.x, y, z) - grid.lo;
                const float* from = grid.values.data() + b * brick_samples + static_cast<std::size_t>(64 * z + 8 * y + lo.x);
                std::copy(from, from + (hi.x - lo.x),
                          values.begin() + static_cast<std::ptrdiff_t>(
                                               (static_cast<std::size_t>(at.z) * ny + static_cast<std::size_t>(at.y)) * nx +
                                               static_cast<std::size_t>(at.x)));
            }
    }
    out.resize(head + values.size() * sizeof(float));
    std::memcpy(out.data() + head, values.data(), values.size() * sizeof(float));
    return out;
}

}  // namespace clume
