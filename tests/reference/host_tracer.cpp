// SPDX-License-Identifier: MIT
// Path tracing over the host medium, rows shared out to threads, and the two helpers that time it.
// max_depth counts scattering events; the collision after the last one still emits.
#include "tests/reference/host_tracer.h"

#include "tests/reference/host_phase.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>

namespace clume::reference {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Calls work(i) for 0 ≤ i < count on `threads` threads, the caller's one included.
template <class Work> void share_out(int count, int threads, const Work& work) {
    std::atomic<int> next{0};
    const auto run = [&] {
        for (int i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) work(i);
    };
    std::vector<std::thread> helpers;
    for (int i = 1; i < threads; ++i) helpers.emplace_back(run);
    run();
    for (auto& helper : helpers) helper.join();
}

}  // namespace

HostTracer::HostTracer(const Scene& scene, int cells, std::optional<int> max_depth)
    : build_start_(now()),
      film_(scene.film),
      max_depth_(max_depth.value_or(scene.render.max_depth)),
      camera_(scene),
      lights_(scene),
      medium_(scene, cells) {
    build_seconds_ = now() - build_start_;
}

HostTracer::Sample HostTracer::trace_path(HostRay ray, HostRandom& random) const {
    glm::dvec3 radiance(0), beta(1);
    bool opaque = false;
    for (int depth = 0;; ++depth) {
        SurfaceHit surface{infinity, glm::dvec3(0)};
        if (lights_.has_surfaces()) surface = lights_.nearest_surface(ray);
        const HostCollision collision = medium_.fly(ray, surface.t, random);
        radiance += beta * medium_.glow(ray, collision.primitive < 0 ? surface.t : collision.t, random);
        if (collision.primitive < 0) {
            if (surface.t < infinity) {
                if (depth == 0) opaque = true;
                radiance += beta * surface.radiance;
            } else {
                radiance += beta * lights_.background(ray.direction, depth == 0);
            }
            break;
        }
        opaque = opaque || depth == 0;
        const HostMaterial& material = medium_.material(collision.primitive);
        radiance += beta * material.emission;
        beta *= material.albedo;
        if (depth == max_depth_ || (beta.x == 0 && beta.y == 0 && beta.z == 0)) break;
        ray.origin += collision.t * ray.direction;
        if (lights_.sampled_count() > 0)
            radiance += beta * direct_light(ray.origin, ray.direction, material.phase, random);
        ray.direction = sample_phase(material.phase, ray.direction, random);
    }
    return {radiance, opaque};
}

glm::dvec3 HostTracer::direct_light(const glm::dvec3& x, const glm::dvec3& d, const Phase& phase,
                                    HostRandom& random) const {
    glm::dvec3 sum(0);
    for (std::size_t i = 0; i < lights_.sampled_count(); ++i) {
        const LightSample light = lights_.sample(i, x);
        if (light.irradiance.x == 0 && light.irradiance.y == 0 && light.irradiance.z == 0) continue;
        const HostRay shadow{x, light.direction};
        if (lights_.has_surfaces() && lights_.nearest_surface(shadow).t < light.distance) continue;
        if (medium_.fly(shadow, light.distance, random).primitive >= 0) continue;
        sum += light.irradiance * phase_value(phase, glm::dot(d, light.direction));
    }
    return sum;
}

void HostTracer::trace_row(HostImage& image, const HostCrop& crop, int row, std::uint32_t spp, std::uint64_t seed) const {
    std::uint64_t not_finite = 0;
    for (int column = 0; column < image.width; ++column) {
        const int x = crop.x0 + column, y = crop.y0 + row;
        const std::size_t pixel = static_cast<std::size_t>(row) * image.width + column;
        HostRandom random(seed, static_cast<std::uint64_t>(y) * film_.width + x);
        glm::dvec3 sum(0), squares(0);
        std::uint32_t opaque = 0;
        for (std::uint32_t s = 0; s < spp; ++s) {
            const double dx = random.uniform(), dy = random.uniform();
            const Sample sample = trace_path(camera_.ray(x + dx, y + dy), random);
            opaque += sample.opaque;
            const glm::dvec3 v = sample.radiance;
            if (!std::isfinite(v.x + v.y + v.z)) {
                ++not_finite;
                continue;
            }
            sum += v;
            squares += v * v;
        }
        const double n = spp;
        for (int k = 0; k < 3; ++k) {
            image.rgb[3 * pixel + k] = sum[k] / n;
            if (spp > 1)
                image.variance[3 * pixel + k] = std::max(0.0, squares[k] - sum[k] * sum[k] / n) / (n * (n - 1));
        }
        image.alpha[pixel] = opaque / n;
    }
    if (not_finite > 0) std::atomic_ref(image.not_finite) += not_finite;
}

HostImage HostTracer::trace(std::uint32_t spp, std::uint64_t seed, int threads, std::optional<HostCrop> crop) const {
    const HostCrop area = crop.value_or(HostCrop{0, 0, film_.width, film_.height});
    if (spp == 0 || area.x0 < 0 || area.y0 < 0 || area.x1 > film_.width || area.y1 > film_.height ||
        area.x0 >= area.x1 || area.y0 >= area.y1)
        throw std::invalid_argument("host tracer: no samples, or a crop that isn't inside the film");
    HostImage image;
    image.width = area.x1 - area.x0;
    image.height = area.y1 - area.y0;
    const std::size_t pixels = static_cast<std::size_t>(image.width) * image.height;
    image.rgb.resize(3 * pixels);
    image.variance.resize(3 * pixels);
    image.alpha.resize(pixels);
    image.paths = pixels * spp;
    image.build_seconds = build_seconds_;
    const double start = now();
    share_out(image.height, threads, [&](int row) { trace_row(image, area, row, spp, seed); });
    image.seconds = now() - start;
    return image;
}

FlightRate HostTracer::free_flights(std::uint64_t n, bool inside, std::uint64_t seed, int threads) const {
    constexpr std::uint64_t chunk = 4096;
    const int chunks = static_cast<int>((n + chunk - 1) / chunk);
    std::vector<double> lengths(static_cast<std::size_t>(chunks), 0);
    std::vector<std::uint64_t> collided(static_cast<std::size_t>(chunks), 0);
    const glm::dvec3 centre = 0.5 * (medium_.lower() + medium_.upper()), half = 0.5 * (medium_.upper() - medium_.lower());
    const double radius = std::min({half.x, half.y, half.z});
    const double start = now();
    share_out(chunks, threads, [&](int c) {
        HostRandom random(seed, static_cast<std::uint64_t>(c));
        double length = 0;
        std::uint64_t hits = 0;
        for (std::uint64_t i = c * chunk; i < std::min(n, (c + 1) * chunk); ++i) {
            HostRay ray;
            if (inside) {
                const double r = radius * std::cbrt(random.uniform());
                ray.origin = centre + sample_sphere(random) * r;
                ray.direction = sample_sphere(random);
            } else {
                const double x = film_.width * random.uniform();
                ray = camera_.ray(x, film_.height * random.uniform());
            }
            const HostCollision collision = medium_.fly(ray, infinity, random);
            if (collision.primitive < 0) continue;
            length += collision.t;
            ++hits;
        }
        lengths[static_cast<std::size_t>(c)] = length;
        collided[static_cast<std::size_t>(c)] = hits;
    });
    FlightRate rate;
    const double seconds = now() - start;
    double length = 0;
    for (double part : lengths) length += part;
    for (std::uint64_t part : collided) rate.collided += part;
    rate.flights = n;
    rate.flights_per_s = static_cast<double>(n) / seconds;
    rate.mean_flight = rate.collided > 0 ? length / static_cast<double>(rate.collided) : 0;
    return rate;
}

HostImage render_host(const Scene& scene, const HostOptions& options) {
    return HostTracer(scene, options.cells, options.max_depth)
        .trace(options.spp, options.seed, options.threads, options.crop);
}

FlightRate free_flights_host(const Scene& scene, std::uint64_t n, bool inside, int threads, int cells) {
    return HostTracer(scene, cells).free_flights(n, inside, 0, threads);
}

int best_cell_resolution(const Scene& scene, int threads) {
    int best = 0;
    double best_rate = -1;
    for (int cells : {48, 96}) {
        const HostTracer tracer(scene, cells);
        double seconds = 0, paths = 0;
        for (std::uint64_t round = 0; seconds < 0.25; ++round) {
            const HostImage image = tracer.trace(1, round, threads);
            seconds += image.seconds;
            paths += static_cast<double>(image.paths);
        }
        if (paths / seconds > best_rate) best = cells, best_rate = paths / seconds;
    }
    return best;
}

}  // namespace clume::reference
