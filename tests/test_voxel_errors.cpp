// SPDX-License-Identifier: MIT
// What is wrong with voxel files and what is said about it; damaged ones never crash, hang or take memory.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "src/voxel_file.h"
#include "src/voxel_grid.h"
#include "tests/library_voxels.h"
#include "tests/memory_limit.h"
#include "tests/temp_folder.h"
#include "tests/voxel_scene.h"

using namespace clume;
using namespace clume::test;

namespace {

/// Reads every grid that can be a medium. The message if that fails, "" if it doesn't.
std::string error_of(const std::filesystem::path& path, std::uint64_t* most_bytes = nullptr) {
    try {
        const auto file = open_voxel_file(path);
        for (std::size_t i = 0; i < file->entries().size(); ++i) {
            if (!file->entries()[i].refusal.empty()) continue;
            const VoxelGrid grid = file->read(i);
            if (most_bytes != nullptr) *most_bytes = std::max(*most_bytes, byte_size(grid));
            for (const float v : grid.values)
                if (!(v >= 0) || !std::isfinite(v)) return "a value that is no density";
        }
    } catch (const SceneError& error) {
        const std::string message = error.what();
        CHECK(message.find('\n') == std::string::npos);
        CHECK(message.starts_with(path.string() + ": "));
        return message.substr(path.string().size() + 2);
    }
    return "";
}

/// Writes anew: some file systems wait for the disk when a file is cut to nothing and filled again.
std::filesystem::path rewrite(const TempFolder& folder, const std::string& name, const std::string& bytes) {
    std::filesystem::remove(folder.path() / name);
    return folder.write(name, bytes);
}

void check(const std::string& message, const std::string& part) {
    INFO(message);
    INFO(part);
    CHECK(message.find(part) != std::string::npos);
}

/// A few voxels and a tile: all kinds of nodes, and small files.
LibraryGrid small_grid() {
    LibraryGrid g;
    std::uint32_t state = 3;
    for (const glm::ivec3& i : lattice_points({3, 2, 0}, {15, 8, 7})) {
        state = state * 1664525u + 1013904223u;
        if (state >> 31) g.voxels.push_back({i, static_cast<float>(state >> 20)});
    }
    g.tiles = {{{16, 0, 0}, 8, 1.5f}};
    g.axes = glm::dmat3(0.5);
    return g;
}

std::string small_vol() { return vol_file({5, 4, 3}, bytes_of(ball_samples({5, 4, 3}))); }

std::string changed(std::string bytes, std::size_t at, const std::string& with) { return bytes.replace(at, with.size(), with); }

template <class Value>
std::string raw(Value value) {
    return bytes_of<Value>({value});
}

}  // namespace

TEST_CASE("VoxelErrors.UnknownFilesAndHeaders", "[quick]") {
    const TempFolder folder;
    check(error_of(folder.path() / "none.vol"), "no such file");
    check(error_of(folder.write("a.xyz", "")), "unknown kind of voxel file; known: .vdb, .nvdb, .vol, .raw");
    for (const char* name : {"a.vol", "a.vdb", "a.nvdb"})
        for (const char* text : {"", "V", "hello, world"}) check(error_of(folder.write(name, text)), "unknown format: not a");

    const std::string vol = small_vol();
    const auto vol_error = [&](std::size_t at, const std::string& with) {
        return error_of(folder.write("a.vol", changed(vol, at, with)));
    };
    check(vol_error(3, "\x02"), "version 2 of the .vol format; known: 3");
    check(vol_error(4, raw<std::int32_t>(4)), "unknown .vol encoding 4; known: 1 (float32), 2 (float16), 3 (uint8)");
    check(vol_error(8, raw<std::int32_t>(0)), "a resolution of 0 x 4 x 3");
    check(vol_error(8, raw<std::int32_t>(-5)), "a resolution of -5 x 4 x 3");
    check(vol_error(8, raw<std::int32_t>(2147483647)), "a resolution of 2147483647 x 4 x 3");
    check(vol_error(8, bytes_of<std::int32_t>({1 << 29, 1 << 29, 1 << 29})), "bytes, the file holds 240");
    check(vol_error(8, raw<std::int32_t>(6)), "6 x 4 x 3 samples of 4 bytes need 288 bytes, the file holds 240");
    check(vol_error(20, raw<std::int32_t>(3)), "3 channels; only one-channel .vol files");
    check(error_of(folder.write("a.vol", vol + "x")), "need 240 bytes, the file holds 241");

    write_library_vdb(folder.path() / "a.vdb", {small_grid()});
    const std::string vdb = file_bytes(folder.path() / "a.vdb");
    const auto vdb_error = [&](std::size_t at, const std::string& with) {
        return error_of(folder.write("a.vdb", changed(vdb, at, with)));
    };
    check(vdb_error(8, raw<std::uint32_t>(221)), "file version 221 of OpenVDB; known: 222 to 224");
    check(vdb_error(8, raw<std::uint32_t>(999)), "file version 999 of OpenVDB");
    check(vdb_error(20, std::string(1, '\0')), "grids without offsets");

    write_library_nvdb(folder.path() / "a.nvdb", {small_grid()}, "none");
    const std::string nvdb = file_bytes(folder.path() / "a.nvdb");
    const auto nvdb_error = [&](std::size_t at, const std::string& with) {
        return error_of(folder.write("a.nvdb", changed(nvdb, at, with)));
    };
    check(nvdb_error(0, std::string(nvdb.rend() - 8, nvdb.rend())), "of the other byte order");
    check(nvdb_error(8, raw<std::uint32_t>(31u << 21)), "version 31 of NanoVDB; known: 32");
    check(nvdb_error(14, raw<std::uint16_t>(3)), "unknown NanoVDB codec 3");
    check(nvdb_error(16, raw<std::uint64_t>(1ull << 40)), "bytes cannot hold a grid of 1099511627776");
    check(nvdb_error(16, raw<std::uint64_t>(17)), "a grid of 17 bytes");
    check(nvdb_error(24, raw<std::uint64_t>(1ull << 40)), "cut short or corrupt: needs 1099511627776 bytes");
    const std::size_t grid = 16 + 176 + 8;  // header, metadata, the name "density"
    check(nvdb_error(grid, "X"), "corrupt: a grid without the right magic number");
    check(nvdb_error(grid + 16, raw<std::uint32_t>(33u << 21)), "version 33 of NanoVDB");
    check(nvdb_error(grid + 636, raw<std::uint32_t>(2)), "corrupt: a grid of another type than told");
    check(nvdb_error(grid + 672 + 24, raw<std::uint64_t>(1)), "corrupt: a node is to be at byte");
    check(nvdb_error(grid + 672 + 24, raw<std::uint64_t>(~0ull << 40)), "corrupt: a node is to be at byte");
    check(nvdb_error(grid + 672 + 64 + 24, raw<std::uint32_t>(0xFFFFFFFF)), "corrupt: a node is to be at byte");
}

TEST_CASE("VoxelErrors.FewNodesThatClaimToBeManyAreRefused", "[quick]") {
    const TempFolder folder;
    write_library_nvdb(folder.path() / "a.nvdb", {small_grid()}, "none");
    std::string bytes = file_bytes(folder.path() / "a.nvdb");
    const auto offset_at = [&](std::size_t at) {
        std::int64_t out;
        std::memcpy(&out, bytes.data() + at, sizeof out);
        return static_cast<std::size_t>(out);
    };
    const std::size_t root = 16 + 176 + 8 + 672 + 64, upper = root + offset_at(root + 64 + 8);
    // All 32768 children of the only upper node are its first one.
    const std::size_t child_mask = upper + 32 + 4096, table = upper + 32 + 2 * 4096 + 32;
    REQUIRE(bytes[child_mask] == 1);
    const std::string first = bytes.substr(table, 8);
    for (std::size_t i = 0; i < 4096; ++i) bytes[child_mask + i] = '\xFF';
    for (std::size_t i = 0; i < 32768; ++i) bytes.replace(table + 8 * i, 8, first);
    check(error_of(folder.write("a.nvdb", bytes)), "corrupt: nodes with several parents");
}

TEST_CASE("VoxelErrors.GridsThatCannotBeMediaAreListed", "[quick]") {
    const TempFolder folder;
    std::vector<LibraryGrid> grids;
    for (const char* kind : {"level set", "vector", "int", "frustum"}) {
        grids.push_back(small_grid());
        grids.back().kind = grids.back().name = kind;
    }
    const auto error = [&](const std::string& name, const std::string& keys) {
        return medium_error(folder, "\"file\": \"" + name + "\"" + keys);
    };
    write_library_vdb(folder.path() / "a.vdb", grids);
    grids.pop_back();
    write_library_nvdb(folder.path() / "a.nvdb", grids, "blosc");
    for (const std::string name : {"a.vdb", "a.nvdb"}) {
        check(error(name, ""), "s.json:3:27: " + name + ": no grid that can be a medium; it holds \"level set\" (a level set)");
        check(error(name, R"(, "grid": "level set")"), name + ": grid \"level set\" cannot be a medium: a level set; it holds");
        check(error(name, R"(, "grid": "vector")"), "grid \"vector\" cannot be a medium: not a float grid but ");
        check(error(name, R"(, "grid": "int")"), "grid \"int\" cannot be a medium: not a float grid but ");
        check(error(name, R"(, "grid": "densty")"),
              name + ": no grid \"densty\"; it holds \"level set\" (a level set), \"vector\" (not");
    }
    check(error("a.vdb", R"(, "grid": "frustum")"),
          "s.json:3:44: a.vdb: grid \"frustum\" cannot be a medium: a grid with a frustum transform");

    grids.assign(3, small_grid());
    grids[0].name = "heat";
    grids[1].name = "smoke";
    grids[2].kind = grids[2].name = "vector";
    write_library_vdb(folder.path() / "b.vdb", grids);
    check(error("b.vdb", ""),
          "b.vdb: no grid \"density\", and several to choose from with \"grid\"; it holds \"heat\" (float)");
    CHECK(error("b.vdb", R"(, "grid": "smoke")").empty());
    check(error("b.vdb", R"(, "grid": "smoke", "emission_grid": "fire")"),
          "no grid \"fire\"; it holds \"heat\" (float), \"smoke\"");
    check(error("b.vdb", R"(, "grid": "smoke", "emission_grid": "vector")"), "grid \"vector\" cannot be a medium");
    grids.erase(grids.begin());
    write_library_vdb(folder.path() / "c.vdb", grids);
    CHECK(read_medium(folder, R"("file": "c.vdb")").grid_name == "smoke");
}

TEST_CASE("VoxelErrors.SamplesThatAreNoNumbers", "[quick]") {
    const TempFolder folder;
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()}) {
        std::vector<float> samples(5 * 4 * 3, 1);
        samples[index_of({5, 4, 3}, {3, 1, 2})] = bad;
        samples[index_of({5, 4, 3}, {4, 2, 2})] = bad;
        check(error_of(folder.write("a.vol", vol_file({5, 4, 3}, bytes_of(samples)))), "sample (3, 1, 2) is ");
        folder.write("a.raw", bytes_of(samples));
        check(medium_error(folder, R"("file": "a.raw", "resolution": [5, 4, 3], "bounds": [[0,0,0],[1,1,1]])"),
              "s.json:3:27: a.raw: sample (3, 1, 2) is ");
        LibraryGrid g = small_grid();
        g.voxels.push_back({{20, -8, 3}, bad});
        write_library_vdb(folder.path() / "a.vdb", {g});
        write_library_nvdb(folder.path() / "a.nvdb", {g}, "zip");
        check(error_of(folder.path() / "a.vdb"), "sample (20, -8, 3) is ");
        check(error_of(folder.path() / "a.nvdb"), "sample (20, -8, 3) is ");
        g.voxels.back().active = false;
        write_library_vdb(folder.path() / "a.vdb", {g});
        CHECK(error_of(folder.path() / "a.vdb").empty());
        g = small_grid();
        g.background = bad;
        write_library_vdb(folder.path() / "a.vdb", {g});
        check(error_of(folder.path() / "a.vdb"), "the background is ");
    }
}

TEST_CASE("VoxelErrors.TilesBeyondMemoryAreRefused", "[quick]") {
    const TempFolder folder;
    LibraryGrid g = small_grid();
    for (int i = 0; i < 64; ++i) g.tiles.push_back({{4096 * (i - 32), 4096, 0}, 4096, 2});
    write_library_vdb(folder.path() / "a.vdb", {g});
    write_library_nvdb(folder.path() / "a.nvdb", {g}, "blosc");
    for (const char* name : {"a.vdb", "a.nvdb"}) {
        const std::string message = error_of(folder.path() / name);
        check(message, "bricks of 8 x 8 x 8 samples need ");
        check(message, "half of this machine's memory is ");
    }
    // Of the background's value they only widen the box.
    for (LibraryTile& t : g.tiles) t.value = 0;
    write_library_vdb(folder.path() / "a.vdb", {g});
    CHECK(error_of(folder.path() / "a.vdb").empty());
    CHECK(open_voxel_file(folder.path() / "a.vdb")->read(0).hi.x == 4096 * 32);
}

TEST_CASE("VoxelErrors.CutShortAtEveryByteIsAnError", "[quick]") {
    const TempFolder folder;
    write_library_vdb(folder.path() / "vdb.vdb", {small_grid()});
    write_library_nvdb(folder.path() / "nvdb.nvdb", {small_grid()}, "none");
    write_library_nvdb(folder.path() / "zip.nvdb", {small_grid()}, "zip");
    folder.write("vol.vol", small_vol());
    for (const std::string name : {"vol.vol", "vdb.vdb", "nvdb.nvdb", "zip.nvdb"}) {
        const std::string bytes = file_bytes(folder.path() / name);
        CHECK(error_of(folder.path() / name).empty());
        // Every byte of the headers, then fewer.
        for (std::size_t size = 0; size < bytes.size(); size += size < 1000 ? 1 : 997) {
            INFO(name << " " << size << " of " << bytes.size());
            CHECK_FALSE(error_of(rewrite(folder, "cut." + name.substr(name.find('.') + 1), bytes.substr(0, size))).empty());
        }
        CHECK_FALSE(
            error_of(rewrite(folder, "cut." + name.substr(name.find('.') + 1), bytes.substr(0, bytes.size() - 1))).empty());
    }
    folder.write("a.raw", std::string(239, '\0'));
    check(medium_error(folder, R"("file": "a.raw", "resolution": [5, 4, 3], "bounds": [[0,0,0],[1,1,1]])"),
          "a.raw: 5 x 4 x 3 floats are 240 bytes, the file holds 239");
}

TEST_CASE("VoxelErrors.DamagedFilesNeverCrash", "[quick]") {
    const TempFolder folder;
    LibraryGrid half = small_grid();
    half.kind = "half";
    write_library_vdb(folder.path() / "active.vdb", {small_grid()}, 2);
    write_library_vdb(folder.path() / "zip.vdb", {half, small_grid()}, 1);
    write_library_vdb(folder.path() / "blosc.vdb", {small_grid()}, 6);
    write_library_nvdb(folder.path() / "none.nvdb", {small_grid()}, "none");
    write_library_nvdb(folder.path() / "zip.nvdb", {small_grid(), small_grid()}, "zip");
    write_library_nvdb(folder.path() / "blosc.nvdb", {small_grid()}, "blosc");
    write_library_nvdb(folder.path() / "fpn.nvdb", {small_grid()}, "none", "fpn");
    folder.write("a.vol", small_vol());
    const MemoryLimit limit(std::uint64_t{4} << 30);
    std::uint64_t state = 12345;
    const auto random = [&](std::size_t below) {
        state = state * 6364136223846793005ull + 1442695040888963407ull;
        return static_cast<std::size_t>((state >> 33) % below);
    };
    for (const std::string name :
         {"active.vdb", "zip.vdb", "blosc.vdb", "none.nvdb", "zip.nvdb", "blosc.nvdb", "fpn.nvdb", "a.vol"}) {
        const std::string good = file_bytes(folder.path() / name), bad = "bad." + name.substr(name.find('.') + 1);
        std::uint64_t whole = 0, most = 0;
        REQUIRE(error_of(folder.path() / name, &whole).empty());
        std::size_t refused = 0;
        constexpr std::size_t tries = 600;
        for (std::size_t i = 0; i < tries; ++i) {
            std::string bytes = good;
            for (std::size_t n = 1 + random(4); n > 0; --n) {
                // Headers are where a byte does most.
                const std::size_t at = random(random(2) == 0 ? std::min<std::size_t>(bytes.size(), 1400) : bytes.size());
                if (random(2) == 0)
                    bytes[at] = static_cast<char>(bytes[at] ^ (1 << random(8)));
                else
                    bytes[at] = static_cast<char>(random(2) == 0 ? 0xFF : random(256));
            }
            INFO(name << " " << i);
            const auto path = rewrite(folder, bad, bytes);
            try {
                refused += !error_of(path, &most).empty();
            } catch (const std::exception& error) {
                FAIL("not a SceneError: " << error.what());
            }
        }
        // Some damage must be noticed, and some (of samples) cannot be; no tile of 128³ comes of four bytes more than 32 times.
        CHECK(refused > 0);
        CHECK(refused < tries);
        CHECK(most < whole + 32 * 4096 * 2060ull + 1100 * good.size());
    }
}
