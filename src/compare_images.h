// SPDX-License-Identifier: MIT
// Pictures of a report: images at one exposure, signed error maps, cost maps; all 8-bit sRGB, as PNG bytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace clume {

/// Row 0 on top, RGB interleaved.
struct Picture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

/// Linear RGB times 2^stops.
Picture tone_mapped(std::span<const double> rgb, int width, int height, double stops);

/// 0 where the image is well exposed as it is, else what puts its 99th percentile at 0.8.
double common_exposure(std::span<const double> rgb);

/// Mean over the channels of (x − r), per pixel.
std::vector<double> signed_errors(std::span<const double> rgb, std::span<const double> reference);

/// Blue: too dark by `scale` or more; white: right; red: too bright.
Picture error_map(std::span<const double> errors, int width, int height, double scale);

/// Dark: at most `least`; yellow: `most` or more; logarithmic between (0 < least < most).
Picture cost_map(std::span<const float> cost, int width, int height, double least, double most);

/// The value that `share` of the values stay below; 0 without values.
double percentile(std::vector<double> values, double share);

/// Averages whole blocks of pixels until it is at most `most` wide.
Picture shrunk(const Picture& picture, int most);

/// Throws RenderError.
std::string png_bytes(const Picture& picture);

/// "data:<type>;base64,..."
std::string data_uri(const std::string& type, const std::string& bytes);

/// CSS gradients of the two colour maps, from left to right, for scale bars.
std::string error_gradient();
std::string cost_gradient();

}  // namespace clume
