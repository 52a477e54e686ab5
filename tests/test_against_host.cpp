// SPDX-License-Identifier: MIT
// Media, phase functions, cameras, depths and the film against the host path tracer: same mean image, same alpha, whatever
// way distances are sampled. Lights have tests of their own (test_lights.cpp).
#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

constexpr std::uint32_t spp = 256;

void check_against_host(const std::string& name, const Scene& scene, const std::vector<Way>& ways, const RenderOptions& options = {},
                        std::uint32_t host_spp = spp) {
    std::optional<HostCrop> crop;
    if (options.crop) crop = HostCrop{options.crop->x0, options.crop->y0, options.crop->x1, options.crop->y1};
    const HostImage host = HostTracer(scene, 32).trace(host_spp, 78, 2, crop);
    REQUIRE(host.not_finite == 0);
    for (const Way& way : ways) {
        const RenderResult r = render_by(way, scene, spp, 0, options);
        check_clean(r);
        check_same(name + " by " + way.name(), colour_of(r.image), colour_of(host));
        check_same(name + "_alpha by " + way.name(), alpha_of(r.image), alpha_of(host, host_spp));
    }
}

Light sun(const glm::dvec3& irradiance = {4, 3, 2}) {
    Light l = light_of(LightKind::directional);
    l.direction = {-0.4, -1, 0.5};
    l.irradiance = irradiance;
    return l;
}

Scene small(KernelFamily kernel, std::uint64_t seed = 5) {
    Scene scene = random_mixture(kernel, 30, seed, 6, 3);
    scene.film = {24, 20};
    scene.camera.origin = {0.5, 0.8, -3.4};
    return scene;
}

/// Three media that differ in kernel, extent, phase function and transform, overlapping in the middle.
Scene mixed() {
    Scene scene = small(KernelFamily::gaussian, 21);
    const KernelFamily kernels[] = {KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform};
    const double extents[] = {2.2, 3, 1.4};
    const glm::dmat3 turns[] = {glm::dmat3(1), {{0.2, 0.9, 0}, {-0.8, 0.3, 0.1}, {0, 0.2, 0.7}}, {{-0.6, 0, 0}, {0, 0.5, 0.3}, {0.1, -0.4, 0.7}}};
    scene.media.clear();
    for (int i = 0; i < 3; ++i) {
        EllipsoidMedium m = random_mixture(kernels[i], 20, 30 + static_cast<std::uint64_t>(i), 4, 2).media[0];
        m.extent = extents[i];
        m.density_scale = 0.7 + 0.5 * i;
        for (Primitive& p : m.primitives) {
            p.center = turns[i] * p.center + glm::dvec3(0.3 * i - 0.3, 0.1 * i, 0);
            p.axes = turns[i] * p.axes;
        }
        scene.media.push_back(m);
    }
    scene.media[0].phase = {PhaseKind::henyey_greenstein, -0.3};
    scene.media[1].phase = {PhaseKind::rayleigh, 0};
    for (std::size_t i = 0; i < 20; i += 2) {
        scene.media[2].primitives[i].has_g = true;
        scene.media[2].primitives[i].g = 0.08f * static_cast<float>(i) - 0.6f;
    }
    for (std::size_t i = 0; i < 20; i += 3) scene.media[1].primitives[i].emission = {0.3, 0.1 * static_cast<double>(i % 4), 0.05};
    scene.lights = {constant_light({0.4, 0.5, 0.6}), sun()};
    return scene;
}

}  // namespace

TEST_CASE("Media.EachKernelEqualsHost") {
    for (KernelFamily kernel : {KernelFamily::epanechnikov, KernelFamily::uniform}) {
        Scene scene = small(kernel);
        scene.lights = {sun()};
        check_against_host("kernel_" + std::to_string(static_cast<int>(kernel)), scene, {delta, decomposition_bvh});
    }
}

TEST_CASE("Media.UnlikeOnesInOneSceneEqualHost") { check_against_host("mixed", mixed(), unbiased_ways); }

TEST_CASE("Media.UnlikeOnesQuick", "[quick]") { check_against_host("mixed_quick", mixed(), {delta}); }

TEST_CASE("Media.EmissionAndColourPerPrimitiveEqualHost") {
    Scene scene = small(KernelFamily::gaussian, 8);
    for (std::size_t i = 0; i < 30; ++i) {
        scene.media[0].primitives[i].albedo = {0.1 * static_cast<double>(i % 10), 0.9, 0.033 * static_cast<double>(i)};
        scene.media[0].primitives[i].emission = {i % 3 == 0 ? 2.0 : 0.0, 0.5, 0.1 * static_cast<double>(i % 5)};
    }
    scene.lights = {};
    check_against_host("emission", scene, {delta, decomposition});
}

TEST_CASE("Media.FarAndLargeEqualsHost") {
    // Recentred and scaled before anything is float: neither place nor size matters.
    const double size = 3000;
    const glm::dvec3 place(2e10, -4e10, 1e10);
    Scene scene = small(KernelFamily::gaussian, 9);
    scene.camera.origin = scene.camera.origin * size + place;
    scene.camera.target = scene.camera.target * size + place;
    for (Primitive& p : scene.media[0].primitives) {
        p.center = p.center * size + place;
        p.axes = p.axes * size;
        p.sigma_t /= size;
    }
    scene.lights = {point_light(glm::dvec3(-1.2, 1, -0.8) * size + place, glm::dvec3(4) * size * size)};
    check_against_host("far", scene, {delta});
}

TEST_CASE("Media.DenseEqualsHost") {
    Scene scene = small(KernelFamily::gaussian, 12);
    scene.media[0].density_scale = 12;
    scene.lights = {constant_light(glm::dvec3(1)), sun()};
    check_against_host("dense", scene, {delta, decomposition});
}

TEST_CASE("Phases.EachEqualsHost") {
    Scene scene = small(KernelFamily::gaussian);
    for (double g : {0.75, -0.5}) {
        scene.media[0].phase = {PhaseKind::henyey_greenstein, g};
        scene.lights = {sun()};
        check_against_host("henyey_greenstein", scene, {delta});
    }
    scene.lights = {contrast_environment(false, 0.3)};  // through MIS: sampling, density and value must agree
    check_against_host("henyey_greenstein_mis", scene, {delta}, {}, 4 * spp);
    scene.media[0].phase = {PhaseKind::rayleigh, 0};
    check_against_host("rayleigh_mis", scene, {delta}, {}, 4 * spp);
    scene.lights = {sun()};
    check_against_host("rayleigh", scene, {delta});
}

TEST_CASE("Phases.SamplingAloneEqualsHost") {
    // A bright sphere straight ahead and one beside, found by scattering alone, once: the share of each direction counts.
    Scene scene = small(KernelFamily::gaussian);
    Light ahead = light_of(LightKind::sphere), beside = light_of(LightKind::sphere);
    ahead.center = {-0.5, -0.8, 3.4};
    beside.center = {3, 0.3, 0.2};
    ahead.radius = beside.radius = 1.6;
    ahead.radiance = {4, 1, 0};
    beside.radiance = {0, 1, 4};
    scene.lights = {ahead, beside};
    scene.render.light_sampling = LightSampling::phase;
    scene.render.max_depth = 1;
    scene.camera.fov_rad = 0.5;
    for (const Phase& phase : {Phase{PhaseKind::rayleigh, 0}, Phase{PhaseKind::henyey_greenstein, 0.5}}) {
        scene.media[0].phase = phase;
        check_against_host("phase_sampling_" + std::to_string(static_cast<int>(phase.kind)), scene, {delta});
    }
}

TEST_CASE("Phases.OwnParameterOfEachPrimitiveEqualsHost") {
    Scene scene = small(KernelFamily::gaussian);
    for (std::size_t i = 0; i < 30; ++i) {
        if (i % 3 == 0) continue;  // keeps its medium's
        scene.media[0].primitives[i].has_g = true;
        scene.media[0].primitives[i].g = static_cast<float>(i) * 0.06f - 0.9f;
    }
    scene.media[0].phase = {PhaseKind::henyey_greenstein, 0.4};
    scene.lights = {contrast_environment(false, 0.3)};
    check_against_host("own_g_mis", scene, {delta}, {}, 4 * spp);
    scene.media[0].phase = {};
    scene.lights = {sun()};
    check_against_host("own_g", scene, {decomposition_bvh});
}

TEST_CASE("Depth.EachLimitEqualsHost") {
    Scene scene = mixed();
    for (int depth : {0, 1, 2}) {
        scene.render.max_depth = depth;
        check_against_host("depth_" + std::to_string(depth), scene, {delta});
    }
    // Emission after the last scattering event counts; roulette changes no mean, not even from the first event on.
    scene.render.max_depth = -1;
    scene.render.rr_depth = 0;
    check_against_host("roulette_at_once", scene, {delta});
}

TEST_CASE("Cameras.EachEqualsHost") {
    Scene scene = small(KernelFamily::gaussian, 14);
    scene.lights = {constant_light({1, 0.6, 0.3}, true), sun()};
    scene.camera.origin = {0.1, 0.05, -0.2};  // amid the medium
    scene.camera.target = {1, 0.4, 0.3};
    scene.camera.fov_rad = 1.7;
    check_against_host("camera_inside", scene, unbiased_ways);
    scene.camera.kind = CameraKind::orthographic;
    scene.camera.width = 1.8;
    scene.camera.up = {0.3, 1, 0.2};
    check_against_host("camera_orthographic_inside", scene, {delta});
    scene.camera.origin = {2, 1.5, -3};
    scene.camera.target = {0.3, 0.2, 0.1};
    check_against_host("camera_orthographic", scene, {delta});
}

TEST_CASE("Cameras.CropEqualsHost") {
    Scene scene = small(KernelFamily::gaussian, 14);
    scene.lights = {contrast_environment(true, 2)};
    RenderOptions options;
    options.crop = CropWindow{5, 3, 21, 15};
    check_against_host("crop", scene, {delta}, options, 4 * spp);
}

TEST_CASE("Background.IsSeenOnlyIfVisible") {
    Scene scene = small(KernelFamily::gaussian, 15);
    scene.camera.target = {0.9, 0.4, 0};  // part of the film looks past the medium
    for (bool visible : {false, true}) {
        scene.lights = {constant_light({1, 0.5, 0.25}, visible), constant_light({0.1, 0.2, 0.3}, !visible)};
        check_against_host(visible ? "background_a" : "background_b", scene, {delta});
        const RenderResult r = render_by(delta, scene, 4);
        const glm::vec3 expected(scene.lights[visible ? 0 : 1].radiance);
        CHECK(r.stats.empty_pixels > 0);
        // The corner meets nothing.
        const std::size_t corner = r.image.alpha.size() - 24;
        bool found = false;
        for (std::size_t i : {std::size_t{0}, std::size_t{23}, corner, r.image.alpha.size() - 1}) {
            if (r.image.alpha[i] > 0) continue;
            found = true;
            for (std::size_t c = 0; c < 3; ++c) CHECK(r.image.rgb[3 * i + c] == Approx(expected[static_cast<int>(c)]));
        }
        CHECK(found);
    }
}
