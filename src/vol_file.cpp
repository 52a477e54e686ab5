// SPDX-License-Identifier: MIT
// Mitsuba's .vol, version 3: "VOL", the version, encoding, resolution, channels and a bounding box, 48 bytes, then samples at
// the centres of the box's voxels, x fastest. The format is documented with Mitsuba's `gridvolume`.
#include <ImathConfig.h>
#include <fmt/format.h>
#include <half.h>

#include <bit>

#include "src/byte_reader.h"
#include "src/input_file.h"
#include "src/voxel_file.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

enum Encoding : std::int32_t { float32 = 1, float16 = 2, uint8 = 3 };

constexpr std::size_t header_bytes = 48;

class VolFile : public VoxelFile {
  public:
    explicit VolFile(const std::filesystem::path& path) : name_(path.string()), bytes_(read_file_bytes(path)) {
        ByteReader in(name_, bytes_);
        if (!std::string_view(bytes_).starts_with("VOL")) in.fail("unknown format: not a Mitsuba .vol file");
        in.take(3);
        if (const int version = in.get<std::uint8_t>(); version != 3)
            in.fail(fmt::format("version {} of the .vol format; known: 3", version));
        encoding_ = in.get<std::int32_t>();
        if (encoding_ != float32 && encoding_ != float16 && encoding_ != uint8)
            in.fail(fmt::format("unknown .vol encoding {}; known: 1 (float32), 2 (float16), 3 (uint8)", encoding_));
        for (int i = 0; i < 3; ++i) size_[i] = in.get<std::int32_t>();
        const auto channels = in.get<std::int32_t>();
        if (glm::any(glm::lessThan(size_, glm::ivec3(1))) ||
            glm::any(glm::greaterThan(size_, glm::ivec3(largest_lattice_coordinate))))
            in.fail(fmt::format("a resolution of {} x {} x {}; each must be at least 1", size_.x, size_.y, size_.z));
        if (channels != 1) in.fail(fmt::format("{} channels; only one-channel .vol files can be a medium", channels));
        for (glm::dvec3* corner : {&min_, &max_})
            for (int i = 0; i < 3; ++i) (*corner)[i] = in.get<float>();
        sample_bytes_ = encoding_ == float32 ? 4 : encoding_ == float16 ? 2 : 1;
        const auto needed =
            static_cast<unsigned __int128>(static_cast<std::uint64_t>(size_.x) * static_cast<std::uint64_t>(size_.y)) *
            (static_cast<std::uint64_t>(size_.z) * sample_bytes_);
        if (needed != in.left())
            in.fail(fmt::format("{} x {} x {} samples of {} bytes need {:.0f} bytes, the file holds {}", size_.x, size_.y,
                                size_.z, sample_bytes_, static_cast<double>(needed), in.left()));
        entries_.push_back({"", encoding_ == float32 ? "float32" : encoding_ == float16 ? "float16" : "uint8", ""});
    }

    const std::vector<VoxelFileEntry>& entries() const override { return entries_; }

    VoxelGrid read(std::size_t) const override {
        const auto nx = static_cast<std::size_t>(size_.x), ny = static_cast<std::size_t>(size_.y);
        VoxelGrid grid = make_dense_grid(name_, size_, [&](int y, int z, float* row) {
            const char* from = bytes_.data() + header_bytes +
                               (static_cast<std::size_t>(z) * ny + static_cast<std::size_t>(y)) * nx * sample_bytes_;
            if (encoding_ == float32) {
                std::memcpy(row, from, nx * sizeof(float));
                return;
            }
            for (std::size_t x = 0; x < nx; ++x) {
                if (encoding_ == uint8) {
                    row[x] = static_cast<float>(static_cast<unsigned char>(from[x])) / 255.0f;
                } else {
                    std::uint16_t bits;
                    std::memcpy(&bits, from + 2 * x, sizeof bits);
                    row[x] = imath_half_to_float(bits);
                }
            }
        });
        place_in_box(grid, min_, max_);
        return grid;
    }

  private:
    std::string name_, bytes_;
    std::vector<VoxelFileEntry> entries_;
    std::int32_t encoding_ = float32;
    std::size_t sample_bytes_ = 4;
    glm::ivec3 size_{0};
    glm::dvec3 min_{0}, max_{0};
};

}  // namespace

std::unique_ptr<VoxelFile> open_vol(const std::filesystem::path& path) { return std::make_unique<VolFile>(path); }

}  // namespace clume
