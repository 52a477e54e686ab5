// SPDX-License-Identifier: MIT
#include "tests/fuzz/small_files.h"

#include <ImfArray.h>
#include <ImfRgbaFile.h>

#include "src/voxel_writer.h"

namespace clume::fuzz {

SmallFiles::SmallFiles() {
    std::string vertex;
    for (const char* name : {"x", "y", "z", "scale_0", "scale_1", "scale_2", "sigma_t"}) vertex += std::string("property float ") + name + "\n";
    folder_.write("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\n" + vertex + "end_header\n0 0 0 -1 -1 -1 1\n");

    VoxelGrid grid;
    grid.hi = glm::ivec3(2);
    grid.brick_origins = {glm::ivec3(0)};
    grid.values.assign(512, 0.0f);
    grid.values[0] = grid.values[9] = 1;
    for (const char* name : {"a.vol", "a.nvdb", "a.vdb"}) write_voxel_file(folder() / name, grid);
    folder_.write("a.raw", std::string(8 * sizeof(float), '\0'));

    Imf::Array2D<Imf::Rgba> texels(1, 2);
    for (int x = 0; x < 2; ++x) texels[0][x] = Imf::Rgba(1, 1, 1);
    Imf::RgbaOutputFile image((folder() / "a.exr").c_str(), 2, 1, Imf::WRITE_RGB);
    image.setFrameBuffer(&texels[0][0], 1, 2);
    image.writePixels(1);
    folder_.write("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80");
}

}  // namespace clume::fuzz
