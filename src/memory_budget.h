// SPDX-License-Identifier: MIT
// How much memory this process may use, and whether what comes next fits: asked before it is taken, so that a scene too
// large is refused with figures and nothing is killed half-way. One budget per process, as there is one memory.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace clume {

/// --memory-limit; to be said before anything is read.
void set_memory_limit(std::uint64_t bytes);

/// What was set; else what the machine, or the control group this runs in, had free at the first call, with what this
/// process used already.
std::uint64_t memory_limit();

/// Bytes of physical memory in this machine.
std::uint64_t machine_memory();

/// Bytes of memory that this process holds now (resident).
std::uint64_t memory_in_use();

struct MemoryNeed {
    std::string what;
    std::uint64_t bytes = 0;
};

/// Throws SceneError if that, beside what is in use, would be more than the limit: "NAME: needs 812.0 MB: in use 300.0, film
/// 512.0; the limit is 600.0 MB (--memory-limit)".
void require_memory(const std::string& name, const std::vector<MemoryNeed>& needs);

/// "2G", "512M", "65536K", a number of bytes: powers of 1024. Throws UsageError naming `flag`.
std::uint64_t parse_byte_size(const std::string& flag, const std::string& text);

}  // namespace clume
