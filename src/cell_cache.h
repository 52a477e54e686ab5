// SPDX-License-Identifier: MIT
// Cells kept on disk (runtime/disk_cache.h) where building them took long, so that a second render of a scene starts at once.
#pragma once

#include <filesystem>
#include <functional>

#include "runtime/disk_cache.h"
#include "src/cells.h"

namespace clume {

/// The tree over a scene's ellipsoids, built at the latest when this is called.
using TreeSource = std::function<const BvhTree&()>;

/// build_cells(ellipsoids, tree(), options), or what it gave when it was last asked the same, for which no tree is asked for.
/// Kept are those that took that long, up to 256 MB. An empty folder keeps nothing.
Cells cached_cells(std::span<const Ellipsoid> ellipsoids, const TreeSource& tree, const CellOptions& options, const std::filesystem::path& folder,
                   double long_enough_s = 0.05);

/// "cells" beside the programs; empty if there is no cache.
std::filesystem::path cells_folder();

Binary encode_cells(const Cells& cells);
/// Throws SceneError if that is not what encode_cells made.
Cells decode_cells(std::span<const unsigned char> bytes);

}  // namespace clume
