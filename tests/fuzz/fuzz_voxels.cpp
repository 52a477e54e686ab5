// SPDX-License-Identifier: MIT
// Voxel files of every kind: each grid that can be a medium is read, one after the other.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "src/voxel_file.h"
#include "src/voxel_grid.h"
#include "tests/fuzz/targets.h"

namespace clume::fuzz {

namespace {

/// What whoever reads a grid may rely on.
void check(const VoxelGrid& grid) {
    const bool counted = grid.values.size() == grid.brick_origins.size() * brick_samples;
    if (counted && grid.values.size() > 1'000'000) return;  // takes too long
    const auto [least, most] = sample_range(grid);
    if (counted && least >= 0 && std::isfinite(most) && !std::isnan(world_box(grid).first.x * 0)) return;
    if (counted && least >= 0 && std::isfinite(most) && !is_placed(grid)) return;
    std::fputs("a grid that is none\n", stderr);
    std::abort();
}

template <std::unique_ptr<VoxelFile> (*open)(const std::filesystem::path&)>
void run(std::string_view bytes) {
    read_as_file(bytes, [](const std::string& path) {
        const auto file = open(path);
        for (std::size_t i = 0; i < file->entries().size() && i < 8; ++i)
            if (file->entries()[i].refusal.empty()) check(file->read(i));
    });
}

/// The resolution, which a scene gives, comes first: three bytes.
void run_raw(std::string_view bytes) {
    if (bytes.size() < 3) return;
    glm::ivec3 size;
    for (int i = 0; i < 3; ++i) size[i] = 1 + static_cast<unsigned char>(bytes[static_cast<std::size_t>(i)]);
    read_as_file(bytes.substr(3), [&](const std::string& path) { check(read_raw(path, size)); });
}

}  // namespace

const Target vol{"vol", run<open_vol>, dense_memory};
const Target raw{"raw", run_raw, dense_memory};
const Target nvdb{"nvdb", run<open_nvdb>, sparse_memory};
const Target vdb{"vdb", run<open_vdb>, sparse_memory};

}  // namespace clume::fuzz
