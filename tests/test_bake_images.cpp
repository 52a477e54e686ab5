// SPDX-License-Identifier: MIT
// A mixture baked to a grid converges to the mixture: samples at voxel centres, trilinear between them, are off by the second
// derivative times the edge squared, so transmittances and images by O(1/N²). That is for smooth densities: a Gaussian has a
// jump of e^(−E²/2) of its peak where its support ends, 4e-6 at the extent of 5 used here.
#include "src/bake.h"
#include "tests/pairs.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;
using probing::LinePrimitive;
using probing::test_device;

namespace {

Scene smooth_mixture() {
    Scene scene = random_mixture(KernelFamily::gaussian, 12, 17, 5, 2);
    scene.media[0].extent = 5;
    scene.film = {20, 16};
    scene.camera.origin = {0.5, 0.8, -5};
    for (Primitive& p : scene.media[0].primitives) {
        p.axes = p.axes * 0.5;
        p.albedo = {0.9, 0.7, 0.8};
    }
    scene.lights = {sunlight(), constant_light({0.3, 0.4, 0.5}, true)};
    return scene;
}

Scene baked(Scene scene, int resolution) {
    const std::atomic<bool> stop{false};
    GridMedium m;
    m.density = bake(scene, resolution, [](double) {}, stop).value();
    m.albedo = scene.media[0].primitives[0].albedo;
    scene.media.clear();
    scene.grids = {m};
    return scene;
}

}  // namespace

TEST_CASE("BakedMixtures.TransmittanceConvergesWithSecondOrder") {
    const Scene mixture = smooth_mixture();
    const DeviceScene exact = make_device_scene(mixture, {});
    const auto rays = probing::random_rays(2000, 23);
    std::vector<double> error;
    for (const int resolution : {32, 64, 128}) {
        const DeviceScene device = make_device_scene(baked(mixture, resolution), {});
        // The same rays in the other's coordinates.
        std::vector<ProbeRay> there = rays;
        for (ProbeRay& r : there) {
            const probing::WorldRay w(r, exact.normalization);
            const glm::dvec3 o = (w.origin - device.normalization.center) * device.normalization.scale;
            for (int k = 0; k < 3; ++k) r.origin[k] = static_cast<float>(o[k]);
            r.t_end = static_cast<float>(w.t_end * device.normalization.scale);
        }
        const auto got = Probe(test_device(), device).transmittances(there).values;
        double sum = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            double depth = 0;
            for (const Ellipsoid& e : exact.ellipsoids) depth += LinePrimitive(e, rays[i]).depth(static_cast<double>(rays[i].t_end));
            sum += std::pow(static_cast<double>(got[i].transmittance) - std::exp(-depth), 2);
        }
        error.push_back(std::sqrt(sum / static_cast<double>(rays.size())));
        UNSCOPED_INFO(resolution << " voxels: error " << error.back());
    }
    for (std::size_t i = 1; i < error.size(); ++i) {
        const double order = std::log2(error[i - 1] / error[i]);
        UNSCOPED_INFO("order " << order);
        CHECK(order > 1.8);
        CHECK(order < 2.2);
    }
}

TEST_CASE("BakedMixtures.ImageConverges") {
    const Scene mixture = smooth_mixture();
    const Estimate truth = colour_of(render_pair({"delta"}, mixture, 512, 1).image);
    const auto image = [&](int resolution) { return colour_of(render_pair({"delta"}, baked(mixture, resolution), 512, 2).image); };
    check_same("baked", image(128), truth);
    CHECK_FALSE(compare(image(10), truth).pass);
}
