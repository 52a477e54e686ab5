// SPDX-License-Identifier: MIT
// EXR by the OpenEXR library, from memory; Radiance HDR [Ward92, "Real pixels", Graphics Gems II] by the few lines below:
// the usual single-file decoders take a file cut short for zeros, or never return from it.
#include "src/environment_reader.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "src/error.h"
#include "src/exr_input.h"
#include "src/input_file.h"
#include "src/json_reader.h"
#include "src/memory_bound.h"

namespace clume {

namespace {

[[noreturn]] void fail(const std::string& name, const std::string& why) { throw SceneError(fmt::format("{}: {}", name, why)); }

/// An image of that size, checked but without its texels.
EnvironmentImage sized_image(const std::string& name, std::int64_t width, std::int64_t height, std::uint64_t file_bytes) {
    if (width < 1 || height < 1 || width > largest_image_side || height > largest_image_side)
        fail(name, fmt::format("an image of {} x {} texels; each side must be in [1,{}]", width, height, largest_image_side));
    // The file and the tables that follow from the image need room as well.
    const std::uint64_t byte_size = static_cast<std::uint64_t>(width * height) * 3 * sizeof(float);
    if (byte_size > physical_memory_bytes() / 2)
        fail(name, fmt::format("an image of {} x {} texels needs {:.1f} GB; this machine has {:.1f}", width, height,
                               static_cast<double>(byte_size) * 2e-9, static_cast<double>(physical_memory_bytes()) * 1e-9));
    check_memory(name, image_memory, static_cast<double>(byte_size), file_bytes);
    EnvironmentImage image;
    image.width = static_cast<int>(width);
    image.height = static_cast<int>(height);
    return image;
}

EnvironmentImage read_exr(const std::string& name, const std::string& bytes) {
    ExrInput stream(name, bytes);
    Imf::InputFile file(stream);
    const Imf::Header& header = file.header();
    const Imath::Box2i data = header.dataWindow(), display = header.displayWindow();

    const Imf::ChannelList& channels = header.channels();
    const bool rgb = channels.findChannel("R") && channels.findChannel("G") && channels.findChannel("B");
    if (!rgb && !channels.findChannel("Y")) fail(name, "no channels R, G and B, and no Y");
    if (!rgb && (channels.findChannel("RY") || channels.findChannel("BY")))
        fail(name, "luminance and chroma channels are not supported; save it with R, G and B");
    for (const char* channel : {"R", "G", "B", "Y"})
        if (const Imf::Channel* found = channels.findChannel(channel);
            found && (rgb != (channel[0] == 'Y')) && (found->xSampling != 1 || found->ySampling != 1))
            fail(name, fmt::format("channel {} is subsampled", channel));

    const auto side = [](int low, int high) { return static_cast<std::int64_t>(high) - low + 1; };
    EnvironmentImage image = sized_image(name, side(display.min.x, display.max.x), side(display.min.y, display.max.y), bytes.size());
    EnvironmentImage stored = sized_image(name, side(data.min.x, data.max.x), side(data.min.y, data.max.y), bytes.size());
    const auto texels = [](const EnvironmentImage& of) { return static_cast<double>(of.width) * of.height; };
    // Where the windows differ, both are held for a while.
    if (data != display) check_memory(name, image_memory, (texels(image) + texels(stored)) * 3 * sizeof(float), bytes.size());
    stored.rgb.resize(static_cast<std::size_t>(stored.width) * static_cast<std::size_t>(stored.height) * 3);

    const std::size_t x_stride = 3 * sizeof(float), y_stride = x_stride * static_cast<std::size_t>(stored.width);
    // The library wants the address that pixel (0, 0) would have.
    const auto base = reinterpret_cast<std::intptr_t>(stored.rgb.data()) -
                      static_cast<std::intptr_t>(data.min.x) * static_cast<std::intptr_t>(x_stride) -
                      static_cast<std::intptr_t>(data.min.y) * static_cast<std::intptr_t>(y_stride);
    Imf::FrameBuffer frame;
    const auto slice = [&](const char* channel, std::size_t offset) {
        frame.insert(channel,
                     Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(base + static_cast<std::intptr_t>(offset * sizeof(float))),  // NOLINT(performance-no-int-to-ptr)
                                x_stride, y_stride));
    };
    if (rgb) {
        slice("R", 0);
        slice("G", 1);
        slice("B", 2);
    } else {
        slice("Y", 0);
    }
    file.setFrameBuffer(frame);
    file.readPixels(data.min.y, data.max.y);
    if (!rgb)
        for (std::size_t i = 0; i < stored.rgb.size(); i += 3) stored.rgb[i + 1] = stored.rgb[i + 2] = stored.rgb[i];
    if (data == display) return stored;

    image.rgb.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3);
    const std::int64_t shift_x = static_cast<std::int64_t>(data.min.x) - display.min.x,
                       shift_y = static_cast<std::int64_t>(data.min.y) - display.min.y;
    for (std::int64_t y = 0; y < stored.height; ++y)
        for (std::int64_t x = 0; x < stored.width; ++x) {
            const std::int64_t to_x = x + shift_x, to_y = y + shift_y;
            if (to_x < 0 || to_y < 0 || to_x >= image.width || to_y >= image.height) continue;
            std::copy_n(stored.rgb.begin() + (y * stored.width + x) * 3, 3,
                        image.rgb.begin() + (to_y * image.width + to_x) * 3);
        }
    return image;
}

class HdrReader {
  public:
    HdrReader(const std::string& name, std::string_view bytes) : name_(name), bytes_(bytes) {}

    EnvironmentImage run() {
        line();
        bool known = false;
        while (true) {
            const std::string_view text = line();
            if (text.empty()) break;
            if (text.starts_with("FORMAT=")) {
                if (text != "FORMAT=32-bit_rle_rgbe")
                    fail(name_, fmt::format("unknown HDR format {}; known: 32-bit_rle_rgbe", in_quotes(text.substr(7))));
                known = true;
            }
        }
        if (!known) fail(name_, "the HDR header has no FORMAT line");
        const std::string_view size = line();
        int width = 0, height = 0, used = 0;
        const std::string words(size);
        if (words.size() > 64 || std::sscanf(words.c_str(), "-Y %9d +X %9d%n", &height, &width, &used) != 2 ||
            static_cast<std::size_t>(used) != words.size())
            fail(name_, fmt::format("unknown HDR orientation or size {}; known: -Y height +X width", in_quotes(size)));
        EnvironmentImage image = sized_image(name_, width, height, bytes_.size());
        std::vector<unsigned char> texels(static_cast<std::size_t>(width) * 4);
        for (int y = 0; y < height; ++y) {
            scan_line(texels);
            // Grown as read: what the header says costs nothing until the file holds it.
            image.rgb.resize(image.rgb.size() + static_cast<std::size_t>(width) * 3);
            for (int x = 0; x < width; ++x) {
                const unsigned char* texel = texels.data() + static_cast<std::size_t>(x) * 4;
                const float unit = texel[3] == 0 ? 0.0f : std::ldexp(1.0f, texel[3] - (128 + 8));
                float* out = image.rgb.data() +
                             (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) * 3;
                for (int c = 0; c < 3; ++c) out[c] = static_cast<float>(texel[c]) * unit;
            }
        }
        return image;
    }

  private:
    std::string_view line() {
        const std::size_t end = bytes_.find('\n', at_);
        if (end == std::string_view::npos) fail(name_, "the HDR header has no end");
        std::string_view text = bytes_.substr(at_, end - at_);
        if (text.ends_with('\r')) text.remove_suffix(1);
        at_ = end + 1;
        return text;
    }

    unsigned char byte() {
        if (at_ >= bytes_.size()) fail(name_, "the file is cut short");
        return static_cast<unsigned char>(bytes_[at_++]);
    }

    void scan_line(std::vector<unsigned char>& texels) {
        const std::size_t width = texels.size() / 4;
        unsigned char head[4];
        for (unsigned char& b : head) b = byte();
        const bool per_channel = width >= 8 && width < 32768 && head[0] == 2 && head[1] == 2 && head[2] < 128;
        if (per_channel) {
            if (static_cast<std::size_t>(head[2]) * 256 + head[3] != width)
                fail(name_, "corrupt HDR: a scan line of another length");
            for (std::size_t c = 0; c < 4; ++c)
                for (std::size_t x = 0; x < width;) {
                    const unsigned char count = byte();
                    const std::size_t run = count > 128 ? count - 128u : count;
                    if (run == 0 || run > width - x) fail(name_, "corrupt HDR: a run beyond its scan line");
                    const unsigned char value = count > 128 ? byte() : static_cast<unsigned char>(0);
                    for (std::size_t i = 0; i < run; ++i) texels[(x++) * 4 + c] = count > 128 ? value : byte();
                }
            return;
        }
        // Flat texels; (1, 1, 1, n) repeats the last one, n in base 256 over marks that follow each other.
        int shift = 0;
        for (std::size_t x = 0; x < width;) {
            if (x > 0 || shift > 0)
                for (unsigned char& b : head) b = byte();
            if (head[0] == 1 && head[1] == 1 && head[2] == 1) {
                const std::size_t run = shift < 24 ? static_cast<std::size_t>(head[3]) << shift : width;
                if (x == 0 || run > width - x) fail(name_, "corrupt HDR: a run beyond its scan line");
                for (std::size_t i = 0; i < run; ++i, ++x)
                    std::copy_n(texels.begin() + static_cast<std::ptrdiff_t>((x - 1) * 4), 4,
                                texels.begin() + static_cast<std::ptrdiff_t>(x * 4));
                shift += 8;
            } else {
                std::copy_n(head, 4, texels.begin() + static_cast<std::ptrdiff_t>(x++ * 4));
                shift = 0;
            }
        }
    }

    const std::string& name_;
    std::string_view bytes_;
    std::size_t at_ = 0;
};

}  // namespace

EnvironmentImage read_environment(const std::filesystem::path& path) {
    const std::string name = path.string();
    std::string bytes = read_file_bytes(path);
    EnvironmentImage image;
    try {
        if (bytes.starts_with("\x76\x2f\x31\x01"))
            image = read_exr(name, checked_exr(name, std::move(bytes)));
        else if (bytes.starts_with("#?RADIANCE") || bytes.starts_with("#?RGBE"))
            image = HdrReader(name, bytes).run();
        else
            fail(name, "unknown format: neither EXR nor Radiance HDR");
    } catch (const SceneError&) {
        throw;
    } catch (const std::exception& error) {
        // One line, whatever the library says.
        std::string why = error.what();
        std::replace(why.begin(), why.end(), '\n', ' ');
        fail(name, "corrupt or unreadable image: " + why);
    }
    for (std::size_t i = 0; i < image.rgb.size(); ++i) {
        const float value = image.rgb[i];
        if (std::isfinite(value) && value >= 0) continue;
        const std::size_t texel = i / 3, width = static_cast<std::size_t>(image.width);
        fail(name, fmt::format("texel ({}, {}) is {}; every value must be finite and not negative", texel % width,
                               texel / width, value));
    }
    return image;
}

}  // namespace clume
