// SPDX-License-Identifier: MIT
#include "src/voxel_file.h"

#include <fmt/format.h>

#include <cctype>
#include <cstring>

#include "src/error.h"
#include "src/input_file.h"
#include "src/json_reader.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

std::string extension_of(const std::filesystem::path& path) {
    std::string out = path.extension().string();
    for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return out;
}

/// What a file holds, for messages; long lists are cut.
std::string listing(std::span<const VoxelFileEntry> entries) {
    if (entries.empty()) return "the file holds no grid";
    std::string out = "it holds ";
    constexpr std::size_t most = 32;
    for (std::size_t i = 0; i < entries.size() && i < most; ++i)
        out += fmt::format("{}{} ({})", i == 0 ? "" : ", ", in_quotes(entries[i].name),
                           entries[i].refusal.empty() ? entries[i].type : entries[i].refusal);
    if (entries.size() > most) out += fmt::format(" and {} more", entries.size() - most);
    return out;
}

}  // namespace

bool is_voxel_file(const std::filesystem::path& path) {
    const std::string extension = extension_of(path);
    return extension == ".vol" || extension == ".vdb" || extension == ".nvdb";
}

std::unique_ptr<VoxelFile> open_voxel_file(const std::filesystem::path& path) {
    const std::string extension = extension_of(path);
    if (extension == ".vol") return open_vol(path);
    if (extension == ".vdb") return open_vdb(path);
    if (extension == ".nvdb") return open_nvdb(path);
    throw SceneError(fmt::format("{}: unknown kind of voxel file; known: .vdb, .nvdb, .vol, .raw", path.string()));
}

std::size_t find_grid(const std::filesystem::path& path, std::span<const VoxelFileEntry> entries,
                      const std::optional<std::string>& name) {
    const auto fail = [&](const std::string& why) { throw SceneError(fmt::format("{}: {}", path.string(), why)); };
    const auto named = [&](const std::string& wanted) -> std::optional<std::size_t> {
        std::optional<std::size_t> found;
        for (std::size_t i = 0; i < entries.size(); ++i) {
            if (entries[i].name != wanted) continue;
            if (found) fail(fmt::format("several grids are called {}; {}", in_quotes(wanted), listing(entries)));
            found = i;
        }
        if (found && !entries[*found].refusal.empty())
            fail(fmt::format("grid {} cannot be a medium: {}; {}", in_quotes(wanted), entries[*found].refusal,
                             listing(entries)));
        return found;
    };
    if (name) {
        if (const auto found = named(*name)) return *found;
        fail(fmt::format("no grid {}; {}", in_quotes(*name), listing(entries)));
    }
    if (const auto found = named("density")) return *found;
    std::optional<std::size_t> only;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (!entries[i].refusal.empty()) continue;
        if (only) fail(fmt::format("no grid \"density\", and several to choose from with \"grid\"; {}", listing(entries)));
        only = i;
    }
    if (!only) fail(fmt::format("no grid that can be a medium; {}", listing(entries)));
    return *only;
}

VoxelGrid read_raw(const std::filesystem::path& path, const glm::ivec3& size) {
    const std::string name = path.string(), bytes = read_file_bytes(path);
    const auto nx = static_cast<std::uint64_t>(size.x), ny = static_cast<std::uint64_t>(size.y);
    const auto needed = static_cast<unsigned __int128>(nx * ny) * static_cast<std::uint64_t>(size.z) * sizeof(float);
    if (needed != bytes.size())
        throw SceneError(fmt::format("{}: {} x {} x {} floats are {:.0f} bytes, the file holds {}", name, size.x, size.y,
                                     size.z, static_cast<double>(needed), bytes.size()));
    return make_dense_grid(name, size, [&](int y, int z, float* row) {
        const std::size_t first = (static_cast<std::size_t>(z) * ny + static_cast<std::size_t>(y)) * nx;
        std::memcpy(row, bytes.data() + first * sizeof(float), nx * sizeof(float));
    });
}

}  // namespace clume
