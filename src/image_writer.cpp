// SPDX-License-Identifier: MIT
// OpenEXR and libpng behind two functions. Both libraries write through the stream of an OutputFile, so that a full disk is
// noticed (OpenEXR's destructor, which writes the line table, swallows exceptions: the stream remembers the error).
#include "src/image_writer.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "src/error.h"
#include "src/exr_input.h"
#include "src/input_file.h"

namespace clume {

namespace {

/// OpenEXR's output stream over a C stream.
class ExrStream : public Imf::OStream {
  public:
    ExrStream(std::FILE* file, const char* name) : Imf::OStream(name), file_(file) {}
    void write(const char bytes[], int count) override {
        if (std::fwrite(bytes, 1, static_cast<std::size_t>(count), file_) != static_cast<std::size_t>(count))
            throw RenderError("a write failed (is the disk full?)");
    }
    std::uint64_t tellp() override { return static_cast<std::uint64_t>(ftello(file_)); }
    void seekp(std::uint64_t position) override {
        if (fseeko(file_, static_cast<off_t>(position), SEEK_SET) != 0) throw RenderError("a seek failed");
    }

  private:
    std::FILE* file_;
};

constexpr std::array colour_names{"R", "G", "B"};
constexpr std::array variance_names{"variance.R", "variance.G", "variance.B"};

/// Channels of `image`; the frame buffer reads from or writes to its arrays, which must have their full size.
Imf::FrameBuffer frame_buffer(RenderImage& image, const Imath::Box2i& window) {
    Imf::FrameBuffer buffer;
    const auto width = static_cast<std::size_t>(window.max.x - window.min.x) + 1;
    const auto add = [&](const char* name, Imf::PixelType type, void* data, std::size_t stride) {
        buffer.insert(name, Imf::Slice::Make(type, data, window, stride, stride * width));
    };
    for (std::size_t c = 0; c < 3; ++c) {
        add(colour_names[c], Imf::FLOAT, image.rgb.data() + c, 3 * sizeof(float));
        add(variance_names[c], Imf::FLOAT, image.variance.data() + c, 3 * sizeof(float));
    }
    add("A", Imf::FLOAT, image.alpha.data(), sizeof(float));
    add("samples", Imf::UINT, image.samples.data(), sizeof(std::uint32_t));
    return buffer;
}

/// Pixels of the window. Throws RenderError if the arrays do not fit it.
std::size_t checked_pixel_count(const std::filesystem::path& path, const RenderImage& image) {
    const CropWindow& w = image.window;
    const bool inside =
        w.x0 >= 0 && w.y0 >= 0 && w.x0 < w.x1 && w.y0 < w.y1 && w.x1 <= image.film_width && w.y1 <= image.film_height;
    const std::size_t count = inside ? static_cast<std::size_t>(w.x1 - w.x0) * static_cast<std::size_t>(w.y1 - w.y0) : 0;
    if (count == 0 || image.rgb.size() != 3 * count || image.alpha.size() != count || image.variance.size() != 3 * count ||
        image.samples.size() != count)
        throw RenderError(path.string() + ": cannot be written: the image does not fit its window");
    return count;
}

}  // namespace

std::uint8_t encode_srgb(double linear) {
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 255;
    const double encoded = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::lround(encoded * 255));
}

void write_exr(const std::filesystem::path& path, const RenderImage& image, const ImageMetadata& metadata) {
    checked_pixel_count(path, image);
    OutputFile file(path);
    try {
        const CropWindow& w = image.window;
        const Imath::Box2i display({0, 0}, {image.film_width - 1, image.film_height - 1});
        const Imath::Box2i data({w.x0, w.y0}, {w.x1 - 1, w.y1 - 1});
        Imf::Header header(display, data);
        header.compression() = Imf::ZIP_COMPRESSION;
        Imf::addChromaticities(header, Imf::Chromaticities());  // Rec.709, D65
        for (const auto& [key, value] : metadata) header.insert(key, Imf::StringAttribute(value));
        // The frame buffer's pointers are not const, but an output file only reads through them.
        const Imf::FrameBuffer buffer = frame_buffer(const_cast<RenderImage&>(image), data);
        for (auto slice = buffer.begin(); slice != buffer.end(); ++slice)
            header.channels().insert(slice.name(), Imf::Channel(slice.slice().type));
        const std::string name = path.string();
        ExrStream stream(file.stream(), name.c_str());
        Imf::OutputFile exr(stream, header);
        exr.setFrameBuffer(buffer);
        exr.writePixels(w.y1 - w.y0);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        file.fail(error.what());
    }
    file.commit();
}

RenderImage read_exr(const std::filesystem::path& path, ImageMetadata* metadata, bool colour_suffices) {
    try {
        const std::string bytes = checked_exr(path.string(), read_file_bytes(path));
        ExrInput stream(path.string(), bytes);
        Imf::InputFile exr(stream);
        const Imf::Header& header = exr.header();
        const Imath::Box2i data = header.dataWindow(), display = header.displayWindow();
        RenderImage image;
        image.film_width = display.max.x - display.min.x + 1;
        image.film_height = display.max.y - display.min.y + 1;
        image.window = {data.min.x, data.min.y, data.max.x + 1, data.max.y + 1};
        const auto count =
            static_cast<std::size_t>(data.max.x - data.min.x + 1) * static_cast<std::size_t>(data.max.y - data.min.y + 1);
        image.rgb.resize(3 * count);
        image.alpha.resize(count);
        image.variance.resize(3 * count);
        image.samples.resize(count);
        const Imf::FrameBuffer buffer = frame_buffer(image, data);
        for (auto slice = buffer.begin(); slice != buffer.end(); ++slice)
            if (header.channels().findChannel(slice.name()) == nullptr &&
                (!colour_suffices || std::find(colour_names.begin(), colour_names.end(), std::string_view(slice.name())) != colour_names.end()))
                throw RenderError(std::string("it has no channel ") + slice.name());
        exr.setFrameBuffer(buffer);
        exr.readPixels(data.min.y, data.max.y);
        if (metadata != nullptr)
            for (auto attribute = header.begin(); attribute != header.end(); ++attribute)
                if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute.attribute()))
                    metadata->emplace_back(attribute.name(), text->value());
        return image;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const SceneError& error) {
        throw RenderError(path.string() + ": cannot be read" + (error.what() + path.string().size()));
    } catch (const std::exception& error) {
        throw RenderError(path.string() + ": cannot be read: " + error.what());
    }
}

void write_png(const std::filesystem::path& path, const RenderImage& image, double exposure_stops) {
    const std::size_t count = checked_pixel_count(path, image);
    const double gain = std::exp2(exposure_stops);
    std::vector<std::uint8_t> bytes(3 * count);
    std::transform(image.rgb.begin(), image.rgb.end(), bytes.begin(), [&](float v) { return encode_srgb(gain * v); });

    OutputFile file(path);
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(image.window.x1 - image.window.x0);
    png.height = static_cast<png_uint_32>(image.window.y1 - image.window.y0);
    png.format = PNG_FORMAT_RGB;  // 8-bit formats are sRGB to libpng, which writes the sRGB chunk
    if (png_image_write_to_stdio(&png, file.stream(), 0, bytes.data(), 0, nullptr) == 0) file.fail(png.message);
    file.commit();
}

}  // namespace clume
