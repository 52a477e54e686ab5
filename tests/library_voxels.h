// SPDX-License-Identifier: MIT
// Voxel files as the OpenVDB and NanoVDB libraries write and read them: the other side of the tests of our own readers and
// writers. Their headers are compiled in library_voxels.cpp only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace clume::test {

struct LibraryVoxel {
    glm::ivec3 at;
    float value;
    bool active = true;
};

/// An aligned cube of one value, as large a node as its place and size allow.
struct LibraryTile {
    glm::ivec3 lo;
    int side;
    float value;
    bool active = true;
};

/// One grid to write. `kind`: float, double, half (float saved as half), level set, vector, int, frustum.
/// `map`: affine, scale, uniform scale, translate, scale translate, uniform scale translate, unitary; those other than affine
/// take what they can from axes and origin.
struct LibraryGrid {
    std::string name = "density", kind = "float", map = "affine";
    float background = 0;
    std::vector<LibraryVoxel> voxels;
    std::vector<LibraryTile> tiles;
    glm::dmat3 axes{1};
    glm::dvec3 origin{0};
};

/// OpenVDB compression flags: 1 zip, 2 active values only, 4 blosc. `shared`: the last grid shares the first one's tree.
void write_library_vdb(const std::filesystem::path& path, const std::vector<LibraryGrid>& grids, std::uint32_t compression = 6,
                       bool shared = false);

/// `codec`: none, zip, blosc. `type`: float, double, fp4, fp8, fp16, fpn. Grids of kind vector and int stay what they are.
void write_library_nvdb(const std::filesystem::path& path, const std::vector<LibraryGrid>& grids, const std::string& codec,
                        const std::string& type = "float");

/// What the library reads of a float grid in a .vdb or .nvdb file at lattice points: values where active, else the background.
struct LibrarySamples {
    std::vector<float> values;
    glm::ivec3 lo, hi;  ///< of the active voxels, half-open
    std::vector<glm::dvec3> world;
};
LibrarySamples read_by_library(const std::filesystem::path& path, const std::string& name,
                               const std::vector<glm::ivec3>& points);

}  // namespace clume::test
