// SPDX-License-Identifier: MIT
// The spatial cells as a structure, on the host: every primitive that meets a cell is in its list, each bound and the
// majorant hold everywhere in the cell, empty cells know their distance, and threads change nothing.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <sched.h>

#include "src/cell_cache.h"
#include "src/cells.h"
#include "tests/flight_reference.h"
#include "tests/temp_folder.h"

namespace {

using namespace clume;
using namespace clume::probing;

struct Built {
    std::string name;
    HostArray<Ellipsoid> ellipsoids;
    Cells cells;
};

Cells build(const HostArray<Ellipsoid>& e, bool chords) {
    CellOptions options;
    options.costs.null_share = chords ? 0 : 1;
    options.costs.chord_share = chords ? 1 : 0;
    options.max_references = std::max<std::size_t>(std::size_t{2} << 20, 10 * e.size());
    return build_cells(e, build_bvh(e), options);
}

/// One huge and many tiny primitives.
Scene huge_and_tiny() {
    Scene scene = overlapping_mixture({KernelFamily::gaussian}, 1, 1);
    TestRandom random(2);
    auto& list = scene.media[0].primitives;
    list[0].axes *= 4.0;
    for (int i = 0; i < 600; ++i)
        list.push_back(reference::make_primitive({random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4)}, glm::dvec3(random.spread(1e-4, 1e-2)), random.spread(1, 100),
                                                 {random.uniform(), random.uniform(), random.uniform()}));
    return scene;
}

/// Needles of axis ratio 1e4 and discs, in every direction, some along the axes.
Scene needles() {
    Scene scene = overlapping_mixture({KernelFamily::epanechnikov, KernelFamily::gaussian}, 2, 1);
    TestRandom random(3);
    for (int i = 0; i < 300; ++i)
        scene.media[static_cast<std::size_t>(i % 2)].primitives.push_back(reference::make_primitive(
            {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5)}, i % 3 ? glm::dvec3(0.3, 3e-5, 3e-5) : glm::dvec3(0.2, 0.2, 2e-5), 100,
            i % 5 ? glm::dvec3(random.uniform(), random.uniform(), random.uniform()) : glm::dvec3(0)));
    return scene;
}

/// Small clusters far apart: mostly empty space.
Scene clusters() {
    Scene scene = overlapping_mixture({KernelFamily::uniform, KernelFamily::gaussian}, 2, 1);
    for (auto& m : scene.media) m.primitives.clear();
    TestRandom random(4);
    for (int c = 0; c < 12; ++c) {
        const glm::dvec3 at(random.uniform(-8, 8), random.uniform(-8, 8), random.uniform(-8, 8));
        for (int i = 0; i < 40; ++i)
            scene.media[static_cast<std::size_t>(i % 2)].primitives.push_back(reference::make_primitive(
                at + 0.2 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)), glm::dvec3(0.05 * random.spread(0.3, 3)), 4));
    }
    return scene;
}

const std::vector<std::pair<std::string, Scene>>& scenes() {
    static const std::vector<std::pair<std::string, Scene>> all = {
        {"gaussians", reference::random_mixture(KernelFamily::gaussian, 800, 5)},
        {"epanechnikovs", reference::random_mixture(KernelFamily::epanechnikov, 300, 6)},
        {"uniforms", reference::random_mixture(KernelFamily::uniform, 300, 7)},
        {"one", overlapping_mixture({KernelFamily::gaussian}, 1, 8)},
        {"mixed", overlapping_mixture({KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform}, 60, 9)},
        {"huge and tiny", huge_and_tiny()},
        {"needles", needles()},
        {"clusters", clusters()},
    };
    return all;
}

const std::vector<Built>& built() {
    static const std::vector<Built> all = [] {
        std::vector<Built> b;
        for (const auto& [name, scene] : scenes())
            for (const bool chords : {false, true}) {
                const auto e = make_ellipsoids(scene, normalize(scene));
                b.push_back({name + (chords ? ", chords" : ", null collisions"), e, build(e, chords)});
            }
        return b;
    }();
    return all;
}

double density(const Ellipsoid& e, const glm::dvec3& x) {
    const glm::dvec3 v = x - e.center;
    const glm::dvec3 a(e.w[0] * v.x + e.w[1] * v.y + e.w[2] * v.z, e.w[3] * v.y + e.w[4] * v.z, e.w[5] * v.z);
    const double r2 = glm::dot(a, a);
    if (r2 >= e.extent * e.extent) return 0;
    return e.sigma * (e.family == KernelFamily::gaussian ? std::exp(-0.5 * r2) : e.family == KernelFamily::uniform ? 1 : 1 - r2 / (e.extent * e.extent));
}

/// Calls visit(link, box) for every cell that is not split.
template <class Visit>
void for_each_cell(const Cells& c, const Visit& visit) {
    const auto walk = [&](const auto& self, std::uint32_t link, const Box& box) -> void {
        if (!(link & CELL_INNER)) return visit(link, box);
        const glm::dvec3 middle = 0.5 * (box.lo + box.hi);
        for (int k = 0; k < 8; ++k) {
            Box child = box;
            for (int axis = 0; axis < 3; ++axis) ((k >> axis & 1) ? child.lo : child.hi)[axis] = middle[axis];
            self(self, c.table[(link & ~CELL_INNER) + static_cast<std::uint32_t>(k)], child);
        }
    };
    for (std::uint32_t z = 0; z < c.roots.z; ++z)
        for (std::uint32_t y = 0; y < c.roots.y; ++y)
            for (std::uint32_t x = 0; x < c.roots.x; ++x) {
                const glm::dvec3 lo = c.origin + glm::dvec3(x, y, z) * c.root_size;
                walk(walk, c.table[x + c.roots.x * (y + c.roots.y * z)], {lo, lo + c.root_size});
            }
}

/// The link of the cell that holds x; CELL_EMPTY_MAX's complement if outside the grid.
std::uint32_t link_at(const Cells& c, const glm::dvec3& x) {
    glm::dvec3 q = (x - c.origin) / c.root_size;
    glm::dvec3 cell = glm::floor(q);
    for (int k = 0; k < 3; ++k)
        if (cell[k] < 0 || cell[k] >= c.roots[k]) return 0;
    std::uint32_t link = c.table[static_cast<std::size_t>(cell.x) + c.roots.x * (static_cast<std::size_t>(cell.y) + c.roots.y * static_cast<std::size_t>(cell.z))];
    q -= cell;
    while (link & CELL_INNER) {
        q *= 2.0;
        cell = glm::floor(q);
        link = c.table[(link & ~CELL_INNER) + static_cast<std::uint32_t>(cell.x + 2 * cell.y + 4 * cell.z)];
        q -= cell;
    }
    return link;
}

/// The point of the box where the primitive is densest: coordinate descent on a convex function, run to the end.
glm::dvec3 densest_in(const Ellipsoid& e, const Box& box) {
    glm::dvec3 best = glm::clamp(e.center, box.lo, box.hi);
    const double* w = e.w;
    const double m[3][3] = {{w[0] * w[0], w[0] * w[1], w[0] * w[2]}, {w[0] * w[1], w[1] * w[1] + w[3] * w[3], w[1] * w[2] + w[3] * w[4]}, {w[0] * w[2], w[1] * w[2] + w[3] * w[4], w[2] * w[2] + w[4] * w[4] + w[5] * w[5]}};
    for (int sweep = 0; sweep < 200; ++sweep)
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            best[k] = std::clamp(e.center[k] - (m[k][i] * (best[i] - e.center[i]) + m[k][j] * (best[j] - e.center[j])) / m[k][k], box.lo[k], box.hi[k]);
        }
    return best;
}

}  // namespace

TEST_CASE("Cells.ListEveryPrimitiveThatMeetsThem", "[cells][quick]") {
    TestRandom random(10);
    for (const Built& b : built()) {
        const auto check_at = [&](const glm::dvec3& x) {
            double all = 0, listed = 0;
            for (const Ellipsoid& e : b.ellipsoids) all += density(e, x);
            const std::uint32_t link = link_at(b.cells, x);
            if (link >= CELL_EMPTY_MAX) {
                const Cells::Leaf& leaf = b.cells.leaves[link - CELL_EMPTY_MAX];
                for (const std::uint32_t i : leaf.primitives) listed += density(b.ellipsoids[i], x);
                if (all > leaf.majorant) FAIL(b.name << ": density " << all << " above the majorant " << leaf.majorant);
            }
            if (std::abs(all - listed) > 1e-12 * all) FAIL(b.name << ": density " << all << ", of the cell's list " << listed);
        };
        const glm::dvec3 size = glm::dvec3(b.cells.roots) * b.cells.root_size;
        for (int i = 0; i < 2000; ++i) check_at(b.cells.origin + size * glm::dvec3(random.uniform(), random.uniform(), random.uniform()));
        for (int i = 0; i < 3000; ++i) {  // inside supports, just inside their surface too
            const Ellipsoid& e = b.ellipsoids[static_cast<std::size_t>(random.below(static_cast<int>(b.ellipsoids.size())))];
            glm::dvec3 z(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
            z *= e.extent * (i % 2 ? 1 - 1e-7 : random.uniform()) / glm::length(z);
            glm::dvec3 v;
            v.z = z.z / e.w[5], v.y = (z.y - e.w[4] * v.z) / e.w[3], v.x = (z.x - e.w[1] * v.y - e.w[2] * v.z) / e.w[0];
            check_at(e.center + v);
        }
    }
    SUCCEED();
}

TEST_CASE("Cells.BoundsHoldAtTheDensestPoint", "[cells][quick]") {
    TestRandom random(11);
    std::size_t bounds = 0;
    double tightest = 1e300;
    for (const Built& b : built()) {
        std::size_t seen = 0;
        for_each_cell(b.cells, [&](std::uint32_t link, const Box& box) {
            if (link < CELL_EMPTY_MAX || (seen++ > 500 && random.below(20) != 0) || bounds > 400000) return;
            const Cells::Leaf& leaf = b.cells.leaves[link - CELL_EMPTY_MAX];
            REQUIRE(leaf.bounds.size() == leaf.primitives.size());
            REQUIRE(std::is_sorted(leaf.primitives.begin(), leaf.primitives.end()));
            const auto total = [&](const glm::dvec3& x) {
                double sum = 0;
                for (const std::uint32_t i : leaf.primitives) sum += density(b.ellipsoids[i], x);
                return sum;
            };
            double sum = 0;
            glm::dvec3 start = 0.5 * (box.lo + box.hi);
            for (std::size_t k = 0; k < leaf.primitives.size(); ++k) {
                const Ellipsoid& e = b.ellipsoids[leaf.primitives[k]];
                const glm::dvec3 x = densest_in(e, box);
                const double bound = static_cast<double>(leaf.bounds[k]);
                if (density(e, x) > bound) FAIL(b.name << ": density " << density(e, x) << " above its bound " << bound);
                sum += bound;
                ++bounds;
                if (k < 8 && total(x) > total(start)) start = x;
            }
            // The whole density's local maximum, climbed from the best of these points.
            double step = 0.25 * (box.hi.x - box.lo.x), best = total(start);
            for (int k = 0; k < 24; ++k) {
                const glm::dvec3 x = glm::clamp(start + step * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)), box.lo, box.hi);
                const double value = total(x);
                if (value > best) start = x, best = value;
                else step *= 0.8;
            }
            if (best > leaf.majorant) FAIL(b.name << ": density " << best << " above the majorant " << leaf.majorant);
            if (std::abs(sum / leaf.majorant - 1) > 1e-6) FAIL(b.name << ": the majorant is not the sum of the bounds");
            tightest = std::min(tightest, leaf.majorant / best);
        });
    }
    report(fmt::format("{} bounds, tightest majorant {:.5f} of the density", bounds, tightest));
    CHECK(tightest >= 1);
    CHECK(tightest < 1.01);
}

TEST_CASE("Cells.EmptyOnesKnowTheirDistance", "[cells][quick]") {
    // An empty cell of distance k says that all roots within k − 1 of it are empty: counted over prefix sums of the others.
    std::size_t far = 0;
    for (const Built& b : built()) {
        const glm::ivec3 n(b.cells.roots);
        std::vector<std::int64_t> sum(static_cast<std::size_t>((n.x + 1) * (n.y + 1) * (n.z + 1)));
        const auto prefix = [&](int x, int y, int z) -> std::int64_t& { return sum[static_cast<std::size_t>(x + (n.x + 1) * (y + (n.y + 1) * z))]; };
        const auto link = [&](int x, int y, int z) { return b.cells.table[static_cast<std::size_t>(x + n.x * (y + n.y * z))]; };
        for (int z = 0; z < n.z; ++z)
            for (int y = 0; y < n.y; ++y)
                for (int x = 0; x < n.x; ++x)
                    prefix(x + 1, y + 1, z + 1) = (link(x, y, z) >= CELL_EMPTY_MAX) + prefix(x, y + 1, z + 1) + prefix(x + 1, y, z + 1) + prefix(x + 1, y + 1, z) - prefix(x, y, z + 1) -
                                                  prefix(x, y + 1, z) - prefix(x + 1, y, z) + prefix(x, y, z);
        std::size_t wrong = 0;
        for (int z = 0; z < n.z; ++z)
            for (int y = 0; y < n.y; ++y)
                for (int x = 0; x < n.x; ++x) {
                    if (link(x, y, z) >= CELL_EMPTY_MAX) continue;
                    const int reach = static_cast<int>(link(x, y, z)) - 1;
                    const int x0 = std::max(0, x - reach), x1 = std::min(n.x, x + reach + 1), y0 = std::max(0, y - reach), y1 = std::min(n.y, y + reach + 1), z0 = std::max(0, z - reach),
                              z1 = std::min(n.z, z + reach + 1);
                    const std::int64_t full = prefix(x1, y1, z1) - prefix(x0, y1, z1) - prefix(x1, y0, z1) - prefix(x1, y1, z0) + prefix(x0, y0, z1) + prefix(x0, y1, z0) + prefix(x1, y0, z0) - prefix(x0, y0, z0);
                    wrong += reach < 0 || full != 0;
                    far += reach > 2;
                }
        INFO(b.name);
        CHECK(wrong == 0);
    }
    CHECK(far > 100);
}

TEST_CASE("Cells.ThreadsChangeNothing", "[cells][quick]") {
    const auto same = [](const Cells& a, const Cells& b) {
        if (a.table != b.table || a.leaves.size() != b.leaves.size() || a.root_size != b.root_size || a.levels != b.levels) return false;
        for (std::size_t i = 0; i < a.leaves.size(); ++i)
            if (a.leaves[i].primitives != b.leaves[i].primitives || a.leaves[i].bounds != b.leaves[i].bounds || a.leaves[i].majorant != b.leaves[i].majorant) return false;
        return true;
    };
    // On one core, hardware_concurrency is 1 and so is the number of threads.
    cpu_set_t before, one;
    REQUIRE(sched_getaffinity(0, sizeof before, &before) == 0);
    CPU_ZERO(&one);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
        if (CPU_ISSET(cpu, &before)) {
            CPU_SET(cpu, &one);
            break;
        }
    for (const auto& [name, scene] : scenes()) {
        const auto many_e = make_ellipsoids(scene, normalize(scene));
        const Cells many = build(many_e, false);
        REQUIRE(sched_setaffinity(0, sizeof one, &one) == 0);
        const auto single_e = make_ellipsoids(scene, normalize(scene));
        const Cells single = build(single_e, false);
        REQUIRE(sched_setaffinity(0, sizeof before, &before) == 0);
        INFO(name);
        CHECK(same(many, single));
    }
}

TEST_CASE("Cells.AreKept", "[quick]") {
    const DeviceScene scene = make_device_scene(huge_and_tiny(), {});
    const BvhTree tree = build_bvh(scene.ellipsoids);
    CellOptions options, finer;
    options.max_references = finer.max_references = std::size_t{2} << 20;
    options.control = true;
    finer.roots = 20;
    const Binary built = encode_cells(build_cells(scene.ellipsoids, tree, options)), other = encode_cells(build_cells(scene.ellipsoids, tree, finer));
    REQUIRE(built != other);
    CHECK(encode_cells(decode_cells(built)) == built);

    const clume::test::TempFolder folder;
    int trees = 0;
    const TreeSource count_tree = [&]() -> const BvhTree& { return ++trees, tree; };
    const auto ask = [&](const CellOptions& o, double long_enough_s = 0) { return encode_cells(cached_cells(scene.ellipsoids, count_tree, o, folder.path(), long_enough_s)); };
    const auto files = [&] { return std::distance(std::filesystem::directory_iterator(folder.path()), std::filesystem::directory_iterator()); };
    CHECK(ask(options, 1e9) == built);
    CHECK(files() == 0);
    CHECK(ask(options) == built);
    REQUIRE(files() == 1);
    // A second start builds no tree.
    const int first_start = trees;
    CHECK(ask(options) == built);
    CHECK(trees == first_start);
    // What lies there is what is given, if it can be.
    const std::string key = std::filesystem::directory_iterator(folder.path())->path().stem().string();
    REQUIRE(store_binary(folder.path(), key, other));
    CHECK(ask(options) == other);
    for (const std::size_t size : {std::size_t{1}, built.size() / 2, built.size() - 1}) {
        REQUIRE(store_binary(folder.path(), key, std::span(built).first(size)));
        CHECK(ask(options) == built);
    }
    CHECK(ask(finer) == other);
    CHECK(files() == 2);
    // A scene that differs in one bit is another.
    HostArray<Ellipsoid> moved = scene.ellipsoids.values();
    moved[3].center.x = std::nextafter(moved[3].center.x, 9.0);
    (void)cached_cells(moved, count_tree, options, folder.path(), 0);
    CHECK(files() == 3);
    CHECK(encode_cells(cached_cells(scene.ellipsoids, count_tree, options, {}, 0)) == built);
}

TEST_CASE("Cells.AreBuiltWhereBuildingIsMeasured", "[quick]") {
    // As benchmarks ask for it: neither kept nor taken from what was.
    const clume::test::TempFolder cache;
    const char* before = std::getenv("XDG_CACHE_HOME");
    const std::string old = before ? before : "";
    setenv("XDG_CACHE_HOME", cache.path().c_str(), 1);
    RenderOptions options;
    options.kept_cells = false;
    const Scene scene = reference::ball_scene_n(20000);  // more than 50 ms
    const DeviceScene built = make_device_scene(scene, options);
    CHECK_FALSE(std::filesystem::exists(cells_folder()));
    CHECK(make_device_scene(scene, {}).hash() == built.hash());
    if (before) setenv("XDG_CACHE_HOME", old.c_str(), 1);
    else unsetenv("XDG_CACHE_HOME");
}
