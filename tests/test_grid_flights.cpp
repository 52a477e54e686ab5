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

double flight_p(Probe& probe, const Scene& scene, const DeviceScene& device, const ProbeRay& r, std::size_t count, std::uint32_t sample, double slack = 1e-5) {
    Law law(scene, device, r);
    std::vector<double> observed(law.expected.size());
    for (const ProbeHit& hit : probe.flights(std::vector<ProbeRay>(count, r), sample).values) {
        if (!hit.collided()) {
            observed.back() += 1;
            continue;
        }
        const double t = static_cast<double>(hit.t);
        if (t < law.t0 - slack * (1 + law.t0) || t > law.t1 + slack * (1 + law.t1)) return 0;
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

TEST_CASE("GridFlights.MarchIsBiasedByItsStep", "[kernels]") {
    Scene scene = scenes()[0].second;
    scene.render.strategy = "march";
    std::vector<double> p;
    for (const double step : {0.3, 0.001}) {
        scene.render.step = step;
        const DeviceScene device = make_device_scene(scene, {});
        Probe probe(test_device(), device);
        p.push_back(flight_p(probe, scene, device, kRays[0], 40000, 5, step));
    }
    INFO("p " << p[0] << " with a coarse step, " << p[1] << " with a fine one");
    CHECK(p[0] < 1e-9);
    CHECK(p[1] > 1e-4);
}

TEST_CASE("GridTransmittance.EveryEstimatorHasTheMean", "[kernels]") {
    // exp(−∫ σ dt) over two grids: exactly, or on average with the estimator's own spread.
    struct Estimator {
        const char *name, *strategy, *bound;
        int majorant_grid;
    };
    const Estimator estimators[] = {{"analytic", "delta", "tree", 0}, {"ratio", "delta", "tree", 0}, {"ratio", "delta", "scene", 0}, {"ratio", "decomposition", "grid", 12},
                                    {"residual-ratio", "delta", "tree", 0}, {"residual-ratio", "delta", "scene", 0}, {"binary", "delta", "tree", 0}, {"binary", "decomposition", "tree", 0}};
    std::vector<std::pair<std::string, double>> all;
    for (const double density : {0.6, 4.0}) {
        Scene scene = scenes()[0].second;
        scene.grids.push_back(scenes()[3].second.grids[0]);
        // Never 0: there is something to take out.
        scene.grids[0].density = voxel_grid({0, 0, 0}, {20, 21, 19}, [](const glm::ivec3& p) { return 0.5 + random_samples(1)(p); }, false, glm::dmat3(0.1), glm::dvec3(-0.95, -1, -0.9));
        for (auto& m : scene.grids) m.density_scale *= 0.2 * density;
        for (const Estimator& e : estimators) {
            Scene here = scene;
            here.render.strategy = e.strategy;
            here.render.transmittance = e.name;
            here.render.bound = e.bound;
            if (e.majorant_grid) here.render.majorant_grid = e.majorant_grid;
            const DeviceScene device = make_device_scene(here, {});
            Probe probe(test_device(), device);
            std::uint32_t sample = 0;
            for (const ProbeRay& r : kRays) {
                const WorldRay w(r, device.normalization);
                double depth = 0;
                for (const GridMedium& m : here.grids) depth += host_density(m).integral(w.origin, w.direction, 0, w.t_end);
                constexpr std::size_t count = 20000;
                double sum = 0, square = 0;
                for (const ProbeHit& h : probe.estimated_transmittances(std::vector<ProbeRay>(count, r), sample++).values) {
                    const double t = static_cast<double>(h.transmittance);
                    CHECK((t >= 0 && t <= 1));
                    sum += t;
                    square += t * t;
                }
                const double mean = sum / count, expected = std::exp(-depth);
                // What the sample's own spread can't show where few estimates are above 0: all of them 0.1 or more.
                const double deviation = std::sqrt(std::max({square / count - mean * mean, 0.0, std::string(e.name) == "analytic" && depth < 2 ? 0.0 : 0.1 * std::min(expected, 0.02)}) / count) + 1e-6 * (1 + depth) * expected;
                all.emplace_back(fmt::format("{} by {} {}, ray {}: {} of {}", e.name, e.strategy, e.bound, sample - 1, mean, expected), reference::z_test_p((mean - expected) / deviation));
            }
        }
    }
    const double threshold = reference::sidak_threshold(1e-4, all.size());
    for (const auto& [what, p] : all) {
        INFO(what);
        CHECK(p > threshold);
    }
}

TEST_CASE("GridTransmittance.ResidualRatioKnowsConstants", "[kernels]") {
    // A box of one density has no residual: the estimate is exact, without a random number.
    Scene scene = grid_scene(grid_medium(voxel_grid({0, 0, 0}, {24, 24, 24}, [](auto) { return 1.0; }, false, glm::dmat3(0.08)), 0.7));
    scene.render.transmittance = "residual-ratio";
    const DeviceScene device = make_device_scene(scene, {});
    const auto rays = random_rays(400, 5);
    const auto got = Probe(test_device(), device).estimated_transmittances(rays).values;
    const HostGrid host = host_density(scene.grids[0]);
    std::size_t hit = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const WorldRay w(rays[i], device.normalization);
        const double depth = host.integral(w.origin, w.direction, 0, w.t_end);
        hit += depth > 0;
        CHECK(static_cast<double>(got[i].transmittance) == Approx(std::exp(-depth)).epsilon(1e-5));
    }
    CHECK(hit > 200);
}

TEST_CASE("GridTransmittance.MarchConverges", "[kernels]") {
    Scene scene = scenes()[2].second;
    scene.render.transmittance = "march";
    double error[2] = {0, 0};
    for (const int fine : {0, 1}) {
        scene.render.step = fine ? 0.004 : 0.2;
        const DeviceScene device = make_device_scene(scene, {});
        const HostGrid host = host_density(scene.grids[0]);
        const auto rays = random_rays(400, 5);
        const auto got = Probe(test_device(), device).estimated_transmittances(rays).values;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const WorldRay w(rays[i], device.normalization);
            error[fine] = std::max(error[fine], std::abs(static_cast<double>(got[i].transmittance) - std::exp(-host.integral(w.origin, w.direction, 0, w.t_end))));
        }
    }
    INFO(error[0] << " " << error[1]);
    CHECK(error[0] > 0.01);
    CHECK(error[1] < 0.01);
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
