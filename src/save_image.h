// SPDX-License-Identifier: MIT
// The end of a render: the image to its files. Hours of work are not lost for want of a folder or of space: what can't be
// written where it was asked for is written elsewhere.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "src/image_writer.h"

namespace clume {

struct SavedImage {
    std::vector<std::filesystem::path> files;  ///< written: the EXR, then the PNG if it could be
    std::vector<std::string> failures;         ///< one line each; empty if all is where it was asked for
};

/// Writes `exr` and `png`. Where the EXR can't be written it goes under a name not taken ("NAME-rescued.exr") to the first
/// of current folder, $HOME and folder for temporary files that takes it, the PNG beside it. A PNG alone is not rescued.
/// Throws RenderError if the EXR could be written nowhere.
SavedImage save_image(const std::filesystem::path& exr, const std::filesystem::path& png, const RenderImage& image, const ImageMetadata& metadata,
                      double exposure_stops);

}  // namespace clume
