// SPDX-License-Identifier: MIT
// The kernel sources inside the binary, by file name; generated from kernels/ at build time.
#pragma once

#include <span>
#include <string_view>

namespace clume {

struct EmbeddedFile {
    std::string_view name;  ///< "math.cl"
    std::string_view text;
};

/// Every file of kernels/, in no particular order.
std::span<const EmbeddedFile> embedded_kernels();

}  // namespace clume
