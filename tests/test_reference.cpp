// SPDX-License-Identifier: MIT
// The references proved by themselves: the high-precision closed forms against quadrature, and the host path tracer against
// closed forms and numerical integration. What the engine's tests lean on must stand alone.
#include "tests/reference/analytic_scenes.h"
#include "tests/reference/high_precision.h"
#include "tests/reference/host_phase.h"
#include "tests/reference/host_tracer.h"
#include "tests/reference/statistics.h"

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

using namespace clume;
using namespace clume::reference;

namespace {

constexpr double pi = std::numbers::pi;
constexpr KernelFamily families[] = {KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform};

double integrate(const auto& f, double a, double b) {
    return boost::math::quadrature::gauss_kronrod<double, 31>::integrate(f, a, b, 8, 1e-9);
}

/// Distance from x inside the unit ball to its surface along d.
double to_surface(const glm::dvec3& x, const glm::dvec3& d) {
    const double b = glm::dot(x, d);
    return -b + std::sqrt(b * b - glm::dot(x, x) + 1);
}

/// The middle pixel's mean and standard error for the unit ball seen through a needle-thin orthographic camera along +z
/// at offset (x, y).
struct Measured {
    double mean, error, alpha;
};
Measured measure(Scene scene, double x, double y, std::uint32_t spp, std::optional<int> max_depth) {
    scene.camera.origin = {x, y, -3};
    scene.camera.target = {x, y, 0};
    scene.camera.width = 1e-6;
    scene.film = {8, 8};
    const HostImage image = HostTracer(scene, 24, max_depth).trace(spp / 64, 5);
    Measured m{0, 0, 0};
    for (std::size_t i = 0; i < 64; ++i)
        m.mean += image.rgb[3 * i] / 64, m.error += image.variance[3 * i] / 4096, m.alpha += image.alpha[i] / 64;
    m.error = std::sqrt(m.error);
    return m;
}

/// One primitive's extinction at x, straight from the definition.
double extinction_of(const EllipsoidMedium& m, const Primitive& p, const glm::dvec3& x) {
    const glm::dvec3 z = glm::inverse(p.axes) * (x - p.center);
    const double r = glm::dot(z, z), e = m.extent * m.extent;
    if (r >= e) return 0;
    const double k = m.kernel == KernelFamily::gaussian ? std::exp(-r / 2) : m.kernel == KernelFamily::uniform ? 1 : 1 - r / e;
    return m.density_scale * p.sigma_t * k;
}

Light delta_light(LightKind kind) {
    Light light;
    light.kind = kind;
    light.intensity = light.irradiance = glm::dvec3(2);
    light.position = {0.4, 0.5, -0.3};  // inside the ball
    light.target = {0.1, 0.2, 0.2};
    light.direction = {0.6, 0, 0.8};
    light.beam_rad = 0.3;
    light.cutoff_rad = 1.2;
    return light;
}

}  // namespace

TEST_CASE("HighPrecision.scalars", "[quick][reference]") {
    namespace h = high;
    for (double x : {1e-8, 0.4, 0.6, 2.0, 4.5, 9.0}) {
        const h::Real back = x < 5 ? h::erf_inv(-h::erf(h::Real(x))) : h::Real(-h::erfc_inv(h::erfc(h::Real(x))));
        CHECK(h::mp::abs(back / x + 1) < (x < 4 ? 1e-40 : 1e-25));
    }
    CHECK(h::mp::abs(h::erf_difference(8, 8.5) / (h::erfc(8) - h::erfc(8.5)) - 1) < 1e-40);
    CHECK(h::mp::abs(h::exp(h::log(h::Real(7))) - 7) < 1e-45);
}

TEST_CASE("HighPrecision.closed_forms_equal_quadrature", "[quick][reference]") {
    HostRandom random(21, 0);
    const auto u = [&] { return 2 * random.uniform() - 1; };
    for (KernelFamily family : families)
        for (int trial = 0; trial < 12; ++trial) {
            const double stretch = trial % 3 == 0 ? 1e4 : 2;
            const glm::dvec3 rotation{random.uniform(), random.uniform(), random.uniform()};
            const Primitive p = make_primitive({u(), u(), u()}, {0.5, 0.5 / stretch, 0.3}, 1, rotation);
            const glm::dvec3 aim = p.center + p.axes * glm::dvec3(u(), u(), u());
            const glm::dvec3 origin = trial % 4 == 1 ? aim : glm::dvec3(3 * u(), 3 * u(), -4);
            const glm::dvec3 direction = origin == aim ? glm::dvec3(0, 0, 1) : glm::normalize(aim - origin);
            const high::Chord chord(origin, direction, p.center, high::whitening_from_axes(p.axes), 2.5,
                                    default_extent(family), family);
            const auto interval = chord.interval(0, 1e9);
            REQUIRE(interval);
            const high::Real a = interval->enter, c = interval->exit, b = a + (c - a) * random.uniform();
            const high::Real all = chord.optical_depth(0, 1e9);
            INFO("family " << static_cast<int>(family) << ", trial " << trial);
            CHECK(abs(chord.optical_depth_quadrature(0, 1e9) / all - 1) < 1e-28);
            CHECK(abs(chord.optical_depth_quadrature(a, b) / chord.optical_depth(a, b) - 1) < 1e-28);
            CHECK(abs((chord.optical_depth(a, b) + chord.optical_depth(b, c)) / all - 1) < 1e-38);
            const high::Real tau = all * random.uniform();
            const auto t = chord.invert(0, tau);
            REQUIRE(t);
            CHECK(abs(chord.optical_depth(0, *t) / tau - 1) < 1e-35);
            CHECK_FALSE(chord.invert(0, all * 1.0000001));
        }
}

TEST_CASE("HostMedium.extinction_and_bounds", "[quick][reference]") {
    for (KernelFamily family : families) {
        Scene scene = random_mixture(family, 60, 4, 12, 3);
        scene.media[0].density_scale = 2.5;
        scene.media.push_back(random_mixture(KernelFamily::gaussian, 20, 5).media[0]);
        scene.media[1].primitives.push_back(make_primitive({0, 0, 0}, {0.3, 3e-4, 0.01}, 50, {0.3, 0.1, 0.7}));
        const HostMedium medium(scene, 40);
        HostRandom random(8, 0);
        double worst = 0;
        int above = 0, tight = 0;
        for (int i = 0; i < 20000; ++i) {
            const glm::dvec3 u{random.uniform(), random.uniform(), random.uniform()};
            const glm::dvec3 x = i % 4 == 0 ? scene.media[1].primitives.back().axes * (4.0 * u - 2.0)
                                            : medium.lower() + u * (medium.upper() - medium.lower());
            double sum = 0;
            for (const auto& m : scene.media)
                for (const auto& p : m.primitives) sum += extinction_of(m, p, x);
            worst = std::max(worst, std::abs(medium.extinction(x) - sum) / (sum + 1e-6));
            above += sum > medium.max_extinction(x);
            tight += sum > 0.5 * medium.max_extinction(x) && sum > 0;
        }
        CHECK(worst < 1e-9);
        CHECK(above == 0);
        CHECK(tight > 2000);
    }
}

TEST_CASE("HostMedium.flights_follow_the_extinction", "[quick][reference]") {
    for (KernelFamily family : families) {
        Scene scene = random_mixture(family, 80, 9, 10, 0.2);
        scene.media.push_back(random_mixture(KernelFamily::gaussian, 20, 5, 4, 0.2).media[0]);
        std::vector<std::pair<const EllipsoidMedium*, const Primitive*>> all;
        for (const auto& m : scene.media)
            for (const auto& p : m.primitives) all.emplace_back(&m, &p);
        const HostRay ray{{0.05, -0.1, -2.5}, glm::normalize(glm::dvec3(0.03, 0.04, 1))};
        const int n = 400000, bins = 40, steps = 20000;
        const double end = 4.5, dt = end / steps;
        std::vector<double> where(bins + 1, 0), who(all.size() + 1, 0);  // the last one: escaped
        double depth = 0;
        for (int i = 0; i < steps; ++i) {
            std::vector<double> rates;
            double sum = 0;
            const glm::dvec3 x = ray.origin + ray.direction * ((i + 0.5) * dt);
            for (const auto& [m, p] : all) sum += rates.emplace_back(extinction_of(*m, *p, x));
            const double mass = n * std::exp(-depth) * -std::expm1(-sum * dt);
            where[static_cast<std::size_t>(i * bins / steps)] += mass;
            for (std::size_t k = 0; k < all.size() && sum > 0; ++k) who[k] += mass * rates[k] / sum;
            depth += sum * dt;
        }
        where.back() = who.back() = n * std::exp(-depth);
        REQUIRE(depth > 0.5);
        REQUIRE(depth < 6);
        for (int cells : {2, 40}) {
            const HostMedium medium(scene, cells);
            HostRandom random(31, static_cast<std::uint64_t>(cells));
            std::vector<double> flown(bins + 1, 0), met(all.size() + 1, 0);
            for (int i = 0; i < n; ++i) {
                const HostCollision c = medium.fly(ray, 1e9, random);
                ++flown[c.primitive < 0 ? bins : static_cast<std::size_t>(c.t / end * bins)];
                ++met[c.primitive < 0 ? all.size() : static_cast<std::size_t>(c.primitive)];
            }
            const ChiSquare position = chi_square(flown, where), index = chi_square(met, who);
            INFO("family " << static_cast<int>(family) << ", cells " << cells << ", depth " << depth);
            CHECK(position.p > sidak_threshold(0.01, 12));
            CHECK(index.p > sidak_threshold(0.01, 12));
            CHECK(position.degrees > 10);
            CHECK(index.degrees > 8);
        }
    }
}

TEST_CASE("HostPhase.samples_follow_the_density", "[quick][reference]") {
    const Phase phases[] = {{PhaseKind::isotropic, 0}, {PhaseKind::rayleigh, 0}, {PhaseKind::henyey_greenstein, 0.8},
                            {PhaseKind::henyey_greenstein, -0.4}, {PhaseKind::henyey_greenstein, 0}};
    for (const Phase& phase : phases)
        for (const glm::dvec3 d : {glm::dvec3(0, 0, -1), glm::dvec3(0.48, -0.6, 0.64)}) {
            HostRandom random(17, 3);
            const int n = 100000, bins = 50;
            std::vector<double> counts(bins, 0), expected;
            double mean = 0;
            for (int i = 0; i < n; ++i) {
                const double c = glm::dot(d, sample_phase(phase, d, random));
                mean += c / n;
                ++counts[static_cast<std::size_t>(std::clamp(static_cast<int>((c + 1) / 2 * bins), 0, bins - 1))];
            }
            const auto density = [&](double c) { return 2 * pi * n * phase_value(phase, c); };
            for (int i = 0; i < bins; ++i) expected.push_back(integrate(density, 2.0 * i / bins - 1, 2.0 * (i + 1) / bins - 1));
            CHECK(chi_square(counts, expected).p > 1e-4);
            CHECK(mean == Approx(phase.kind == PhaseKind::henyey_greenstein ? phase.g : 0).margin(0.01));
        }
}

TEST_CASE("HostTracer.furnaces", "[reference]") {
    for (KernelFamily family : families)
        for (double density : {0.1, 1.0, 10.0, 100.0})
            for (bool inside : {false, true})
                for (bool emissive : {false, true}) {
                    const auto make = emissive ? emissive_furnace : white_furnace;
                    const HostImage image = HostTracer(make(family, density, inside)).trace(1, 0);
                    double worst = 0;  // every path's weights add up to 1, whatever it meets
                    for (double v : image.rgb) worst = std::max(worst, std::abs(v - 1));
                    CHECK(worst < 1e-9);
                }
}

TEST_CASE("HostTracer.absorbing_gaussian_closed_form", "[quick][reference]") {
    const Scene scene = absorbing_gaussian();
    const int spp = 256, w = scene.film.width, h = scene.film.height;
    const HostImage image = render_host(scene, {.spp = spp, .seed = 3, .max_depth = {}, .crop = {}});
    double statistic = 0, worst_depth = 0;
    int pixels = 0;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            double t = 0;  // over the pixel's area
            for (int row = 0; row < 8; ++row)
                for (int column = 0; column < 8; ++column) t += absorbing_gaussian_transmittance(scene, x + (column + 0.5) / 8, y + (row + 0.5) / 8) / 64;
            const std::size_t i = static_cast<std::size_t>(y) * w + x;
            CHECK(std::abs(image.rgb[3 * i] - (1 - image.alpha[i])) < 1e-12);
            worst_depth = std::max(worst_depth, -std::log(t));
            if (t * spp > spp - 5 || t * spp < 5) continue;
            const double z = (1 - image.alpha[i] - t) / std::sqrt(t * (1 - t) / spp);
            statistic += z * z;
            ++pixels;
        }
    REQUIRE(pixels > 50);
    CHECK(worst_depth > 0.5);
    CHECK(std::abs((statistic - pixels) / std::sqrt(2.0 * pixels)) < 4);
}

TEST_CASE("HostTracer.homogeneous_sphere", "[quick][reference]") {
    for (double sigma : {0.3, 2.0, 5.0}) {
        Scene scene = homogeneous_sphere(sigma, 0.5);
        scene.camera.origin = {0.3, -0.4, -3};
        const Measured m = measure(scene, 0.3, -0.4, 64000, {});
        const double t = std::exp(-sigma * 2 * std::sqrt(0.75));
        CHECK(std::abs(1 - m.alpha - t) < 4 * std::sqrt(t * (1 - t) / 64000));
        scene.camera.target = {0.3, -0.4, 0};
        CHECK(homogeneous_sphere_transmittance(scene, 16, 16) == Approx(t));
    }
}

TEST_CASE("HostTracer.single_scattering_equals_integration", "[reference]") {
    const double sigma = 1.5, albedo = 0.7, x = -0.2, y = 0.1, half = std::sqrt(1 - x * x - y * y);
    const Phase phases[] = {{PhaseKind::isotropic, 0}, {PhaseKind::henyey_greenstein, 0.6}, {PhaseKind::rayleigh, 0}};
    for (const Phase& phase : phases)
        for (LightKind kind : {LightKind::point, LightKind::spot, LightKind::directional}) {
            Scene scene = homogeneous_sphere(sigma, albedo);
            scene.media[0].phase = phase;
            const Light light = delta_light(kind);
            scene.lights = {light};
            const double expected = integrate(
                [&](double s) {
                    const glm::dvec3 p{x, y, -half + s};
                    glm::dvec3 l = light.position - p;
                    double r = glm::length(l), e = light.intensity.x / (r * r), depth = r;
                    if (kind == LightKind::directional) {
                        l = -light.direction, r = 1;
                        e = light.irradiance.x, depth = to_surface(p, l);
                    }
                    l /= r;
                    if (kind == LightKind::spot) {
                        const double angle = std::acos(glm::dot(glm::normalize(light.target - light.position), -l));
                        e *= std::clamp((light.cutoff_rad - angle) / (light.cutoff_rad - light.beam_rad), 0.0, 1.0);
                    }
                    return sigma * albedo * std::exp(-sigma * (s + depth)) * e * phase_value(phase, l.z);
                },
                0, 2 * half);
            const Measured m = measure(scene, x, y, 400000, 1);
            INFO("light " << static_cast<int>(kind) << ", phase " << static_cast<int>(phase.kind) << ": " << m.mean
                          << " ± " << m.error << " against " << expected);
            CHECK(m.error < 0.01 * expected);
            CHECK(std::abs(m.mean - expected) < 4 * m.error);
            CHECK(measure(scene, x, y, 64, 0).mean == 0);
        }
}

TEST_CASE("HostTracer.sphere_light_is_found_and_blocks", "[reference]") {
    // On the axis behind the medium, seen along +z through the middle: once directly, attenuated, and once scattered.
    const double sigma = 0.8, albedo = 0.9, radius = 1, distance = 3;
    Scene scene = homogeneous_sphere(sigma, albedo);
    Light light;
    light.kind = LightKind::sphere;
    light.center = {0, 0, distance};
    light.radius = radius;
    light.radiance = glm::dvec3(1.5);
    scene.lights = {light};
    const double scattered = integrate(
        [&](double s) {
            const glm::dvec3 p{0, 0, s - 1};
            const double lowest = std::sqrt(1 - std::pow(radius / (distance - p.z), 2));
            const double in = integrate(
                [&](double c) { return 2 * pi * std::exp(-sigma * to_surface(p, {std::sqrt(1 - c * c), 0, c})); }, lowest, 1);
            return sigma * albedo * std::exp(-sigma * s) * 1.5 / (4 * pi) * in;
        },
        0, 2);
    const double direct = 1.5 * std::exp(-2 * sigma);
    const Measured depth_0 = measure(scene, 0, 0, 100000, 0), depth_1 = measure(scene, 0, 0, 400000, 1);
    CHECK(std::abs(depth_0.mean - direct) < 4 * depth_0.error);
    CHECK(std::abs(depth_1.mean - direct - scattered) < 4 * depth_1.error);
    CHECK(depth_0.alpha == 1);  // opaque behind the medium

    // A rectangle in front: black from behind, bright from its front, and nothing is seen through it.
    light.kind = LightKind::rectangle;
    light.corner = {-1, -1, -2};
    light.edge_u = {2, 0, 0};
    light.edge_v = {0, 2, 0};
    scene.lights.push_back(light);
    CHECK(measure(scene, 0, 0, 64, 0).mean == 0);
    CHECK(measure(scene, 0, 0, 64, 0).alpha == 1);
    std::swap(scene.lights[1].edge_u, scene.lights[1].edge_v);
    CHECK(measure(scene, 0, 0, 64, 0).mean == Approx(1.5));
}

TEST_CASE("HostLights.environment_orientation", "[quick][reference]") {
    Scene scene;
    Light light;
    light.kind = LightKind::envmap;
    light.image.width = 8;
    light.image.height = 4;
    for (int i = 0; i < 32; ++i)
        for (int k = 0; k < 3; ++k) light.image.rgb.push_back(static_cast<float>(i));
    light.scale = 2;
    scene.lights = {light};
    const auto texel = [](const Scene& s, const glm::dvec3& d) {
        return static_cast<int>(std::lround(HostLights(s).background(glm::normalize(d), false).x / 2));
    };
    CHECK(texel(scene, {-0.1, -0.1, 1}) == 2 * 8 + 4);  // lon slightly below 0: right of the centre
    CHECK(texel(scene, {0.1, 0.1, 1}) == 1 * 8 + 3);
    CHECK(texel(scene, {1, 0.1, -0.1}) == 1 * 8 + 1);
    CHECK(texel(scene, {0.01, 1, 0.001}) < 8);
    CHECK(HostLights(scene).background({0, 0, 1}, true).x == 0);
    scene.lights[0].rotate_y_rad = pi / 2;  // what was seen along +z moves to +x
    CHECK(texel(scene, {1, -0.1, 0.1}) == 2 * 8 + 4);
}

TEST_CASE("HostTracer.image_does_not_depend_on_threads_crop_or_cells", "[quick][reference]") {
    Scene scene = random_mixture(KernelFamily::epanechnikov, 40, 2, 6, 4);
    scene.media.push_back(random_mixture(KernelFamily::gaussian, 30, 3, 4, 4).media[0]);
    scene.media.push_back(homogeneous_sphere(0.3, 0.8).media[0]);
    scene.media[1].phase = {PhaseKind::rayleigh, 0};
    scene.media[0].primitives[0].has_g = true;
    scene.media[0].primitives[0].g = 0.7f;
    scene.lights.push_back(delta_light(LightKind::directional));
    scene.lights.push_back(delta_light(LightKind::sphere));
    scene.lights.back().radius = 0.2;
    scene.lights.back().center = {0.8, 0.8, 0.2};
    const HostTracer tracer(scene, 32);
    const HostImage one = tracer.trace(24, 9, 1), two = tracer.trace(24, 9, 2);
    CHECK(one.rgb == two.rgb);
    CHECK(one.variance == two.variance);
    CHECK(one.alpha == two.alpha);
    const HostImage crop = tracer.trace(24, 9, 2, HostCrop{5, 7, 20, 19});
    std::size_t different = 0;
    for (std::size_t y = 7; y < 19; ++y)
        for (std::size_t x = 5; x < 20; ++x) different += crop.rgb[3 * ((y - 7) * 15 + x - 5)] != one.rgb[3 * (y * 32 + x)];
    CHECK(different == 0);
    // Another grid has other bounds and other null collisions: the same mean from other samples.
    const HostImage coarse = HostTracer(scene, 3).trace(24, 10);
    const ImageTest test = compare_images(one.rgb, one.variance, coarse.rgb, coarse.variance, 32, 32);
    CHECK(test.pass);
    CHECK(test.tests > 30);
}

TEST_CASE("HostTracer.many_thin_primitives_equal_one", "[quick][reference]") {
    Scene one = absorbing_gaussian(3), many = one;
    one.media[0].primitives[0].albedo = glm::dvec3(0.8);
    many.media[0].primitives[0] = one.media[0].primitives[0];
    many.media[0].primitives[0].sigma_t /= 7;
    many.media[0].primitives.resize(7, many.media[0].primitives[0]);
    one.lights.push_back(delta_light(LightKind::directional)), many.lights = one.lights;
    const HostImage a = render_host(one, {.spp = 64, .max_depth = {}, .crop = {}});
    const HostImage b = render_host(many, {.spp = 64, .seed = 1, .cells = 20, .max_depth = {}, .crop = {}});
    CHECK(compare_images(a.rgb, a.variance, b.rgb, b.variance, 32, 32).pass);
    many.media[0].primitives.resize(6);  // a seventh of the medium missing must be seen
    const HostImage c = render_host(many, {.spp = 64, .seed = 1, .cells = 20, .max_depth = {}, .crop = {}});
    CHECK_FALSE(compare_images(a.rgb, a.variance, c.rgb, c.variance, 32, 32).pass);
}

TEST_CASE("HostTracer.free_flights", "[quick][reference]") {
    // Origins uniform in a ball of radius 1, isotropic: the share that escapes is ∫ e^{−σ s} p(s) ds with the density
    // p(s) = (3/4)(1 − s²/4) of the distance to the surface.
    const double sigma = 1.3;
    const FlightRate rate = free_flights_host(homogeneous_sphere(sigma, 1), 200000, true, 2, 16);
    const double escape = integrate([&](double s) { return 0.75 * (1 - s * s / 4) * std::exp(-sigma * s); }, 0, 2);
    const double share = 1 - static_cast<double>(rate.collided) / static_cast<double>(rate.flights);
    CHECK(std::abs(share - escape) < 4 * std::sqrt(escape * (1 - escape) / 200000));
    CHECK(rate.flights_per_s > 0);
}
