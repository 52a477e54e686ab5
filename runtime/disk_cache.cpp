// SPDX-License-Identifier: MIT
// The cache's file format and folder. Several processes may use one folder: files appear whole by rename.
#include "runtime/disk_cache.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <system_error>
#include <utility>

#include "runtime/hash.h"

namespace clume {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view magic = "CLUMEPC1";
constexpr std::size_t digest_size = 64, length_size = 16;
constexpr std::size_t most_files = 256;
constexpr std::uintmax_t most_bytes = std::uintmax_t{1} << 30;

std::string fixed_hex(std::uint64_t value) {
    std::string text(length_size, '0');
    for (std::size_t i = length_size; i-- > 0; value >>= 4) text[i] = "0123456789abcdef"[value & 15];
    return text;
}

std::string digest_of(std::span<const unsigned char> binary) {
    return sha256_hex(std::as_bytes(binary));
}

fs::path file_of(const fs::path& folder, const std::string& key) {
    return folder / (key + ".clbin");
}

void remove_oldest(const fs::path& folder) {
    struct File {
        fs::file_time_type time;
        std::uintmax_t size;
        fs::path path;
    };
    std::vector<File> files;
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
        std::error_code gone;
        if (it->path().extension() == ".clbin") files.push_back({it->last_write_time(gone), it->file_size(gone), it->path()});
    }
    std::sort(files.begin(), files.end(), [](const File& a, const File& b) { return a.time > b.time; });
    std::uintmax_t bytes = 0;
    for (std::size_t i = 0; i < files.size(); ++i)
        if ((bytes += files[i].size) > most_bytes || i >= most_files) fs::remove(files[i].path, error);
}

}  // namespace

fs::path cache_folder() {
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache) return fs::path(cache) / "clume";
    if (const char* home = std::getenv("HOME"); home && *home) return fs::path(home) / ".cache" / "clume";
    return {};
}

std::string encode_cache_entry(std::string_view key, std::span<const unsigned char> binary) {
    std::string content(magic);
    content += sha256_hex(key);
    content += digest_of(binary);
    content += fixed_hex(binary.size());
    content.append(binary.begin(), binary.end());
    return content;
}

std::optional<Binary> decode_cache_entry(std::string_view key, std::string_view content) {
    const std::size_t header = magic.size() + 2 * digest_size + length_size;
    if (content.size() <= header || !content.starts_with(magic)) return std::nullopt;
    const std::string_view payload = content.substr(header);
    const Binary binary(payload.begin(), payload.end());
    if (content.substr(magic.size(), digest_size) != sha256_hex(key)) return std::nullopt;
    if (content.substr(magic.size() + digest_size, digest_size) != digest_of(binary)) return std::nullopt;
    if (content.substr(magic.size() + 2 * digest_size, length_size) != fixed_hex(binary.size())) return std::nullopt;
    return binary;
}

std::optional<Binary> load_binary(const fs::path& folder, const std::string& key) try {
    if (folder.empty()) return std::nullopt;
    std::ifstream file(file_of(folder, key), std::ios::binary);
    if (!file) return std::nullopt;
    std::string content(fs::file_size(file_of(folder, key)), '\0');
    file.read(content.data(), static_cast<std::streamsize>(content.size()));
    content.resize(static_cast<std::size_t>(file.gcount()));
    return decode_cache_entry(key, content);
} catch (const std::exception&) {
    return std::nullopt;
}

bool store_binary(const fs::path& folder, const std::string& key, std::span<const unsigned char> binary) try {
    if (folder.empty() || binary.empty()) return false;
    fs::create_directories(folder);
    static std::atomic<unsigned> counter{0};
    const fs::path temporary =
        folder / (key + "." + std::to_string(::getpid()) + "." + std::to_string(counter++) + ".tmp");
    bool written = false;
    {
        std::ofstream file(temporary, std::ios::binary);
        const std::string content = encode_cache_entry(key, binary);
        file.write(content.data(), static_cast<std::streamsize>(content.size()));
        file.close();
        written = !file.fail();
    }
    std::error_code error;
    if (written) fs::rename(temporary, file_of(folder, key), error);
    if (!written || error) {
        fs::remove(temporary, error);
        return false;
    }
    remove_oldest(folder);
    return true;
} catch (const std::exception&) {
    return false;
}

}  // namespace clume
