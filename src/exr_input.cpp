// SPDX-License-Identifier: MIT
#include "src/exr_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <set>
#include <stdexcept>

#include "src/byte_reader.h"
#include "src/environment_reader.h"
#include "src/json_reader.h"
#include "src/memory_bound.h"

namespace clume {

namespace {

constexpr std::uint32_t deep_flag = 0x800, multi_part_flag = 0x1000;
constexpr std::size_t longest_name = 255;
/// The scan lines that are compressed together, by the compression's number: NONE, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA,
/// DWAB. The library's buffers hold that many, however few an image has.
constexpr std::int64_t chunk_lines[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

/// Types of one size: the library reads that much whatever the attribute says, and would be elsewhere afterwards.
constexpr std::pair<std::string_view, std::size_t> fixed_sizes[] = {
    {"box2f", 16}, {"box2i", 16},    {"chromaticities", 32}, {"compression", 1}, {"deepImageState", 1}, {"double", 8}, {"envmap", 1},
    {"float", 4},  {"int", 4},       {"keycode", 28},        {"lineOrder", 1},   {"m33d", 72},          {"m33f", 36},  {"m44d", 128},
    {"m44f", 64},  {"rational", 8},  {"tiledesc", 9},        {"timecode", 8},    {"v2d", 16},           {"v2f", 8},    {"v2i", 8},
    {"v3d", 24},   {"v3f", 12},      {"v3i", 12}};

/// Text up to a NUL.
std::string_view name_of(ByteReader& in, std::string_view bytes) {
    const std::size_t end = bytes.find('\0', in.at());
    if (end == std::string_view::npos || end - in.at() > longest_name) in.fail("corrupt EXR header: a name without an end");
    const std::string_view name = in.take(end - in.at());
    in.take(1);
    return name;
}

/// What no type is called that the library knows: an attribute of such a type is so many bytes to it.
constexpr char unknown_type = '?';

class PartChecker {
  public:
    /// `in` reads `bytes`.
    PartChecker(ByteReader& in, std::string& bytes) : in_(in), bytes_(bytes) {}

    /// Reads up to the empty name that ends a header.
    void run() {
        while (true) {
            const std::string_view name = name_of(in_, bytes_);
            if (name.empty()) break;
            const std::size_t type_at = in_.at();
            const std::string_view type = name_of(in_, bytes_);
            const auto size = in_.get<std::int32_t>();
            if (size < 0) in_.fail(fmt::format("corrupt EXR header: attribute {} of {} bytes", in_quotes(name), size));
            if (!names_.insert(name).second) in_.fail(fmt::format("corrupt EXR header: attribute {} stands twice", in_quotes(name)));
            const std::string_view value = in_.take(static_cast<std::uint64_t>(size));
            const auto* fixed = std::find_if(std::begin(fixed_sizes), std::end(fixed_sizes), [&](const auto& one) { return one.first == type; });
            if (fixed != std::end(fixed_sizes) && value.size() != fixed->second)
                in_.fail(fmt::format("corrupt EXR header: attribute {} of {} bytes, not {}", in_quotes(name), value.size(), fixed->second));
            ByteReader attribute(in_.name(), value);
            const bool known = take(name, type, attribute, value);
            if (!known && fixed == std::end(fixed_sizes) && type != "string" && !type.empty()) bytes_[type_at] = unknown_type;
        }
        check();
    }

  private:
    void expect(std::string_view name, std::string_view type, std::string_view wanted) const {
        if (type != wanted) in_.fail(fmt::format("corrupt EXR header: attribute {} is of type {}", in_quotes(name), in_quotes(type)));
    }

    /// Whether it is an attribute that the image is read by.
    bool take(std::string_view name, std::string_view type, ByteReader& value, std::string_view bytes) {
        if (name == "dataWindow") {
            expect(name, type, "box2i");
            std::int64_t box[4];
            for (std::int64_t& corner : box) corner = value.get<std::int32_t>();
            width_ = box[2] - box[0] + 1;
            height_ = box[3] - box[1] + 1;
        } else if (name == "compression") {
            expect(name, type, "compression");
            const auto which = value.get<std::uint8_t>();
            if (which >= std::size(chunk_lines)) in_.fail(fmt::format("unknown EXR compression {}", which));
            lines_ = chunk_lines[which];
        } else if (name == "channels") {
            expect(name, type, "chlist");
            while (!name_of(value, bytes).empty()) {
                const auto pixel_type = value.get<std::int32_t>();
                value.take(12);  // linearity and sampling; what is subsampled is counted in full
                pixel_bytes_ += pixel_type == 1 ? 2 : 4;
            }
            if (value.left() > 0) in_.fail("corrupt EXR header: a list of channels of another size");
        } else if (name == "tiles") {
            expect(name, type, "tiledesc");
            tile_width_ = value.get<std::uint32_t>();
            tile_height_ = value.get<std::uint32_t>();
            if (tile_width_ < 1 || tile_height_ < 1) in_.fail("corrupt EXR header: tiles of no size");
        } else if (name == "chunkCount") {
            expect(name, type, "int");
            check_table(value.get<std::int32_t>());
        } else {
            return false;
        }
        return true;
    }

    /// A table of offsets has eight bytes for each chunk.
    void check_table(std::int64_t chunks) const {
        if (chunks < 0 || static_cast<std::uint64_t>(chunks) > bytes_.size() / 8)
            in_.fail(fmt::format("cut short or corrupt: {} chunks in an EXR file of {} bytes", chunks, bytes_.size()));
    }

    void check() const {
        if (names_.count("dataWindow") == 0 || names_.count("channels") == 0 || names_.count("compression") == 0)
            in_.fail("corrupt EXR header: no attribute \"dataWindow\", \"channels\" or \"compression\"");
        if (width_ < 1 || height_ < 1 || width_ > largest_image_side || height_ > largest_image_side)
            in_.fail(fmt::format("an image of {} x {} texels; each side must be in [1,{}]", width_, height_, largest_image_side));
        const bool tiled = names_.count("tiles") != 0;
        const auto chunks = [](std::int64_t all, std::int64_t one) { return (all + one - 1) / one; };
        check_table(tiled ? chunks(width_, tile_width_) * chunks(height_, tile_height_) : chunks(height_, lines_));
        // Beside the pixels there are up to four copies of a chunk with all its channels, in the library and its decoders, and of a
        // file with tiles one row of them. Which of both a file is depends on more than this attribute: both are counted.
        const double width = static_cast<double>(width_), height = static_cast<double>(height_), pixel = static_cast<double>(pixel_bytes_);
        const double lines = width * static_cast<double>(lines_);
        const double tile = static_cast<double>(tile_width_) * static_cast<double>(tile_height_), row = width * static_cast<double>(tile_height_);
        check_memory(in_.name(), image_memory, std::max(pixel, 3.0 * sizeof(float)) * width * height + 4 * pixel * std::max(lines, tile) + pixel * (tiled ? row : 0),
                     bytes_.size());
    }

    ByteReader& in_;
    std::string& bytes_;
    std::set<std::string_view> names_;
    std::int64_t width_ = 0, height_ = 0, tile_width_ = 1, tile_height_ = 1, lines_ = 1;
    std::uint64_t pixel_bytes_ = 0;
};

}  // namespace

std::string checked_exr(const std::string& name, std::string bytes) {
    ByteReader in(name, bytes);
    if (!bytes.starts_with("\x76\x2f\x31\x01")) in.fail("not an EXR file");
    in.take(4);
    const auto version = in.get<std::uint32_t>();
    if ((version & deep_flag) != 0) in.fail("a deep EXR image is not supported");
    do PartChecker(in, bytes).run();
    while ((version & multi_part_flag) != 0 && in.left() > 0 && bytes[in.at()] != '\0');
    return bytes;
}

bool ExrInput::read(char out[], int n) {
    if (n < 0 || static_cast<std::size_t>(n) > bytes_.size() - at_) throw std::runtime_error("the file is cut short");
    std::memcpy(out, bytes_.data() + at_, static_cast<std::size_t>(n));
    at_ += static_cast<std::size_t>(n);
    return at_ < bytes_.size();
}

void ExrInput::seekg(uint64_t position) { at_ = std::min<std::size_t>(position, bytes_.size()); }

}  // namespace clume
