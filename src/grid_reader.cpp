// SPDX-License-Identifier: MIT
// Placement in three steps: the file's own, `bounds` instead of it, then `transform`. An emission grid moves with its density:
// what `bounds` does to the density's placement is done to the emission's, so that both stay where they were to each other.
#include "src/grid_reader.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "src/error.h"
#include "src/medium_keys.h"
#include "src/voxel_file.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

struct Bounds {
    glm::dvec3 min, max;
};

Bounds read_bounds(const SectionReader& medium) {
    const JsonValue& value = *medium.value("bounds");
    std::array<glm::dvec3, 2> corners;
    const std::string shape = "\"bounds\" must be two lists of 3 numbers, least and greatest";
    if (value.items.size() != 2) medium.fail("bounds", shape);
    for (std::size_t c = 0; c < 2; ++c) {
        const JsonValue& corner = value.items[c];
        if (corner.type != JsonType::array || corner.items.size() != 3) medium.source().fail(corner.at, shape);
        for (int i = 0; i < 3; ++i) {
            const JsonValue& item = corner.items[static_cast<std::size_t>(i)];
            if (item.type != JsonType::number) medium.source().fail(item.at, shape);
            corners[c][i] = item.number;
        }
    }
    for (int i = 0; i < 3; ++i)
        if (!(corners[0][i] < corners[1][i]) || !std::isfinite(corners[1][i] - corners[0][i]))
            medium.fail("bounds", fmt::format("\"bounds\" must grow along every axis: {} to {} along {}", corners[0][i],
                                              corners[1][i], "xyz"[i]));
    return {corners[0], corners[1]};
}

glm::ivec3 read_resolution(const SectionReader& medium) {
    const glm::dvec3 given = medium.triple("resolution");
    if (given != glm::floor(given)) medium.fail("resolution", "\"resolution\" must be whole numbers");
    return glm::ivec3(given);
}

void move(VoxelGrid& grid, const glm::dmat3& linear, const glm::dvec3& translate) {
    grid.axes = linear * grid.axes;
    grid.origin = linear * grid.origin + translate;
}

bool is_raw(const std::filesystem::path& path) {
    const std::string extension = path.extension().string();
    return extension == ".raw" || extension == ".RAW";
}

/// Density and emission grid in the file's own placement.
void read_file(GridMedium& medium, const SectionReader& section, const std::filesystem::path& path) {
    const auto file = open_voxel_file(path);
    const auto& entries = file->entries();
    const bool nameless = entries.size() == 1 && entries[0].name.empty();
    for (const char* key : {"grid", "emission_grid"})
        if (section.given(key) && nameless && path.extension() == ".vol")
            section.fail(key, fmt::format("\"{}\" names a grid, and a .vol file has one grid without a name", key));
    const auto find = [&](const char* key) {
        if (!section.given(key)) return find_grid(path, entries, {});
        try {
            return find_grid(path, entries, section.text(key));
        } catch (const SceneError& error) {
            section.source().fail_asset(section.at(key), error.what());
        }
    };
    const std::size_t density = find("grid");
    medium.grid_name = entries[density].name;
    medium.density = file->read(density);
    if (section.given("emission_grid")) medium.emission_grid = file->read(find("emission_grid"));
}

}  // namespace

GridMedium read_grid(const SectionReader& section, const std::filesystem::path& folder) {
    GridMedium medium;
    medium.interpolation = section.text("interpolation") == "nearest" ? Interpolation::nearest : Interpolation::trilinear;
    medium.density_scale = section.number("density_scale");
    medium.phase = read_phase(section);
    medium.albedo = section.triple("albedo");
    medium.emission =
        section.given("emission") ? section.triple("emission") : glm::dvec3(section.given("emission_grid") ? 1 : 0);
    const Transform transform = read_transform(section);
    std::optional<Bounds> bounds;
    if (section.given("bounds")) bounds = read_bounds(section);

    const std::filesystem::path path = find_asset(section, "file", folder);
    medium.source = path.string();
    const bool raw = is_raw(path);
    for (const char* key : {"resolution", "bounds"})
        if (raw && !section.given(key)) section.source().fail(section.at(), fmt::format("a .raw file needs \"{}\"", key));
    for (const char* key : {"grid", "emission_grid"})
        if (raw && section.given(key))
            section.fail(key, fmt::format("\"{}\" names a grid, and a .raw file has one grid without a name", key));
    if (!raw && section.given("resolution"))
        section.fail("resolution", "\"resolution\" is for .raw files; other files know theirs");
    const auto resolution = raw ? read_resolution(section) : glm::ivec3(0);
    try {
        if (raw)
            medium.density = read_raw(path, resolution);
        else
            read_file(medium, section, path);
    } catch (const SceneError& error) {
        const std::string what = error.what();
        if (!what.starts_with(path.string() + ": ")) throw;  // about a key, placed already
        section.source().fail_asset(section.at("file"), what);
    }

    VoxelGrid& density = medium.density;
    if (bounds) {
        const VoxelGrid as_read{density.lo, density.hi, density.sparse, 0, density.axes, density.origin, {}, {}, 0};
        place_in_box(density, bounds->min, bounds->max);
        if (medium.emission_grid) {
            if (!is_placed(as_read))
                section.fail("bounds", "the file's own placement is singular: no place for the emission grid");
            const glm::dmat3 linear = density.axes * glm::inverse(as_read.axes);
            move(*medium.emission_grid, linear, density.origin - linear * as_read.origin);
        }
    }
    for (VoxelGrid* grid : {&density, medium.emission_grid ? &*medium.emission_grid : nullptr}) {
        if (grid == nullptr) continue;
        if (!is_placed(*grid))
            section.source().fail_asset(
                section.at("file"), fmt::format("{}: the file's own placement has no volume; give \"bounds\"", path.string()));
        move(*grid, transform.linear, transform.translate);
        if (!is_placed(*grid))
            section.fail(section.given("transform") ? "transform" : "file", "the grid's placement is outside double precision");
    }
    return medium;
}

}  // namespace clume
