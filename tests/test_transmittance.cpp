// SPDX-License-Identifier: MIT
// Analytic transmittance on the device: exp(−Σ τ) against 50 digits, the same bits for both accelerators and every width,
// nothing lost at any overlap, the order of primitives immaterial.
#include <fmt/format.h>
#include <span>

#include "tests/flight_reference.h"
#include "tests/reference/high_precision.h"

namespace {

using namespace clume;
using namespace clume::probing;
using reference::high::Real;

/// Σ τ over all primitives, as the device's floats have them.
double exact_depth(std::span<const Ellipsoid> ellipsoids, const ProbeRay& r) {
    Real sum = 0;
    const auto d = [](float v) { return static_cast<double>(v); };
    for (const Ellipsoid& e : ellipsoids) {
        if (!LinePrimitive(e, r).hit()) continue;
        float w[6], mu[3];
        for (int k = 0; k < 6; ++k) w[k] = static_cast<float>(e.w[k]);
        for (int k = 0; k < 3; ++k) mu[k] = static_cast<float>(e.center[k]);
        const double exact_w[6] = {d(w[0]), d(w[1]), d(w[2]), d(w[3]), d(w[4]), d(w[5])};
        const reference::high::Chord chord({d(r.origin[0]), d(r.origin[1]), d(r.origin[2])}, {d(r.direction[0]), d(r.direction[1]), d(r.direction[2])}, {d(mu[0]), d(mu[1]), d(mu[2])},
                                           reference::high::whitening_from_upper(exact_w), Real(static_cast<float>(e.sigma)), Real(e.extent), e.family);
        sum += chord.optical_depth(Real(0), Real(r.t_end));
    }
    return static_cast<double>(sum);
}

std::vector<std::pair<std::string, Scene>> scenes() {
    std::vector<std::pair<std::string, Scene>> all = {
        {"gaussians", reference::random_mixture(KernelFamily::gaussian, 1000, 3)},
        {"epanechnikovs", reference::random_mixture(KernelFamily::epanechnikov, 1000, 4)},
        {"uniforms", reference::random_mixture(KernelFamily::uniform, 1000, 5)},
        {"mixed", overlapping_mixture({KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform}, 300, 6)}};
    for (auto& [name, scene] : all) scene.lights.clear();
    return all;
}

}  // namespace

TEST_CASE("Transmittance.IsTheProductOverAllPrimitives", "[kernels]") {
    for (const auto& [name, scene] : scenes()) {
        const DeviceScene packed = device_scene(scene, "decomposition", "cells");
        const auto rays = random_rays(160, 12);
        const auto got = Probe(test_device(), packed).transmittances(rays).values;
        double worst = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const double depth = exact_depth(packed.ellipsoids, rays[i]), t = static_cast<double>(got[i].transmittance);
            INFO(name << " ray " << i << ": depth " << depth << " gives " << t);
            if (depth > 60) {
                CHECK(t < 1e-25);
                continue;
            }
            // Positions are known to some ulp: uniform supports end at a jump.
            worst = std::max(worst, std::abs(std::log(t) + depth) / (1 + depth));
            CHECK(t == Approx(std::exp(-depth)).epsilon(5e-6 * (1 + depth)));
        }
        report(fmt::format("{}: depth off by {:.2g} of 1 + depth", name, worst));
    }
}

TEST_CASE("Transmittance.AcceleratorsAndWidthsGiveTheSameBits", "[kernels]") {
    for (const auto& [name, scene] : scenes()) {
        if (name != "gaussians" && name != "mixed") continue;
        const auto rays = random_rays(4000, 13);
        std::vector<ProbeHit> first;
        for (const char* accelerator : {"cells", "fine", "bvh"}) {
            const DeviceScene packed = decomposition_scene(scene, accelerator);
            if (std::string(accelerator) == "fine") CHECK(packed.leaves.size() > 100);
            for (const int width : kWidths) {
                const auto got = Probe(test_device(), packed, width).transmittances(rays).values;
                if (first.empty()) first = got;
                std::size_t differing = 0;
                for (std::size_t i = 0; i < rays.size(); ++i) differing += bits(first[i].transmittance) != bits(got[i].transmittance);
                INFO(name << " on " << accelerator << ", width " << width);
                CHECK(differing == 0);
            }
        }
    }
}

TEST_CASE("Transmittance.RouletteKeepsTheMean", "[kernels]") {
    // Past an optical depth the renderer goes on by roulette: exp(−depth) on average, the same bits on every accelerator.
    const Scene scene = overlapping_mixture({KernelFamily::gaussian, KernelFamily::uniform}, 200, 18);
    Scene dense = scene;
    for (auto& m : dense.media) m.density_scale = 3;
    std::size_t deep = 0;
    for (const Scene* s : {&scene, static_cast<const Scene*>(&dense)}) {
        Probe probe(test_device(), fine_cells(*s)), other(test_device(), device_scene(*s, "decomposition", "bvh"));
        const auto rays = random_rays(12, 19);
        const auto exact = probe.transmittances(rays).values;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const std::vector<ProbeRay> copies(40000, rays[i]);
            const auto got = probe.roulette_transmittances(copies).values, same = other.roulette_transmittances(copies).values;
            double sum = 0, square = 0;
            for (std::size_t k = 0; k < got.size(); ++k) {
                if (bits(got[k].transmittance) != bits(same[k].transmittance)) FAIL("ray " << i << " differs between accelerators");
                sum += static_cast<double>(got[k].transmittance);
                square += static_cast<double>(got[k].transmittance) * static_cast<double>(got[k].transmittance);
            }
            const double n = static_cast<double>(got.size()), mean = sum / n, t = static_cast<double>(exact[i].transmittance), sd = std::sqrt(std::max(square / n - mean * mean, 1e-14) / n);
            deep += sd > 1e-6;
            INFO("ray " << i << ": transmittance " << t << ", mean " << mean << " ± " << sd);
            CHECK(std::abs(mean - t) < 4.5 * std::max(sd, std::sqrt(std::exp(-2.0) * t / n) + 1e-7));
        }
    }
    CHECK(deep > 3);
}

TEST_CASE("Transmittance.NothingIsLostAtAnyOverlap", "[kernels]") {
    // 2,000 primitives of all sizes over one point, and rays through it.
    Scene scene = overlapping_mixture({KernelFamily::gaussian, KernelFamily::uniform}, 2, 1);
    for (auto& m : scene.media) m.primitives.clear();
    TestRandom random(14);
    for (int i = 0; i < 2000; ++i)
        scene.media[static_cast<std::size_t>(i % 2)].primitives.push_back(reference::make_primitive(
            0.01 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)), glm::dvec3(random.spread(0.05, 0.3), random.spread(0.05, 0.3), random.spread(0.05, 0.3)), 0.003,
            {random.uniform(), random.uniform(), random.uniform()}));
    const ProbeRay rays[] = {ray({0, 0, -1.9}, {0.001, 0.002, 1}), ray({0.003, 0, 0.001}, {0.2, 0.3, -0.5}), ray({0.001, 0.0, 0.0}, {-0.0, 1, 0.0})};
    for (const char* accelerator : {"cells", "fine", "bvh"}) {
        const DeviceScene packed = decomposition_scene(scene, accelerator);
        Probe probe(test_device(), packed);
        const auto got = probe.transmittances(rays).values;
        for (std::size_t i = 0; i < std::size(rays); ++i) {
            const double depth = exact_depth(packed.ellipsoids, rays[i]);
            INFO(accelerator << " ray " << i << " depth " << depth);
            CHECK(depth > 0.5);
            CHECK(-std::log(static_cast<double>(got[i].transmittance)) == Approx(depth).epsilon(1e-5));
        }
        // As many flights as the transmittance says escape: 4 standard deviations.
        const double n = 40000, t = static_cast<double>(got[0].transmittance);
        double escaped = 0;
        for (const auto& h : probe.flights(std::vector<ProbeRay>(40000, rays[0])).values) escaped += !h.collided();
        CHECK(std::abs(escaped / n - t) < 4 * std::sqrt(t * (1 - t) / n));
    }
}

TEST_CASE("Transmittance.OrderOfPrimitivesIsRounding", "[kernels]") {
    Scene scene = overlapping_mixture({KernelFamily::gaussian, KernelFamily::epanechnikov}, 200, 15);
    const auto rays = random_rays(2000, 16);
    const auto forward = Probe(test_device(), device_scene(scene, "decomposition", "cells")).transmittances(rays).values;
    for (auto& m : scene.media) std::reverse(m.primitives.begin(), m.primitives.end());
    const auto backward = Probe(test_device(), device_scene(scene, "decomposition", "cells")).transmittances(rays).values;
    for (std::size_t i = 0; i < rays.size(); ++i)
        if (!(std::abs(forward[i].transmittance - backward[i].transmittance) <= 1e-6f * (forward[i].transmittance + 1e-6f))) FAIL("ray " << i);
    SUCCEED();
}

TEST_CASE("Transmittance.FarClustersAreAllVisited", "[kernels]") {
    // Empty cells are crossed by their distance to the next that is not: the depth behind them must be the whole one.
    Scene scene = overlapping_mixture({KernelFamily::gaussian}, 1, 1);
    scene.media[0].primitives.clear();
    TestRandom random(17);
    std::vector<glm::dvec3> centers;
    for (int c = 0; c < 15; ++c) {
        centers.emplace_back(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(-9, 9));
        for (int i = 0; i < 30; ++i)
            scene.media[0].primitives.push_back(reference::make_primitive(centers.back() + 0.2 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)), glm::dvec3(random.spread(0.02, 0.2)), 0.5));
    }
    const DeviceScene packed = fine_cells(scene, 5), nulls = device_scene(scene, "delta", "auto");
    std::vector<ProbeRay> rays;
    for (const glm::dvec3& a : centers)
        for (const glm::dvec3& b : centers)
            if (&a != &b) rays.push_back(ray((2.0 * a - b - packed.normalization.center) * packed.normalization.scale, b - a));
    const auto got = Probe(test_device(), packed).transmittances(rays).values;
    double expected = 0, variance = 0, escaped = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        double depth = 0;
        for (const Ellipsoid& e : packed.ellipsoids) depth += LinePrimitive(e, rays[i]).depth(1e30);
        INFO("ray " << i);
        CHECK(depth > 0);
        CHECK(static_cast<double>(got[i].transmittance) == Approx(std::exp(-depth)).epsilon(3e-5));
        expected += 200 * std::exp(-depth);
        variance += 200 * std::exp(-depth) * (1 - std::exp(-depth));
    }
    Probe delta(test_device(), nulls);
    for (std::uint32_t sample = 0; sample < 200; ++sample)
        for (const auto& h : delta.flights(rays, sample).values) escaped += !h.collided();
    INFO(escaped << " of " << expected << " escape null collisions");
    CHECK(std::abs(escaped - expected) < 4 * std::sqrt(variance));
}
