// SPDX-License-Identifier: MIT
// clume_fuzz_seeds FOLDER: the fuzzers' first inputs, FOLDER/TARGET/*, and their words, FOLDER/TARGET.dict. Made from scenes/ and by
// the writers of the project and of the libraries, so that no binary file is kept; the inputs once found to be trouble come along.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfTiledOutputFile.h>
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <vector>

#include "src/ply_header.h"
#include "src/scene_schema.h"
#include "src/voxel_writer.h"
#include "tests/library_voxels.h"

namespace fs = std::filesystem;
using namespace clume;

namespace {

std::string bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void write(const fs::path& path, std::string_view bytes) {
    fs::create_directories(path.parent_path());
    std::ofstream out(path, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) throw std::runtime_error(path.string() + ": cannot be written");
}

std::vector<fs::path> files_of(const fs::path& folder, const char* extension) {
    std::vector<fs::path> out;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == extension) out.push_back(entry.path());
    return out;
}

/// The project's scenes, and two that have between them nearly every key of the table.
void make_scenes(const fs::path& folder) {
    // The files they name become the small ones that fuzz_scene has.
    static const std::regex file(R"re("file"\s*:\s*"[^"]*(\.\w+)")re");
    for (const fs::path& path : files_of(CLUME_SCENES_DIR, ".json"))
        write(folder / path.filename(), std::regex_replace(bytes_of(path), file, R"("file": "a$1")"));
    const auto scene = [&](const char* name, const char* media, const char* lights) {
        write(folder / name, fmt::format(R"({{"camera":{{"type":"orthographic","width":2,"origin":[0,0,-4],"target":[0,0,0],"up":[0,1,0]}},
"film":{{"width":64,"height":64}},"render":{{"strategy":"delta","majorant_grid":64,"step":0.1,"light_sampling":"nee"}},
"media":[{}],"lights":[{}]}})",
                                         media, lights));
    };
    scene("all_lights.json",
          R"({"type":"ellipsoids","kernel":"uniform","extent":2,"primitives":[{"center":[0,0,0],"covariance":[1,0,0,1,0,1],"density":1,"albedo":[1,0,1],"emission":0.5,"g":-0.5},
{"center":[0,0,1],"scale":[1,2,3],"rotation":[1,2,3,4],"density":0}]})",
          R"({"type":"point","position":[0,1,0],"intensity":1},{"type":"spot","position":[0,1,0],"target":[0,0,0],"intensity":1,"beam":10,"cutoff":20},
{"type":"sphere","center":[0,1,0],"radius":1,"radiance":1},{"type":"rectangle","corner":[0,1,0],"edge_u":[1,0,0],"edge_v":[0,0,1],"radiance":[1,2,3]},
{"type":"envmap","file":"a.hdr","rotate_y":90},{"type":"constant","radiance":1,"visible_to_camera":true},{"type":"directional","direction":[0,-1,0],"irradiance":2})");
    scene("grids.json",
          R"({"type":"grid","file":"a.vdb","grid":"density","bounds":[[0,0,0],[1,1,1]],"interpolation":"nearest","emission_grid":"density","transform":{"matrix":[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}},
{"type":"grid","file":"a.nvdb","phase":{"type":"rayleigh"},"transform":{"scale":-2,"rotate":{"axis":[0,1,0],"angle":30},"translate":[1,2,3]}},
{"type":"grid","file":"a.vol","emission":1},{"type":"grid","file":"a.raw","resolution":[2,2,2],"bounds":[[0,0,0],[1,1,1]]})",
          R"({"type":"envmap","file":"a.exr"})");
}

void make_plys(const fs::path& folder) {
    for (const fs::path& path : files_of(CLUME_SCENES_DIR, ".ply")) {
        // The first three vertices are as good as all.
        std::string bytes = bytes_of(path);
        const ply::Header header = ply::read_header(bytes, path.string());
        bytes.resize(header.data_offset + 3 * header.find("vertex")->row_bytes);
        write(folder / path.filename(), std::regex_replace(bytes.substr(0, header.data_offset), std::regex("element vertex [0-9]+"), "element vertex 3") +
                                            bytes.substr(header.data_offset));
    }
    std::string columns;
    for (const char* name : {"double x", "int y", "uchar z", "float scale_0", "short scale_1", "char scale_2", "float rot_0", "float rot_1", "float rot_2",
                             "float rot_3", "float sigma_t", "float opacity", "float f_dc_0", "float f_dc_1", "float f_dc_2", "float emission_0",
                             "float emission_1", "float emission_2", "float g", "list uchar ushort more"})
        columns += fmt::format("property {}\n", name);
    const auto head = [&](const char* format) {
        return fmt::format("ply\nformat {} 1.0\ncomment made\nelement before 1\nproperty list int float items\nelement vertex 1\n{}element after 2\nproperty uint u\nend_header\n",
                           format, columns);
    };
    write(folder / "ascii.ply", head("ascii") + "2 7 8\n1 2 3 0.1 1 1 1 0 0 0 1 2 0.1 0.2 0.3 1 1 1 0.5 2 4 5\n6\n7\n");
    std::string row(4, '\0');  // no items
    row += std::string(8 + 4 + 1 + 4 + 2 + 1, '\1') + std::string("\0\0\x80\x3f", 4) + std::string(12, '\0') + std::string(4 * 9, '\0') + "\1\2\3" + std::string(8, '\0');
    write(folder / "little.ply", head("binary_little_endian") + row);
    write(folder / "big.ply", head("binary_big_endian") + row);
}

void make_voxels(const fs::path& folder) {
    VoxelGrid grid;
    grid.hi = {10, 3, 2};
    grid.brick_origins = {glm::ivec3(0), glm::ivec3(8, 0, 0)};
    grid.values.assign(1024, 0.0f);
    for (const int i : {0, 9, 70, 512, 513}) grid.values[static_cast<std::size_t>(i)] = 0.5f;
    const std::string vol = vol_bytes(grid);
    write(folder / "vol/own.vol", vol);
    for (const int encoding : {2, 3}) {
        std::string narrow = vol.substr(0, 48 + 60 * (encoding == 2 ? 2 : 1));
        narrow[4] = static_cast<char>(encoding);
        write(folder / "vol" / fmt::format("{}.vol", encoding), narrow);
    }
    write(folder / "raw/a.raw", std::string("\x03\x02\x01", 3) + std::string(4 * 3 * 2 * 4, '\x3f'));
    write(folder / "vdb/own.vdb", vdb_bytes(grid));
    write(folder / "nvdb/own.nvdb", nvdb_bytes(grid));

    test::LibraryGrid given;
    for (int i = 0; i < 20; ++i) given.voxels.push_back({{i, i % 5, i}, static_cast<float>(i) * 0.1f, i % 3 != 0});
    given.tiles = {{{64, 0, 0}, 8, 1}, {{4096, 0, 0}, 4096, 0}};
    for (const char* kind : {"float", "double", "half", "vector", "frustum"})
        for (const std::uint32_t compression : {0u, 1u, 2u, 6u}) {
            if (compression == 0 && std::string_view(kind) != "float") continue;  // large, so slow
            given.kind = kind;
            given.map = compression == 0 ? "scale translate" : compression == 1 ? "affine" : "uniform scale";
            test::write_library_vdb(folder / "vdb" / fmt::format("{}_{}.vdb", kind, compression), {given}, compression);
        }
    given.kind = "float";
    test::write_library_vdb(folder / "vdb/shared.vdb", {given, given}, 6, true);
    for (const char* type : {"float", "double", "fp4", "fp8", "fp16", "fpn"})
        for (const char* codec : {"none", "zip", "blosc"}) {
            if (std::string_view(codec) != "none" && std::string_view(type) != "float") continue;
            test::write_library_nvdb(folder / "nvdb" / fmt::format("{}_{}.nvdb", type, codec), {given}, codec, type);
        }
    // A tile of 4096 bricks takes a while: one file of each kind has it.
    given.tiles = {{{128, 0, 0}, 128, 2}};
    test::write_library_vdb(folder / "vdb/tile.vdb", {given}, 6);
    test::write_library_nvdb(folder / "nvdb/tile.nvdb", {given}, "zip");
}

void make_images(const fs::path& folder) {
    write(folder / "sky.exr", bytes_of(fs::path(CLUME_SCENES_DIR) / "sky.exr"));
    for (int compression = 0; compression < Imf::NUM_COMPRESSION_METHODS; ++compression)
        for (const auto type : {Imf::HALF, Imf::FLOAT, Imf::UINT})
            for (const bool tiled : {false, true}) {
                if (type == Imf::UINT && compression > 3) continue;
                Imf::Header header(9, 5);
                header.compression() = static_cast<Imf::Compression>(compression);
                std::vector<float> values(45, 0.5f);
                Imf::FrameBuffer frame;
                for (const char* channel : {"R", "G", "B"}) {
                    header.channels().insert(channel, Imf::Channel(type));
                    frame.insert(channel, Imf::Slice(type, reinterpret_cast<char*>(values.data()), 4, 36));
                }
                const std::string path = (folder / fmt::format("{}_{}_{}.exr", compression, static_cast<int>(type), tiled)).string();
                if (tiled) {
                    header.setTileDescription(Imf::TileDescription(4, 4, compression % 2 == 0 ? Imf::ONE_LEVEL : Imf::MIPMAP_LEVELS));
                    Imf::TiledOutputFile file(path.c_str(), header);
                    file.setFrameBuffer(frame);
                    for (int level = 0; level < file.numLevels(); ++level)
                        file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
                } else {
                    Imf::OutputFile file(path.c_str(), header);
                    file.setFrameBuffer(frame);
                    file.writePixels(5);
                }
            }
    const std::string head = "#?RADIANCE\n# made\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1\n\n";
    write(folder / "flat.hdr", head + "-Y 2 +X 3\n" + std::string(24, '\x40'));
    write(folder / "repeated.hdr", head + "-Y 2 +X 9\n\x40\x40\x40\x40\1\1\1\x08\x40\x40\x40\x40\1\1\1\x08");
    std::string line("\2\2\0\x08", 4);
    for (int c = 0; c < 4; ++c) line += "\x84\x40\x04" "abcd";
    write(folder / "runs.hdr", head + "-Y 2 +X 8\n" + line + line);
}

/// One word per line, in quotes, other bytes as \xNN.
void write_words(const fs::path& path, const std::set<std::string>& words) {
    std::string out;
    for (const std::string& word : words) {
        out += '"';
        for (const char c : word)
            out += c > 0x20 && c < 0x7F && c != '"' && c != '\\' ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
        out += "\"\n";
    }
    write(path, out);
}

void make_words(const fs::path& folder) {
    std::set<std::string> keys{"1e999", "null", "true", "65536", "a.ply", "a.vdb", "a.nvdb", "a.vol", "a.raw", "a.exr", "a.hdr", "\\u0000", "[[", "{}"};
    for (const KeySpec& key : scene_schema()) {
        keys.insert(fmt::format("\"{}\":", key.name));
        for (const auto& word : ply::split_words(key.choices)) keys.insert(fmt::format("\"{}\"", word));
    }
    write_words(folder / "scene.dict", keys);
    write_words(folder / "ply.dict", {"ply\n", "format ", "ascii", "binary_little_endian", "binary_big_endian", " 1.0\n", "element vertex ", "element ", "property ",
                                      "list ", "char ", "uchar ", "short ", "ushort ", "int ", "uint ", "float ", "double ", "x\n", "scale_0\n", "rot_0\n", "sigma_t\n",
                                      "sigma_t_0\n", "opacity\n", "albedo_0\n", "f_dc_0\n", "emission_0\n", "g\n", "end_header\n", "comment ", "4294967295"});
    write_words(folder / "vdb.dict", {"Tree_float_5_4_3", "Tree_double_5_4_3", "_HalfFloat", "AffineMap", "UnitaryMap", "ScaleMap", "UniformScaleMap", "TranslationMap",
                                      "ScaleTranslateMap", "UniformScaleTranslateMap", "NonlinearFrustumMap", "class", "string", "level set"});
    write_words(folder / "environment.dict", {"dataWindow", "displayWindow", "box2i", "channels", "chlist", "tiles", "tiledesc", "compression", "preview", "chunkCount",
                                              "type", "string", "stringvector", "name", "R", "G", "B", "Y", "RY", "lineOrder", "#?RADIANCE\n", "#?RGBE\n",
                                              "FORMAT=32-bit_rle_rgbe\n", "-Y ", " +X ", "65536"});
}

}  // namespace

int main(int argc, char** argv) try {
    if (argc != 2) {
        std::fprintf(stderr, "clume_fuzz_seeds FOLDER\n");
        return 2;
    }
    const fs::path folder = argv[1];
    for (const char* target : {"vdb", "nvdb", "environment"}) fs::create_directories(folder / target);
    const fs::path kept = fs::path(CLUME_SOURCE_DIR) / "tests/fuzz/regressions";
    for (const auto& entry : fs::recursive_directory_iterator(kept))
        if (entry.is_regular_file()) write(folder / entry.path().lexically_relative(kept), bytes_of(entry.path()));
    make_scenes(folder / "scene");
    make_plys(folder / "ply");
    make_voxels(folder);
    make_images(folder / "environment");
    make_words(folder);
    return 0;
} catch (const std::exception& error) {
    std::fprintf(stderr, "clume_fuzz_seeds: %s\n", error.what());
    return 1;
}
