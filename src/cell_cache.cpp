// SPDX-License-Identifier: MIT
#include "src/cell_cache.h"

#include <fmt/format.h>

#include <chrono>
#include <cstring>

#include "runtime/hash.h"
#include "src/byte_reader.h"
#include "src/memory_budget.h"

namespace clume {

namespace {

constexpr std::size_t kMostBytes = std::size_t{256} << 20;

template <class Value>
void put(Binary& out, std::span<const Value> values) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    out.insert(out.end(), bytes, bytes + values.size_bytes());
}

template <class Value>
void put(Binary& out, const Value& value) {
    put(out, std::span<const Value>(&value, 1));
}

template <class Value>
std::vector<Value> take(ByteReader& in, std::uint64_t count) {
    if (count > in.left() / sizeof(Value)) in.fail("cut short");
    const std::string_view bytes = in.take(count * sizeof(Value));
    std::vector<Value> values(static_cast<std::size_t>(count));
    if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

/// Everything that the cells depend on, the code that builds them too.
std::string key_of(std::span<const Ellipsoid> ellipsoids, const CellOptions& o) {
    static_assert(sizeof(Ellipsoid) == 18 * sizeof(double) + 2 * sizeof(std::uint32_t), "hashed as it lies in memory");
    return sha256_hex(fmt::format("cells {} {} {} {} {} {} {} {} {} {} {} {}", CLUME_CELLS_CODE, sha256_hex(std::as_bytes(ellipsoids)), o.costs.step, o.costs.tentative, o.costs.chord,
                                  o.costs.null_share, o.costs.chord_share, o.costs.density_share, o.max_levels, o.roots.value_or(0), o.control, o.max_references));
}

}  // namespace

Binary encode_cells(const Cells& c) {
    Binary out;
    out.reserve(c.table.size() * 4 + c.leaves.size() * 24 + c.references * 8 + 128);
    put(out, c.origin);
    put(out, c.root_size);
    put(out, c.roots);
    put(out, c.levels);
    for (const std::size_t size : {c.references, c.table.size(), c.leaves.size()}) put(out, std::uint64_t{size});
    put(out, std::span<const std::uint32_t>(c.table));
    for (const Cells::Leaf& leaf : c.leaves) {
        put(out, std::uint64_t{leaf.primitives.size()});
        put(out, leaf.majorant);
        put(out, leaf.control);
        put(out, std::span<const std::uint32_t>(leaf.primitives));
        put(out, std::span<const float>(leaf.bounds));
    }
    return out;
}

Cells decode_cells(std::span<const unsigned char> bytes) {
    ByteReader in("kept cells", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    Cells c;
    c.origin = in.get<glm::dvec3>();
    c.root_size = in.get<double>();
    c.roots = in.get<glm::uvec3>();
    c.levels = in.get<std::uint32_t>();
    c.references = in.get<std::uint64_t>();
    const auto entries = in.get<std::uint64_t>(), leaves = in.get<std::uint64_t>();
    c.table = take<std::uint32_t>(in, entries);
    if (leaves > in.left() / 24) in.fail("cut short");
    c.leaves.resize(static_cast<std::size_t>(leaves));
    for (Cells::Leaf& leaf : c.leaves) {
        const auto count = in.get<std::uint64_t>();
        leaf.majorant = in.get<double>();
        leaf.control = in.get<double>();
        leaf.primitives = take<std::uint32_t>(in, count);
        leaf.bounds = take<float>(in, count);
    }
    if (in.left() > 0) in.fail("too long");
    return c;
}

std::filesystem::path cells_folder() {
    const std::filesystem::path cache = cache_folder();
    return cache.empty() ? cache : cache / "cells";
}

Cells cached_cells(std::span<const Ellipsoid> ellipsoids, const TreeSource& tree, const CellOptions& options, const std::filesystem::path& folder, double long_enough_s) {
    // Cells of so many are too large to be kept, and a file is in memory three times while it is read.
    if (folder.empty() || ellipsoids.size() > kMostBytes / 64 || memory_in_use() + 3 * kMostBytes > memory_limit()) return build_cells(ellipsoids, tree(), options);
    const std::string key = key_of(ellipsoids, options);
    if (const auto kept = load_binary(folder, key)) {
        try {
            return decode_cells(*kept);
        } catch (const SceneError&) {  // as good as none
        }
    }
    const auto start = std::chrono::steady_clock::now();
    Cells cells = build_cells(ellipsoids, tree(), options);
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < long_enough_s) return cells;
    if (const Binary bytes = encode_cells(cells); bytes.size() <= kMostBytes) store_binary(folder, key, bytes);
    return cells;
}

}  // namespace clume
