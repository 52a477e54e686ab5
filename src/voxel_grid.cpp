// SPDX-License-Identifier: MIT
// Both builders make two passes, so that memory is known before it is taken: which bricks there are, then their samples.
#include "src/voxel_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <tuple>

#include "src/error.h"
#include "src/input_file.h"
#include "src/memory_bound.h"
#include "src/parallel.h"

namespace clume {

namespace {

bool before(const glm::ivec3& a, const glm::ivec3& b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); }

[[noreturn]] void fail_sample(const std::string& name, const glm::ivec3& i, float value) {
    throw SceneError(fmt::format("{}: sample ({}, {}, {}) is {}; every value must be finite", name, i.x, i.y, i.z, value));
}

}  // namespace

void check_brick_memory(const std::string& name, std::uint64_t bricks) {
    const double needed = static_cast<double>(bricks) * (brick_samples * sizeof(float) + sizeof(glm::ivec3));
    const double held = static_cast<double>(physical_memory_bytes());
    if (needed > held / 2)
        throw SceneError(
            fmt::format("{}: {} bricks of 8 x 8 x 8 samples need {:.1f} GB, and half of this machine's memory is {:.1f}", name,
                        bricks, needed * 1e-9, held * 0.5e-9));
}

VoxelGrid make_dense_grid(const std::string& name, const glm::ivec3& size, const RowSource& rows) {
    VoxelGrid grid;
    grid.hi = size;
    const glm::ivec3 bricks = (size + 7) / 8;
    const auto row_bricks = static_cast<std::size_t>(bricks.x),
               brick_rows = static_cast<std::size_t>(bricks.y) * static_cast<std::size_t>(bricks.z);
    const auto origin_of = [&](std::size_t brick_row, std::size_t x) {
        const auto across = static_cast<std::size_t>(bricks.y);
        return 8 * glm::ivec3(static_cast<int>(x), static_cast<int>(brick_row % across), static_cast<int>(brick_row / across));
    };

    // Which bricks hold something.
    std::vector<char> is_stored(row_bricks * brick_rows);
    std::atomic<std::size_t> negative{0};
    std::mutex mutex;
    std::optional<std::tuple<int, int, int, float>> bad;  // z, y, x, value
    parallel_chunks(brick_rows, 1, [&](std::size_t begin, std::size_t) {
        const glm::ivec3 origin = origin_of(begin, 0);
        std::vector<float> row(static_cast<std::size_t>(size.x));
        std::size_t below = 0;
        for (int z = origin.z; z < std::min(origin.z + 8, size.z); ++z)
            for (int y = origin.y; y < std::min(origin.y + 8, size.y); ++y) {
                rows(y, z, row.data());
                for (std::size_t x = 0; x < row.size(); ++x) {
                    if (!std::isfinite(row[x])) {
                        const std::lock_guard lock(mutex);
                        const auto here = std::tuple(z, y, static_cast<int>(x), row[x]);
                        if (!bad || std::tie(z, y, std::get<2>(here)) <
                                        std::tie(std::get<0>(*bad), std::get<1>(*bad), std::get<2>(*bad)))
                            bad = here;
                    }
                    below += row[x] < 0;
                    if (row[x] > 0) is_stored[begin * row_bricks + x / 8] = 1;
                }
            }
        negative += below;
    });
    if (bad) fail_sample(name, {std::get<2>(*bad), std::get<1>(*bad), std::get<0>(*bad)}, std::get<3>(*bad));
    grid.negative = negative;

    std::vector<std::size_t> first(brick_rows + 1);
    for (std::size_t r = 0; r < brick_rows; ++r) {
        std::size_t count = 0;
        for (std::size_t x = 0; x < row_bricks; ++x) count += static_cast<std::size_t>(is_stored[r * row_bricks + x]);
        first[r + 1] = first[r] + count;
    }
    check_brick_memory(name, first.back());
    grid.brick_origins.resize(first.back());
    grid.values.resize(first.back() * brick_samples);
    parallel_chunks(brick_rows, 1, [&](std::size_t r, std::size_t) {
        if (first[r] == first[r + 1]) return;
        const glm::ivec3 origin = origin_of(r, 0);
        std::size_t slot = first[r];
        for (std::size_t x = 0; x < row_bricks; ++x)
            if (is_stored[r * row_bricks + x]) grid.brick_origins[slot++] = origin_of(r, x);
        std::vector<float> row(row_bricks * 8);
        for (int z = 0; z < std::min(8, size.z - origin.z); ++z)
            for (int y = 0; y < std::min(8, size.y - origin.y); ++y) {
                rows(origin.y + y, origin.z + z, row.data());
                slot = first[r];
                for (std::size_t x = 0; x < row_bricks; ++x) {
                    if (!is_stored[r * row_bricks + x]) continue;
                    float* to = grid.values.data() + slot++ * brick_samples + static_cast<std::size_t>(64 * z + 8 * y);
                    for (std::size_t i = 0; i < 8 && 8 * x + i < static_cast<std::size_t>(size.x); ++i)
                        to[i] = std::max(row[8 * x + i], 0.0f);
                }
            }
    });
    return grid;
}

BrickSet::BrickSet(std::string name, double background, std::uint64_t file_bytes)
    : name_(std::move(name)), file_bytes_(file_bytes) {
    if (!std::isfinite(static_cast<float>(background)))
        fail(fmt::format("the background is {}; it must be finite", background));
    background_ = std::max(static_cast<float>(background), 0.0f);
}

void BrickSet::fail(const std::string& why) const { throw SceneError(fmt::format("{}: {}", name_, why)); }

void BrickSet::check_count(std::uint64_t bricks) const {
    check_brick_memory(name_, bricks);
    check_memory(name_, sparse_memory, static_cast<double>(bricks) * (brick_samples * sizeof(float) + sizeof(glm::ivec3) + sizeof(Entry)),
                 file_bytes_);
}

void BrickSet::grow(const glm::ivec3& lo, const glm::ivec3& hi) {
    lo_ = glm::min(lo_, lo);
    hi_ = glm::max(hi_, hi);
}

float BrickSet::admit(float value, const glm::ivec3& at) {
    if (!std::isfinite(value)) fail_sample(name_, at, value);
    if (value < 0) ++negative_;
    return std::max(value, 0.0f);
}

void BrickSet::add_tile(const glm::ivec3& lo, int side, double value) {
    const auto given = static_cast<float>(value);
    const float kept = admit(given, lo);
    if (given < 0)
        negative_ += static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * static_cast<std::size_t>(side) - 1;
    grow(lo, lo + side);
    if (kept == background_) return;
    const auto across = static_cast<std::uint64_t>(side / 8);
    check_count(entries_.size() + across * across * across);
    for (int z = 0; z < side; z += 8)
        for (int y = 0; y < side; y += 8)
            for (int x = 0; x < side; x += 8) entries_.push_back({lo + glm::ivec3(x, y, z), kept, no_source});
}

VoxelGrid BrickSet::build(const LeafSource& leaves) {
    check_count(entries_.size());
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return before(a.origin, b.origin); });
    for (std::size_t i = 1; i < entries_.size(); ++i)
        if (entries_[i].origin == entries_[i - 1].origin)
            fail(fmt::format("corrupt: two nodes hold sample ({}, {}, {})", entries_[i].origin.x, entries_[i].origin.y,
                             entries_[i].origin.z));
    VoxelGrid grid;
    grid.sparse = true;
    grid.background = background_;
    grid.brick_origins.reserve(entries_.size());
    grid.values.reserve(entries_.size() * brick_samples);
    float samples[brick_samples];
    for (const Entry& entry : entries_) {
        if (entry.source == no_source) {
            std::fill(std::begin(samples), std::end(samples), entry.value);
        } else {
            float in_file[brick_samples];
            std::uint64_t active[8] = {};
            leaves(entry.source, in_file, active);
            for (int z = 0, i = 0; z < 8; ++z)
                for (int y = 0; y < 8; ++y)
                    for (int x = 0; x < 8; ++x, ++i) {
                        const int n = 64 * x + 8 * y + z;
                        samples[i] = background_;
                        if ((active[n / 64] >> (n % 64) & 1) == 0) continue;
                        const glm::ivec3 at = entry.origin + glm::ivec3(x, y, z);
                        grow(at, at + 1);
                        samples[i] = admit(in_file[n], at);
                    }
        }
        if (std::all_of(std::begin(samples), std::end(samples), [&](float v) { return v == background_; })) continue;
        grid.brick_origins.push_back(entry.origin);
        grid.values.insert(grid.values.end(), std::begin(samples), std::end(samples));
    }
    // Not for a little: while it moves, both are there.
    if (grid.values.size() < grid.values.capacity() / 2) {
        grid.brick_origins.shrink_to_fit();
        grid.values.shrink_to_fit();
    }
    if (lo_.x < hi_.x) {
        grid.lo = lo_;
        grid.hi = hi_;
    }
    grid.negative = negative_;
    return grid;
}

void place_in_box(VoxelGrid& grid, const glm::dvec3& min, const glm::dvec3& max) {
    const glm::dvec3 voxel = (max - min) / glm::max(glm::dvec3(grid.hi - grid.lo), 1.0);
    grid.axes = glm::dmat3(voxel.x, 0, 0, 0, voxel.y, 0, 0, 0, voxel.z);
    grid.origin = min - (glm::dvec3(grid.lo) - 0.5) * voxel;
}

bool is_placed(const VoxelGrid& grid) {
    const double volume = std::abs(glm::determinant(grid.axes));
    return std::isfinite(volume) && volume > 0 && std::isfinite(glm::dot(glm::abs(grid.origin), glm::dvec3(1)));
}

float sample_at(const VoxelGrid& grid, glm::ivec3 i) {
    if (grid.lo.x >= grid.hi.x) return 0;
    if (!grid.sparse) i = glm::clamp(i, grid.lo, grid.hi - 1);
    const glm::ivec3 origin = {i.x & ~7, i.y & ~7, i.z & ~7}, in = i - origin;
    const auto found = std::lower_bound(grid.brick_origins.begin(), grid.brick_origins.end(), origin, before);
    if (found == grid.brick_origins.end() || *found != origin) return grid.sparse ? grid.background : 0;
    const auto brick = static_cast<std::size_t>(found - grid.brick_origins.begin());
    return grid.values[brick * brick_samples + static_cast<std::size_t>(in.x + 8 * in.y + 64 * in.z)];
}

std::pair<float, float> sample_range(const VoxelGrid& grid) {
    if (grid.lo.x >= grid.hi.x) return {0.0f, 0.0f};
    std::uint64_t own = 0;
    float least = INFINITY, most = -INFINITY;
    for (std::size_t b = 0; b < grid.brick_origins.size(); ++b) {
        const glm::ivec3 origin = grid.brick_origins[b];
        const glm::ivec3 lo = glm::max(grid.lo - origin, 0), hi = glm::min(grid.hi - origin, 8);
        for (int z = lo.z; z < hi.z; ++z)
            for (int y = lo.y; y < hi.y; ++y)
                for (int x = lo.x; x < hi.x; ++x, ++own) {
                    const float v = grid.values[b * brick_samples + static_cast<std::size_t>(x + 8 * y + 64 * z)];
                    least = std::min(least, v);
                    most = std::max(most, v);
                }
    }
    const glm::dvec3 size(grid.hi - grid.lo);
    if (static_cast<double>(own) < size.x * size.y * size.z) {
        const float elsewhere = grid.sparse ? grid.background : 0;
        least = std::min(least, elsewhere);
        most = std::max(most, elsewhere);
    }
    return {least, most};
}

std::pair<glm::dvec3, glm::dvec3> world_box(const VoxelGrid& grid) {
    const glm::dvec3 lo = glm::dvec3(grid.lo) - 0.5, hi = glm::dvec3(grid.hi) - 0.5;
    const glm::dvec3 middle = grid.origin + grid.axes * (0.5 * (lo + hi)), half = 0.5 * (hi - lo);
    const glm::dvec3 reach =
        glm::abs(grid.axes[0]) * half.x + glm::abs(grid.axes[1]) * half.y + glm::abs(grid.axes[2]) * half.z;
    return {middle - reach, middle + reach};
}

double brick_count(const VoxelGrid& grid) {
    if (grid.lo.x >= grid.hi.x) return 0;
    const glm::dvec3 bricks = (((grid.hi + 7) & ~7) - (grid.lo & ~7)) / 8;
    return bricks.x * bricks.y * bricks.z;
}

std::uint64_t byte_size(const VoxelGrid& grid) {
    return grid.values.size() * sizeof(float) + grid.brick_origins.size() * sizeof(glm::ivec3);
}

}  // namespace clume
