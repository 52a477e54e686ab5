// SPDX-License-Identifier: MIT
// Point and spot lights inside a medium (kernels/lamp.cl): single scattering against numerical integration, any number of
// scatterings against light tracing on the host, noise that falls as it must, and where all this is left out.
#include <numbers>

#include "src/strategies.h"
#include "tests/device_image.h"
#include "tests/pairs.h"
#include "tests/reference/host_light_tracer.h"
#include "tests/reference/host_phase.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;

namespace {

const glm::dvec3 place{0.13, -0.21, 0.17};

Light spot_within() {
    Light l = light_of(LightKind::spot);
    l.position = place;
    l.target = {0.5, 0.6, -0.3};
    l.intensity = glm::dvec3(3);
    l.beam_rad = 0.3;
    l.cutoff_rad = 0.6;
    return l;
}

/// A ball of radius 1 that absorbs nothing, with a light in it.
Scene lit_ball(const Light& light, const Phase& phase = {}, double sigma = 1) {
    Scene scene = homogeneous_sphere(sigma, 1);
    scene.film = {16, 16};
    scene.media[0].phase = phase;
    scene.lights = {light};
    scene.render.max_depth = 1;
    return scene;
}

/// Radiance of a lit ball's single scattering on the ray along +z through (x, y): ∫ over the angle at the light, in which the
/// integrand is smooth, by Simpson's rule.
double singly_scattered(const Scene& scene, double x, double y) {
    const double square = 1 - x * x - y * y;
    if (square <= 0) return 0;
    const Light& light = scene.lights[0];
    const double half = std::sqrt(square), sigma = scene.media[0].primitives[0].sigma_t, gap = std::hypot(x - light.position.x, y - light.position.y);
    const double begin = std::atan((-half - light.position.z) / gap), end = std::atan((half - light.position.z) / gap);
    const int n = 100;
    double sum = 0;
    for (int i = 0; i <= n; ++i) {
        const double z = light.position.z + gap * std::tan(begin + (end - begin) * i / n);
        const glm::dvec3 p{x, y, z}, rest = light.position - p, back = rest / std::sqrt(glm::dot(rest, rest));
        double falloff = 1;
        if (light.kind == LightKind::spot) {
            const double angle = std::acos(std::clamp(glm::dot(glm::normalize(light.target - light.position), -back), -1.0, 1.0));
            falloff = std::clamp((light.cutoff_rad - angle) / (light.cutoff_rad - light.beam_rad), 0.0, 1.0);
        }
        const double value = sigma * std::exp(-sigma * (z + half + std::sqrt(glm::dot(rest, rest)))) * falloff * phase_value(scene.media[0].phase, back.z);
        sum += (i == 0 || i == n ? 1 : i % 2 ? 4 : 2) * value;
    }
    return light.intensity.x / gap * sum * (end - begin) / (3 * n);
}

/// Of a lit ball; near the light, where radiance is as one over the distance, by more points.
Estimate expected_image(const Scene& scene) {
    const HostCamera camera(scene);
    std::vector<double> means;
    for (int y = 0; y < scene.film.height; ++y)
        for (int x = 0; x < scene.film.width; ++x) {
            const glm::dvec3 middle = camera.ray(x + 0.5, y + 0.5).origin - scene.lights[0].position;
            const double off = std::hypot(middle.x, middle.y);
            const int n = off < 0.12 ? 200 : off < 0.3 ? 48 : 12;
            double sum = 0;
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) {
                    const glm::dvec3 p = camera.ray(x + (i + 0.5) / n, y + (j + 0.5) / n).origin;
                    sum += singly_scattered(scene, p.x, p.y);
                }
            means.push_back(sum / (n * n));
        }
    return grey(scene.film.width, scene.film.height, means, {});
}

/// Relative, since the one pixel that the light projects to is so bright that its error alone would tell; and within the ball's
/// outline, across which the expected image is integrated too coarsely.
double mean_square_error(const Estimate& e, const Estimate& truth) {
    double sum = 0, count = 0;
    for (int y = 0; y < e.height; ++y)
        for (int x = 0; x < e.width; ++x) {
            if (std::hypot(x + 0.5 - 0.5 * e.width, y + 0.5 - 0.5 * e.height) * 2.5 / e.width > 0.8) continue;
            const std::size_t i = 3 * static_cast<std::size_t>(y * e.width + x);
            sum += std::pow(e.mean[i] / truth.mean[i] - 1, 2);
            count += 1;
        }
    return sum / count;
}

Estimate estimate_of(const Scene& scene, const DeviceImage& image) {
    const std::size_t values = 3 * static_cast<std::size_t>(scene.film.width) * static_cast<std::size_t>(scene.film.height);
    Estimate e{scene.film.width, scene.film.height, std::vector<double>(values, 0), std::vector<double>(values, 0)};
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            e.mean[3 * image.pixels[i] + c] = image.values[i].mean[c];
            e.variance[3 * image.pixels[i] + c] = image.values[i].variance[c];
        }
    return e;
}

/// Two point lights and a spot amid a colourful mixture of three families, seen straight ahead.
Scene lit_mixture(bool grids) {
    Scene scene = grids ? mixed_grid_scene() : mixed_scene();
    for (EllipsoidMedium& m : scene.media)
        for (Primitive& p : m.primitives) p.emission = glm::dvec3(0);
    for (GridMedium& m : scene.grids) m.emission = glm::dvec3(0);
    scene.film = {12, 12};
    scene.camera.kind = CameraKind::orthographic;
    scene.camera.origin = {0.5, 0.8, -3.4};
    scene.camera.width = 2.4;
    scene.lights = {point_light({0.2, 0.1, -0.15}, {3, 1, 2}), point_light({-0.4, 0.3, 0.2}, {0.5, 1.5, 1}), spot_within()};
    return scene;
}

void check_pair(const std::string& name, const Pair& pair, const Scene& scene, const HostImage& host, std::uint32_t spp) {
    const RenderResult r = render_pair(pair, scene, spp, 3);
    if (find_strategy(pair.strategy)->kind == BiasKind::unbiased) check_clean(r);
    check_same(name + " by " + pair.name(), colour_of(r.image), colour_of(host));
}

}  // namespace

TEST_CASE("Lamps.PlacesAreUniformInTheAngle", "[quick]") {
    const float foots[] = {0, 0.3f, -0.7f, 2, 1e-3f}, gaps[] = {1, 0.1f, 1e-3f, 1e-6f}, ends[][2] = {{0, 1}, {0, 4}, {0.2f, 0.5f}, {0.9999f, 1}};
    std::vector<Probe::LampView> views;
    std::vector<float> u;
    for (float foot : foots)
        for (float gap : gaps)
            for (const auto& end : ends)
                for (float x : {1e-7f, 1e-3f, 0.1f, 0.37f, 0.5f, 0.82f, 0.999f}) {
                    views.push_back({foot, gap, end[0], end[1]});
                    u.push_back(x);
                }
    const auto places = Probe(select_devices({}).front()).lamp_places(views, u);
    double worst = 0, worst_span = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const Probe::LampPlace& p = places[i];
        REQUIRE(p.place >= p.begin);
        REQUIRE(p.place <= p.end);
        const auto gap = static_cast<double>(views[i].gap), begin = static_cast<double>(p.begin), end = static_cast<double>(p.end), s = static_cast<double>(p.place);
        const auto angle = [&](double a, double b) { return std::atan2(gap * (b - a), gap * gap + a * b); };
        // The ray's own length: its ends, counted from the foot, are rounded.
        const double length = static_cast<double>(views[i].t1) - static_cast<double>(views[i].t0);
        worst_span = std::max(worst_span, std::abs(static_cast<double>(p.span) / std::atan2(gap * length, gap * gap + begin * end) - 1));
        // The angle up to the place, beside what rounding of the place itself makes of it.
        const double blur = std::abs(s) * 0x1p-23 * gap / (gap * gap + s * s);
        worst = std::max(worst, (std::abs(angle(begin, s) - static_cast<double>(u[i]) * angle(begin, end)) - blur) / angle(begin, end));
    }
    CHECK(worst_span < 1e-6);
    CHECK(worst < 2e-6);
}

TEST_CASE("Lamps.SingleScatteringFromWithin") {
    struct Case {
        Light light;
        Phase phase;
        Pair pair;
    };
    const Light point = point_light(place, glm::dvec3(2));
    const Phase forward{PhaseKind::henyey_greenstein, 0.6}, backward{PhaseKind::henyey_greenstein, -0.8}, rayleigh{PhaseKind::rayleigh, 0};
    for (const Case& c : {Case{point, {}, {"delta"}}, Case{point, forward, {"decomposition", "binary"}}, Case{spot_within(), rayleigh, {"delta", "ratio"}},
                          Case{spot_within(), backward, {"regular", "residual-ratio"}}, Case{point, rayleigh, {"progressive"}}}) {
        const Scene scene = lit_ball(c.light, c.phase);
        const RenderResult r = render_pair(c.pair, scene, 2048, 1);
        INFO("light " << static_cast<int>(c.light.kind) << ", phase " << static_cast<int>(c.phase.kind));
        check_same("single scattering within by " + c.pair.name(), colour_of(r.image), expected_image(scene));
    }
}

TEST_CASE("Lamps.SingleScatteringQuick", "[quick]") {
    const Scene scene = lit_ball(point_light(place, glm::dvec3(2)));
    check_same("lamp_quick", colour_of(render_by(delta, scene, 1024).image), expected_image(scene));
}

TEST_CASE("Lamps.BallEqualsLightTracing") {
    // Many scatterings: the light itself is found from places that were found near it.
    for (const Phase& phase : {Phase{}, Phase{PhaseKind::henyey_greenstein, 0.7}}) {
        Scene scene = lit_ball(point_light(place, {2, 1, 3}), phase, 3);
        for (Primitive& p : scene.media[0].primitives) p.albedo = {1, 0.8, 0.5};
        for (int depth : {2, 3, -1}) {
            scene.render.max_depth = depth;
            const HostImage host = trace_from_lights(scene, 1 << 20, 5);
            check_pair("lit ball " + std::to_string(depth), {"delta"}, scene, host, 1024);
        }
    }
}

TEST_CASE("Lamps.EveryMethodEqualsLightTracing") {
    for (bool grids : {false, true}) {
        const Scene scene = lit_mixture(grids);
        const HostImage host = trace_from_lights(scene, 1 << 19, 6);
        // Each unbiased strategy and estimator once; those with grids take in both accelerators.
        const Pair pairs[] = {{"delta", "analytic", "tree"}, {"delta", "ratio", "grid"}, {"delta", "residual-ratio", "scene"}, {"decomposition", "binary", "auto", "newton", "cells"}, {"regular", "analytic", "auto", "newton", "bvh"}};
        for (const Pair& pair : pairs) check_pair(grids ? "lit grids" : "lit mixture", pair, scene, host, 512);
    }
}

TEST_CASE("Lamps.FineStepsComeNearLightTracing") {
    // Biased methods, with steps so fine that the noise hides it.
    Scene scene = lit_mixture(true);
    scene.render.step = 0.01;
    const HostImage host = trace_from_lights(scene, 1 << 18, 7);
    for (const Pair& pair : {Pair{"march", "march"}, Pair{"march-analytic", "ratio"}, Pair{"regular-linear", "analytic"}}) check_pair("lit marching", pair, scene, host, 64);
}

TEST_CASE("Lamps.ErrorFallsAsTheRootOfTheSamples") {
    const Scene scene = lit_ball(point_light(place, glm::dvec3(2)));
    const Estimate truth = expected_image(scene);
    DeviceScene device = make_device_scene(scene, {});
    REQUIRE(define_of(device, "CLUME_LAMPS") == "1");
    std::vector<double> x, y;
    double claimed = 0;
    for (int k = 3; k <= 11; ++k) {
        device.params.seed_lo = static_cast<device::uint>(k);
        const Estimate e = estimate_of(scene, render_device(scene, device, 1u << k));
        x.push_back(k);
        y.push_back(0.5 * std::log2(mean_square_error(e, truth)));
        claimed = mean_of(e.variance) * (1u << k);
    }
    const double mean_x = mean_of(x), mean_y = mean_of(y);
    double xy = 0, xx = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        xy += (x[i] - mean_x) * (y[i] - mean_y);
        xx += (x[i] - mean_x) * (x[i] - mean_x);
    }
    INFO("slope " << xy / xx);
    CHECK(std::abs(xy / xx + 0.5) < 0.08);
    CHECK(y.back() < mean_y - 0.5 * (x.back() - mean_x) + 0.4);
    // Without: the same mean, in theory, and a variance that has no bound.
    set_define(device, "CLUME_LAMPS", "0");
    const double plain_claimed = mean_of(estimate_of(scene, render_device(scene, device, 2048)).variance) * 2048;
    INFO("variance of a sample " << claimed << ", without " << plain_claimed);
    CHECK(plain_claimed > 10 * claimed);
}

TEST_CASE("Lamps.OnlyWhereMediumIsNear", "[quick]") {
    const auto told = [](const Scene& scene) {
        for (const auto& [name, what] : explain(scene, {}))
            if (name == "lights amid medium") return what;
        return std::string("not told");
    };
    Scene scene = homogeneous_sphere(1, 0.8);
    scene.lights = {constant_light(glm::dvec3(1))};
    CHECK(told(scene) == "not told");
    scene.lights = {point_light({0, 3, 0}, glm::dvec3(1))};
    CHECK(told(scene) == "none");
    CHECK(define_of(make_device_scene(scene, {}), "CLUME_LAMPS") == "0");
    scene.lights.push_back(point_light({0, 1.01, 0}, glm::dvec3(1)));
    CHECK_THAT(told(scene), Catch::StartsWith("1: "));
    scene.lights.push_back(spot_within());
    CHECK_THAT(told(scene), Catch::StartsWith("2: "));
    scene.lights[2].intensity = glm::dvec3(0);
    CHECK_THAT(told(scene), Catch::StartsWith("1: "));
}
