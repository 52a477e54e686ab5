// SPDX-License-Identifier: MIT
// A folder with the smallest files that a scene can name: a.ply, a.vol, a.nvdb, a.vdb, a.raw (2 × 2 × 2), a.exr, a.hdr.
#pragma once

#include <filesystem>

#include "tests/temp_folder.h"

namespace clume::fuzz {

class SmallFiles {
  public:
    SmallFiles();
    const std::filesystem::path& folder() const { return folder_.path(); }

  private:
    test::TempFolder folder_;
};

}  // namespace clume::fuzz
