// SPDX-License-Identifier: MIT
// The environment reader: EXR of several kinds and Radiance HDR, and what broken files give.
// EXR files are written by OpenEXR here, HDR files byte by byte.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfTiledOutputFile.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "src/environment_reader.h"
#include "src/error.h"
#include "tests/temp_folder.h"

using namespace clume;
using clume::test::TempFolder;

namespace {

std::string error_of(const std::filesystem::path& path) {
    try {
        read_environment(path);
    } catch (const SceneError& error) {
        std::string message = error.what();
        CHECK(message.find('\n') == std::string::npos);
        CHECK(message.find(path.string()) == 0);
        return message;
    }
    return "";
}

/// Stored value of channel c at column x and row y of the data window.
float texel(int c, int x, int y) { return static_cast<float>(1 + c + 10 * x + 100 * y); }

struct ExrCase {
    std::vector<std::string> channels{"R", "G", "B"};
    Imf::PixelType type = Imf::FLOAT;
    Imath::Box2i display{{0, 0}, {6, 3}}, data{{0, 0}, {6, 3}};
    bool tiled = false;
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    float first = 1;  ///< value of the first texel of the first channel
};

void write_exr(const std::filesystem::path& path, const ExrCase& what) {
    const int width = what.data.max.x - what.data.min.x + 1, height = what.data.max.y - what.data.min.y + 1;
    Imf::Header header(what.display, what.data);
    header.compression() = what.compression;
    std::vector<std::vector<float>> values;
    std::vector<std::vector<unsigned>> integers;
    std::vector<std::vector<half>> halves;
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < what.channels.size(); ++c) {
        auto& v = values.emplace_back();
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) v.push_back(texel(static_cast<int>(c), x, y));
        if (c == 0) v[0] = what.first;
        integers.emplace_back(v.begin(), v.end());
        auto& h = halves.emplace_back();
        for (const float f : v) h.push_back(half(f));
    }
    for (std::size_t c = 0; c < what.channels.size(); ++c) {
        header.channels().insert(what.channels[c], Imf::Channel(what.type));
        const std::size_t size = what.type == Imf::HALF ? 2 : 4;
        char* data = what.type == Imf::HALF   ? reinterpret_cast<char*>(halves[c].data())
                     : what.type == Imf::UINT ? reinterpret_cast<char*>(integers[c].data())
                                              : reinterpret_cast<char*>(values[c].data());
        const auto offset =
            (static_cast<std::ptrdiff_t>(what.data.min.y) * width + what.data.min.x) * static_cast<std::ptrdiff_t>(size);
        frame.insert(what.channels[c], Imf::Slice(what.type, data - offset, size, size * static_cast<std::size_t>(width)));
    }
    if (what.tiled) {
        header.setTileDescription(Imf::TileDescription(4, 2));
        Imf::TiledOutputFile file(path.c_str(), header);
        file.setFrameBuffer(frame);
        file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
    } else {
        Imf::OutputFile file(path.c_str(), header);
        file.setFrameBuffer(frame);
        file.writePixels(height);
    }
}

std::string file_bytes(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

const std::string hdr_head = "#?RADIANCE\n# a test\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n";

}  // namespace

TEST_CASE("Environment.ExrTypesAndLayouts", "[quick]") {
    const TempFolder folder;
    for (const auto type : {Imf::HALF, Imf::FLOAT, Imf::UINT})
        for (const bool tiled : {false, true})
            for (const char* extra : {"", "A"}) {
                ExrCase what;
                what.type = type;
                what.tiled = tiled;
                if (*extra != 0) what.channels.push_back(extra);
                write_exr(folder.path() / "a.exr", what);
                const EnvironmentImage image = read_environment(folder.path() / "a.exr");
                REQUIRE(image.width == 7);
                REQUIRE(image.height == 4);
                REQUIRE(image.rgb.size() == 84);
                for (int y = 0; y < 4; ++y)
                    for (int x = 0; x < 7; ++x)
                        for (int c = 0; c < 3; ++c)
                            CHECK(image.rgb[static_cast<std::size_t>((y * 7 + x) * 3 + c)] == texel(c, x, y));
            }
}

TEST_CASE("Environment.ExrLuminanceIsGrey", "[quick]") {
    const TempFolder folder;
    ExrCase what;
    what.channels = {"Y"};
    write_exr(folder.path() / "a.exr", what);
    const EnvironmentImage image = read_environment(folder.path() / "a.exr");
    for (std::size_t c = 0; c < 3; ++c) CHECK(image.rgb[9 + c] == texel(0, 3, 0));
}

TEST_CASE("Environment.ExrDataWindowIsPlacedInTheDisplayWindow", "[quick]") {
    const TempFolder folder;
    ExrCase what;
    what.display = {{10, 20}, {16, 23}};
    what.data = {{12, 19}, {18, 21}};  // one row above, two columns to the right of the display window
    write_exr(folder.path() / "a.exr", what);
    const EnvironmentImage image = read_environment(folder.path() / "a.exr");
    REQUIRE(image.width == 7);
    REQUIRE(image.height == 4);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 7; ++x)
            CHECK(image.rgb[static_cast<std::size_t>((y * 7 + x) * 3)] == (x >= 2 && y < 2 ? texel(0, x - 2, y + 1) : 0.0f));
    what.display = what.data = {{-3, -5}, {3, -2}};
    write_exr(folder.path() / "b.exr", what);
    CHECK(read_environment(folder.path() / "b.exr").rgb[3] == texel(0, 1, 0));
}

TEST_CASE("Environment.BadTexelsAreRefused", "[quick]") {
    const TempFolder folder;
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f}) {
        ExrCase what;
        what.first = bad;
        write_exr(folder.path() / "a.exr", what);
        CHECK(error_of(folder.path() / "a.exr").find("texel (0, 0) is") != std::string::npos);
    }
}

TEST_CASE("Environment.ExrWithoutColourIsRefused", "[quick]") {
    const TempFolder folder;
    for (const std::vector<std::string>& channels : {std::vector<std::string>{"Z"}, {"R", "G"}, {"Y", "RY", "BY"}}) {
        ExrCase what;
        what.channels = channels;
        write_exr(folder.path() / "a.exr", what);
        CHECK_FALSE(error_of(folder.path() / "a.exr").empty());
    }
}

TEST_CASE("Environment.DamagedExrNeverCrashes", "[quick]") {
    const TempFolder folder;
    ExrCase what;
    what.compression = Imf::PIZ_COMPRESSION;
    write_exr(folder.path() / "good.exr", what);
    const std::string good = file_bytes(folder.path() / "good.exr");
    for (std::size_t size = 4; size + 1 < good.size(); size += 7) {
        INFO(size << " of " << good.size());
        CHECK_FALSE(error_of(folder.write("cut.exr", good.substr(0, size))).empty());
    }
    for (std::size_t at = 4; at < good.size(); ++at) {
        std::string bytes = good;
        bytes[at] = static_cast<char>(bytes[at] ^ 0xFF);
        const auto path = folder.write("flipped.exr", bytes);
        CHECK_NOTHROW(error_of(path));
    }
}

TEST_CASE("Environment.HdrFlatAndRunLength", "[quick]") {
    const TempFolder folder;
    std::string flat = hdr_head + "-Y 2 +X 3\n";
    for (int i = 0; i < 6; ++i) flat += {static_cast<char>(128), static_cast<char>(64 + i), 0, static_cast<char>(129 + i % 2)};
    EnvironmentImage image = read_environment(folder.write("a.hdr", flat));
    REQUIRE(image.width == 3);
    REQUIRE(image.height == 2);
    CHECK(image.rgb[0] == 1.0f);
    CHECK(image.rgb[1] == 0.5f);
    CHECK(image.rgb[3] == 2.0f);
    CHECK(image.rgb[15] == 2.0f);

    std::string runs = hdr_head + "-Y 2 +X 10\n";
    for (int row = 0; row < 2; ++row) {
        runs += {2, 2, 0, 10};
        runs += {static_cast<char>(128 + 10), static_cast<char>(128)};
        runs += {10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
        runs += {static_cast<char>(128 + 4), 9, 6, 0, 0, 0, 0, 0, 0};
        runs += {static_cast<char>(128 + 10), static_cast<char>(129)};
    }
    image = read_environment(folder.write("b.hdr", runs));
    REQUIRE(image.rgb.size() == 60);
    CHECK(image.rgb[30] == 1.0f);
    CHECK(image.rgb[31] == 1.0f / 128);
    CHECK(image.rgb[58] == 10.0f / 128);
    CHECK(image.rgb[3 * 3 + 2] == 9.0f / 128);
    CHECK(image.rgb[4 * 3 + 2] == 0.0f);

    for (const std::string& good : {flat, runs})
        for (std::size_t size = 0; size < good.size(); ++size) {
            INFO(size << " of " << good.size());
            CHECK_FALSE(error_of(folder.write("cut.hdr", good.substr(0, size))).empty());
        }
}

TEST_CASE("Environment.BadHdrIsRefused", "[quick]") {
    const TempFolder folder;
    for (const std::string size : {"-Y 65536 +X 65536\n", "-Y 0 +X 4\n", "-Y 999999999 +X 999999999\n", "-Y -5 +X 4\n",
                                   "+X 4 -Y 4\n", "-Y 4\n", "-Y 4 +X 4 x\n", "\n"})
        CHECK_FALSE(error_of(folder.write("a.hdr", hdr_head + size + "abcd")).empty());
    CHECK(error_of(folder.write("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\nabcd")).find("unknown HDR format") !=
          std::string::npos);
    std::string runs = hdr_head + "-Y 1 +X 8\n";
    runs += {2, 2, 0, 8, 0, 0, 0, 0, 0, 0};  // a run of nothing
    CHECK(error_of(folder.write("a.hdr", runs)).find("corrupt HDR") != std::string::npos);
}

TEST_CASE("Environment.UnknownFormatAndMissingFile", "[quick]") {
    const TempFolder folder;
    CHECK(error_of(folder.write("a.exr", "\x89PNG\r\n")).find("unknown format") != std::string::npos);
    CHECK(error_of(folder.write("a.exr", "")).find("unknown format") != std::string::npos);
    CHECK(error_of(folder.path() / "none.exr").find("no such file") != std::string::npos);
    CHECK(error_of(folder.path()).find("not a file") != std::string::npos);
}
