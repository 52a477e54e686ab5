// SPDX-License-Identifier: MIT
// A look at an EXR file's headers before the OpenEXR library may see them: the library allocates by the sizes it finds there
// (attributes, tiles, scan lines, tables of offsets), whatever the file holds. The format: openexr.com, "OpenEXR File Layout".
#pragma once

#include <string>
#include <string_view>

namespace clume {

/// Throws SceneError "name: why" unless every attribute lies within the file, no attribute stands twice in a header, each table
/// of chunks can be there, and each part's pixels, all channels taken, are within half of `image_memory` (memory_bound.h).
/// Deep images are refused.
void check_exr_headers(const std::string& name, std::string_view bytes);

}  // namespace clume
