// SPDX-License-Identifier: MIT
// Voxel media in scenes, for the tests of their readers: a scene around one medium, raw bytes, and samples to fill files with.
#pragma once

#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "src/error.h"
#include "src/scene_reader.h"
#include "src/voxel_grid.h"
#include "tests/temp_folder.h"

namespace clume::test {

template <class Value>
std::string bytes_of(const std::vector<Value>& values) {
    std::string out(values.size() * sizeof(Value), '\0');
    std::memcpy(out.data(), values.data(), out.size());
    return out;
}

inline std::string file_bytes(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Line 3 holds the medium: `"type": "grid"` and the keys given.
inline std::string grid_scene(const std::string& keys, bool lit = true) {
    return "{ \"camera\": { \"origin\": [0, 0, -4], \"target\": [0, 0, 0] },\n  \"media\": [\n{ \"type\": \"grid\", " + keys +
           " } ],\n  \"lights\": [ " + (lit ? R"({ "type": "constant", "radiance": 1 })" : "") + " ] }\n";
}

inline GridMedium read_medium(const TempFolder& folder, const std::string& keys) {
    return parse_scene(grid_scene(keys), folder.path() / "s.json").grids.at(0);
}

/// The message without the folder's name; empty if there is none.
inline std::string medium_error(const TempFolder& folder, const std::string& keys, bool lit = true) {
    try {
        parse_scene(grid_scene(keys, lit), folder.path() / "s.json");
    } catch (const SceneError& error) {
        std::string message = error.what();
        CHECK(message.find('\n') == std::string::npos);
        const std::string prefix = folder.path().string() + "/";
        for (auto at = message.find(prefix); at != std::string::npos; at = message.find(prefix))
            message.erase(at, prefix.size());
        return message;
    }
    return "";
}

/// Samples for a grid of that size, x fastest: noise in a ball, 0 outside, so that some bricks are empty and others not full.
inline std::vector<float> ball_samples(const glm::ivec3& size) {
    std::vector<float> out;
    std::uint32_t state = 1;
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) {
                state = state * 1664525u + 1013904223u;
                const glm::dvec3 u = (glm::dvec3(x, y, z) + 0.5) / glm::dvec3(size) - 0.5;
                out.push_back(glm::dot(u, u) < 0.16 ? static_cast<float>(0.25 + (state >> 8) * 0x1p-24) : 0.0f);
            }
    return out;
}

inline std::size_t index_of(const glm::ivec3& size, const glm::ivec3& i) {
    return (static_cast<std::size_t>(i.z) * static_cast<std::size_t>(size.y) + static_cast<std::size_t>(i.y)) *
               static_cast<std::size_t>(size.x) +
           static_cast<std::size_t>(i.x);
}

/// Every lattice point from lo to hi.
inline std::vector<glm::ivec3> lattice_points(const glm::ivec3& lo, const glm::ivec3& hi) {
    std::vector<glm::ivec3> out;
    for (int z = lo.z; z < hi.z; ++z)
        for (int y = lo.y; y < hi.y; ++y)
            for (int x = lo.x; x < hi.x; ++x) out.emplace_back(x, y, z);
    return out;
}

/// A .vol file; other headers by changing bytes of it.
inline std::string vol_file(const glm::ivec3& size, const std::string& samples, int encoding = 1,
                            const glm::vec3& min = glm::vec3(0), const glm::vec3& max = glm::vec3(1)) {
    return "VOL\x03" + bytes_of<std::int32_t>({encoding, size.x, size.y, size.z, 1}) +
           bytes_of<float>({min.x, min.y, min.z, max.x, max.y, max.z}) + samples;
}

}  // namespace clume::test
