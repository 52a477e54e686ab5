// SPDX-License-Identifier: MIT
// While it lives, the process can't take more than `extra` bytes beyond what it has: what asks for more gets std::bad_alloc.
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <cstdint>
#include <fstream>

namespace clume::test {

class MemoryLimit {
  public:
    explicit MemoryLimit([[maybe_unused]] std::uint64_t extra) {
        getrlimit(RLIMIT_AS, &before_);
#ifndef __SANITIZE_ADDRESS__
        std::ifstream in("/proc/self/statm");
        std::uint64_t pages = 0;
        in >> pages;
        rlimit limit = before_;
        limit.rlim_cur = std::min<rlim_t>(before_.rlim_cur, pages * 4096 + extra);
        setrlimit(RLIMIT_AS, &limit);
#endif
    }
    ~MemoryLimit() { setrlimit(RLIMIT_AS, &before_); }

  private:
    rlimit before_{};
};

}  // namespace clume::test
