// SPDX-License-Identifier: MIT
#include "src/cells.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <queue>

#include "src/memory_budget.h"
#include "src/parallel.h"

namespace clume {
namespace {

constexpr std::uint32_t kMaxLevels = 8;
constexpr std::size_t kMaxRoots = std::size_t{1} << 22;

struct Cost {
    const CellCosts& c;
    /// Per unit of length travelled inside a cubic cell of edge `size` (mean chord 2/3 size).
    double operator()(double size, std::size_t primitives, double majorant) const {
        const double groups = std::ceil(static_cast<double>(primitives) / CLUME_GROUP_SIZE);
        const double visits = 1.5 / size;
        const double null = visits * c.step + majorant * c.tentative;
        const double chord = visits * (c.step + groups * c.chord);
        const double density = visits * c.step + majorant * (c.tentative + groups * 0.5 * c.chord);
        return c.null_share * null + c.chord_share * chord + c.density_share * density;
    }
};

using List = Cells::Leaf;

/// The least bound >= `bound` for which peak / bound has 8 significant bits (layout.h, Reference).
float coarse_bound(double peak, double bound) {
    const std::uint32_t scale = std::bit_cast<std::uint32_t>(static_cast<float>(peak / std::max(bound, 1e-30 * peak))) & 0xffff0000u;
    return static_cast<float>(peak / static_cast<double>(std::bit_cast<float>(scale)));
}

/// The primitives among `candidates` that meet the box, and their bound.
template <class Candidates>
List list_of(std::span<const Ellipsoid> ellipsoids, const Candidates& candidates, const Box& box) {
    List list;
    list.primitives.reserve(candidates.size());
    list.bounds.reserve(candidates.size());
    for (const std::uint32_t i : candidates) {
        const double bound = box_extinction(ellipsoids[i], box);
        if (!(bound > 0)) continue;
        const float up = coarse_bound(ellipsoids[i].sigma, bound * (1 + 1e-5));
        list.primitives.push_back(i);
        list.bounds.push_back(up);
        list.majorant += static_cast<double>(up);
    }
    return list;
}

Box octant(const Box& box, int k) {
    const glm::dvec3 middle = 0.5 * (box.lo + box.hi);
    Box b;
    for (int axis = 0; axis < 3; ++axis) {
        b.lo[axis] = (k >> axis) & 1 ? middle[axis] : box.lo[axis];
        b.hi[axis] = (k >> axis) & 1 ? box.hi[axis] : middle[axis];
    }
    return b;
}

/// One root cell's octree, entries relative to its own arrays.
struct Subtree {
    std::vector<std::uint32_t> blocks;  ///< children, 8 a block; inner entries index blocks / 8
    std::vector<Cells::Leaf> leaves;
    std::uint32_t root = 1;             ///< entry
    std::uint32_t depth = 0;

    std::size_t byte_size() const {
        std::size_t bytes = 4 * blocks.size();
        for (const Cells::Leaf& leaf : leaves) bytes += sizeof(leaf) + 32 + 8 * leaf.primitives.size();  // and what the heap adds to two arrays
        return bytes;
    }
};

struct Refiner {
    std::span<const Ellipsoid> ellipsoids;
    Cost cost;
    double allowance;  ///< how much the references of a cell may grow by a split
    std::uint32_t max_levels;
    double dear;       ///< cost per unit of length from which a split is tried
    bool control;

    std::uint32_t leaf(Subtree& out, List&& list, const Box& box) const {
        if (list.primitives.empty()) return 1;
        if (control)
            for (const std::uint32_t i : list.primitives) list.control += box_extinction_least(ellipsoids[i], box);
        list.primitives.shrink_to_fit();  // room was for all of the parent's
        list.bounds.shrink_to_fit();
        out.leaves.push_back(std::move(list));
        return CELL_EMPTY_MAX + static_cast<std::uint32_t>(out.leaves.size() - 1);
    }

    std::uint32_t refine(Subtree& out, const Box& box, List&& list, std::uint32_t level) const {
        const double size = box.hi.x - box.lo.x;
        const std::size_t n = list.primitives.size();
        out.depth = std::max(out.depth, level);
        if (n == 0 || level == max_levels || cost(size, n, list.majorant) < dear) return leaf(out, std::move(list), box);
        List children[8];
        double child_cost = 0;
        std::size_t references = 0;
        for (int k = 0; k < 8; ++k) {
            children[k] = list_of(ellipsoids, list.primitives, octant(box, k));
            references += children[k].primitives.size();
            child_cost += cost(0.5 * size, children[k].primitives.size(), children[k].majorant) / 8;
        }
        const double own = cost(size, n, list.majorant);
        const bool crowded = n > 64 * CLUME_GROUP_SIZE && references < 4 * n;
        if (!crowded && (child_cost > 0.55 * own || static_cast<double>(references) > allowance * static_cast<double>(n)))
            return leaf(out, std::move(list), box);
        const std::size_t block = out.blocks.size() / 8;
        out.blocks.resize(out.blocks.size() + 8);
        for (int k = 0; k < 8; ++k) {
            const std::uint32_t entry = refine(out, octant(box, k), std::move(children[k]), level + 1);
            out.blocks[8 * block + static_cast<std::size_t>(k)] = entry;
        }
        return CELL_INNER | static_cast<std::uint32_t>(block);
    }
};

struct RootChoice {
    double size;          ///< edge of the root cells
    double typical_cost;  ///< where the media are, per unit of length
};

/// Root cell size of least cost at points where the media are, given the most references allowed.
RootChoice choose_root_size(std::span<const Ellipsoid> ellipsoids, const BvhTree& tree, const Cost& cost, const glm::dvec3& extent, std::size_t max_references) {
    const double longest = std::max({extent.x, extent.y, extent.z});
    const std::size_t n = ellipsoids.size();
    const std::size_t stride = std::max<std::size_t>(1, n / 20000), samples = std::min<std::size_t>(n, 128);
    RootChoice best{longest, std::numeric_limits<double>::max()};
    double best_total = std::numeric_limits<double>::max();
    for (double size = longest; size > longest / 1500; size *= 0.84) {
        const glm::dvec3 counts = glm::ceil(extent / size);
        const double cells = counts.x * counts.y * counts.z;
        if (cells > static_cast<double>(kMaxRoots)) break;
        double references = 0;
        for (std::size_t i = 0; i < n; i += stride) {
            const glm::dvec3 h = 2.0 * ellipsoids[i].half / size;
            references += (h.x + 1) * (h.y + 1) * (h.z + 1);
        }
        // Boxes overcount ellipsoids by about their volume ratio.
        references *= 0.6 * static_cast<double>(stride);
        const bool last = references * 1.3 > static_cast<double>(max_references) || cells * 1.7 > static_cast<double>(kMaxRoots);
        // Lists this long are never worth it while smaller cells are affordable: not even looked at.
        if (!last && references > 768 * cells) {
            best.size = size;
            continue;
        }
        std::vector<double> sampled(samples);
        parallel_chunks(samples, 8, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s) {
                const Ellipsoid& e = ellipsoids[s * n / samples];
                // A point inside the support, by a fixed low-discrepancy sequence.
                const double u = static_cast<double>(s);
                const glm::dvec3 r(std::fmod(u * 0.8191725134, 1.0), std::fmod(u * 0.6710436067, 1.0), std::fmod(u * 0.5497004779, 1.0));
                const glm::dvec3 p = e.center + 0.6 * (2.0 * r - 1.0) * e.half;
                const glm::dvec3 lo = glm::floor(p / size) * size;
                const Box box{lo, lo + size};
                std::size_t count = 0;
                double majorant = 0;
                tree.overlapping(ellipsoids, box, [&](std::uint32_t i) {
                    const double bound = box_extinction(ellipsoids[i], box);
                    if (bound > 0) ++count, majorant += bound;
                });
                sampled[s] = cost(size, count, majorant);
            }
        });
        double mean = 0;
        for (const double c : sampled) mean += c / static_cast<double>(samples);
        // Duplicates cost memory and cache: a logarithmic price beyond a cache's worth of references.
        const double total = mean * (1 + 0.15 * std::log2(1 + references / 65536));
        if (total < best_total) best_total = total, best = {size, mean};
        if (total > 1.5 * best_total || last) break;
    }
    return best;
}

}  // namespace

void measure_emptiness(std::span<std::uint32_t> roots, const glm::uvec3& counts) {
    constexpr std::uint8_t most = CELL_EMPTY_MAX - 1;
    // With a rim of cells that count as far away; rows follow each other in y, then in z.
    const glm::ivec3 n(counts);
    const std::ptrdiff_t row = n.x + 2, plane = row * (n.y + 2);
    std::vector<std::uint8_t> distances(static_cast<std::size_t>(plane * (n.z + 2)), most), near(static_cast<std::size_t>(row));
    const auto row_at = [&](int y, int z) { return distances.data() + (z + 1) * plane + (y + 1) * row + 1; };
    const auto each = [&](auto&& f) {
        std::size_t i = 0;
        for (int z = 0; z < n.z; ++z)
            for (int y = 0; y < n.y; ++y)
                for (int x = 0; x < n.x; ++x, ++i) f(roots[i], row_at(y, z)[x]);
    };
    each([](std::uint32_t entry, std::uint8_t& distance) { distance = entry < CELL_EMPTY_MAX ? most : 0; });
    // Two sweeps of the 26-neighbour distance transform: what lies behind in z and in y at once for a row, then what does in x.
    for (const int ahead : {1, -1})
        for (int c = 0; c < n.z; ++c)
            for (int b = 0; b < n.y; ++b) {
                std::uint8_t* here = row_at(ahead > 0 ? b : n.y - 1 - b, ahead > 0 ? c : n.z - 1 - c);
                const std::uint8_t *behind = here - ahead * plane, *beside = here - ahead * row;
                for (std::ptrdiff_t x = -1; x <= n.x; ++x)
                    near[static_cast<std::size_t>(x + 1)] = std::min(std::min(behind[x - row], behind[x]), std::min(behind[x + row], beside[x]));
                for (int a = 0; a < n.x; ++a) {
                    const int x = ahead > 0 ? a : n.x - 1 - a;
                    const std::uint8_t* by = near.data() + x;
                    const int least = std::min({by[0], by[1], by[2], here[x - ahead]});
                    here[x] = static_cast<std::uint8_t>(std::min<int>(here[x], least + 1));
                }
            }
    each([](std::uint32_t& entry, std::uint8_t distance) {
        if (entry < CELL_EMPTY_MAX) entry = distance;
    });
}

Cells build_cells(std::span<const Ellipsoid> ellipsoids, const BvhTree& tree, const CellOptions& options) {
    const std::size_t max_references = options.max_references;
    Cells cells;
    cells.table = {1};
    if (ellipsoids.empty()) return cells;
    const Box bounds = bounds_of(ellipsoids);
    const double margin = 1e-4 * glm::length(bounds.hi - bounds.lo);
    cells.origin = glm::dvec3(glm::vec3(bounds.lo - margin));
    const glm::dvec3 extent = bounds.hi + margin - cells.origin;
    const Cost cost{options.costs};
    // The device works with the float of 1 / size: use exactly that here.
    const double longest = std::max({extent.x, extent.y, extent.z});
    const RootChoice choice = options.roots ? RootChoice{longest / *options.roots, 0} : choose_root_size(ellipsoids, tree, cost, extent, max_references);
    cells.root_size = 1.0 / static_cast<double>(static_cast<float>(1.0 / choice.size));
    cells.roots = glm::uvec3(glm::max(glm::ceil(extent / cells.root_size), 1.0));
    const std::size_t roots = static_cast<std::size_t>(cells.roots.x) * cells.roots.y * cells.roots.z;

    // Which boxes of primitives meet which roots: counted, then filled, in primitive order.
    const auto range = [&](std::uint32_t i, glm::ivec3& lo, glm::ivec3& hi) {
        const Ellipsoid& e = ellipsoids[i];
        const glm::ivec3 last = glm::ivec3(cells.roots) - 1;
        lo = glm::clamp(glm::ivec3(glm::floor((e.center - e.half - cells.origin) / cells.root_size)), glm::ivec3(0), last);
        hi = glm::clamp(glm::ivec3(glm::floor((e.center + e.half - cells.origin) / cells.root_size)), glm::ivec3(0), last);
    };
    std::vector<std::uint64_t> offset(roots + 1, 0);
    const auto n = static_cast<std::uint32_t>(ellipsoids.size());
    // Slabs of roots, one thread each: every slab looks at all primitives, in order.
    const auto visit = [&](auto&& f) {
        parallel_chunks(cells.roots.z, (cells.roots.z + 3) / 4, [&](std::size_t slab_begin, std::size_t slab_end) {
            for (std::uint32_t i = 0; i < n; ++i) {
                glm::ivec3 lo, hi;
                range(i, lo, hi);
                const int z_lo = std::max(lo.z, static_cast<int>(slab_begin)), z_hi = std::min(hi.z, static_cast<int>(slab_end) - 1);
                for (int z = z_lo; z <= z_hi; ++z)
                    for (int y = lo.y; y <= hi.y; ++y)
                        for (int x = lo.x; x <= hi.x; ++x)
                            f(i, static_cast<std::size_t>(x) + static_cast<std::size_t>(cells.roots.x) * (static_cast<std::size_t>(y) + static_cast<std::size_t>(cells.roots.y) * static_cast<std::size_t>(z)));
            }
        });
    };
    visit([&](std::uint32_t, std::size_t root) { ++offset[root + 1]; });
    for (std::size_t r = 0; r < roots; ++r) offset[r + 1] += offset[r];
    require_memory("cells", {{"lists of the root cells", offset[roots] * sizeof(std::uint32_t) + roots * (sizeof(std::uint64_t) + sizeof(Subtree))}});
    std::vector<std::uint32_t> candidates(offset[roots]);
    {
        std::vector<std::uint64_t> cursor(offset.begin(), offset.end() - 1);
        visit([&](std::uint32_t i, std::size_t root) { candidates[cursor[root]++] = i; });
    }

    // As deep as integers at the finest level stay exact in float.
    std::uint32_t max_levels = std::min(options.max_levels, kMaxLevels);
    while (max_levels > 0 && (static_cast<std::uint64_t>(std::max({cells.roots.x, cells.roots.y, cells.roots.z})) << max_levels) > (1u << 22)) --max_levels;
    const double spare = static_cast<double>(max_references) / std::max(1.0, 0.6 * static_cast<double>(candidates.size()));
    const Refiner refiner{ellipsoids, cost, std::clamp(2.0 * spare, 1.5, 8.0), max_levels, 2.5 * choice.typical_cost, options.control};
    std::vector<Subtree> subtrees(roots);
    // How much they take shows only on the way: the rest is expected to take as much per candidate as those so far.
    std::atomic<std::size_t> candidates_done{0}, bytes_done{0};
    parallel_chunks(roots, 64, [&](std::size_t begin, std::size_t end) {
        if (candidates_done > 0) {
            const double left = static_cast<double>(candidates.size() - candidates_done), each = static_cast<double>(bytes_done) / static_cast<double>(candidates_done);
            require_memory("cells", {{"to split them further", static_cast<std::uint64_t>(0.9 * left * each)}});
        }
        std::size_t bytes = 0;
        for (std::size_t r = begin; r < end; ++r) {
            const glm::dvec3 at(r % cells.roots.x, r / cells.roots.x % cells.roots.y, r / cells.roots.x / cells.roots.y);
            const Box box{cells.origin + at * cells.root_size, cells.origin + (at + 1.0) * cells.root_size};
            List list = list_of(ellipsoids, std::span(candidates).subspan(offset[r], offset[r + 1] - offset[r]), box);
            if (!list.primitives.empty()) subtrees[r].root = refiner.refine(subtrees[r], box, std::move(list), 0);
            bytes += subtrees[r].byte_size();
        }
        bytes_done += bytes;
        candidates_done += offset[end] - offset[begin];
    });

    // One table: roots, then all blocks; leaves in the order of their roots.
    std::size_t entries = roots, leaf_count = 0;
    for (const auto& s : subtrees) {
        cells.levels = std::max(cells.levels, s.depth);
        entries += s.blocks.size();
        leaf_count += s.leaves.size();
    }
    require_memory("cells", {{"table", entries * sizeof(std::uint32_t)}, {"leaves", leaf_count * sizeof(Cells::Leaf)}});
    cells.table.reserve(entries);
    cells.leaves.reserve(leaf_count);
    cells.table.assign(roots, 1);
    const auto place = [&](std::uint32_t entry, std::size_t first_block, std::size_t first_leaf) -> std::uint32_t {
        if (entry & CELL_INNER) return CELL_INNER | static_cast<std::uint32_t>(roots + 8 * ((entry & ~CELL_INNER) + first_block));
        return entry < CELL_EMPTY_MAX ? entry : entry + static_cast<std::uint32_t>(first_leaf);
    };
    std::size_t blocks = 0;
    for (std::size_t r = 0; r < roots; ++r) {
        Subtree& s = subtrees[r];
        cells.table[r] = place(s.root, blocks, cells.leaves.size());
        const std::size_t first_leaf = cells.leaves.size();
        for (const std::uint32_t entry : s.blocks) cells.table.push_back(place(entry, blocks, first_leaf));
        for (auto& leaf : s.leaves) {
            cells.references += leaf.primitives.size();
            cells.leaves.push_back(std::move(leaf));
        }
        blocks += s.blocks.size() / 8;
        s = {};
    }
    measure_emptiness(std::span(cells.table).first(roots), cells.roots);
    return cells;
}

double scene_bound(std::span<const Ellipsoid> ellipsoids, const BvhTree& tree) {
    if (ellipsoids.empty()) return 0;
    struct Candidate {
        double bound;
        Box box;
        bool operator<(const Candidate& other) const { return bound < other.bound; }
    };
    double highest = 0;  // density found at a box's middle
    const auto bounded = [&](const Box& box) {
        Candidate c{0, box};
        const glm::dvec3 middle = 0.5 * (box.lo + box.hi);
        const Box point{middle, middle};
        double here = 0;
        tree.overlapping(ellipsoids, box, [&](std::uint32_t i) {
            c.bound += box_extinction(ellipsoids[i], box);
            here += box_extinction(ellipsoids[i], point);
        });
        highest = std::max(highest, here);
        return c;
    };
    std::priority_queue<Candidate> queue;
    queue.push(bounded(bounds_of(ellipsoids)));
    for (int split = 0; split < 4000 / 8; ++split) {
        const Candidate top = queue.top();
        if (top.bound <= 1.02 * highest) break;
        queue.pop();
        for (int k = 0; k < 8; ++k) queue.push(bounded(octant(top.box, k)));
    }
    return queue.top().bound * (1 + 1e-5);
}

}  // namespace clume
