// SPDX-License-Identifier: MIT
// Reads with plain POSIX calls: the size is known and checked before anything is allocated, the file is read in one piece.
#include "src/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "src/error.h"
#include "src/memory_budget.h"

namespace clume {

namespace {

struct Descriptor {
    int fd;
    ~Descriptor() {
        if (fd >= 0) ::close(fd);
    }
};

}  // namespace

std::uint64_t physical_memory_bytes() {
    return std::min(memory_limit(), machine_memory());
}

std::string read_file_bytes(const std::filesystem::path& path) {
    const auto fail = [&](const std::string& why) { throw SceneError(fmt::format("{}: {}", path.string(), why)); };
    // Non-blocking, so that opening a pipe nobody writes to returns.
    const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
    if (file.fd < 0) fail(errno == ENOENT ? "no such file" : std::strerror(errno));
    struct stat status {};
    if (::fstat(file.fd, &status) != 0) fail(std::strerror(errno));
    if (!S_ISREG(status.st_mode)) fail("not a file");
    const auto byte_size = static_cast<std::uint64_t>(status.st_size);
    require_memory(path.string(), {{"the file", byte_size}});
    std::string bytes(byte_size, '\0');
    std::size_t got = 0;
    while (got < bytes.size()) {
        const ssize_t n = ::read(file.fd, bytes.data() + got, bytes.size() - got);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail(std::strerror(errno));
        if (n == 0) break;
        got += static_cast<std::size_t>(n);
    }
    bytes.resize(got);
    return bytes;
}

}  // namespace clume
