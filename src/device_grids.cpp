// SPDX-License-Identifier: MIT
#include "src/device_grids.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fmt/format.h>

#include "src/cells.h"
#include "src/device_values.h"
#include "src/error.h"
#include "src/memory_budget.h"
#include "src/parallel.h"

namespace clume {
namespace {

constexpr int kBrick = GRID_BRICK;
constexpr std::uint64_t kMaxRoots = std::uint64_t{1} << 21;
constexpr std::uint32_t kMaxLevels = 10;
constexpr double kSlack = 1 + 0x1p-20;  // of a bound, for the rounding of interpolation

struct Range {
    glm::dvec3 lo, hi;
};

/// Where the density may not be 0, lattice coordinates (scene.h).
Range support_of(const VoxelGrid& g, Interpolation interpolation) {
    const bool wide = g.sparse && interpolation == Interpolation::trilinear;
    return {glm::dvec3(g.lo) - (wide ? 1.0 : 0.5), glm::dvec3(g.hi) - (wide ? 0.0 : 0.5)};
}

/// Of a box in lattice coordinates, world units.
std::array<glm::dvec3, 8> corners_of(const VoxelGrid& g, const Range& r) {
    std::array<glm::dvec3, 8> corners;
    for (int c = 0; c < 8; ++c) corners[static_cast<std::size_t>(c)] = g.origin + g.axes * glm::dvec3(c & 1 ? r.hi.x : r.lo.x, c & 2 ? r.hi.y : r.lo.y, c & 4 ? r.hi.z : r.lo.z);
    return corners;
}

int floor_div(int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

/// A grid laid out: cell c of the table (c >= 0, per axis) spans lattice [base + c − shift, … + 1).
struct Layout {
    const VoxelGrid& grid;
    Interpolation interpolation;
    double factor;          ///< of the values
    Range support;
    glm::ivec3 base;
    double shift;           ///< ½ for voxels that are centred on lattice points
    glm::ivec3 bricks;      ///< of the table, before it is rounded up to whole roots
    std::vector<glm::ivec3> stored;  ///< bricks of the table that hold something, ascending by (z, y, x)
    std::vector<float> most;         ///< largest value of each

    Layout(const VoxelGrid& g, Interpolation i, double f) : grid(g), interpolation(i), factor(f), support(support_of(g, i)), shift(i == Interpolation::nearest ? 0.5 : 0) {
        // First cell met by the support; sparse tables are aligned with the file's own bricks.
        const glm::ivec3 first = i == Interpolation::nearest ? g.lo : g.lo - 1;
        base = first;
        if (g.sparse)
            for (int k = 0; k < 3; ++k) base[k] = floor_div(first[k], kBrick) * kBrick;
        bricks = (g.hi - base + kBrick - 1) / kBrick;
    }
    int samples() const { return interpolation == Interpolation::nearest ? kBrick : GRID_ROW; }
};

/// Copies the samples of one brick of the table, times the layout's factor; below 2^-100 they are 0.
void gather(const Layout& l, const glm::ivec3& brick, float* out) {
    const VoxelGrid& g = l.grid;
    const glm::ivec3 first = l.base + brick * kBrick;
    int source[3][GRID_ROW], offset[3][GRID_ROW], low[3], high[3];
    bool own[3][GRID_ROW];
    for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < GRID_ROW; ++i) {
            int x = first[k] + i;
            own[k][i] = !g.sparse || (x >= g.lo[k] && x < g.hi[k]);
            x = std::clamp(x, g.lo[k], g.hi[k] - 1);
            source[k][i] = floor_div(x, kBrick);
            offset[k][i] = x - source[k][i] * kBrick;
        }
        low[k] = source[k][0];
        high[k] = source[k][GRID_ROW - 1];
    }
    const float* from[2][2][2];  // [z][y][x]
    const auto before = [](const glm::ivec3& a, const glm::ivec3& b) { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; };
    for (int c = 0; c < 8; ++c) {
        const glm::ivec3 origin = kBrick * glm::ivec3(c & 1 ? high[0] : low[0], c & 2 ? high[1] : low[1], c & 4 ? high[2] : low[2]);
        const auto at = std::lower_bound(g.brick_origins.begin(), g.brick_origins.end(), origin, before);
        const bool found = at != g.brick_origins.end() && *at == origin;
        from[c >> 2][c >> 1 & 1][c & 1] = found ? g.values.data() + 512 * static_cast<std::size_t>(at - g.brick_origins.begin()) : nullptr;
    }
    const float missing = g.sparse ? g.background : 0;
    for (int z = 0; z < GRID_ROW; ++z)
        for (int y = 0; y < GRID_ROW; ++y)
            for (int x = 0; x < GRID_ROW; ++x) {
                const float* p = from[source[2][z] != low[2]][source[1][y] != low[1]][source[0][x] != low[0]];
                float v = own[0][x] && own[1][y] && own[2][z] ? (p ? p[(offset[2][z] * kBrick + offset[1][y]) * kBrick + offset[0][x]] : missing) : g.background;
                v = static_cast<float>(std::min(static_cast<double>(v) * l.factor, 1e30));
                out[(z * GRID_ROW + y) * GRID_ROW + x] = v < 0x1p-100f ? 0 : v;
            }
}

std::pair<float, float> extremes(const Layout& l, const float* values) {
    const int n = l.samples();
    float least = values[0], most = values[0];
    for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) {
                const float v = values[(z * GRID_ROW + y) * GRID_ROW + x];
                least = std::min(least, v);
                most = std::max(most, v);
            }
    return {least, most};
}

/// Bricks of the table in which some sample is not 0.
void find_stored(Layout& l) {
    const VoxelGrid& g = l.grid;
    std::vector<glm::ivec3> candidates;
    const auto all = [&] {
        for (int z = 0; z < l.bricks.z; ++z)
            for (int y = 0; y < l.bricks.y; ++y)
                for (int x = 0; x < l.bricks.x; ++x) candidates.emplace_back(x, y, z);
    };
    const double count = static_cast<double>(l.bricks.x) * l.bricks.y * l.bricks.z;
    if (count <= 64 + 8.0 * static_cast<double>(g.brick_origins.size()) || (g.sparse && g.background > 0)) {
        if (count > 0x1p31) throw SceneError("a voxel grid with a background above 0 fills more than 2^31 bricks");
        all();
    } else {
        // A brick's samples are seen from the cells before them, too, and, clamped, from one sample beyond the border.
        for (const glm::ivec3& origin : g.brick_origins) {
            glm::ivec3 first, last;
            for (int k = 0; k < 3; ++k) {
                first[k] = std::max(0, floor_div(origin[k] - 2 - l.base[k], kBrick));
                last[k] = std::min(l.bricks[k] - 1, floor_div(origin[k] + kBrick - l.base[k], kBrick));
            }
            for (int z = first.z; z <= last.z; ++z)
                for (int y = first.y; y <= last.y; ++y)
                    for (int x = first.x; x <= last.x; ++x) candidates.emplace_back(x, y, z);
        }
        const auto key = [](const glm::ivec3& b) { return std::array<int, 3>{b.z, b.y, b.x}; };
        std::sort(candidates.begin(), candidates.end(), [&](const glm::ivec3& a, const glm::ivec3& b) { return key(a) < key(b); });
        candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
    }
    std::vector<float> most(candidates.size());
    parallel_chunks(candidates.size(), 256, [&](std::size_t begin, std::size_t end) {
        float values[GRID_BRICK_VALUES];
        for (std::size_t i = begin; i < end; ++i) {
            gather(l, candidates[i], values);
            most[i] = extremes(l, values).second;
        }
    });
    for (std::size_t i = 0; i < candidates.size(); ++i)
        if (most[i] > 0) l.stored.push_back(candidates[i]), l.most.push_back(most[i]);
}

std::uint32_t levels_of(const Layout& l) {
    std::uint32_t levels = 0;
    const auto roots = [&](int n) { return (static_cast<std::uint64_t>(n) + (std::uint64_t{1} << levels) - 1) >> levels; };
    while (levels < kMaxLevels && roots(l.bricks.x) * roots(l.bricks.y) * roots(l.bricks.z) > kMaxRoots) ++levels;
    if (roots(l.bricks.x) * roots(l.bricks.y) * roots(l.bricks.z) > 64 * kMaxRoots || std::max({l.bricks.x, l.bricks.y, l.bricks.z}) > (1 << 21))
        throw SceneError(fmt::format("a voxel grid of {} x {} x {} bricks of 8 is too large", l.bricks.x, l.bricks.y, l.bricks.z));
    return levels;
}

/// The table of bricks: roots, then blocks of 8; leaves link CELL_EMPTY_MAX + index into `stored`.
std::vector<std::uint32_t> make_table(const Layout& l, const glm::uvec3& roots, std::uint32_t levels) {
    std::vector<std::uint32_t> table(static_cast<std::size_t>(roots.x) * roots.y * roots.z, 1);
    for (std::size_t i = 0; i < l.stored.size(); ++i) {
        const glm::uvec3 b(l.stored[i]), r = b >> levels;
        std::size_t at = r.x + static_cast<std::size_t>(roots.x) * (r.y + static_cast<std::size_t>(roots.y) * r.z);
        for (std::uint32_t shift = levels; shift-- > 0;) {
            if (table[at] == 1) {
                table[at] = CELL_INNER | static_cast<std::uint32_t>(table.size());
                table.resize(table.size() + 8, 1);
            }
            at = (table[at] & ~CELL_INNER) + (b.x >> shift & 1) + 2 * (b.y >> shift & 1) + 4 * (b.z >> shift & 1);
        }
        table[at] = CELL_EMPTY_MAX + static_cast<std::uint32_t>(i);
    }
    if (table.size() >= CELL_INNER) throw SceneError("a voxel grid's table of bricks is too large");
    measure_emptiness(std::span(table).first(static_cast<std::size_t>(roots.x) * roots.y * roots.z), roots);
    return table;
}

/// A table of bounds of its own: cubes from the support's corner on, each with the largest sample that its density depends on.
void add_bounds(const Layout& l, double per_root, int along, std::size_t first_value, device::GridInfo& info, DeviceScene& out) {
    const glm::dvec3 size = l.support.hi - l.support.lo;
    const double edge = largest(size) / along;  // in cells
    info.bounds_scale = static_cast<float>(per_root / edge);
    const double scale = static_cast<double>(info.bounds_scale);
    const glm::dvec3 corner(info.lower.x, info.lower.y, info.lower.z);
    const glm::uvec3 counts(glm::max(glm::ceil(size / per_root * scale - 1e-3), 1.0));
    if (static_cast<double>(counts.x) * counts.y * counts.z > 0x1p28) throw SceneError("render.majorant_grid needs more than 2^28 cells");
    std::vector<float> most(static_cast<std::size_t>(counts.x) * counts.y * counts.z, 0);
    // Bounds' cells that a sample at table position p [cells] reaches, a margin for the device's rounding included.
    const double reach = l.interpolation == Interpolation::nearest ? 0.5 : 1, margin = 0.01 + 0x1p-20 * largest(size);
    const auto cell = [&](double p, int k) { return static_cast<int>(std::clamp(std::floor((p / per_root - corner[k]) * scale), 0.0, static_cast<double>(counts[k] - 1))); };
    for (std::size_t i = 0; i < l.stored.size(); ++i) {
        int lo[3][GRID_ROW], hi[3][GRID_ROW];
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < GRID_ROW; ++j) {
                const double p = l.stored[i][k] * kBrick + j + l.shift;
                lo[k][j] = cell(p - reach - margin, k);
                hi[k][j] = cell(p + reach + margin, k);
            }
        const float* values = out.grid_values.data() + first_value + GRID_BRICK_VALUES * i;
        const int n = l.samples();
        for (int z = 0; z < n; ++z)
            for (int y = 0; y < n; ++y)
                for (int x = 0; x < n; ++x) {
                    const float v = values[(z * GRID_ROW + y) * GRID_ROW + x];
                    if (!(v > 0)) continue;
                    for (int c = lo[2][z]; c <= hi[2][z]; ++c)
                        for (int b = lo[1][y]; b <= hi[1][y]; ++b)
                            for (int a = lo[0][x]; a <= hi[0][x]; ++a) {
                                float& m = most[static_cast<std::size_t>(a) + counts.x * (static_cast<std::size_t>(b) + static_cast<std::size_t>(counts.y) * static_cast<std::size_t>(c))];
                                m = std::max(m, v);
                            }
                }
    }
    std::vector<std::uint32_t> links(most.size());
    for (std::size_t i = 0; i < most.size(); ++i) links[i] = most[i] > 0 ? CELL_EMPTY_MAX : 1;
    measure_emptiness(links, counts);
    info.bounds_x = counts.x, info.bounds_y = counts.y, info.bounds_z = counts.z;
    info.first_bound = static_cast<device::uint>(out.grid_cells.size());
    for (std::size_t i = 0; i < most.size(); ++i) out.grid_cells.push_back({links[i], static_cast<float>(static_cast<double>(most[i]) * kSlack), 0, 0});
}

/// Edge, in bricks, of a table's cells that makes flights through the media cheapest: steps against tentative collisions.
int cheapest_edge(const Layout& l, double scale) {
    // Nanoseconds of one core for a step from cell to cell and for a tentative collision (tests on a 256³ cloud).
    constexpr double step = 28, tentative = 55;
    const double voxel = std::cbrt(std::abs(glm::determinant(l.grid.axes))) * scale;
    int best = 1;
    double least = 1e300;
    for (const int edge : {1, 2, 3, 4, 6, 8, 12, 16}) {
        const glm::ivec3 counts = (l.bricks + edge - 1) / edge;
        if (edge > 1 && std::max({counts.x, counts.y, counts.z}) < 2) break;
        const double cells = static_cast<double>(counts.x) * counts.y * counts.z;
        if (cells > 0x1p24) continue;
        std::vector<float> bound(static_cast<std::size_t>(cells), 0);
        for (std::size_t i = 0; i < l.most.size(); ++i) {
            const glm::ivec3 c = l.stored[i] / edge;
            float& b = bound[static_cast<std::size_t>(c.x) + static_cast<std::size_t>(counts.x) * (static_cast<std::size_t>(c.y) + static_cast<std::size_t>(counts.y) * static_cast<std::size_t>(c.z))];
            b = std::max(b, l.most[i]);
        }
        const double size = edge * kBrick * voxel, volume = std::pow(edge, 3);
        double cost = 0;
        for (const float b : bound)
            if (b > 0) cost += volume * (1.5 / size * step + static_cast<double>(b) * tentative);
        if (cost < least) least = cost, best = edge;
    }
    return best;
}

/// Appends one laid-out grid.
void add_grid(const Layout& l, std::uint32_t levels, int bounds, DeviceScene& out) {
    device::GridInfo info{};
    info.interpolation = l.interpolation == Interpolation::nearest ? GRID_NEAREST : GRID_TRILINEAR;
    info.emission_grid = GRID_NONE;
    const double per_root = static_cast<double>(kBrick << levels);
    const glm::uvec3 roots = (glm::uvec3(l.bricks) + (1u << levels) - 1u) >> levels;
    info.roots_x = roots.x, info.roots_y = roots.y, info.roots_z = roots.z;

    // root cells = (lattice − base + shift) / per_root; lattice = axes⁻¹ (world − origin). About the support's centre, whose
    // float is what the device subtracts.
    const Normalization& n = out.normalization;
    const glm::dmat3 inverse = glm::inverse(l.grid.axes);
    const glm::dvec3 middle = 0.5 * (l.support.lo + l.support.hi);
    const glm::vec3 center((l.grid.origin + l.grid.axes * middle - n.center) * n.scale);
    const glm::dvec3 at = inverse * (glm::dvec3(center) / n.scale + n.center - l.grid.origin);
    info.center = {center.x, center.y, center.z, 0};
    device::float4* rows[] = {&info.to_x, &info.to_y, &info.to_z};
    for (int k = 0; k < 3; ++k) {
        const auto of = [&](int c) { return static_cast<float>(inverse[c][k] / n.scale / per_root); };
        *rows[k] = {of(0), of(1), of(2), static_cast<float>((at[k] - l.base[k] + l.shift) / per_root)};
    }
    const auto corner = [&](const glm::dvec3& lattice) {
        const glm::vec3 c((lattice - glm::dvec3(l.base) + l.shift) / per_root);
        return device::float4{c.x, c.y, c.z, 0};
    };
    info.lower = corner(l.support.lo);
    info.upper = corner(l.support.hi);

    const std::size_t first_value = out.grid_values.size(), first_entry = out.grid_cells.size();
    info.first_brick = static_cast<device::uint>(first_value / GRID_BRICK_VALUES);
    info.first_entry = static_cast<device::uint>(first_entry);
    if (first_value / GRID_BRICK_VALUES + l.stored.size() > 0x7fffff00u) throw SceneError("voxel grids of more than 2^31 bricks");
    require_memory("voxel grid", {{"values on the host", 4 * (first_value + GRID_BRICK_VALUES * l.stored.size())}});
    out.grid_values.resize(first_value + GRID_BRICK_VALUES * l.stored.size());
    const std::vector<std::uint32_t> table = make_table(l, roots, levels);
    out.grid_cells.resize(first_entry + table.size());
    std::vector<device::CellEntry> leaf(l.stored.size());
    parallel_chunks(l.stored.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            float* values = out.grid_values.data() + first_value + GRID_BRICK_VALUES * i;
            gather(l, l.stored[i], values);
            const auto [least, largest] = extremes(l, values);
            leaf[i] = {0, static_cast<float>(static_cast<double>(largest) * kSlack), std::bit_cast<std::uint32_t>(least), least == largest};
        }
    });
    for (std::size_t i = 0; i < table.size(); ++i) {
        const std::uint32_t link = table[i];
        device::CellEntry& entry = out.grid_cells[first_entry + i];
        entry = {link, 0, 0, 0};
        if ((link & CELL_INNER) || link < CELL_EMPTY_MAX) continue;
        entry = leaf[link - CELL_EMPTY_MAX];
        entry.link = link;
    }
    for (const float m : l.most) info.bound = std::max(info.bound, static_cast<float>(static_cast<double>(m) * kSlack));
    if (bounds > 0) add_bounds(l, per_root, bounds, first_value, info, out);
    out.grids.push_back(info);
}

/// Corners of the part of the support in which bricks are stored, world units.
std::array<glm::dvec3, 8> stored_corners(const Layout& l) {
    Range r{glm::dvec3(1e300), glm::dvec3(-1e300)};
    for (const glm::ivec3& b : l.stored) {
        const glm::dvec3 lo = glm::dvec3(l.base + b * kBrick) - l.shift;
        r.lo = glm::min(r.lo, lo);
        r.hi = glm::max(r.hi, lo + static_cast<double>(kBrick));
    }
    r.lo = glm::max(r.lo, l.support.lo);
    r.hi = glm::min(r.hi, l.support.hi);
    return corners_of(l.grid, r);
}

}  // namespace

std::array<glm::dvec3, 8> grid_corners(const VoxelGrid& grid, Interpolation interpolation) {
    return corners_of(grid, support_of(grid, interpolation));
}

GridTraits pack_grids(const Scene& scene, const std::string& bound, DeviceScene& out) {
    GridTraits traits;
    const RenderSettings& r = scene.render;
    const bool ratio = out.transmittance == "ratio" || out.transmittance == "residual-ratio";
    traits.nulls = out.strategy == "delta" || out.strategy == "progressive" || ratio;
    if (scene.grids.size() > 512) throw SceneError(fmt::format("{}: more than 512 voxel media", scene.path));
    std::vector<Layout> layouts;
    const double per_length = 1 / out.normalization.scale;
    for (const GridMedium& m : scene.grids) layouts.emplace_back(m.density, m.interpolation, m.density_scale * per_length);
    for (const GridMedium& m : scene.grids)
        if (m.emission_grid) layouts.emplace_back(*m.emission_grid, m.interpolation, per_length);
    for (Layout& l : layouts) {
        find_stored(l);
        traits.bricks += l.stored.size();
        traits.levels = std::max(traits.levels, levels_of(l));
        traits.kinds |= l.interpolation == Interpolation::nearest ? GRID_NEAREST : GRID_TRILINEAR;
    }
    // Edges of the tables' cells, in bricks. Lower bounds (of residual-ratio) are the bricks' alone.
    std::vector<int> edges(layouts.size(), 0);
    if (traits.nulls && bound != "scene" && bound != "tree" && out.transmittance != "residual-ratio" && out.strategy != "progressive") {
        for (std::size_t i = 0; i < scene.grids.size(); ++i) edges[i] = cheapest_edge(layouts[i], out.normalization.scale);
        traits.tables = bound == "grid" || r.majorant_grid || std::any_of(edges.begin(), edges.end(), [](int e) { return e > 1; });
    }
    for (std::size_t i = 0; i < layouts.size(); ++i) {
        const glm::dvec3 size = layouts[i].support.hi - layouts[i].support.lo;
        const double along = largest(size) / (kBrick * std::max(1, edges[i]));
        const int bounds = !traits.tables ? 0 : r.majorant_grid.value_or(static_cast<int>(std::ceil(along)));
        add_grid(layouts[i], traits.levels, i < scene.grids.size() ? bounds : 0, out);
        if (out.strategy == "progressive" && i < scene.grids.size()) {
            // A start that knows nothing of where the density is: a tenth of its bound.
            out.grids.back().first_learned = static_cast<device::uint>(out.learned.size());
            out.learned.resize(out.learned.size() + std::max<std::size_t>(1, layouts[i].stored.size()), std::max(0.1f * out.grids.back().bound, 1e-20f));
        }
        if (!layouts[i].stored.empty()) out.grid_boxes.push_back(stored_corners(layouts[i]));
    }
    for (std::size_t g = 0, next = scene.grids.size(); g < scene.grids.size(); ++g) {
        const GridMedium& m = scene.grids[g];
        device::GridInfo& info = out.grids[g];
        info.primitive = static_cast<device::uint>(out.ellipsoids.size() + g);
        for (int k = 0; k < 3; ++k) traits.voxel_edge = std::min(traits.voxel_edge, glm::length(m.density.axes[k]));
        if (!m.emission_grid) continue;
        traits.emission_grids = true;
        info.emission_grid = static_cast<device::uint>(next);
        info.emission = pack(m.emission);
        double longest = 0;
        const auto corners = grid_corners(*m.emission_grid, m.interpolation);
        for (const auto& a : corners)
            for (const auto& b : corners) longest = std::max(longest, glm::length(a - b));
        traits.brightest = std::max(traits.brightest, largest(m.emission) * static_cast<double>(out.grids[next].bound) * longest * out.normalization.scale);
        ++next;
    }
    return traits;
}

}  // namespace clume
