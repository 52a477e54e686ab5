// SPDX-License-Identifier: MIT
// EXR files as the OpenEXR library may see them: it allocates by the sizes it finds in a header (attributes, tiles, scan lines,
// tables of offsets), whatever the file holds, and reads some attributes to their own end, not the header's. The format:
// openexr.com, "OpenEXR File Layout".
#pragma once

#include <ImfIO.h>

#include <string>
#include <string_view>

namespace clume {

/// The file's bytes, made safe to read. Throws SceneError "name: why" unless every attribute lies within the file, none stands
/// twice in a header, each table of chunks can be there, and each part's pixels, all channels taken, are within half of
/// `image_memory` (memory_bound.h). Deep images are refused. Attributes that no image needs and whose type has no fixed size
/// (previews, manifests, lists of texts) become opaque to the library.
std::string checked_exr(const std::string& name, std::string bytes);

/// Reads bytes that outlive it.
class ExrInput : public Imf::IStream {
  public:
    ExrInput(const std::string& name, std::string_view bytes) : Imf::IStream(name.c_str()), bytes_(bytes) {}
    bool read(char out[], int n) override;
    uint64_t tellg() override { return at_; }
    void seekg(uint64_t position) override;

  private:
    std::string_view bytes_;
    std::size_t at_ = 0;
};

}  // namespace clume
