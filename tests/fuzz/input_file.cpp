// SPDX-License-Identifier: MIT
#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "src/error.h"
#include "tests/fuzz/targets.h"

namespace clume::fuzz {

void read_as_file(std::string_view bytes, const std::function<void(const std::string& path)>& read) {
    static const int file = memfd_create("input", MFD_CLOEXEC);
    if (file < 0 || ftruncate(file, 0) != 0 || pwrite(file, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
        std::perror("a file in memory");
        std::abort();
    }
    try {
        read("/proc/self/fd/" + std::to_string(file));
    } catch (const SceneError&) {
    }
}

}  // namespace clume::fuzz
