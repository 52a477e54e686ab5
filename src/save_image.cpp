// SPDX-License-Identifier: MIT
#include "src/save_image.h"

#include <cstdlib>
#include <system_error>

#include "src/error.h"
#include "src/interrupt.h"

namespace clume {

namespace fs = std::filesystem;

namespace {

std::vector<fs::path> rescue_folders() {
    std::vector<fs::path> folders{"."};
    if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') folders.emplace_back(home);
    std::error_code error;
    const fs::path temporary = fs::temp_directory_path(error);
    folders.push_back(error ? fs::path("/tmp") : temporary);
    return folders;
}

/// NAME-rescued.exr, NAME-rescued-2.exr, ... in the folder: the first that isn't there.
fs::path free_name(const fs::path& folder, const fs::path& exr) {
    const std::string stem = exr.stem().string() + "-rescued";
    std::error_code error;
    for (int n = 1; n < 1000; ++n) {
        fs::path path = folder / (stem + (n == 1 ? "" : "-" + std::to_string(n)) + ".exr");
        if (!fs::exists(fs::symlink_status(path, error))) return path;
    }
    return folder / (stem + ".exr");
}

}  // namespace

SavedImage save_image(const fs::path& exr, const fs::path& png, const RenderImage& image, const ImageMetadata& metadata, double exposure_stops) {
    const PutOffLeaving until_written;
    SavedImage saved;
    fs::path preview = png;
    try {
        write_exr(exr, image, metadata);
        saved.files.push_back(exr);
    } catch (const RenderError& error) {
        std::string failure = error.what();
        for (const fs::path& folder : rescue_folders()) {
            const fs::path elsewhere = free_name(folder, exr);
            try {
                write_exr(elsewhere, image, metadata);
            } catch (const RenderError& again) {
                failure += std::string("\n  nor elsewhere: ") + again.what();
                continue;
            }
            saved.files.push_back(elsewhere);
            preview = fs::path(elsewhere).replace_extension(".png");
            break;
        }
        if (saved.files.empty()) throw RenderError(failure);
        saved.failures.push_back(failure + "\n  the image was saved as " + saved.files.front().string());
    }
    try {
        write_png(preview, image, exposure_stops);
        saved.files.push_back(preview);
    } catch (const RenderError& error) {
        saved.failures.push_back(error.what());
    }
    return saved;
}

}  // namespace clume
