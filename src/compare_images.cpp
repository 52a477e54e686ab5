// SPDX-License-Identifier: MIT
// Colour maps: ColorBrewer's RdBu for signed errors and viridis for cost, both even to the eye and safe for the colour-blind.
#include "src/compare_images.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "src/error.h"
#include "src/image_writer.h"

namespace clume {
namespace {

using Stops = std::span<const std::uint32_t>;

constexpr std::array<std::uint32_t, 11> blue_white_red{0x053061, 0x2166ac, 0x4393c3, 0x92c5de, 0xd1e5f0, 0xf7f7f7,
                                                       0xfddbc7, 0xf4a582, 0xd6604d, 0xb2182b, 0x67001f};
constexpr std::array<std::uint32_t, 10> viridis{0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e, 0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b, 0xfde725};

/// Colour at t in 0..1 (clamped; NaN is 0).
void colour(Stops stops, double t, std::uint8_t* out) {
    const double at = (t > 0 ? std::min(t, 1.0) : 0.0) * static_cast<double>(stops.size() - 1);
    const auto i = std::min(static_cast<std::size_t>(at), stops.size() - 2);
    const double f = at - static_cast<double>(i);
    for (int c = 0; c < 3; ++c) {
        const int shift = 16 - 8 * c;
        const double a = (stops[i] >> shift) & 255u, b = (stops[i + 1] >> shift) & 255u;
        out[c] = static_cast<std::uint8_t>(std::lround(a + (b - a) * f));
    }
}

std::string gradient(Stops stops) {
    std::string css = "linear-gradient(to right";
    for (const std::uint32_t s : stops) css += fmt::format(",#{:06x}", s);
    return css + ")";
}

Picture blank(int width, int height) {
    return {width, height, std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
}

}  // namespace

Picture tone_mapped(std::span<const double> rgb, int width, int height, double stops) {
    Picture p = blank(width, height);
    const double gain = std::exp2(stops);
    std::transform(rgb.begin(), rgb.end(), p.rgb.begin(), [&](double v) { return encode_srgb(gain * v); });
    return p;
}

double common_exposure(std::span<const double> rgb) {
    const double bright = percentile({rgb.begin(), rgb.end()}, 0.99);
    return bright > 0 && (bright < 0.25 || bright > 1) ? std::log2(0.8 / bright) : 0;
}

std::vector<double> signed_errors(std::span<const double> rgb, std::span<const double> reference) {
    std::vector<double> errors(rgb.size() / 3);
    for (std::size_t i = 0; i < rgb.size(); ++i) errors[i / 3] += (rgb[i] - reference[i]) / 3;
    return errors;
}

Picture error_map(std::span<const double> errors, int width, int height, double scale) {
    Picture p = blank(width, height);
    for (std::size_t i = 0; i < errors.size(); ++i) colour(blue_white_red, 0.5 + 0.5 * errors[i] / scale, &p.rgb[3 * i]);
    return p;
}

Picture cost_map(std::span<const float> cost, int width, int height, double least, double most) {
    Picture p = blank(width, height);
    for (std::size_t i = 0; i < cost.size(); ++i)
        colour(viridis, std::log(std::max(static_cast<double>(cost[i]), least) / least) / std::log(most / least), &p.rgb[3 * i]);
    return p;
}

double percentile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

Picture shrunk(const Picture& picture, int most) {
    const int by = (picture.width + most - 1) / most;
    if (by <= 1) return picture;
    Picture out = blank((picture.width + by - 1) / by, (picture.height + by - 1) / by);
    for (int y = 0; y < out.height; ++y)
        for (int x = 0; x < out.width; ++x)
            for (int c = 0; c < 3; ++c) {
                int sum = 0, count = 0;
                for (int v = y * by; v < std::min((y + 1) * by, picture.height); ++v)
                    for (int u = x * by; u < std::min((x + 1) * by, picture.width); ++u, ++count)
                        sum += picture.rgb[static_cast<std::size_t>(3 * (u + picture.width * v) + c)];
                out.rgb[static_cast<std::size_t>(3 * (x + out.width * y) + c)] = static_cast<std::uint8_t>((sum + count / 2) / count);
            }
    return out;
}

std::string png_bytes(const Picture& picture) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = static_cast<png_uint_32>(picture.width);
    png.height = static_cast<png_uint_32>(picture.height);
    png.format = PNG_FORMAT_RGB;
    png_alloc_size_t size = 0;
    if (png_image_write_to_memory(&png, nullptr, &size, 0, picture.rgb.data(), 0, nullptr) == 0) throw RenderError(std::string("PNG: ") + png.message);
    std::string bytes(size, '\0');
    if (png_image_write_to_memory(&png, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) == 0) throw RenderError(std::string("PNG: ") + png.message);
    bytes.resize(size);
    return bytes;
}

std::string data_uri(const std::string& type, const std::string& bytes) {
    constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out = "data:" + type + ";base64,";
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t word = 0;
        const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
        for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < n ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) out += k <= n ? digits[word >> (18 - 6 * k) & 63u] : '=';
    }
    return out;
}

std::string error_gradient() { return gradient(blue_white_red); }
std::string cost_gradient() { return gradient(viridis); }

}  // namespace clume
