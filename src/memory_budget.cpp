// SPDX-License-Identifier: MIT
// Figures come from /proc and /sys/fs/cgroup; where a file is missing, that bound is left out.
#include "src/memory_budget.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "src/error.h"

namespace clume {

namespace {

std::atomic<std::uint64_t> limit{0};

std::optional<std::uint64_t> number_in(const std::string& path) {
    std::ifstream file(path);
    std::uint64_t value = 0;
    if (file >> value) return value;
    return std::nullopt;  // not there, or "max"
}

/// What the control group leaves, this process's own share included.
std::uint64_t free_in_control_group() {
    std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
    const auto bound = [&](const std::string& folder, const char* most, const char* now) {
        const auto limit_bytes = number_in(folder + most), used = number_in(folder + now);
        if (limit_bytes && used) least = std::min(least, *limit_bytes - std::min(*limit_bytes, *used) + memory_in_use());
    };
    std::ifstream groups("/proc/self/cgroup");
    for (std::string line; std::getline(groups, line);) {
        if (!line.starts_with("0::")) continue;
        for (std::string path = line.substr(3); !path.empty(); path.erase(path.rfind('/')))
            bound("/sys/fs/cgroup" + path, "/memory.max", "/memory.current");
    }
    bound("/sys/fs/cgroup", "/memory.max", "/memory.current");
    bound("/sys/fs/cgroup/memory", "/memory.limit_in_bytes", "/memory.usage_in_bytes");
    return least;
}

std::uint64_t free_in_machine() {
    std::ifstream file("/proc/meminfo");
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string name;
        std::uint64_t kilobytes = 0;
        if (words >> name >> kilobytes && name == "MemAvailable:") return kilobytes * 1024 + memory_in_use();
    }
    return machine_memory();
}

}  // namespace

std::uint64_t machine_memory() { return static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)); }

void set_memory_limit(std::uint64_t bytes) { limit = bytes; }

std::uint64_t memory_limit() {
    if (limit == 0) limit = std::min(free_in_machine(), free_in_control_group());
    return limit;
}

std::uint64_t memory_in_use() {
    std::ifstream file("/proc/self/statm");
    std::uint64_t size = 0, resident = 0;
    file >> size >> resident;
    return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void require_memory(const std::string& name, const std::vector<MemoryNeed>& needs) {
    const std::uint64_t used = memory_in_use();
    std::uint64_t sum = used;
    for (const MemoryNeed& need : needs) sum += need.bytes;
    if (sum <= memory_limit()) return;
    std::string parts = fmt::format("in use {:.1f}", static_cast<double>(used) / 1e6);
    for (const MemoryNeed& need : needs) parts += fmt::format(", {} {:.1f}", need.what, static_cast<double>(need.bytes) / 1e6);
    throw SceneError(fmt::format("{}: needs {:.1f} MB of memory: {}; the limit is {:.1f} MB (--memory-limit)", name, static_cast<double>(sum) / 1e6, parts,
                                 static_cast<double>(memory_limit()) / 1e6));
}

std::uint64_t parse_byte_size(const std::string& flag, const std::string& text) {
    std::uint64_t value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const std::string unit(stop, text.data() + text.size());
    const int shift = unit.empty() ? 0 : unit == "K" ? 10 : unit == "M" ? 20 : unit == "G" ? 30 : unit == "T" ? 40 : -1;
    if (error != std::errc() || shift < 0 || value == 0 || value > std::numeric_limits<std::uint64_t>::max() >> shift)
        throw UsageError(flag + " " + text + ": must be a size such as 512M or 2G");
    return value << shift;
}

}  // namespace clume
