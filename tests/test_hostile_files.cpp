// SPDX-License-Identifier: MIT
// Files made to do harm: to take memory or time by what they claim, to be no files at all, to write, to run something, or to
// speak to the terminal. What fuzzing has found is in test_fuzz_regressions.cpp.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <set>
#include <string>

#include "src/device_scene.h"
#include "src/environment_reader.h"
#include "src/error.h"
#include "src/memory_bound.h"
#include "src/printable.h"
#include "src/scene_reader.h"
#include "src/scene_schema.h"
#include "src/voxel_file.h"
#include "tests/cli_process.h"
#include "tests/fuzz/small_files.h"
#include "tests/fuzz/zip_vdb.h"
#include "tests/library_voxels.h"
#include "tests/memory_limit.h"
#include "tests/voxel_scene.h"

using namespace clume;
using namespace clume::test;

namespace {

template <class Read>
std::string error_of(const Read& read) {
    try {
        read();
    } catch (const SceneError& error) {
        return error.what();
    }
    return "";
}

void check(const std::string& message, const std::string& part) {
    INFO(message);
    CHECK_THAT(message, Catch::Contains(part));
}

std::string little(std::int64_t value, std::size_t bytes) { return std::string(reinterpret_cast<const char*>(&value), bytes); }

std::string attribute(const std::string& name, const std::string& type, const std::string& value) {
    return name + '\0' + type + '\0' + little(static_cast<std::int64_t>(value.size()), 4) + value;
}

/// The head of an EXR file of that size; `more` are further attributes. No pixels follow.
std::string exr_head(int width, int height, const std::string& more = "", int channels = 3, int version = 2) {
    const std::string box = little(0, 8) + little(width - 1, 4) + little(height - 1, 4);
    std::string list;
    for (int c = 0; c < channels; ++c)
        list += (c < 3 ? std::string(1, "BGR"[c]) : "S" + std::to_string(c)) + '\0' + little(2, 4) + little(0, 4) + little(1, 4) + little(1, 4);
    return "\x76\x2f\x31\x01" + little(version, 4) + attribute("channels", "chlist", list + '\0') + attribute("compression", "compression", std::string(1, '\3')) +
           attribute("dataWindow", "box2i", box) + attribute("displayWindow", "box2i", box) + attribute("lineOrder", "lineOrder", std::string(1, '\0')) +
           attribute("pixelAspectRatio", "float", std::string("\0\0\x80\x3f", 4)) + attribute("screenWindowCenter", "v2f", std::string(8, '\0')) +
           attribute("screenWindowWidth", "float", std::string("\0\0\x80\x3f", 4)) + more + '\0';
}

/// White, half, deflated.
void write_flat_exr(const std::filesystem::path& path, int width, int height) {
    Imf::Header header(width, height);
    header.compression() = Imf::ZIP_COMPRESSION;
    std::vector<std::uint16_t> line(static_cast<std::size_t>(width), 0x3c00);
    Imf::FrameBuffer frame;
    for (const char* channel : {"R", "G", "B"}) {
        header.channels().insert(channel, Imf::Channel(Imf::HALF));
        frame.insert(channel, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(line.data()), 2, 0));
    }
    Imf::OutputFile file(path.string().c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(height);
}

}  // namespace

TEST_CASE("HostileFiles.ClaimsCostNothing", "[quick]") {
    const TempFolder folder;
    const MemoryLimit limit(std::uint64_t{600} << 20);
    const auto image_error = [&](const std::string& bytes) {
        return error_of([&] { read_environment(folder.write("a.img", bytes)); });
    };
    check(image_error(exr_head(60000, 60000)), "chunks in an EXR file");
    check(image_error(exr_head(60000, 60000) + std::string(30000, '\0')), "may make of itself");
    CHECK_FALSE(image_error(exr_head(4, 4, "", 100000)).empty());  // many names, no pixels
    check(image_error(exr_head(1000, 1000, "", 1000)), "may make of itself");
    check(image_error(exr_head(65537, 1)), "each side must be in [1,65536]");
    const auto size = little(0x7fffffff, 4);
    check(image_error(exr_head(4, 4, std::string("owner\0string\0", 13) + size)), "cut short");
    check(image_error(exr_head(4, 4, attribute("order", "lineOrder", "") + '\0')), "of 0 bytes, not 1");
    // What these claim is never read.
    const std::string list("G\0\2\0\0\0", 6), manifest = little(0x7fffffff, 4) + "x";
    for (const auto& [type, value] : {std::pair{"stringvector", size}, {"preview", little(60000, 4) + little(60000, 4)}, {"chlist", list}, {"idmanifest", manifest}, {"floatvector", "abcde"}})
        check(image_error(exr_head(4, 4, attribute("more", type, value))), "the file is cut short");
    check(image_error(exr_head(4, 4, attribute("chunkCount", "int", size), 3, 0x1002)), "chunks in an EXR file");
    check(image_error(exr_head(60000, 1, attribute("tiles", "tiledesc", little(1, 4) + little(1, 4) + '\0'), 3, 0x202)), "chunks in an EXR file");
    check(image_error(exr_head(4, 4, attribute("tiles", "tiledesc", little(1 << 30, 4) + little(1 << 30, 4) + '\0'), 3, 0x202)), "may make of itself");
    check(image_error(exr_head(4, 4, attribute("dataWindow", "box2i", std::string(16, '\0')))), "stands twice");
    check(image_error(exr_head(4, 4, "", 3, 0x802)), "a deep EXR image");
    // Runs of runs: 16 bytes a line.
    std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 20000 +X 30000\n";
    for (int y = 0; y < 1000; ++y) hdr += std::string("\x80\x80\x80\x80\1\1\1\xff\1\1\1\xff", 12);
    check(image_error(hdr), "may make of itself");

    const auto voxel_error = [&](const char* name, const std::string& bytes) {
        return error_of([&] {
            const auto file = open_voxel_file(folder.write(name, bytes));
            file->read(0);
        });
    };
    check(voxel_error("a.vol", vol_file({1 << 29, 1 << 29, 1 << 29}, "abcd")), "the file holds 4");
    check(error_of([&] { read_raw(folder.write("a.raw", "abcd"), {65536, 65536, 65536}); }), "the file holds 4");

    LibraryGrid tiles;
    for (int x = 0; x < 100; ++x) tiles.tiles.push_back({{128 * x, 0, 0}, 128, 2});
    write_library_vdb(folder.path() / "a.vdb", {tiles});
    write_library_nvdb(folder.path() / "a.nvdb", {tiles}, "zip");
    for (const char* name : {"a.vdb", "a.nvdb"})
        check(error_of([&] { open_voxel_file(folder.path() / name)->read(0); }), "may make of itself");
    // What such a block is made of does fit.
    tiles.tiles.resize(8);
    write_library_vdb(folder.path() / "a.vdb", {tiles});
    CHECK(open_voxel_file(folder.path() / "a.vdb")->read(0).brick_origins.size() == 8 * 4096);

    std::string vertex;
    for (const char* name : {"x", "y", "z", "scale_0", "scale_1", "scale_2", "sigma_t"}) vertex += std::string("property char ") + name + "\n";
    for (const char* format : {"ascii", "binary_big_endian"})
        check(error_of([&] {
                  folder.write("a.ply", std::string("ply\nformat ") + format + " 1.0\nelement vertex 4000000000\n" + vertex + "end_header\n1 1 1 1 1 1 1\n");
                  parse_scene(R"({"camera":{"origin":[0,0,-4],"target":[0,0,0]},"media":[{"type":"ellipsoids","kernel":"gaussian","file":"a.ply"}]})",
                              folder.path() / "s.json");
              }),
              "bytes for 4000000000 vertices");
}

TEST_CASE("HostileFiles.AFlatImageIsStillRead", "[quick]") {
    // Deflate makes a thousandth of it: the bound must allow that.
    const TempFolder folder;
    write_flat_exr(folder.path() / "flat.exr", 4096, 2048);
    CHECK(std::filesystem::file_size(folder.path() / "flat.exr") < 100'000);
    CHECK(read_environment(folder.path() / "flat.exr").rgb.back() == 1);
}

TEST_CASE("Binary.AFileNamedOftenIsHeldWithinTheLimit") {
    const SceneFolder folder;
    write_flat_exr(folder.path / "flat.exr", 1024, 512);
    std::string lights;
    for (int i = 0; i < 100; ++i) lights += std::string(i == 0 ? "" : ",") + R"({"type":"envmap","file":"flat.exr"})";
    std::ofstream(folder.path / "often.json") << R"({"camera":{"origin":[0,0,-4],"target":[0,0,0]},"lights":[)" << lights << "]}";
    Process process({"render", "often.json", "--memory-limit", "400M", "--quiet"}, folder.path);
    CHECK(process.wait() == 3);
    CHECK_THAT(process.err, Catch::Contains("the files up to here hold"));
}

TEST_CASE("HostileFiles.WhatSinglePrecisionCantHoldIsRefused", "[quick]") {
    const MemoryLimit limit(std::uint64_t{600} << 20);
    const auto pack = [](const std::string& primitives, const std::string& keys = "") {
        return error_of([&] {
            make_device_scene(parse_scene(R"({"camera":{"origin":[0,0,-4],"target":[0,0,0]},"lights":[{"type":"constant","radiance":1}],"media":[{"type":"ellipsoids","kernel":"gaussian",)" +
                                              keys + "\"primitives\":[" + primitives + "]}]}",
                                          "s.json"),
                              {});
        });
    };
    const std::string sound = R"({"center":[0,0,0],"scale":0.3,"density":1})";
    CHECK(pack(sound).empty());
    CHECK(pack(R"({"center":[0,0,0],"scale":0.3,"density":1e27})").empty());
    CHECK(pack(sound + R"(,{"center":[0,0,0],"scale":1e-15,"density":1})").empty());
    check(pack(sound + R"(,{"center":[0,0,0.1],"scale":0.3,"density":1e308})"), "the primitive at (0, 0, 0.1) is outside single precision: extinction 1e+308");
    check(pack(R"({"center":[0,0,0],"scale":0.3,"density":1e200})", R"("density_scale":1e200,)"), "extinction inf");
    check(pack(R"({"center":[0,0,0],"scale":1e39,"density":1})"), "is an optical depth above 1e+28");
    check(pack(R"({"center":[0,0,0],"scale":[1e39,1,1e-39],"density":1})"), "a scale less than 1e-18");
    check(pack(sound + R"(,{"center":[1e30,0,0],"scale":1,"density":1})"), "a scale less than 1e-18");
    check(pack(R"({"center":[1.7e308,0,0],"scale":1,"density":1},{"center":[-1.7e308,0,0],"scale":1,"density":1})"), "s.json: what is in the scene reaches too far");
    for (const char* extent : {"1e300", "1e100", "1e-300"}) check(pack(sound, std::string("\"extent\":") + extent + ","), "must be in [1e-15,1e15]");
    for (const char* extent : {"1e15", "1e-15"}) CHECK(pack(sound, std::string("\"extent\":") + extent + ",").empty());
}

TEST_CASE("HostileFiles.HeadersOfManyNamesTakeNoTime", "[quick]") {
    const TempFolder folder;
    const auto seconds_of = [&](const std::string& middle, const std::string& why) {
        folder.write("a.ply", "ply\nformat ascii 1.0\n" + middle + "end_header\n");
        const auto begin = std::chrono::steady_clock::now();
        check(error_of([&] {
                  parse_scene(R"({"camera":{"origin":[0,0,-4],"target":[0,0,0]},"media":[{"type":"ellipsoids","kernel":"gaussian","file":"a.ply"}]})",
                              folder.path() / "s.json");
              }),
              why);
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    std::string elements, properties;
    for (int i = 0; i < 200'000; ++i) {
        elements += "element e" + std::to_string(i) + " 0\n";
        if (i % 4096 == 0) properties += "element e" + std::to_string(i) + " 0\n";
        properties += "property char p" + std::to_string(i % 4096) + "\n";
    }
    CHECK(seconds_of(elements, "more than 4096 elements") < 10);
    CHECK(seconds_of(properties, "more than 4096 properties") < 10);
}

TEST_CASE("HostileFiles.OnlyRegularFilesAreRead", "[quick]") {
    const TempFolder folder;
    REQUIRE(mkfifo((folder.path() / "pipe.ply").c_str(), 0600) == 0);
    std::filesystem::create_symlink("/dev/zero", folder.path() / "zero.ply");
    std::filesystem::create_symlink("pipe.ply", folder.path() / "link.ply");
    std::filesystem::create_symlink("round.ply", folder.path() / "round.ply");
    std::filesystem::create_directory(folder.path() / "folder.ply");
    for (const char* name : {"pipe.ply", "zero.ply", "link.ply", "round.ply", "folder.ply", "/dev/zero", "/dev/stdin", "none.ply"}) {
        INFO(name);
        const std::string scene = std::string(R"({"camera":{"origin":[0,0,-4],"target":[0,0,0]},"media":[{"type":"ellipsoids","kernel":"gaussian","file":")") + name + "\"}]}";
        if (std::string_view(name) != "/dev/stdin" || !std::filesystem::is_regular_file(name)) CHECK_FALSE(error_of([&] { parse_scene(scene, folder.path() / "s.json"); }).empty());
        if (*name != '/') CHECK_FALSE(error_of([&] { read_scene(folder.path() / name); }).empty());
    }
    // A link to a file, and a file above the scene's folder, are read.
    const fuzz::SmallFiles files;
    std::filesystem::create_symlink(files.folder() / "a.ply", folder.path() / "good.ply");
    for (const std::string& name : {std::string("good.ply"), "../" + files.folder().filename().string() + "/a.ply"})
        CHECK(parse_scene(R"({"camera":{"origin":[0,0,-4],"target":[0,0,0]},"lights":[{"type":"constant","radiance":1}],"media":[{"type":"ellipsoids","kernel":"gaussian","file":")" +
                              name + "\"}]}",
                          folder.path() / "s.json")
                  .media.at(0)
                  .primitives.size() == 1);
}

TEST_CASE("HostileFiles.ASceneNamesFilesToReadOnly", "[quick]") {
    // Whoever adds a key that takes text says here what is done with it.
    std::set<std::string> text;
    for (const KeySpec& key : scene_schema())
        if (key.type == KeyType::string) text.insert(std::string(key.section) + "." + std::string(key.name));
    CHECK(text == std::set<std::string>{"media.file", "media.grid", "media.emission_grid", "lights.file"});
}

TEST_CASE("HostileFiles.PrintableHoldsNoOrders", "[quick]") {
    CHECK(printable("plain, größer, 雲, 🌫") == "plain, größer, 雲, 🌫");
    CHECK(printable("\x1b]0;t\x07\x7f") == "\\x1b]0;t\\x07\\x7f");
    CHECK(printable("a\nb\tc") == "a\\x0ab\\x09c");
    CHECK(printable("a\nb\tc", true) == "a\nb\\x09c");
    CHECK(printable("\xc2\x9b" "31m") == "\\xc2\\x9b31m");             // CSI as one character
    CHECK(printable("\x9b" "31m") == "\\x9b31m");                      // and as a byte
    CHECK(printable("\xe2\x80\xae") == "\\xe2\\x80\\xae");             // right to left
    CHECK(printable("\xc0\x9b \xed\xa0\x80 \xf5 \xe2\x80") == "\\xc0\\x9b \\xed\\xa0\\x80 \\xf5 \\xe2\\x80");  // overlong, surrogate, beyond, cut
    CHECK(printable(std::string(1, '\0')) == "\\x00");
}

TEST_CASE("Binary.MessagesGiveTheTerminalNoOrders") {
    const SceneFolder folder;
    const std::string name = "\x1b[31m\x07.exr";
    std::ofstream(folder.path / name) << "no image";
    std::ofstream(folder.path / "named.json") << R"({"camera":{"origin":[0,0,-4],"target":[0,0,0]},"lights":[{"type":"envmap","file":"\u001b[31m\u0007.exr"}]})";
    std::ofstream(folder.path / "attribute.json") << R"({"camera":{"origin":[0,0,-4],"target":[0,0,0]},"lights":[{"type":"envmap","file":"a.exr"}]})";
    std::ofstream(folder.path / "a.exr") << exr_head(4, 4, attribute("\x1b[31m", "float", "1"));
    for (const char* scene : {"named.json", "attribute.json"}) {
        Process process({"info", scene}, folder.path);
        CHECK(process.wait() == 3);
        INFO(process.err);
        CHECK(process.err.find_first_of("\x1b\x07") == std::string::npos);
        CHECK(std::count(process.err.begin(), process.err.end(), '\n') == 1);
    }
}

TEST_CASE("Binary.AComparedScenesNameRunsNothing") {
    const SceneFolder folder;
    const std::string name = "'\"`touch pwned`; system(\"touch pwned\") #<script>alert(1)</script>&.json";
    // A slash can't be in a name.
    const std::string file = [&] {
        std::string out = name;
        std::replace(out.begin(), out.end(), '/', '|');
        return out;
    }();
    std::filesystem::rename(folder.path / "puff.json", folder.path / file);
    Process process({"compare", file, "-o", "report", "--strategies", "delta,decomposition", "--seeds", "2", "--spp", "1", "--quiet"}, folder.path);
    CHECK(process.wait() == 0);
    INFO(process.err);
    for (const char* place : {"pwned", "report/pwned"}) CHECK_FALSE(std::filesystem::exists(folder.path / place));
    const auto text_of = [&](const char* part) { return file_bytes(folder.path / "report" / part); };
    CHECK(text_of("plot.gp").find("pwned") == std::string::npos);
    CHECK(text_of("index.html").find("<script") == std::string::npos);
    CHECK(text_of("index.html").find("&lt;script&gt;") != std::string::npos);
    // What was made is the report alone, and the scene is as it was.
    CHECK(folder.files() == 2);
}

TEST_CASE("HostileFiles.TheDocumentStatesTheBounds", "[quick]") {
    const std::string text = file_bytes(std::filesystem::path(CLUME_SOURCE_DIR) / "docs/design.md");
    const std::pair<const char*, MemoryBound> rows[] = {{"scene, without the files it names", scene_memory},
                                                        {"PLY", ply_memory},
                                                        {"`.vol`, `.raw`", dense_memory},
                                                        {"`.vdb`, `.nvdb`, each grid that is read", sparse_memory},
                                                        {"EXR, HDR", image_memory}};
    for (const auto& [file, bound] : rows)
        CHECK_THAT(text, Catch::Contains("\n| " + std::string(file) + " | " + std::to_string(bound.factor) + " | " + std::to_string(bound.constant >> 20) + " MiB | "));
}

TEST_CASE("VoxelFiles.ZippedVdbIsReadAsTheOther", "[quick]") {
    const TempFolder folder;
    LibraryGrid grid;
    for (int i = 0; i < 40; ++i) grid.voxels.push_back({{i, i % 7, i % 3}, 0.25f * static_cast<float>(i)});
    write_library_vdb(folder.path() / "plain.vdb", {grid}, 6);
    const std::string plain_bytes = file_bytes(folder.path() / "plain.vdb"), zipped = blosc_to_zip(plain_bytes);
    REQUIRE(zipped != plain_bytes);
    REQUIRE(zipped.find("\x78\x9c") != std::string::npos);
    folder.write("zip.vdb", zipped);
    const VoxelGrid plain = open_voxel_file(folder.path() / "plain.vdb")->read(0), unzipped = open_voxel_file(folder.path() / "zip.vdb")->read(0);
    CHECK(plain.brick_origins == unzipped.brick_origins);
    CHECK(plain.values == unzipped.values);
}
