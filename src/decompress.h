// SPDX-License-Identifier: MIT
// The two compressions of voxel files, from memory to memory, for input that may be damaged: never beyond either end.
#pragma once

#include <cstddef>
#include <string_view>

namespace clume {

/// False unless `from` is a zlib stream of exactly `byte_size` bytes.
bool unzip(std::string_view from, void* to, std::size_t byte_size);

/// False unless `from` is a Blosc (version 1) buffer of exactly `byte_size` bytes.
bool unblosc(std::string_view from, void* to, std::size_t byte_size);

}  // namespace clume
