// SPDX-License-Identifier: MIT
// SHA-256, for cache keys and for the hash of the device buffers that --stats-json prints.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace clume {

/// 64 lower-case hexadecimal digits.
std::string sha256_hex(std::span<const std::byte> bytes);
std::string sha256_hex(std::string_view text);

}  // namespace clume
