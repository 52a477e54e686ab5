// SPDX-License-Identifier: MIT
#include "src/memory_bound.h"

#include <fmt/format.h>

#include "src/error.h"

namespace clume {

void check_memory(const std::string& name, const MemoryBound& bound, double needed, std::uint64_t file_bytes) {
    const double most = 0.5 * static_cast<double>(bound.of(file_bytes));
    if (!(needed <= most))
        throw SceneError(fmt::format("{}: asks for {:.3g} MB, more than the {:.3g} MB that a file of {} bytes may make of itself", name,
                                     needed * 1e-6, most * 1e-6, file_bytes));
}

}  // namespace clume
