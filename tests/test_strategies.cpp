// SPDX-License-Identifier: MIT
// Every distance strategy and transmittance estimator against double precision: flights by χ² (t, escape mass, primitive
// collided with), estimates of the transmittance by their mean, what is biased found to be so, bounds that bound, and event
// lists longer than what is held on the chip. Šidák over all tests of a case.
#include <fmt/format.h>
#include <numeric>
#include <span>

#include "tests/flight_reference.h"

namespace {

using namespace clume;
using namespace clume::probing;

constexpr auto kGaussian = KernelFamily::gaussian;
constexpr auto kEpanechnikov = KernelFamily::epanechnikov;
constexpr auto kUniform = KernelFamily::uniform;
const std::vector<KernelFamily> kMixed{kGaussian, kEpanechnikov, kUniform};

/// A program: strategy, estimator, bound and how the bound's grid is chosen.
struct Pair {
    const char *strategy, *transmittance = "analytic", *bound = "auto";
    int grid = 0;
    const char* root = "newton";
    std::string name() const { return fmt::format("{}/{}, bound {} {}, {}", strategy, transmittance, bound, grid, root); }
};

/// As make_device_scene has it, with a light that needs estimates of transmittance.
DeviceScene packed_scene(Scene scene, const Pair& pair) {
    Light light;
    light.kind = LightKind::directional;
    light.direction = {0, -1, 0};
    light.irradiance = glm::dvec3(1);
    scene.lights = {light};
    scene.render.strategy = pair.strategy;
    scene.render.transmittance = pair.transmittance;
    scene.render.bound = pair.bound;
    scene.render.root_finding = pair.root;
    if (pair.grid > 0) scene.render.majorant_grid = pair.grid;
    // Every primitive its own albedo, so that programs look the primitive up.
    int i = 0;
    for (auto& m : scene.media)
        for (auto& p : m.primitives) p.albedo = glm::dvec3(0.5 + 0.001 * (i++ % 400));
    return share_program(make_device_scene(scene, {}));
}

double extinction_at(std::span<const Ellipsoid> all, const glm::dvec3& x) {
    double sum = 0;
    for (const Ellipsoid& e : all) {
        const glm::dvec3 p = x - e.center;
        const glm::dvec3 z(e.w[0] * p.x + e.w[1] * p.y + e.w[2] * p.z, e.w[3] * p.y + e.w[4] * p.z, e.w[5] * p.z);
        const double r2 = glm::dot(z, z), e2 = e.extent * e.extent;
        if (r2 < e2) sum += e.sigma * (e.family == kGaussian ? std::exp(-0.5 * r2) : e.family == kUniform ? 1 : 1 - r2 / e2);
    }
    return sum;
}

/// The highest extinction in a box: random starts and centres, then a shrinking random walk from the best of them.
double highest_extinction(std::span<const Ellipsoid> all, const Box& box, TestRandom& random) {
    const glm::dvec3 size = box.hi - box.lo;
    std::vector<std::pair<double, glm::dvec3>> starts;
    const auto add = [&](const glm::dvec3& x) { starts.emplace_back(extinction_at(all, x), x); };
    for (int i = 0; i < 64; ++i) add(box.lo + size * glm::dvec3(random.uniform(), random.uniform(), random.uniform()));
    for (const Ellipsoid& e : all) add(glm::clamp(e.center, box.lo, box.hi));
    std::sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    double best = 0;
    for (std::size_t s = 0; s < std::min<std::size_t>(3, starts.size()); ++s) {
        auto [value, x] = starts[s];
        for (double step = 0.25; step > 1e-4; step *= 0.93) {
            const glm::dvec3 y = glm::clamp(x + step * size * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)), box.lo, box.hi);
            if (const double v = extinction_at(all, y); v > value) value = v, x = y;
        }
        best = std::max(best, value);
    }
    return best;
}

/// 2,000 primitives of all sizes over one point, depth about 2 through it.
Scene crowd() {
    Scene scene = overlapping_mixture({kGaussian, kUniform, kEpanechnikov}, 3, 1);
    for (auto& m : scene.media) m.primitives.clear();
    TestRandom random(14);
    for (int i = 0; i < 2000; ++i)
        scene.media[static_cast<std::size_t>(i % 3)].primitives.push_back(reference::make_primitive(
            0.01 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)), glm::dvec3(random.spread(0.1, 0.3), random.spread(0.1, 0.3), random.spread(0.1, 0.3)), 0.0015,
            {random.uniform(), random.uniform(), random.uniform()}));
    return scene;
}

}  // namespace

TEST_CASE("Strategies.FlightsFollowTheMixture", "[kernels]") {
    const std::pair<const char*, std::vector<KernelFamily>> families[] = {{"gaussian", {kGaussian}}, {"mixed", kMixed}};
    const Pair pairs[] = {{"regular"}, {"regular", "analytic", "auto", 0, "bisection"}, {"delta", "analytic", "scene"}, {"delta", "analytic", "grid", 7}, {"delta", "analytic", "grid"}, {"progressive"}};
    std::vector<std::pair<std::string, FlightP>> results;
    EscapeMass escape;
    // Of three families at least three, so that one program has them all.
    for (const auto& [name, kernels] : families)
        for (const std::size_t n : {std::size_t{1}, std::max<std::size_t>(2, kernels.size()), std::size_t{50}}) {
            const Scene mixture = overlapping_mixture(kernels, static_cast<int>(n), 140 + n);
            std::vector<FlightLaw> laws;
            for (const ProbeRay& r : kFlightRays) laws.emplace_back(packed_scene(mixture, {"regular"}).ellipsoids, r, 24);
            for (const Pair& pair : pairs) {
                // Alone it is a Gaussian in both cases, and all but `regular` treat it as they do many.
                if (n == 1 && (pair.strategy != std::string("regular") || pair.root != std::string("newton") || kernels.size() > 1)) continue;
                DeviceScene scene = packed_scene(mixture, pair);
                // With bounds that hold, `progressive` is unbiased as well.
                if (std::string(pair.strategy) == "progressive")
                    scene.learned.assign(scene.learned.size(), 1.05f * static_cast<float>(scene_bound(scene.ellipsoids, build_bvh(scene.ellipsoids))));
                Probe probe(test_device(), scene);
                for (std::uint32_t k = 0; k < std::size(kFlightRays); ++k) {
                    const FlightP p = flight_p(probe, laws[k], kFlightRays[k], 40000, k, n > 1);
                    results.emplace_back(fmt::format("{} of {}, {}, ray {}", n, name, pair.name(), k), p);
                    escape.add(pair.name(), p);
                }
            }
        }
    const double threshold = reference::sidak_threshold(1e-4, 2 * results.size());
    for (const auto& [what, p] : results) {
        INFO(what << ": p " << p.t << ", of the primitives " << p.winner);
        CHECK(p.t > threshold);
        CHECK(p.winner > threshold);
    }
    escape.check();
}

TEST_CASE("Strategies.BiasedOnesAreFoundBiased", "[kernels]") {
    // Not at all steps: with fine ones the bias falls below what 40,000 flights tell.
    Scene scene = overlapping_mixture({kGaussian}, 2, 42);
    const auto p_of = [&](const Pair& pair, double step) {
        scene.render.step = step;
        const DeviceScene packed = packed_scene(scene, pair);
        Probe probe(test_device(), packed);
        return flight_p(probe, packed.ellipsoids, kFlightRays[0], 40000, 5).t;
    };
    CHECK(p_of({"march"}, 0.3) < 1e-9);
    CHECK(p_of({"march-analytic"}, 0.3) < 1e-9);
    CHECK(p_of({"march-analytic"}, 0.002) > 1e-4);
    CHECK(p_of({"regular-linear"}, 1) < 1e-9);
    CHECK(p_of({"regular"}, 1) > 1e-4);
    // A bound that is too low and is not learned.
    DeviceScene low = packed_scene(scene, {"progressive"});
    for (float& bound : low.learned) bound *= 0.01f;
    Probe probe(test_device(), low);
    CHECK(flight_p(probe, low.ellipsoids, kFlightRays[0], 40000, 5).t < 1e-9);
}

TEST_CASE("Strategies.MarchingAnalyticallyEscapesExactly", "[kernels]") {
    // Its depth per step is exact: however coarse the step, as much escapes as should.
    Scene scene = overlapping_mixture(kMixed, 60, 43);
    scene.render.step = 0.4;
    const DeviceScene packed = packed_scene(scene, {"march-analytic"});
    Probe probe(test_device(), packed);
    double z = 0;
    for (const ProbeRay& r : kFlightRays) z += flight_p(probe, packed.ellipsoids, r, 20000, 6).escape_z / std::sqrt(3.0);
    CHECK(std::abs(z) < 4);
}

TEST_CASE("Strategies.EstimatorsHaveTheRightMean", "[kernels]") {
    const Pair pairs[] = {{"delta", "ratio"}, {"delta", "residual-ratio", "grid", 24}, {"delta", "binary"}, {"decomposition", "binary"}, {"regular", "ratio", "scene"}, {"delta", "residual-ratio", "scene"}};
    std::vector<double> p;
    std::vector<std::string> what;
    for (const int n : {2, 200})
        for (const double density : {1.0, 4.0})
            for (const Pair& pair : pairs) {
                Scene scene = overlapping_mixture(kMixed, n, 50);
                for (auto& m : scene.media) m.density_scale = density;
                const DeviceScene packed = packed_scene(scene, pair);
                Probe probe(test_device(), packed);
                std::uint32_t sample = 0;
                for (const ProbeRay& r : kFlightRays) {
                    double depth = 0, sum = 0, square = 0;
                    for (const Ellipsoid& e : packed.ellipsoids) depth += LinePrimitive(e, r).depth(1e30);
                    const double count = 20000, t = std::exp(-depth);
                    for (const ProbeHit& h : probe.estimated_transmittances(std::vector<ProbeRay>(20000, r), sample++).values) {
                        const double x = static_cast<double>(h.transmittance);
                        sum += x;
                        square += x * x;
                    }
                    const double mean = sum / count, variance = std::max(square / count - mean * mean, t * 1e-4) / count;
                    p.push_back(reference::z_test_p((mean - t) / std::sqrt(variance)));
                    what.push_back(fmt::format("{} of density {}, {}: {} for {}", n, density, pair.name(), mean, t));
                }
            }
    for (std::size_t i = 0; i < p.size(); ++i) {
        INFO(what[i]);
        CHECK(p[i] > reference::sidak_threshold(1e-4, p.size()));
    }
}

TEST_CASE("Strategies.EventListsHaveNoLimit", "[kernels]") {
    // Eight times as many chords as are held at once overlap at one point: the rest is summed by traversals.
    const Scene scene = crowd();
    const ProbeRay rays[] = {ray({0, 0, -1.9}, {0.001, 0.002, 1}), ray({0.003, 0, 0.001}, {0.2, 0.3, -0.5})};
    for (const Pair& pair : {Pair{"regular"}, {"march-analytic"}, {"regular-linear"}}) {
        const DeviceScene packed = packed_scene(scene, pair);
        Probe probe(test_device(), packed);
        for (const ProbeRay& r : rays) {
            const FlightP p = flight_p(probe, packed.ellipsoids, r, 600, 2);
            INFO(pair.name() << ": p " << p.t << ", escape " << p.escape_z);
            CHECK(std::abs(p.escape_z) < 4);
            if (std::string(pair.strategy) == "regular") CHECK(p.t > 1e-5);
        }
    }
}

TEST_CASE("Strategies.RegularDrawsAsDecompositionDoes", "[kernels]") {
    const Scene scene = overlapping_mixture(kMixed, 70, 61);
    for (const ProbeRay& r : kFlightRays) {
        std::vector<double> histogram[2];
        for (int k = 0; k < 2; ++k) {
            const DeviceScene packed = packed_scene(scene, k ? Pair{"regular"} : Pair{"decomposition"});
            const FlightLaw law(packed.ellipsoids, r, 40);
            histogram[k].assign(law.bins + 1, 0);
            Probe probe(test_device(), packed);
            for (const auto& h : probe.flights(std::vector<ProbeRay>(20000, r), static_cast<std::uint32_t>(k)).values)
                histogram[k][h.collided() ? law.bin(static_cast<double>(h.t)) : law.bins] += 1;
        }
        CHECK(reference::chi_square_two(histogram[0], histogram[1]).p > 1e-5);
    }
}

TEST_CASE("Strategies.WidthsGiveTheSameBits", "[kernels]") {
    const auto rays = random_rays(500, 8);
    const Scene scene = overlapping_mixture(kMixed, 300, 12);
    for (const Pair& pair : {Pair{"regular", "ratio"}, {"march-analytic", "march"}, {"delta", "residual-ratio", "scene"}, {"progressive", "binary"}}) {
        const DeviceScene packed = packed_scene(scene, pair);
        std::vector<ProbeHit> first, estimates;
        for (const int width : kWidths) {
            // `regular` has chords at every width; what the others have beside them is tested at both ends.
            if ((width == 8 || width == 4) && std::string(pair.strategy) != "regular") continue;
            Probe probe(test_device(), packed, width);
            const auto hits = probe.flights(rays, 3).values, transmittances = probe.estimated_transmittances(rays, 3).values;
            if (first.empty()) first = hits, estimates = transmittances;
            INFO(pair.name() << ", width " << width);
            CHECK(first_difference(first, hits) == rays.size());
            CHECK(first_difference(estimates, transmittances) == rays.size());
        }
    }
}

TEST_CASE("Bounds.AreAboveTheDensityEverywhere", "[kernels]") {
    TestRandom random(71);
    double looseness = 0;
    std::size_t boxes = 0;
    for (const auto& kernels : {std::vector<KernelFamily>{kGaussian}, std::vector<KernelFamily>{kUniform}, kMixed}) {
        const DeviceScene packed = packed_scene(overlapping_mixture(kernels, 60, 72), {"delta"});
        const auto& all = packed.ellipsoids;
        const BvhTree tree = build_bvh(all);
        const double whole = scene_bound(all, tree), found = highest_extinction(all, bounds_of(all), random);
        CHECK(whole >= found);
        CHECK(whole < 1.3 * found);
        for (const bool grid : {true, false}) {
            CellOptions options;
            options.max_levels = grid ? 0 : 8;
            if (grid) options.roots = 9;
            options.control = true;
            options.max_references = std::size_t{1} << 20;
            const Cells cells = build_cells(all, tree, options);
            const std::size_t roots = static_cast<std::size_t>(cells.roots.x) * cells.roots.y * cells.roots.z;
            const std::function<void(std::uint32_t, const Box&)> visit = [&](std::uint32_t link, const Box& box) {
                if (link & CELL_INNER) {
                    for (int k = 0; k < 8; ++k) {
                        const glm::dvec3 half = 0.5 * (box.hi - box.lo), lo = box.lo + half * glm::dvec3(k & 1, k >> 1 & 1, k >> 2);
                        visit(cells.table[(link & ~CELL_INNER) + static_cast<std::uint32_t>(k)], {lo, lo + half});
                    }
                    return;
                }
                if (boxes++ % 3 && link < CELL_EMPTY_MAX) return;
                const double highest = highest_extinction(all, box, random);
                if (link < CELL_EMPTY_MAX) {
                    if (highest > 0) FAIL("an empty cell holds " << highest);
                    return;
                }
                const Cells::Leaf& leaf = cells.leaves[link - CELL_EMPTY_MAX];
                if (!(leaf.majorant >= highest)) FAIL("bound " << leaf.majorant << " below " << highest);
                looseness = std::max(looseness, leaf.majorant / std::max(highest, 1e-3));
                for (int i = 0; i < 20; ++i)
                    if (extinction_at(all, box.lo + (box.hi - box.lo) * glm::dvec3(random.uniform(), random.uniform(), random.uniform())) < leaf.control) FAIL("control too high");
            };
            for (std::size_t r = 0; r < roots; ++r) {
                const glm::dvec3 at(r % cells.roots.x, r / cells.roots.x % cells.roots.y, r / cells.roots.x / cells.roots.y);
                visit(cells.table[r], {cells.origin + at * cells.root_size, cells.origin + (at + 1.0) * cells.root_size});
            }
        }
    }
    report(fmt::format("{} cells", boxes));
    CHECK(boxes > 500);
}
