// SPDX-License-Identifier: MIT
// Free flights through voxel grids, alone and beside a mixture, by χ² against double precision: t, escape mass, and which
// medium was collided with. All tests of one case are corrected together (Šidák): it fails by chance with probability 1e-4.
#include <fmt/format.h>

#include "tests/grid_scenes.h"
#include "tests/reference/statistics.h"

namespace {

using namespace clume;
using namespace clume::probing;
using reference::chi_square;
using reference::HostGrid;

/// What flights along one ray must do: per medium (the mixture, then each grid) and bin of t, probabilities; last the escape.
struct Law {
    static constexpr std::size_t bins = 23;  ///< no edge of theirs is one of a voxel: rounding may put a t on the far side
    std::vector<double> expected;
    double t0 = 1e300, t1 = 0;  ///< normalised
    std::size_t media;

    Law(const Scene& scene, const DeviceScene& device, const ProbeRay& r) : media(scene.grids.size() + 1) {
        const WorldRay w(r, device.normalization);
        std::vector<HostGrid> grids;
        for (const GridMedium& m : scene.grids) grids.push_back(host_density(m));
        std::vector<LinePrimitive> line;
        std::vector<double> cuts;
        for (const Ellipsoid& e : device.ellipsoids)
            if (const LinePrimitive p(e, r); p.hit()) line.push_back(p), cuts.insert(cuts.end(), {p.enter(), p.exit()});
        for (const HostGrid& g : grids) {
            double a = 0, b = w.t_end;
            if (g.clip(w.origin, w.direction, a, b)) cuts.insert(cuts.end(), {a * w.scale, b * w.scale});
        }
        expected.assign(media * bins + 1, 0);
        if (cuts.empty()) {
            expected.back() = 1;
            return;
        }
        t0 = *std::min_element(cuts.begin(), cuts.end());
        t1 = std::min(*std::max_element(cuts.begin(), cuts.end()), static_cast<double>(r.t_end));
        // Fine steps: shares by the middle's densities, depths exact.
        constexpr int steps = static_cast<int>(bins) * 400;
        double depth = 0;
        for (int i = 0; i < steps; ++i) {
            const double a = t0 + (t1 - t0) * i / steps, b = t0 + (t1 - t0) * (i + 1) / steps, middle = 0.5 * (a + b);
            std::vector<double> parts(media, 0);
            for (const LinePrimitive& p : line) parts[0] += p.depth(b) - p.depth(a);
            for (std::size_t g = 0; g < grids.size(); ++g) parts[g + 1] = grids[g].integral(w.origin, w.direction, a / w.scale, b / w.scale);
            double all = 0;
            for (const double p : parts) all += p;
            for (std::size_t m = 0; m < media && all > 0; ++m) expected[m * bins + bin(middle)] += std::exp(-depth) * -std::expm1(-all) * parts[m] / all;
            depth += all;
        }
        expected.back() = std::exp(-depth);
    }
    std::size_t bin(double t) const { return static_cast<std::size_t>(std::clamp((t - t0) / (t1 - t0) * bins, 0.0, static_cast<double>(bins - 1))); }
};

double flight_p(Probe& probe, const Scene& scene, const DeviceScene& device, const ProbeRay& r, std::size_t count, std::uint32_t sample) {
    Law law(scene, device, r);
    std::vector<double> observed(law.expected.size());
    for (const ProbeHit& hit : probe.flights(std::vector<ProbeRay>(count, r), sample).values) {
        if (!hit.collided()) {
            observed.back() += 1;
            continue;
        }
        const double t = static_cast<double>(hit.t);
        if (t < law.t0 * (1 - 1e-5) - 1e-5 || t > law.t1 * (1 + 1e-5)) return 0;
        // Without per-primitive look-ups a mixture's flight need not say whose its collision was.
        const std::size_t n = device.ellipsoids.size(), medium = hit.primitive < n || hit.primitive == CLUME_NO_PRIMITIVE ? 0 : hit.primitive - n + 1;
        if (medium >= law.media) return 0;
        observed[medium * Law::bins + law.bin(t)] += 1;
    }
    for (double& e : law.expected) e *= static_cast<double>(count);
    return chi_square(observed, law.expected).p;
}

struct Way {
    const char *strategy, *bound;
    int majorant_grid;
    std::string name() const { return fmt::format("{} {} {}", strategy, bound, majorant_grid); }
};
const Way kWays[] = {{"decomposition", "auto", 0}, {"delta", "tree", 0}, {"delta", "scene", 0}, {"delta", "grid", 5}, {"delta", "grid", 40}};

Scene by(const Way& way, Scene scene) {
    scene.render.strategy = way.strategy;
    scene.render.bound = way.bound;
    if (way.majorant_grid) scene.render.majorant_grid = way.majorant_grid;
    return scene;
}

/// Grids of every kind, each about the origin and about 2 across; a ray through the middle has a depth of about 2.
std::vector<std::pair<std::string, Scene>> scenes() {
    std::vector<std::pair<std::string, Scene>> all;
    for (const Interpolation i : {Interpolation::trilinear, Interpolation::nearest}) {
        const std::string how = i == Interpolation::trilinear ? ", trilinear" : ", nearest";
        all.emplace_back("dense noise" + how, grid_scene(grid_medium(voxel_grid({0, 0, 0}, {20, 21, 19}, random_samples(1), false, glm::dmat3(0.1), glm::dvec3(-0.95, -1, -0.9)), 3.5, i)));
        all.emplace_back("sparse cloud, turned" + how, grid_scene(grid_medium(voxel_grid({3, -7, 0}, {43, 40, 45}, smooth_samples(40), true, turned_axes(0.05), turned_axes(0.05) * glm::dvec3(-21, -18, -21)), 2.5, i)));
    }
    return all;
}

const ProbeRay kRays[] = {ray({0.3, -0.2, -3}, {-0.08, 0.07, 1}), ray({0.05, 0.02, -0.03}, {0.3, -0.9, 0.2}), ray({-0.11, 3, 0.06}, {-0.0, -1, 0.0}), ray({0.9, 0.8, 1.1}, {-1, -0.9, -1}, 1.6)};

struct Tests {
    std::vector<std::pair<std::string, double>> all;
    void add(std::string what, double p) { all.emplace_back(std::move(what), p); }
    ~Tests() noexcept(false) {
        const double threshold = reference::sidak_threshold(1e-4, all.size());
        for (const auto& [what, p] : all) {
            INFO(what);
            CHECK(p > threshold);
        }
    }
};

}  // namespace

TEST_CASE("GridFlights.FollowTheGrid", "[kernels]") {
    Tests tests;
    for (const auto& [name, scene] : scenes())
        for (const Way& way : kWays) {
            const Scene here = by(way, scene);
            const DeviceScene device = make_device_scene(here, {});
            Probe probe(test_device(), device);
            std::uint32_t sample = 0;
            for (const ProbeRay& r : kRays) tests.add(fmt::format("{} by {}, ray {}", name, way.name(), sample), flight_p(probe, here, device, r, 40000, sample)), ++sample;
        }
}

TEST_CASE("GridFlights.CompeteWithAMixture", "[kernels]") {
    // A mixture, two grids that overlap it and each other: which medium is met counts, too.
    Tests tests;
    Scene scene = overlapping_mixture({KernelFamily::gaussian, KernelFamily::uniform}, 12, 4);
    for (const auto& [name, other] : scenes())
        if (name != "dense noise, nearest" && name != "sparse cloud, turned, trilinear") scene.grids.push_back(other.grids[0]);
    scene.grids[1].albedo = glm::dvec3(0.2);  // primitives are told apart
    for (const Way& way : kWays) {
        const Scene here = by(way, scene);
        const DeviceScene device = make_device_scene(here, {});
        Probe probe(test_device(), device);
        std::uint32_t sample = 10;
        for (const ProbeRay& r : kRays) tests.add(fmt::format("mixed by {}, ray {}", way.name(), sample), flight_p(probe, here, device, r, 60000, sample)), ++sample;
    }
}
