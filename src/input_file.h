// SPDX-License-Identifier: MIT
// Input files as bytes, and how much memory there is to hold what they ask for.
// Only regular files are read: a folder, a device or a pipe is an error, so that a reader never waits or runs on for ever.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace clume {

/// The whole file. Throws SceneError "path: why" if it isn't there, isn't a file, can't be read or doesn't fit in memory.
std::string read_file_bytes(const std::filesystem::path& path);

/// Bytes of memory that may be used: this machine's, or less (src/memory_budget.h).
std::uint64_t physical_memory_bytes();

}  // namespace clume
