// SPDX-License-Identifier: MIT
// Free flights on the device by χ² against double precision: t, escape mass and the primitive collided with, for every
// family and a mix of them, 1, 2 and 200 overlapping primitives, rays from outside and inside, by `decomposition` and `delta`
// (the others: test_strategies).
// All tests of one family are corrected together (Šidák): it fails by chance with probability 1e-4.
#include <fmt/format.h>
#include <numeric>

#include "tests/flight_reference.h"
#include "tests/reference/statistics.h"

namespace {

using namespace clume;
using namespace clume::probing;
using reference::chi_square;

constexpr auto kGaussian = KernelFamily::gaussian;
constexpr auto kEpanechnikov = KernelFamily::epanechnikov;
constexpr auto kUniform = KernelFamily::uniform;

const std::pair<const char*, std::vector<KernelFamily>> kFamilies[] = {
    {"gaussian", {kGaussian}}, {"epanechnikov", {kEpanechnikov}}, {"uniform", {kUniform}}, {"mixed", {kGaussian, kEpanechnikov, kUniform}}};

struct Strategy {
    const char *name, *accelerator;
};

}  // namespace

TEST_CASE("Flights.FollowTheMixture", "[kernels]") {
    const Strategy strategies[] = {{"decomposition", "cells"}, {"delta", "auto"}};
    struct Result {
        std::string what;
        FlightP p;
    };
    std::vector<Result> results;
    EscapeMass escape;
    for (const auto& [name, kernels] : kFamilies)
        for (const int n : {1, 2, 200}) {
            const Scene mixture = overlapping_mixture(kernels, n, 40 + static_cast<unsigned>(n));
            std::vector<FlightLaw> laws;
            for (const ProbeRay& r : kFlightRays) laws.emplace_back(device_scene(mixture, "delta", "auto").ellipsoids, r, 24);
            for (const Strategy& s : strategies) {
                Probe probe(test_device(), share_program(device_scene(mixture, s.name, s.accelerator)));
                for (std::uint32_t k = 0; k < std::size(kFlightRays); ++k) {
                    const FlightP p = flight_p(probe, laws[k], kFlightRays[k], 80000, k);
                    results.push_back({fmt::format("{} of {}, {}, ray {}", n, name, s.name, k), p});
                    escape.add(fmt::format("{}, {}", name, s.name), p);
                }
            }
        }
    const double threshold = reference::sidak_threshold(1e-4, 2 * results.size());
    double least = 1;
    for (const Result& r : results) {
        INFO(r.what);
        least = std::min({least, r.p.t, r.p.winner});
        CHECK(r.p.t > threshold);
        CHECK(r.p.winner > threshold);
    }
    escape.check();
    report(fmt::format("least p {:.2g} of {}, threshold {:.2g}", least, 2 * results.size(), threshold));
}

TEST_CASE("Flights.AreTheSameOnEveryAccelerator", "[kernels]") {
    // Each primitive draws its own collision: whatever finds it, the same one wins at the same t, bit for bit. So what the case
    // above finds of one accelerator holds for all.
    for (const auto& [name, kernels] : kFamilies)
        for (const int n : {1, 2, 200}) {
            const Scene mixture = overlapping_mixture(kernels, n, 40 + static_cast<unsigned>(n));
            std::vector<ProbeRay> rays = random_rays(4000, 8);
            for (const ProbeRay& r : kFlightRays) rays.insert(rays.end(), 4000, r);
            std::vector<ProbeHit> on_cells;
            for (const char* accelerator : {"cells", "fine", "bvh"}) {
                auto hits = Probe(test_device(), share_program(decomposition_scene(mixture, accelerator))).flights(rays).values;
                for (ProbeHit& h : hits) h.work = 0;
                if (on_cells.empty()) on_cells = hits;
                INFO(n << " of " << name << " on " << accelerator);
                CHECK(first_difference(hits, on_cells) == rays.size());
            }
        }
}

TEST_CASE("Flights.ThroughManySmallPrimitives", "[kernels]") {
    // Thousands of primitives, about 8 over a point: rays cross many cells, most primitives lie elsewhere.
    std::vector<double> p;
    std::size_t leaves = 0;
    for (const KernelFamily k : {kGaussian, kUniform}) {
        Scene mixture = reference::random_mixture(k, 3000, 21);
        mixture.lights.clear();
        for (const Strategy& s : {Strategy{"decomposition", "cells"}, {"decomposition", "fine"}, {"decomposition", "bvh"}, {"delta", "auto"}}) {
            const bool delta = std::string(s.name) == "delta";
            const DeviceScene scene = delta ? device_scene(mixture, s.name, s.accelerator) : decomposition_scene(mixture, s.accelerator);
            leaves = std::max(leaves, scene.leaves.size());
            Probe probe(test_device(), scene);
            std::uint32_t sample = 0;
            for (const ProbeRay& r : kFlightRays) {
                const FlightP both = flight_p(probe, scene.ellipsoids, r, 40000, sample++);
                INFO(s.name << " on " << s.accelerator << ", ray " << sample << ": " << both.t << " " << both.winner);
                p.insert(p.end(), {both.t, both.winner});
                CHECK(std::min(both.t, both.winner) > reference::sidak_threshold(1e-4, 48));
            }
        }
    }
    CHECK(p.size() == 48);
    CHECK(leaves > 1000);
}

TEST_CASE("Flights.OneGaussian", "[kernels][quick]") {
    for (const Strategy& s : {Strategy{"decomposition", "cells"}, {"delta", "auto"}}) {
        const DeviceScene scene = share_program(device_scene(overlapping_mixture({kGaussian}, 2, 3), s.name, s.accelerator));
        Probe probe(test_device(), scene);
        const FlightP p = flight_p(probe, scene.ellipsoids, kFlightRays[0], 40000, 0);
        CHECK(p.t > 1e-5);
        CHECK(p.winner > 1e-5);
    }
}

TEST_CASE("Flights.MarchIsBiasedByItsStep", "[kernels]") {
    Scene scene = overlapping_mixture({kGaussian}, 2, 42);
    std::vector<double> p;
    for (const double step : {0.3, 0.002}) {
        scene.render.step = step;
        const DeviceScene marched = device_scene(scene, "march", "cells");
        Probe probe(test_device(), marched);
        p.push_back(flight_p(probe, marched.ellipsoids, kFlightRays[0], 40000, 5, false).t);
    }
    INFO("p " << p[0] << " with a coarse step, " << p[1] << " with a fine one");
    CHECK(p[0] < 1e-9);
    CHECK(p[1] > 1e-4);
}

TEST_CASE("Flights.AcceleratorsAndWidthsGiveTheSameBits", "[kernels]") {
    const auto rays = random_rays(4000, 7);
    const Scene scene = overlapping_mixture({kGaussian, kEpanechnikov, kUniform}, 400, 11);
    std::vector<ProbeHit> first;
    std::size_t collided = 0;
    for (const char* accelerator : {"cells", "fine", "bvh"}) {
        const DeviceScene packed = share_program(decomposition_scene(scene, accelerator));
        if (std::string(accelerator) == "fine") CHECK(packed.leaves.size() > 100);
        for (const int width : kWidths) {
            auto hits = Probe(test_device(), packed, width).flights(rays, 3).values;
            for (ProbeHit& h : hits) h.work = 0;
            if (first.empty()) {
                first = hits;
                for (const ProbeHit& h : hits) collided += h.collided();
            }
            INFO(accelerator << " on width " << width);
            const std::size_t at = first_difference(first, hits);
            CAPTURE(at);
            CHECK(at == rays.size());
        }
    }
    CHECK(collided > 800);
    CHECK(collided < 3200);
    const DeviceScene packed = device_scene(scene, "delta", "auto");
    const auto wide = Probe(test_device(), packed, 16).flights(rays, 3).values;
    Probe narrow(test_device(), packed, 1);
    CHECK(first_difference(wide, narrow.flights(rays, 3).values) == rays.size());
    CHECK(first_difference(wide, narrow.single_flights(rays, 3).values) == rays.size());
}

TEST_CASE("Flights.IdenticalPrimitivesShareTheirDensity", "[kernels]") {
    // m primitives of 1/m of the density are one primitive, and each of them wins as often.
    constexpr int m = 37;
    for (const KernelFamily k : {kGaussian, kEpanechnikov, kUniform}) {
        Scene one = overlapping_mixture({k}, 1, 5), many = one;
        auto& list = many.media[0].primitives;
        list[0].sigma_t /= m;
        list.resize(m, list[0]);
        for (const Strategy& s : {Strategy{"decomposition", "cells"}, {"delta", "auto"}}) {
            const DeviceScene scene = share_program(device_scene(many, s.name, s.accelerator)), single = device_scene(one, s.name, s.accelerator);
            Probe probe(test_device(), scene);
            const auto hits = probe.flights(std::vector<ProbeRay>(40000, kFlightRays[1])).values;
            std::vector<double> wins(m);
            for (const auto& h : hits)
                if (h.collided()) wins[h.primitive] += 1;
            const double total = std::accumulate(wins.begin(), wins.end(), 0.0);
            CHECK(chi_square(wins, std::vector<double>(m, total / m)).p > 1e-6);
            CHECK(flight_p(probe, single.ellipsoids, kFlightRays[1], 40000, 1, false).t > 1e-6);
        }
    }
}

TEST_CASE("Flights.OrderOfPrimitivesIsNoise", "[kernels]") {
    Scene scene = overlapping_mixture({kGaussian, kUniform}, 60, 6);
    for (const Strategy& s : {Strategy{"decomposition", "cells"}, {"delta", "auto"}}) {
        std::vector<double> histogram[2];
        for (int turn = 0; turn < 2; ++turn) {
            if (turn == 1)
                for (auto& m : scene.media) std::reverse(m.primitives.begin(), m.primitives.end());
            const DeviceScene packed = device_scene(scene, s.name, s.accelerator);
            const FlightLaw law(packed.ellipsoids, kFlightRays[0], 24);
            histogram[turn].assign(law.bins + 1, 0);
            for (const auto& h : Probe(test_device(), packed).flights(std::vector<ProbeRay>(40000, kFlightRays[0]), static_cast<std::uint32_t>(turn)).values)
                histogram[turn][h.collided() ? law.bin(static_cast<double>(h.t)) : law.bins] += 1;
        }
        CHECK(reference::chi_square_two(histogram[0], histogram[1]).p > 1e-5);
    }
}
