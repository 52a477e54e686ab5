// SPDX-License-Identifier: MIT
// Images to and from files. EXR holds everything, in 32-bit floats; PNG is a preview. Both are written whole or not at all.
// All functions throw RenderError with the file and the reason.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "src/output_file.h"
#include "src/renderer.h"

namespace clume {

using ImageMetadata = std::vector<std::pair<std::string, std::string>>;

/// Scanline OpenEXR, ZIP: R, G, B (premultiplied, linear Rec.709), A, variance.R/G/B (of the mean) as float, `samples` as
/// uint. The data window is the crop window inside a display window of the whole film. Metadata become string attributes.
void write_exr(const std::filesystem::path& path, const RenderImage& image, const ImageMetadata& metadata = {});

/// Reads what write_exr writes, attributes other than strings left out. With `colour_suffices` a file of any origin will do
/// that has R, G and B: what else it lacks is 0 (a variance of 0 means: taken as exact).
RenderImage read_exr(const std::filesystem::path& path, ImageMetadata* metadata = nullptr, bool colour_suffices = false);

/// 8-bit opaque RGB, sRGB, of the crop window: the image over black, which premultiplied colour already is, times 2^exposure,
/// clipped to 0..1.
void write_png(const std::filesystem::path& path, const RenderImage& image, double exposure_stops = 0);

/// Linear to 8-bit sRGB (IEC 61966-2-1), clipped; NaN becomes 0.
std::uint8_t encode_srgb(double linear);

}  // namespace clume
