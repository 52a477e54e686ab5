// SPDX-License-Identifier: MIT
// Images whose expectation is known in closed form or by plain numerical integration: one absorbing primitive of each
// kernel, a homogeneous ball, an opaque flame, and single scattering of light that comes from one direction per point.
#include <numbers>

#include "tests/image_test.h"
#include "tests/reference/analytic_scenes.h"
#include "tests/reference/host_phase.h"

using namespace clume;
using namespace clume::reference;
using namespace clume::test;
using std::numbers::pi;

namespace {

/// One rotated, uneven primitive of a kernel, seen by a perspective camera beside the axis.
Scene one_absorber(KernelFamily kernel, double density) {
    Scene scene = absorbing_gaussian(1);
    EllipsoidMedium& medium = scene.media[0];
    medium.kernel = kernel;
    medium.extent = kernel == KernelFamily::gaussian ? 3 : default_extent(kernel);
    medium.density_scale = density;
    medium.primitives = {make_primitive({0.1, -0.05, 0.2}, {0.35, 0.2, 0.28}, 2.5, {0.3, 0.6, 0.2})};
    medium.primitives[0].albedo = glm::dvec3(0);
    scene.film = {28, 20};
    scene.lights = {constant_light(glm::dvec3(1), true)};
    return scene;
}

/// exp(−optical depth) of a scene's first primitive along a ray, from the formulas of docs/design.md's table of kernels.
double transmittance(const Scene& scene, const HostRay& ray) {
    const EllipsoidMedium& m = scene.media[0];
    const Primitive& p = m.primitives[0];
    const glm::dmat3 w = glm::inverse(p.axes);
    const glm::dvec3 a = w * (ray.origin - p.center), b = w * ray.direction;
    const double speed = std::sqrt(glm::dot(b, b));
    const glm::dvec3 foot = a - b * (glm::dot(a, b) / (speed * speed));
    const double square = m.extent * m.extent - glm::dot(foot, foot);
    if (square <= 0) return 1;
    const double h = std::sqrt(square), sigma = m.density_scale * p.sigma_t;
    if (m.kernel == KernelFamily::uniform) return std::exp(-sigma * 2 * h / speed);
    if (m.kernel == KernelFamily::epanechnikov)
        return std::exp(-sigma * 4.0 / 3 * h * h * h / (speed * m.extent * m.extent));
    return std::exp(-sigma * std::sqrt(2 * pi) / speed * std::exp(-0.5 * glm::dot(foot, foot)) * std::erf(h / std::sqrt(2.0)));
}

/// The mean over each pixel of a function of the camera ray, by n × n points.
template <class Function>
std::vector<double> pixel_means(const Scene& scene, int n, const Function& function) {
    const HostCamera camera(scene);
    std::vector<double> means;
    for (int y = 0; y < scene.film.height; ++y)
        for (int x = 0; x < scene.film.width; ++x) {
            double sum = 0;
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) sum += function(camera.ray(x + (i + 0.5) / n, y + (j + 0.5) / n));
            means.push_back(sum / (n * n));
        }
    return means;
}

/// Alpha against 1 − t with the binomial variance that t has, and radiance, sample by sample, as what is not covered.
void check_covered(const std::string& name, const Scene& scene, const RenderImage& image, const std::vector<double>& t) {
    std::vector<double> alpha;
    for (double v : t) alpha.push_back(1 - v);
    const int w = scene.film.width, h = scene.film.height;
    Estimate rendered = alpha_of(image);
    rendered.variance = share(w, h, alpha, doubles(image.samples)).variance;
    check_same(name, rendered, grey(w, h, alpha, {}));
    double worst = 0;
    for (std::size_t i = 0; i < image.rgb.size(); ++i)
        worst = std::max(worst, std::abs(static_cast<double>(image.rgb[i]) - scene.lights[0].radiance[static_cast<int>(i % 3)] * (1 - static_cast<double>(image.alpha[i / 3]))));
    CHECK(worst < 1e-6);
}

void check_absorber(const std::string& name, const Way& way, const Scene& scene, std::uint32_t spp) {
    const RenderResult r = render_by(way, scene, spp);
    check_clean(r);
    const std::vector<double> t = pixel_means(scene, 16, [&](const HostRay& ray) { return transmittance(scene, ray); });
    INFO(way.name() << ", kernel " << static_cast<int>(scene.media[0].kernel) << ", density " << scene.media[0].density_scale);
    check_covered(name, scene, r.image, t);
    CHECK(*std::min_element(t.begin(), t.end()) < 0.85);
}

/// ∫ f over [a, b] by Simpson's rule.
template <class Function>
double integrate(const Function& f, double a, double b, int n = 200) {
    double sum = f(a) + f(b);
    for (int i = 1; i < n; ++i) sum += (i % 2 ? 4 : 2) * f(a + (b - a) * i / n);
    return sum * (b - a) / (3 * n);
}

/// Distance from p along d to the surface of the unit ball; 0 if the ray leaves it behind.
double to_surface(const glm::dvec3& p, const glm::dvec3& d) {
    const double b = glm::dot(p, d), c = glm::dot(p, p) - 1;
    return std::max(0.0, -b + std::sqrt(std::max(0.0, b * b - c)));
}

Light delta_light(LightKind kind) {
    Light l = light_of(kind);
    l.position = {1.2, 1.5, -1.1};
    l.target = {-0.1, 0.2, 0.1};
    l.intensity = glm::dvec3(6);
    l.beam_rad = 0.15;
    l.cutoff_rad = 0.45;
    l.direction = {-0.5, -1, 0.7};
    l.irradiance = glm::dvec3(2);
    return l;
}

/// Singly scattered radiance that a ray along +z through (x, y) finds in the unit ball.
double singly_scattered(const Scene& scene, const Light& light, double x, double y) {
    const double square = 1 - x * x - y * y;
    if (square <= 0) return 0;
    const double half = std::sqrt(square), sigma = scene.media[0].primitives[0].sigma_t, albedo = scene.media[0].primitives[0].albedo.x;
    return integrate(
        [&](double s) {
            const glm::dvec3 p{x, y, s - half};
            glm::dvec3 l = light.kind == LightKind::directional ? -light.direction : light.position - p;
            const double r = std::sqrt(glm::dot(l, l));
            l /= r;
            double e = light.kind == LightKind::directional ? light.irradiance.x : light.intensity.x / (r * r);
            if (light.kind == LightKind::spot) {
                const double angle = std::acos(glm::dot(glm::normalize(light.target - light.position), -l));
                e *= std::clamp((light.cutoff_rad - angle) / (light.cutoff_rad - light.beam_rad), 0.0, 1.0);
            }
            return sigma * albedo * std::exp(-sigma * (s + to_surface(p, l))) * e * phase_value(scene.media[0].phase, l.z);
        },
        0, 2 * half);
}

Scene scattering_ball(LightKind kind, const Phase& phase) {
    Scene scene = homogeneous_sphere(1.5, 0.7);
    scene.film = {24, 24};
    scene.media[0].phase = phase;
    scene.lights = {delta_light(kind)};
    scene.render.max_depth = 1;
    return scene;
}

Estimate expected_scattering(const Scene& scene) {
    return grey(scene.film.width, scene.film.height,
                pixel_means(scene, 8, [&](const HostRay& ray) { return singly_scattered(scene, scene.lights[0], ray.origin.x, ray.origin.y); }), {});
}

}  // namespace

TEST_CASE("ClosedForm.OneAbsorberOfEachKernel") {
    for (KernelFamily kernel : {KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform})
        for (const Way& way : unbiased_ways)
            for (double density : {0.2, 1.0, 10.0}) check_absorber("absorber", way, one_absorber(kernel, density), 512);
}

TEST_CASE("ClosedForm.AbsorberFromInside") {
    for (const Way& way : unbiased_ways) {
        // The camera stands at the primitive's centre: half of each depth.
        Scene scene = one_absorber(KernelFamily::gaussian, 1);
        scene.camera.origin = scene.media[0].primitives[0].center;
        scene.camera.target = scene.camera.origin + glm::dvec3(1, 0.3, -0.2);
        const RenderResult r = render_by(way, scene, 512);
        const std::vector<double> t = pixel_means(scene, 8, [&](const HostRay& ray) { return std::sqrt(transmittance(scene, ray)); });
        check_covered("absorber_inside by " + way.name(), scene, r.image, t);
    }
}

TEST_CASE("ClosedForm.AbsorberQuick", "[quick]") {
    check_absorber("absorber_quick", delta, one_absorber(KernelFamily::gaussian, 1), 256);
}

TEST_CASE("ClosedForm.HomogeneousBall") {
    for (double sigma : {0.3, 2.0, 5.0}) {
        Scene scene = homogeneous_sphere(sigma, 0);
        scene.lights = {constant_light(glm::dvec3(1), true)};
        const RenderResult r = render_by(decomposition, scene, 256);
        check_clean(r);
        const std::vector<double> t = pixel_means(scene, 32, [&](const HostRay& ray) {
            const double square = 1 - ray.origin.x * ray.origin.x - ray.origin.y * ray.origin.y;
            return square > 0 ? std::exp(-2 * sigma * std::sqrt(square)) : 1;
        });
        check_covered("ball", scene, r.image, t);
    }
}

TEST_CASE("ClosedForm.OpaqueFlameLooksLikeItsEmission") {
    // Nothing scatters, and the flame is so dense that the pixels inside its outline see nothing else.
    Scene scene = homogeneous_sphere(1e4, 0);
    scene.media[0].primitives[0].emission = {3, 2, 0.5};
    const RenderResult r = render_by(delta, scene, 16);
    const Estimate e = colour_of(r.image);
    int inside = 0;
    for (int y = 0; y < e.height; ++y)
        for (int x = 0; x < e.width; ++x) {
            const double dx = (x + 0.5 - 0.5 * e.width) * 2.5 / e.width, dy = (y + 0.5 - 0.5 * e.height) * 2.5 / e.height;
            if (std::hypot(dx, dy) > 0.9) continue;
            ++inside;
            const std::size_t i = 3 * static_cast<std::size_t>(y * e.width + x);
            CHECK(e.mean[i] == Approx(3));
            CHECK(e.mean[i + 1] == Approx(2));
            CHECK(e.mean[i + 2] == Approx(0.5));
            CHECK(r.image.alpha[i / 3] == 1);
        }
    CHECK(inside > 300);
}

TEST_CASE("ClosedForm.ThinFlameEmitsItsShare") {
    // (1 − albedo) L_e of what is absorbed: L_e (1 − albedo)(1 − T) without scattering events.
    Scene scene = homogeneous_sphere(0.8, 0.25);
    scene.media[0].primitives[0].emission = glm::dvec3(2);
    scene.render.max_depth = 0;
    const RenderResult r = render_by(delta, scene, 256);
    const std::vector<double> e = pixel_means(scene, 32, [&](const HostRay& ray) {
        const double square = 1 - ray.origin.x * ray.origin.x - ray.origin.y * ray.origin.y;
        return square > 0 ? 2 * 0.75 * (1 - std::exp(-1.6 * std::sqrt(square))) : 0;
    });
    Estimate rendered = colour_of(r.image);
    for (std::size_t i = 0; i < rendered.mean.size(); ++i) rendered.variance[i] = e[i / 3] * (1.5 - e[i / 3]) / 256 + 0.14 / (256 * 256);
    check_same("thin_flame", rendered, grey(scene.film.width, scene.film.height, e, {}));
}

TEST_CASE("ClosedForm.SingleScattering") {
    struct Case {
        LightKind light;
        Phase phase;
        Way way;
    };
    const Phase isotropic, forward{PhaseKind::henyey_greenstein, 0.6}, rayleigh{PhaseKind::rayleigh, 0};
    for (const Case& c : {Case{LightKind::point, isotropic, delta}, Case{LightKind::spot, forward, decomposition},
                          Case{LightKind::directional, rayleigh, decomposition_bvh}, Case{LightKind::point, forward, delta},
                          Case{LightKind::directional, isotropic, delta}}) {
        const Scene scene = scattering_ball(c.light, c.phase);
        const RenderResult r = render_by(c.way, scene, 1024);
        check_clean(r);
        INFO("light " << static_cast<int>(c.light) << ", phase " << static_cast<int>(c.phase.kind) << ", " << c.way.name());
        check_same("single_scattering", colour_of(r.image), expected_scattering(scene));
    }
}

TEST_CASE("ClosedForm.MarchIsRightWithFineStepsAndBiasedWithCoarseOnes") {
    for (const char* accelerator : {"cells", "bvh"}) {
        const Way march{"march", accelerator};
        Scene scene = scattering_ball(LightKind::directional, {});
        const Estimate expected = expected_scattering(scene);
        scene.render.step = 0.01;
        const RenderResult fine = render_by(march, scene, 512);
        INFO(accelerator);
        check_same("march", colour_of(fine.image), expected, 1e-3);

        // An absorber seen with steps of its own size. Alpha tells, its closed form is exact.
        Scene absorber = one_absorber(KernelFamily::gaussian, 1);
        absorber.render.step = 0.01;
        check_absorber("march_absorber", march, absorber, 256);
        absorber.render.step = 1.7;
        const RenderResult coarse = render_by(march, absorber, 256);
        std::vector<double> covered = pixel_means(absorber, 8, [&](const HostRay& ray) { return 1 - transmittance(absorber, ray); });
        const int w = absorber.film.width, h = absorber.film.height;
        CHECK_FALSE(compare(alpha_of(coarse.image), grey(w, h, covered, {})).pass);
    }
}
