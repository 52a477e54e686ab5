// SPDX-License-Identifier: MIT
// Mixtures for the flight tests and, in double precision, what free flights along one ray through them must do: the
// distribution of t, of the primitive collided with, and the escape mass. Closed forms per primitive, Gauss quadrature
// between the points where a support begins or ends. Normalised coordinates, as the device's.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "src/bvh.h"
#include "src/cells.h"
#include "src/device_scene.h"
#include "src/probe.h"
#include "tests/probe_harness.h"
#include "tests/reference/analytic_scenes.h"
#include "tests/reference/statistics.h"

namespace clume::probing {

/// One primitive along one ray.
struct LinePrimitive {
    KernelFamily family;
    double sigma, w, t_perp, d2, h, e2;

    LinePrimitive(const Ellipsoid& e, const ProbeRay& r) : family(e.family), sigma(e.sigma), e2(e.extent * e.extent) {
        const auto at = [&](const glm::dvec3& x) { return glm::dvec3(e.w[0] * x.x + e.w[1] * x.y + e.w[2] * x.z, e.w[3] * x.y + e.w[4] * x.z, e.w[5] * x.z); };
        const glm::dvec3 a = at(glm::dvec3(r.origin[0], r.origin[1], r.origin[2]) - e.center), b = at({r.direction[0], r.direction[1], r.direction[2]});
        w = glm::length(b);
        t_perp = -glm::dot(a, b) / (w * w);
        const glm::dvec3 p = a + t_perp * b;
        d2 = glm::dot(p, p);
        h = d2 < e2 ? std::sqrt(e2 - d2) : 0;
    }
    bool hit() const { return h > 0 && t_perp + h / w > 0; }
    double enter() const { return std::max(0.0, t_perp - h / w); }
    double exit() const { return t_perp + h / w; }

    double density(double t) const {
        const double u = w * (t - t_perp), r2 = d2 + u * u;
        if (r2 >= e2) return 0;
        return sigma * (family == KernelFamily::gaussian ? std::exp(-0.5 * r2) : family == KernelFamily::uniform ? 1 : 1 - r2 / e2);
    }
    /// From the ray's begin to t.
    double depth(double t) const {
        if (!hit() || t <= enter()) return 0;
        const double u0 = w * (enter() - t_perp), u1 = w * (std::min(t, exit()) - t_perp);
        if (family == KernelFamily::uniform) return sigma * (u1 - u0) / w;
        if (family == KernelFamily::gaussian)
            return sigma * std::sqrt(std::numbers::pi / 2) * std::exp(-0.5 * d2) / w * (std::erf(u1 / std::numbers::sqrt2) - std::erf(u0 / std::numbers::sqrt2));
        return sigma / (w * e2) * (u1 - u0) * (h * h - (u0 * u0 + u0 * u1 + u1 * u1) / 3);
    }
};

/// Expected collisions: per primitive and bin of t, probabilities; what is left escapes.
struct FlightLaw {
    double first = 1e300, last = 0;  ///< where the media begin and end on the ray
    std::size_t bins;
    std::vector<std::size_t> ids;              ///< of the primitives hit
    std::vector<std::vector<double>> by_primitive;  ///< [primitive hit][bin]
    std::vector<double> by_bin;                ///< bins, then the escape mass

    FlightLaw(std::span<const Ellipsoid> ellipsoids, const ProbeRay& ray, std::size_t bin_count) : bins(bin_count), by_bin(bin_count + 1) {
        std::vector<LinePrimitive> line;
        for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
            const LinePrimitive p(ellipsoids[i], ray);
            if (!p.hit()) continue;
            line.push_back(p);
            ids.push_back(i);
            first = std::min(first, p.enter());
            last = std::max(last, p.exit());
        }
        by_primitive.assign(line.size(), std::vector<double>(bins));
        if (line.empty()) {
            by_bin[bins] = 1;
            return;
        }
        std::vector<double> cuts;
        for (std::size_t b = 0; b <= bins; ++b) cuts.push_back(first + (last - first) * static_cast<double>(b) / static_cast<double>(bins));
        for (const auto& p : line) cuts.push_back(p.enter()), cuts.push_back(p.exit());
        std::sort(cuts.begin(), cuts.end());
        static constexpr double node[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
        static constexpr double weight[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
        for (std::size_t c = 0; c + 1 < cuts.size(); ++c) {
            const double middle = 0.5 * (cuts[c] + cuts[c + 1]), half = 0.5 * (cuts[c + 1] - cuts[c]);
            if (!(half > 0)) continue;
            const std::size_t b = bin(middle);
            for (int k = 0; k < 8; ++k) {
                const double t = middle + (k % 2 ? half : -half) * node[k / 2];
                double tau = 0;
                for (const auto& p : line) tau += p.depth(t);
                for (std::size_t i = 0; i < line.size(); ++i) by_primitive[i][b] += half * weight[k / 2] * line[i].density(t) * std::exp(-tau);
            }
        }
        double tau = 0;
        for (const auto& p : line) tau += p.depth(last);
        by_bin[bins] = std::exp(-tau);
        for (const auto& row : by_primitive)
            for (std::size_t b = 0; b < bins; ++b) by_bin[b] += row[b];
    }
    std::size_t bin(double t) const { return static_cast<std::size_t>(std::clamp((t - first) / (last - first) * static_cast<double>(bins), 0.0, static_cast<double>(bins - 1))); }
};

inline Scene empty_scene() {
    Scene scene;
    scene.path = "flights";
    scene.camera.origin = {0, 0, -4};
    scene.film = {16, 16};
    return scene;
}

/// `n` overlapping ellipsoids about the origin, families of `kernels` in turn, each with an extent of its own; a ray
/// through the middle has an optical depth of about 2.
inline Scene overlapping_mixture(const std::vector<KernelFamily>& kernels, int n, std::uint64_t seed) {
    Scene scene = empty_scene();
    TestRandom random(seed);
    for (const KernelFamily k : kernels) {
        EllipsoidMedium m;
        m.kernel = k;
        m.extent = k == KernelFamily::gaussian ? 3 : k == KernelFamily::epanechnikov ? 2.2 : 1.6;
        scene.media.push_back(m);
    }
    for (int i = 0; i < n; ++i) {
        const double s = 0.25;
        const glm::dvec3 scale(s * random.spread(0.5, 2), s * random.spread(0.5, 2), s * random.spread(0.5, 2));
        const glm::dvec3 at = n == 1 ? glm::dvec3(0.02, -0.03, 0.01) : 0.35 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        scene.media[static_cast<std::size_t>(i) % kernels.size()].primitives.push_back(
            reference::make_primitive(at, scale, (n < 3 ? 4.0 : 12.0) / n * random.spread(0.5, 2), {random.uniform(), random.uniform(), random.uniform()}));
    }
    return scene;
}

inline DeviceScene device_scene(Scene scene, const std::string& strategy, const std::string& accelerator) {
    scene.render.strategy = strategy;
    RenderOptions options;
    options.accelerator = accelerator;
    return make_device_scene(scene, options);
}

/// The scene for `decomposition` on cells much finer than the builder would choose (for chords it likes few large ones), so
/// that a ray crosses many of them; packed here, by layout.h, apart from the renderer's own packing.
inline DeviceScene fine_cells(const Scene& scene, double step_cost = 0.5) {
    DeviceScene out = device_scene(scene, "decomposition", "cells");
    CellOptions options;
    options.costs.step = step_cost;
    options.max_references = std::size_t{1} << 20;
    const Cells cells = build_cells(out.ellipsoids, build_bvh(out.ellipsoids), options);
    HostArray<device::CellEntry> table;
    for (const std::uint32_t link : cells.table) table.push_back({link, 0, 0, 0});
    HostArray<device::CellLeaf> leaves;
    HostArray<float> groups;
    HostArray<device::uint> group_medium;
    for (const Cells::Leaf& leaf : cells.leaves) {
        const auto first = static_cast<device::uint>(group_medium.size());
        for (std::size_t i = 0; i < leaf.primitives.size();) {
            const std::size_t base = groups.size();
            groups.resize(base + CLUME_GROUP_FLOATS);
            const std::uint32_t medium = out.ellipsoids[leaf.primitives[i]].medium;
            group_medium.push_back(medium);
            for (std::size_t lane = 0; lane < CLUME_GROUP_SIZE; ++lane) {
                float* row = groups.data() + base + lane;
                const bool used = i < leaf.primitives.size() && out.ellipsoids[leaf.primitives[i]].medium == medium;
                const float nothing[] = {1e6f, 2e6f, 3e6f, 1, 0, 0, 1, 0, 1, 0, from_bits(CLUME_NO_PRIMITIVE)};
                for (std::size_t r = 0; r < CLUME_GROUP_ROWS; ++r) row[16 * r] = nothing[r];
                if (!used) continue;
                const Ellipsoid& e = out.ellipsoids[leaf.primitives[i]];
                for (int k = 0; k < 3; ++k) row[16 * (CLUME_ROW_MU + k)] = static_cast<float>(e.center[k]);
                for (int k = 0; k < 6; ++k) row[16 * (CLUME_ROW_W + k)] = static_cast<float>(e.w[k]);
                row[16 * CLUME_ROW_SIGMA] = static_cast<float>(e.sigma);
                row[16 * CLUME_ROW_ID] = from_bits(leaf.primitives[i]);
                ++i;
            }
        }
        device::CellLeaf packed{};
        packed.first_group = first;
        packed.group_count = static_cast<device::uint>(group_medium.size()) - first;
        leaves.push_back(packed);
    }
    out.cells = std::move(table);
    out.leaves = std::move(leaves);
    out.groups = std::move(groups);
    out.group_medium = std::move(group_medium);
    device::RenderParams& p = out.params;
    p.cells_origin = {static_cast<float>(cells.origin.x), static_cast<float>(cells.origin.y), static_cast<float>(cells.origin.z), static_cast<float>(1 / cells.root_size)};
    p.cells_x = cells.roots.x;
    p.cells_y = cells.roots.y;
    p.cells_z = cells.roots.z;
    p.cells_levels = cells.levels;
    for (auto& [name, value] : out.defines)
        if (name == "CLUME_CELL_LEVELS") value = std::to_string(cells.levels);
    return out;
}

/// One program for mixtures of all sizes: octrees as deep and stacks as high as any of them needs. Plain grids stay what they are.
inline DeviceScene share_program(DeviceScene scene) {
    REQUIRE(scene.params.cells_levels <= 8);
    REQUIRE(scene.bvh_stack <= 128);
    for (auto& [name, value] : scene.defines) {
        if (name == "CLUME_CELL_LEVELS" && value != "0") value = "8";
        if (name == "CLUME_BVH_STACK") value = "128";
    }
    return scene;
}

/// "cells", "fine" (the above) or "bvh".
inline DeviceScene decomposition_scene(const Scene& scene, const std::string& accelerator) {
    return accelerator == "fine" ? fine_cells(scene) : device_scene(scene, "decomposition", accelerator);
}

inline ProbeRay ray(const glm::dvec3& o, const glm::dvec3& to, double t_end = 1e30) {
    const glm::dvec3 d = glm::normalize(to);
    ProbeRay r;
    for (int k = 0; k < 3; ++k) {
        r.origin[k] = static_cast<float>(o[k]);
        r.direction[k] = static_cast<float>(d[k]);
    }
    r.t_end = static_cast<float>(t_end);
    return r;
}

/// Rays from all about the scene and from inside it, a few axis-parallel.
inline std::vector<ProbeRay> random_rays(std::size_t count, std::uint64_t seed, double radius = 1) {
    TestRandom random(seed);
    std::vector<ProbeRay> rays;
    const auto point = [&](double size) { return size * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)); };
    for (std::size_t i = 0; i < count; ++i) {
        glm::dvec3 o = point(i % 2 ? 0.6 * radius : 2.5 * radius), d = i % 2 ? point(1) : point(0.5 * radius) - o;
        if (i % 16 == 5) d = glm::dvec3(-0.0, i % 32 < 16 ? 1 : -1, 0.0);
        if (i % 16 == 6) d.x = -0.0;
        rays.push_back(ray(o, d, i % 4 == 3 ? random.spread(0.01, 3) : 1e30));
    }
    return rays;
}

struct FlightP {
    double t, winner;
    double escape_z = 0;  ///< standard deviations by which more escape than should
};

/// p-values of `count` flights along one ray, whose law is given.
inline FlightP flight_p(Probe& probe, const FlightLaw& law, const ProbeRay& r, std::size_t count, std::uint32_t sample, bool with_winner = true) {
    std::map<std::size_t, std::size_t> row;
    for (std::size_t i = 0; i < law.ids.size(); ++i) row[law.ids[i]] = i;
    std::vector<double> observed(law.bins + 1), expected;
    std::vector<double> winners(law.ids.size() * law.bins), winners_expected;
    const auto n = static_cast<double>(count);
    for (const ProbeHit& hit : probe.flights(std::vector<ProbeRay>(count, r), sample).values) {
        if (!hit.collided()) {
            observed[law.bins] += 1;
            continue;
        }
        const double t = static_cast<double>(hit.t);
        if (t < law.first * (1 - 1e-5) - 1e-5 || t > law.last * (1 + 1e-5)) return {0, 0};
        observed[law.bin(t)] += 1;
        if (!with_winner) continue;
        const auto at = row.find(hit.primitive);
        if (at == row.end()) return {1, 0};
        winners[at->second * law.bins + law.bin(t)] += 1;
    }
    for (const double p : law.by_bin) expected.push_back(n * p);
    for (const auto& line : law.by_primitive)
        for (const double p : line) winners_expected.push_back(n * p);
    // Both totals are the collisions; the escape mass closes them.
    winners.push_back(observed[law.bins]);
    winners_expected.push_back(expected[law.bins]);
    const double escape = law.by_bin[law.bins];
    return {reference::chi_square(observed, expected).p, with_winner ? reference::chi_square(winners, winners_expected).p : 1,
            (observed[law.bins] - n * escape) / std::sqrt(std::max(n * escape * (1 - escape), 1.0))};
}

inline FlightP flight_p(Probe& probe, std::span<const Ellipsoid> ellipsoids, const ProbeRay& r, std::size_t count, std::uint32_t sample, bool with_winner = true) {
    return flight_p(probe, FlightLaw(ellipsoids, r, 24), r, count, sample, with_winner);
}

/// Escape masses of many rays, by what let them fly: together they see 1 % of density, which none does alone.
struct EscapeMass {
    std::map<std::string, std::pair<double, double>> sums;  ///< of z, and terms

    void add(const std::string& what, const FlightP& p) {
        sums[what].first += p.escape_z;
        sums[what].second += 1;
    }
    /// Fails by chance with probability 1e-4.
    void check() const {
        for (const auto& [what, z] : sums) {
            INFO(what << ": escape mass off by " << z.first / std::sqrt(z.second) << " standard deviations");
            CHECK(reference::z_test_p(z.first / std::sqrt(z.second)) > reference::sidak_threshold(1e-4, sums.size()));
        }
    }
};

inline const ProbeRay kFlightRays[] = {ray({0.3, -0.2, -3}, {-0.08, 0.07, 1}), ray({0.05, 0.02, -0.03}, {0.3, -0.9, 0.2}), ray({-0.11, 3, 0.06}, {-0.0, -1, 0.0})};

}  // namespace clume::probing
