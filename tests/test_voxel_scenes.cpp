// SPDX-License-Identifier: MIT
// Voxel media of scenes: what their keys do to what a file holds, and what is said where they are wrong.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "src/voxel_grid.h"
#include "tests/library_voxels.h"
#include "tests/temp_folder.h"
#include "tests/voxel_scene.h"

using namespace clume;
using namespace clume::test;

namespace {

glm::dvec3 world(const VoxelGrid& grid, const glm::dvec3& lattice) { return grid.origin + grid.axes * lattice; }

bool near(const glm::dvec3& a, const glm::dvec3& b) { return glm::distance(a, b) < 1e-12; }

/// Active at (8, 0, -3) to (11, 1, -2), two voxels.
LibraryGrid two_voxels() {
    LibraryGrid g;
    g.voxels = {{{8, 0, -3}, 2}, {{11, 1, -2}, 3}};
    g.axes = glm::dmat3(0, 0.5, 0, -2, 0, 0, 0, 0, 1);
    g.origin = {10, 20, 30};
    return g;
}

const std::string two_by_one_raw = R"("file": "a.raw", "resolution": [2, 1, 1])";

}  // namespace

TEST_CASE("VoxelMedia.DefaultsAndKeys", "[quick]") {
    const TempFolder folder;
    folder.write("a.raw", bytes_of<float>({1, 2}));
    const std::string file = two_by_one_raw + R"(, "bounds": [[0, 0, 0], [4, 1, 1]])";
    const GridMedium plain = read_medium(folder, file);
    CHECK(plain.interpolation == Interpolation::trilinear);
    CHECK(plain.density_scale == 1);
    CHECK(plain.albedo == glm::dvec3(0.9));
    CHECK(plain.emission == glm::dvec3(0));
    CHECK(plain.phase.kind == PhaseKind::isotropic);
    CHECK_FALSE(plain.emission_grid);
    CHECK(plain.source == (folder.path() / "a.raw").string());
    const GridMedium full =
        read_medium(folder, file + R"(, "interpolation": "nearest", "density_scale": 5, "albedo": [0, 0.5, 1],
        "emission": 2, "phase": {"type": "henyey-greenstein", "g": 0.5})");
    CHECK(full.interpolation == Interpolation::nearest);
    CHECK(full.density_scale == 5);
    CHECK(full.albedo == glm::dvec3(0, 0.5, 1));
    CHECK(full.emission == glm::dvec3(2));
    CHECK(full.phase.g == 0.5);
}

TEST_CASE("VoxelMedia.DenseGridFillsItsBounds", "[quick]") {
    const TempFolder folder;
    folder.write("a.raw", bytes_of<float>({1, 2}));
    const std::string file = two_by_one_raw + R"(, "bounds": [[-1, 0, 2], [3, 1, 5]])";
    const VoxelGrid grid = read_medium(folder, file).density;
    // Voxels of 2 × 1 × 3, samples at their centres; the support is [−½, n − ½].
    CHECK(near(world(grid, {0, 0, 0}), {0, 0.5, 3.5}));
    CHECK(near(world(grid, {1, 0, 0}), {2, 0.5, 3.5}));
    CHECK(near(world(grid, {-0.5, -0.5, -0.5}), {-1, 0, 2}));
    CHECK(near(world(grid, {1.5, 0.5, 0.5}), {3, 1, 5}));

    folder.write("a.vol", vol_file({2, 1, 1}, bytes_of<float>({1, 2}), 1, {-7, -7, -7}, {9, 9, 9}));
    CHECK(near(world(read_medium(folder, R"("file": "a.vol")").density, {-0.5, -0.5, -0.5}), glm::dvec3(-7)));
    const VoxelGrid moved = read_medium(folder, R"("file": "a.vol", "bounds": [[-1, 0, 2], [3, 1, 5]])").density;
    CHECK(moved.axes == grid.axes);
    CHECK(moved.origin == grid.origin);
    // The file's own box may be anything where it isn't used.
    folder.write("b.vol", vol_file({2, 1, 1}, bytes_of<float>({1, 2}), 1, {0, 0, 0}, {0, 0, 0}));
    CHECK(read_medium(folder, R"("file": "b.vol", "bounds": [[-1, 0, 2], [3, 1, 5]])").density.origin == grid.origin);
    CHECK(medium_error(folder, R"("file": "b.vol")") ==
          "s.json:3:27: b.vol: the file's own placement has no volume; give \"bounds\"");
}

TEST_CASE("VoxelMedia.BoundsHoldTheActiveBoxOfSparseGrids", "[quick]") {
    const TempFolder folder;
    write_library_vdb(folder.path() / "a.vdb", {two_voxels()});
    write_library_nvdb(folder.path() / "a.nvdb", {two_voxels()}, "zip");
    for (const char* name : {"a.vdb", "a.nvdb"}) {
        const std::string file = "\"file\": \"" + std::string(name) + "\"";
        const VoxelGrid own = read_medium(folder, file).density;
        CHECK(own.lo == glm::ivec3(8, 0, -3));
        CHECK(own.hi == glm::ivec3(12, 2, -1));
        // Rows of the library's matrices are lattice steps.
        CHECK(near(world(own, {1, 0, 0}), {10, 20.5, 30}));
        CHECK(near(world(own, {0, 1, 0}), {8, 20, 30}));
        CHECK(near(world(own, {0, 0, 1}), {10, 20, 31}));
        const VoxelGrid grid = read_medium(folder, file + R"(, "bounds": [[0, 0, 0], [4, 4, 4]])").density;
        CHECK(near(world(grid, {7.5, -0.5, -3.5}), {0, 0, 0}));
        CHECK(near(world(grid, {11.5, 1.5, -1.5}), {4, 4, 4}));
        CHECK(near(world(grid, {8, 0, -3}), {0.5, 1, 1}));
        CHECK(grid.values == own.values);
    }
}

TEST_CASE("VoxelMedia.TransformComesLast", "[quick]") {
    const TempFolder folder;
    folder.write("a.raw", bytes_of<float>({1, 2}));
    const std::string file = two_by_one_raw + R"(, "bounds": [[0, 0, 0], [2, 1, 1]])";
    const VoxelGrid grid =
        read_medium(
            folder,
            file +
                R"(, "transform": {"scale": [-2, 1, 3], "rotate": {"axis": [0, 0, 1], "angle": 90}, "translate": [1, 0, 0]})")
            .density;
    // (x, y, z) → scaled (−2x, y, 3z) → turned (−y, −2x, 3z) → moved.
    CHECK(near(world(grid, {0, 0, 0}), {1 - 0.5, -1, 1.5}));
    CHECK(near(world(grid, {1, 0, 0}), {1 - 0.5, -3, 1.5}));
    CHECK(glm::determinant(grid.axes) == Approx(-6));
    CHECK(medium_error(folder, file + R"(, "transform": {"scale": 1e200})") ==
          "s.json:3:108: the grid's placement is outside double precision");
}

TEST_CASE("VoxelMedia.EmissionGrid", "[quick]") {
    const TempFolder folder;
    LibraryGrid fire = two_voxels();
    fire.name = "flame";
    fire.voxels = {{{20, 0, -3}, 7}};
    fire.origin += glm::dvec3(0, 0, 1);
    write_library_vdb(folder.path() / "a.vdb", {two_voxels(), fire});
    const std::string file = R"("file": "a.vdb", "emission_grid": "flame")";
    const GridMedium own = read_medium(folder, file);
    REQUIRE(own.emission_grid);
    CHECK(own.grid_name == "density");
    CHECK(own.emission == glm::dvec3(1));
    CHECK(read_medium(folder, file + R"(, "emission": [3, 2, 1])").emission == glm::dvec3(3, 2, 1));
    CHECK(sample_at(*own.emission_grid, {20, 0, -3}) == 7);
    CHECK(near(world(*own.emission_grid, {0, 0, 0}), world(own.density, {0, 0, 1})));
    // `bounds` and `transform` move both: what lay at one point lies at one point.
    const GridMedium moved =
        read_medium(folder, file + R"(, "bounds": [[0, 0, 0], [4, 4, 4]], "transform": {"scale": 2, "translate": [5, 6, 7]})");
    for (const glm::dvec3 i : {glm::dvec3(0), {1, 0, 0}, {0, 1, 0}, {20, 0, -3}})
        CHECK(near(world(*moved.emission_grid, i), world(moved.density, i + glm::dvec3(0, 0, 1))));
    CHECK(near(world(moved.density, {7.5, -0.5, -3.5}), {5, 6, 7}));
}

TEST_CASE("VoxelMedia.NegativeValuesAreZeroAndCounted", "[quick]") {
    const TempFolder folder;
    std::vector<float> samples = ball_samples({9, 8, 3});
    samples[0] = -1;
    samples[100] = -1e-30f;
    samples[101] = -0.0f;
    folder.write("a.vol", vol_file({9, 8, 3}, bytes_of(samples)));
    const VoxelGrid dense = read_medium(folder, R"("file": "a.vol")").density;
    CHECK(dense.negative == 2);
    CHECK(sample_range(dense).first == 0);
    LibraryGrid g = two_voxels();
    g.voxels.push_back({{9, 0, -3}, -5});
    g.voxels.push_back({{9, 1, -3}, -5, false});
    g.tiles = {{{16, 0, -8}, 8, -2}};
    write_library_vdb(folder.path() / "a.vdb", {g});
    const VoxelGrid sparse = read_medium(folder, R"("file": "a.vdb")").density;
    CHECK(sparse.negative == 1 + 512);
    CHECK(sample_at(sparse, {9, 0, -3}) == 0);
    CHECK(sparse.hi.x == 24);
    CHECK(sparse.brick_origins.size() == 1);
}

TEST_CASE("VoxelMedia.SeveralMediaKeepTheirOrder", "[quick]") {
    const TempFolder folder;
    folder.write("a.vol", vol_file({2, 1, 1}, bytes_of<float>({1, 2})));
    const Scene scene = parse_scene(
        grid_scene(R"("file": "a.vol", "density_scale": 2 }, { "type": "ellipsoids", "kernel": "uniform", "primitives":
            [ { "center": [0, 0, 0], "scale": 1, "density": 1 } ] }, { "type": "grid", "file": "a.vol", "density_scale": 3)"),
        folder.path() / "s.json");
    REQUIRE(scene.grids.size() == 2);
    REQUIRE(scene.media.size() == 1);
    CHECK(scene.grids[0].density_scale == 2);
    CHECK(scene.grids[1].density_scale == 3);
}

TEST_CASE("VoxelMedia.EmittingGridsAreLights", "[quick]") {
    const TempFolder folder;
    const std::string dark = "no light, no emission and no opaque surface";
    folder.write("a.vol", vol_file({2, 1, 1}, bytes_of<float>({0, 2})));
    folder.write("zero.vol", vol_file({2, 1, 1}, bytes_of<float>({0, 0})));
    const auto error = [&](const std::string& keys) { return medium_error(folder, keys, false); };
    CHECK(error(R"("file": "a.vol")").find(dark) != std::string::npos);
    CHECK(error(R"("file": "a.vol", "emission": [0, 1, 0])").empty());
    CHECK(error(R"("file": "a.vol", "emission": [0, 1, 0], "albedo": [0, 1, 0])").find(dark) != std::string::npos);
    CHECK(error(R"("file": "a.vol", "emission": 1, "density_scale": 0)").find(dark) != std::string::npos);
    CHECK(error(R"("file": "zero.vol", "emission": 1)").find(dark) != std::string::npos);
    LibraryGrid fire = two_voxels(), cold = two_voxels();
    fire.name = "fire";
    cold.name = "cold";
    for (LibraryVoxel& v : cold.voxels) v.value = 0;
    write_library_vdb(folder.path() / "a.vdb", {two_voxels(), fire, cold});
    CHECK(error(R"("file": "a.vdb", "emission_grid": "fire", "density_scale": 0)").empty());
    CHECK(error(R"("file": "a.vdb", "emission_grid": "fire", "emission": 0)").find(dark) != std::string::npos);
    CHECK(error(R"("file": "a.vdb", "emission_grid": "cold")").find(dark) != std::string::npos);
}

TEST_CASE("VoxelMedia.WrongKeysAreTold", "[quick]") {
    const TempFolder folder;
    folder.write("a.raw", bytes_of<float>({1, 2}));
    folder.write("a.vol", vol_file({2, 1, 1}, bytes_of<float>({1, 2})));
    folder.write("a.txt", "");
    const std::string bounds = R"(, "bounds": [[0, 0, 0], [1, 1, 1]])";
    const auto check = [&](const std::string& keys, const std::string& message) {
        INFO(keys);
        CHECK(medium_error(folder, keys) == message);
    };
    check("\"albedo\": 1", "s.json:3:1: missing key \"file\" in media");
    check(R"("file": "b.vol")", "s.json:3:27: no such file: \"b.vol\"");
    check(R"("file": "a.txt")", "s.json:3:27: a.txt: unknown kind of voxel file; known: .vdb, .nvdb, .vol, .raw");
    check(R"("file": "a.vol", "kernel": "gaussian")",
          "s.json:3:36: key \"kernel\" does not belong to media of type \"grid\"; known: type, file, grid, resolution, bounds, "
          "interpolation, emission_grid, density_scale, albedo, emission, phase, transform");
    check(R"("file": "a.vol", "interpolation": "linear")",
          "s.json:3:53: unknown interpolation \"linear\"; known: trilinear, nearest; did you mean \"trilinear\"?");
    check(R"("file": "a.raw")" + bounds, "s.json:3:1: a .raw file needs \"resolution\"");
    check(two_by_one_raw, "s.json:3:1: a .raw file needs \"bounds\"");
    check(R"("file": "a.raw", "resolution": [2, 1, 0.5])" + bounds,
          "s.json:3:57: \"resolution\" must be in [1,65536], not 0.5");
    check(R"("file": "a.raw", "resolution": [2, 1, 1.5])" + bounds, "s.json:3:50: \"resolution\" must be whole numbers");
    check(R"("file": "a.raw", "resolution": [2, 1, 2])" + bounds,
          "s.json:3:27: a.raw: 2 x 1 x 2 floats are 16 bytes, the file holds 8");
    check(R"("file": "a.raw", "resolution": [65536, 65536, 65536])" + bounds,
          "s.json:3:27: a.raw: 65536 x 65536 x 65536 floats are 1125899906842624 bytes, the file holds 8");
    check(two_by_one_raw + bounds + R"(, "grid": "density")",
          "s.json:3:103: \"grid\" names a grid, and a .raw file has one grid without a name");
    check(R"("file": "a.vol", "resolution": [2, 1, 1])",
          "s.json:3:50: \"resolution\" is for .raw files; other files know theirs");
    check(R"("file": "a.vol", "grid": "density")",
          "s.json:3:44: \"grid\" names a grid, and a .vol file has one grid without a name");
    check(R"("file": "a.vol", "emission_grid": "fire")",
          "s.json:3:53: \"emission_grid\" names a grid, and a .vol file has one grid without a name");
    const std::string shape = "\"bounds\" must be two lists of 3 numbers, least and greatest";
    check(R"("file": "a.vol", "bounds": [0, 0, 0, 1, 1, 1])", "s.json:3:46: " + shape);
    check(R"("file": "a.vol", "bounds": [[0, 0, 0], [1, 1]])", "s.json:3:58: " + shape);
    check(R"("file": "a.vol", "bounds": [[0, 0, 0], [1, 1, "1"]])", "s.json:3:65: " + shape);
    check(R"("file": "a.vol", "bounds": [[0, 2, 0], [1, 1, 1]])",
          "s.json:3:46: \"bounds\" must grow along every axis: 2 to 1 along y");
    check(R"("file": "a.vol", "bounds": [[0, 0, 1], [1, 1, 1]])",
          "s.json:3:46: \"bounds\" must grow along every axis: 1 to 1 along z");
}
