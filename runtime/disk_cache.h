// SPDX-License-Identifier: MIT
// What took long to make kept on disk, one file per key: program binaries (of platforms without a cache of their own), choices of
// pilots, lists of cells. A file that is damaged, cut short, of another version or of another key is as good as none: nothing
// here throws, the caller makes it anew.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace clume {

using Binary = std::vector<unsigned char>;

/// $XDG_CACHE_HOME/clume or ~/.cache/clume; empty if neither variable is set.
std::filesystem::path cache_folder();

/// File content: magic, key, SHA-256 of the binary, its size, the binary.
std::string encode_cache_entry(std::string_view key, std::span<const unsigned char> binary);
/// Nothing unless every part is as encode_cache_entry wrote it for that key.
std::optional<Binary> decode_cache_entry(std::string_view key, std::string_view content);

std::optional<Binary> load_binary(const std::filesystem::path& folder, const std::string& key);
/// Written to a temporary file, then renamed; the oldest files beyond 256, or beyond 1 GB together, are removed. False if it
/// couldn't be written.
bool store_binary(const std::filesystem::path& folder, const std::string& key, std::span<const unsigned char> binary);

}  // namespace clume
