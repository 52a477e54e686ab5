// SPDX-License-Identifier: MIT
// Voxel files: one grid reads alike from every format, and sparse ones as the OpenVDB and NanoVDB libraries read them.
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "src/voxel_file.h"
#include "src/voxel_grid.h"
#include "src/voxel_writer.h"
#include "tests/library_voxels.h"
#include "tests/temp_folder.h"
#include "tests/voxel_scene.h"

using namespace clume;
using namespace clume::test;

namespace {

const glm::ivec3 size{19, 9, 26};
const glm::dvec3 box_min{-2, 1, 0.5}, box_max{2.75, 3.25, 7};  // voxels of 1/4

VoxelGrid read_file(const std::filesystem::path& path, const std::optional<std::string>& name = {}) {
    const auto file = open_voxel_file(path);
    return file->read(find_grid(path, file->entries(), name));
}

glm::dvec3 world(const VoxelGrid& grid, const glm::ivec3& i) { return grid.origin + grid.axes * glm::dvec3(i); }

/// The ball as a sparse grid of the libraries, active where it isn't 0.
LibraryGrid ball_grid() {
    LibraryGrid g;
    const std::vector<float> samples = ball_samples(size);
    for (const glm::ivec3& i : lattice_points({0, 0, 0}, size))
        if (samples[index_of(size, i)] != 0) g.voxels.push_back({i, samples[index_of(size, i)]});
    g.axes = glm::dmat3(0.25);
    g.origin = box_min + 0.125;
    return g;
}

/// Bricks are sorted, inside the grid's reach, none is all background, and what lies outside [lo, hi) is background.
void check_bricks(const VoxelGrid& grid) {
    REQUIRE(grid.values.size() == grid.brick_origins.size() * brick_samples);
    const float outside = grid.sparse ? grid.background : 0;
    bool sorted = true, full = true, clean = true;
    for (std::size_t b = 0; b < grid.brick_origins.size(); ++b) {
        const glm::ivec3 o = grid.brick_origins[b];
        sorted = sorted && o == (o & ~7);
        if (b > 0) {
            const glm::ivec3 p = grid.brick_origins[b - 1];
            sorted = sorted && std::tuple(p.z, p.y, p.x) < std::tuple(o.z, o.y, o.x);
        }
        bool holds = false;
        for (int i = 0; i < 512; ++i) {
            const glm::ivec3 at = o + glm::ivec3(i % 8, i / 8 % 8, i / 64);
            const float v = grid.values[b * brick_samples + static_cast<std::size_t>(i)];
            holds = holds || v != outside;
            const bool own = glm::all(glm::lessThanEqual(grid.lo, at)) && glm::all(glm::lessThan(at, grid.hi));
            clean = clean && (own || v == outside);
        }
        full = full && holds;
    }
    CHECK(sorted);
    CHECK(full);
    CHECK(clean);
}

}  // namespace

TEST_CASE("VoxelFiles.EveryFormatReadsTheSame", "[quick]") {
    const TempFolder folder;
    const std::vector<float> samples = ball_samples(size);
    folder.write("a.raw", bytes_of(samples));
    folder.write("a.vol", vol_file(size, bytes_of(samples), 1, box_min, box_max));
    write_library_vdb(folder.path() / "a.vdb", {ball_grid()});
    for (const char* codec : {"none", "zip", "blosc"})
        write_library_nvdb(folder.path() / (std::string(codec) + ".nvdb"), {ball_grid()}, codec);
    const VoxelGrid dense = read_file(folder.path() / "a.vol");
    folder.write("own.vol", vol_bytes(dense));
    folder.write("own.vdb", vdb_bytes(dense));
    folder.write("own.nvdb", nvdb_bytes(dense));

    const std::string raw_keys = R"(, "resolution": [19, 9, 26], "bounds": [[-2, 1, 0.5], [2.75, 3.25, 7]])";
    for (const char* name :
         {"a.raw", "a.vol", "a.vdb", "none.nvdb", "zip.nvdb", "blosc.nvdb", "own.vol", "own.vdb", "own.nvdb"}) {
        INFO(name);
        const GridMedium medium =
            read_medium(folder, "\"file\": \"" + std::string(name) + "\"" + (name == std::string("a.raw") ? raw_keys : ""));
        const VoxelGrid& grid = medium.density;
        const bool is_dense = std::string(name).ends_with("raw") || std::string(name).ends_with("vol");
        CHECK(grid.sparse != is_dense);
        CHECK(medium.grid_name == (is_dense ? "" : "density"));
        check_bricks(grid);
        std::size_t wrong = 0, misplaced = 0;
        for (const glm::ivec3& i : lattice_points({0, 0, 0}, size)) {
            wrong += sample_at(grid, i) != samples[index_of(size, i)];
            misplaced += !(glm::distance(world(grid, i), box_min + 0.125 + 0.25 * glm::dvec3(i)) < 1e-14);
        }
        CHECK(wrong == 0);
        CHECK(misplaced == 0);
        if (is_dense) {
            CHECK(grid.lo == glm::ivec3(0));
            CHECK(grid.hi == size);
        }
        CHECK(static_cast<double>(grid.brick_origins.size()) < brick_count(dense));
    }
}

TEST_CASE("VoxelFiles.WritersAgreeWithTheLibraries", "[quick]") {
    const TempFolder folder;
    VoxelGrid grid = read_file(folder.write("a.vol", vol_file(size, bytes_of(ball_samples(size)), 1, box_min, box_max)));
    // Somewhere else, turned, with a background, far from the origin of the lattice.
    grid.sparse = true;
    grid.background = 0.125f;
    for (float& v : grid.values)
        if (v == 0) v = grid.background;
    for (glm::ivec3& o : grid.brick_origins) o -= glm::ivec3(4104, 16, 8);
    grid.lo -= glm::ivec3(4104, 16, 8);
    grid.hi -= glm::ivec3(4104, 16, 8);
    grid.axes = glm::dmat3(0, 2, 0, -1, 0, 0.5, 0, 0.25, 1);
    const auto points = lattice_points(grid.lo - 3, grid.hi + 3);
    for (const char* name : {"b.vdb", "b.nvdb"}) {
        INFO(name);
        write_voxel_file(folder.path() / name, grid);
        const LibrarySamples there = read_by_library(folder.path() / name, "density", points);
        const VoxelGrid here = read_file(folder.path() / name);
        check_bricks(here);
        CHECK(here.lo == there.lo);
        CHECK(here.hi == there.hi);
        CHECK(here.background == 0.125f);
        CHECK(here.values == grid.values);
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < points.size(); ++i)
            wrong += sample_at(here, points[i]) != there.values[i] || sample_at(grid, points[i]) != there.values[i] ||
                     !(glm::distance(world(here, points[i]), there.world[i]) < 1e-9) ||
                     world(here, points[i]) != world(grid, points[i]);
        CHECK(wrong == 0);
    }
}

TEST_CASE("VoxelFiles.EmptyGridIsWrittenAndRead", "[quick]") {
    const TempFolder folder;
    const VoxelGrid dense = read_file(folder.write("a.vol", vol_file({3, 4, 5}, std::string(240, '\0'))));
    CHECK(dense.brick_origins.empty());
    CHECK(dense.hi == glm::ivec3(3, 4, 5));
    for (const char* name : {"b.vdb", "b.nvdb"}) {
        write_voxel_file(folder.path() / name, dense);
        const VoxelGrid grid = read_file(folder.path() / name);
        CHECK(grid.brick_origins.empty());
        CHECK(grid.lo == grid.hi);
        CHECK(sample_at(grid, {0, 0, 0}) == 0);
        CHECK(sample_range(grid) == std::pair(0.0f, 0.0f));
        const GridMedium medium = read_medium(folder, "\"file\": \"" + std::string(name) + "\", \"bounds\": [[0,0,0],[1,1,1]]");
        CHECK(medium.density.brick_origins.empty());
    }
}

TEST_CASE("VoxelFiles.VdbAgreesWithTheLibrary", "[quick]") {
    const TempFolder folder;
    // Leaves with every way of telling inactive values, tiles of each level, on both sides of the lattice's origin.
    const auto grid_of = [](float background) {
        LibraryGrid g;
        g.background = background;
        g.axes = glm::dmat3(0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5);
        g.origin = {1, 2, 3};
        std::uint32_t state = 7;
        const float inactive[8][2] = {{background, background},
                                      {-background, -background},
                                      {5, 5},
                                      {background, -background},
                                      {background, 5},
                                      {4, 5},
                                      {0, 0},
                                      {0, 0}};
        for (int kind = 0; kind < 8; ++kind)
            for (int n = 0; n < 512; ++n) {
                state = state * 1664525u + 1013904223u;
                const glm::ivec3 at =
                    glm::ivec3(8 * kind - 32, kind % 2 == 0 ? -8 : 0, 8 * (kind % 3)) + glm::ivec3(n % 8, n / 8 % 8, n / 64);
                const bool active = kind == 7 || state >> 30 != 0;
                const float value = static_cast<float>((state >> 8) & 1023) / 256;
                // Kind 6 has more inactive values than a mask can tell.
                g.voxels.push_back({at, active ? value : kind == 6 ? value + 10 : inactive[kind][n % 2], active});
            }
        g.tiles = {{{8, 8, -16}, 8, 1.5f},
                   {{128, 0, 0}, 128, 0.75f},
                   {{-128, -128, -128}, 128, 9, false},
                   {{16, 8, -16}, 8, 7, false},
                   {{4096, 0, 0}, 4096, background, false}};
        return g;
    };
    auto points = lattice_points({-40, -10, -18}, {40, 10, 26});
    for (const glm::ivec3 far : {glm::ivec3(128, 0, 0), {255, 127, 127}, {256, 0, 0}, {-1, -1, -100}, {4100, 5, 5}})
        points.push_back(far);
    const auto path = folder.path() / "a.vdb";
    for (const float background : {0.0f, 0.5f})
        for (const char* kind : {"float", "double", "half"}) {
            LibraryGrid g = grid_of(background);
            g.kind = kind == std::string("half") ? "half" : "float";
            write_library_vdb(path, {g}, 0);
            const LibrarySamples there = read_by_library(path, "density", points);
            g.kind = kind;
            for (const std::uint32_t compression : {0u, 1u, 2u, 3u, 4u, 6u}) {
                INFO(background << " " << kind << " " << compression);
                write_library_vdb(path, {g}, compression);
                const VoxelGrid here = read_file(path);
                check_bricks(here);
                CHECK(here.background == background);
                CHECK(here.lo == there.lo);
                CHECK(here.hi == there.hi);
                std::size_t wrong = 0;
                for (std::size_t i = 0; i < points.size(); ++i)
                    wrong += sample_at(here, points[i]) != there.values[i] || world(here, points[i]) != there.world[i];
                CHECK(wrong == 0);
            }
        }
}

TEST_CASE("VoxelFiles.VdbTransforms", "[quick]") {
    const TempFolder folder;
    for (const char* map :
         {"affine", "scale", "uniform scale", "translate", "scale translate", "uniform scale translate", "unitary"}) {
        INFO(map);
        LibraryGrid g = ball_grid();
        g.map = map;
        g.axes = map == std::string("affine") ? glm::dmat3(0, 2, 0.5, -1, 0, 0, 0, 0.25, 4)
                 : map == std::string("unitary")
                     ? glm::dmat3(0, 1, 0, -1, 0, 0, 0, 0, 1)
                     : glm::dmat3(2, 0, 0, 0, map[0] == 'u' ? 2 : -3, 0, 0, 0, map[0] == 'u' ? 2 : 0.5);
        write_library_vdb(folder.path() / "a.vdb", {g});
        write_library_nvdb(folder.path() / "a.nvdb", {g}, "zip");
        const std::vector<glm::ivec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {5, -7, 11}};
        for (const char* name : {"a.vdb", "a.nvdb"}) {
            const LibrarySamples there = read_by_library(folder.path() / name, "density", points);
            const VoxelGrid here = read_file(folder.path() / name);
            for (std::size_t i = 0; i < points.size(); ++i)
                CHECK(glm::distance(world(here, points[i]), there.world[i]) < 1e-12);
        }
    }
}

TEST_CASE("VoxelFiles.NvdbAgreesWithTheLibrary", "[quick]") {
    const TempFolder folder;
    LibraryGrid g = ball_grid();
    g.background = 0.5;
    g.tiles = {{{8, 16, -16}, 8, 1.5f}, {{128, 0, 0}, 128, 0.75f}, {{-128, -128, -128}, 128, 9, false}};
    for (LibraryVoxel& v : g.voxels) v.at -= glm::ivec3(9, 5, 13);
    const auto points = lattice_points({-18, -8, -18}, {18, 24, 18});
    write_library_nvdb(folder.path() / "float.nvdb", {g}, "none");
    const LibrarySamples there = read_by_library(folder.path() / "float.nvdb", "density", points);
    for (const char* type : {"float", "double", "fp4", "fp8", "fp16", "fpn"})
        for (const char* codec : {"none", "zip", "blosc"}) {
            INFO(type << " " << codec);
            write_library_nvdb(folder.path() / "a.nvdb", {g}, codec, type);
            const VoxelGrid here = read_file(folder.path() / "a.nvdb");
            check_bricks(here);
            CHECK(here.lo == there.lo);
            CHECK(here.hi == there.hi);
            CHECK(here.background == 0.5f);
            // Half a step of the range of values, inactive ones included, or what FpN was asked for.
            const float tolerance = type == std::string("fp4")    ? 4.5f / 15
                                    : type == std::string("fp8")  ? 4.5f / 255
                                    : type == std::string("fp16") ? 4.5f / 65535
                                    : type == std::string("fpn")  ? 1e-3f
                                                                  : 0;
            std::size_t wrong = 0;
            for (std::size_t i = 0; i < points.size(); ++i)
                wrong += !(std::abs(sample_at(here, points[i]) - there.values[i]) <= 1.001f * tolerance);
            CHECK(wrong == 0);
        }
}

TEST_CASE("VoxelFiles.VolEncodings", "[quick]") {
    const TempFolder folder;
    const std::string halves = bytes_of<std::uint16_t>({0x0000, 0x3C00, 0x3800, 0x4248}), octets("\0\xFF\x80\x01", 4);
    const VoxelGrid h = read_file(folder.write("h.vol", vol_file({2, 2, 1}, halves, 2)));
    const VoxelGrid o = read_file(folder.write("o.vol", vol_file({1, 2, 2}, octets, 3)));
    const float half_values[] = {0, 1, 0.5f, 3.140625f}, octet_values[] = {0, 1, 128.0f / 255, 1.0f / 255};
    for (int i = 0; i < 4; ++i) {
        CHECK(sample_at(h, {i % 2, i / 2, 0}) == half_values[i]);
        CHECK(sample_at(o, {0, i % 2, i / 2}) == octet_values[i]);
    }
}

TEST_CASE("VoxelFiles.SharedTreesAndDoubledNames", "[quick]") {
    const TempFolder folder;
    LibraryGrid a = ball_grid(), b = ball_grid();
    a.name = "a";
    b.name = "b";
    b.voxels.clear();
    b.origin = {7, 8, 9};
    const auto path = folder.path() / "a.vdb";
    write_library_vdb(path, {a, b}, 6, true);
    const VoxelGrid first = read_file(path, "a"), second = read_file(path, "b");
    CHECK(first.values == second.values);
    CHECK_FALSE(first.values.empty());
    CHECK(second.origin == glm::dvec3(7, 8, 9));
    b.name = "a";
    write_library_vdb(path, {a, b});
    CHECK_THROWS_WITH(read_file(path, "a"), Catch::Contains("several grids are called \"a\""));
}

TEST_CASE("VoxelGrid.SamplesBeyondTheGrid", "[quick]") {
    const TempFolder folder;
    const VoxelGrid dense = read_file(folder.write("a.vol", vol_file({2, 1, 1}, bytes_of<float>({3, 5}))));
    CHECK(sample_at(dense, {-4, 0, 0}) == 3);
    CHECK(sample_at(dense, {9, -2, 3}) == 5);
    LibraryGrid g;
    g.background = 0.25;
    g.voxels = {{{0, 0, 0}, 3}};
    write_library_vdb(folder.path() / "a.vdb", {g});
    const VoxelGrid sparse = read_file(folder.path() / "a.vdb");
    CHECK(sample_at(sparse, {0, 0, 0}) == 3);
    CHECK(sample_at(sparse, {1, 0, 0}) == 0.25f);
    CHECK(sample_at(sparse, {100, 0, 0}) == 0.25f);
    CHECK(sparse.hi == glm::ivec3(1));
}
