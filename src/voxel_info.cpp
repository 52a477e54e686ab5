// SPDX-License-Identifier: MIT
#include "src/voxel_info.h"

#include <fmt/format.h>

#include "src/json_reader.h"
#include "src/printable.h"
#include "src/voxel_file.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

std::string triple(const glm::dvec3& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z); }

/// Lines that every grid has, below its name.
void print_grid(const VoxelGrid& grid, double scale) {
    const glm::ivec3 size = grid.hi - grid.lo;
    fmt::print("    {}        {} x {} x {} voxels from ({}, {}, {}){}\n", grid.sparse ? "sparse" : "dense ", size.x, size.y,
               size.z, grid.lo.x, grid.lo.y, grid.lo.z, grid.sparse ? fmt::format(", background {:g}", grid.background) : "");
    if (size == glm::ivec3(0)) {
        fmt::print("    values        none: no voxel is active\n");
        return;
    }
    const auto [min, max] = world_box(grid);
    const auto [least, most] = sample_range(grid);
    fmt::print("    bounds        {} to {}\n", triple(min), triple(max));
    fmt::print("    values        {:.4g} to {:.4g}{}\n", least * scale, most * scale,
               grid.negative > 0 ? fmt::format(" ({} negative ones taken as 0)", grid.negative) : "");
    fmt::print("    stored        {} of {:.0f} bricks, {} bytes\n", grid.brick_origins.size(), brick_count(grid), byte_size(grid));
}

}  // namespace

void print_voxel_info(const std::filesystem::path& path) {
    const auto file = open_voxel_file(path);
    fmt::print("{}\n", path.string());
    for (std::size_t i = 0; i < file->entries().size(); ++i) {
        const VoxelFileEntry& entry = file->entries()[i];
        fmt::print("  grid {}        {}{}\n", i, entry.name.empty() ? "" : in_quotes(entry.name) + ", ",
                   entry.refusal.empty() ? entry.type : entry.refusal + ": cannot be a medium");
        if (entry.refusal.empty()) print_grid(file->read(i), 1);
    }
    if (file->entries().empty()) fmt::print("  no grids\n");
}

void print_grid_medium(std::size_t index, const GridMedium& medium) {
    fmt::print("  medium {}        {}: {}{}, density_scale {:g}\n", index, printable(medium.source),
               medium.grid_name.empty() ? "" : "grid " + in_quotes(medium.grid_name) + ", ",
               medium.interpolation == Interpolation::nearest ? "nearest" : "trilinear", medium.density_scale);
    print_grid(medium.density, medium.density_scale);
    if (!medium.emission_grid) return;
    fmt::print("    emission grid, before its factor {}\n", triple(medium.emission));
    print_grid(*medium.emission_grid, 1);
}

}  // namespace clume
