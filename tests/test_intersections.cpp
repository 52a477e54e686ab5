// SPDX-License-Identifier: MIT
// The two intersection routines beside each other: whitening to the unit sphere, and the direct quadratic in Σ⁻¹. Both get
// the ellipsoid rounded to float, once as W and once as Σ⁻¹; the truth is the ellipsoid itself. Errors of a chord's ends are
// in whitened units, i.e. in scales of the ellipsoid along the ray.
#include <array>
#include <cmath>
#include <fmt/format.h>

#include "tests/flight_reference.h"

namespace {

using namespace clume;
using namespace clume::probing;

struct Tally {
    std::size_t count = 0, wrong_hits = 0;
    double sum2 = 0, worst = 0;
    double rms() const { return std::sqrt(sum2 / static_cast<double>(std::max<std::size_t>(count, 1))); }
};

constexpr std::size_t kRays = 1000;

/// Errors of both routines over random ellipsoids of one axis ratio, placed about the origin, and rays through them.
std::array<Tally, 2> tally(double ratio, std::uint64_t seed) {
    TestRandom random(seed);
    constexpr double e = 3;
    Scene scene = empty_scene();
    EllipsoidMedium m;
    std::vector<ProbeGroupRay> rays;
    for (std::size_t i = 0; i < kRays; ++i) {
        const glm::dvec3 center(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const double s = random.spread(0.02, 0.5);
        const glm::dvec3 scale = i % 3 == 0 ? glm::dvec3(s, s / ratio, s / ratio) : i % 3 == 1 ? glm::dvec3(s, s, s / ratio) : glm::dvec3(s, s / std::sqrt(ratio), s / ratio);
        m.primitives.push_back(reference::make_primitive(center, scale, 1, {random.uniform(), random.uniform(), random.uniform()}));
        // Through a point of the support, from 2 units away.
        glm::dvec3 z(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        z *= random.uniform(0, e) / glm::length(z);
        const glm::dvec3 target = center + m.primitives.back().axes * z, d = glm::normalize(glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
        ProbeGroupRay r;
        for (int k = 0; k < 3; ++k) r.origin[k] = static_cast<float>(target[k] - 2 * d[k]), r.direction[k] = static_cast<float>(d[k]);
        rays.push_back(r);
    }
    scene.media.push_back(m);
    const auto ellipsoids = make_ellipsoids(scene, Normalization{});
    std::array<Tally, 2> result;
    for (const bool quadratic : {false, true}) {
        std::vector<float> groups(kRays * CLUME_GROUP_FLOATS, 1.0f);
        HostArray<Ellipsoid> truth = ellipsoids;
        for (std::size_t i = 0; i < kRays; ++i) {
            float* row = groups.data() + i * CLUME_GROUP_FLOATS;
            const double* w = ellipsoids[i].w;
            const double inverse[6] = {w[0] * w[0], w[0] * w[1], w[0] * w[2], w[1] * w[1] + w[3] * w[3], w[1] * w[2] + w[3] * w[4], w[2] * w[2] + w[4] * w[4] + w[5] * w[5]};
            for (int k = 0; k < 3; ++k) {
                row[16 * k] = static_cast<float>(ellipsoids[i].center[k]);
                const volatile float rounded = row[16 * k];
                truth[i].center[k] = static_cast<double>(rounded);  // the centre's own rounding is common to both
            }
            for (int k = 0; k < 6; ++k) row[16 * (CLUME_ROW_W + k)] = static_cast<float>(quadratic ? inverse[k] : w[k]);
        }
        const auto got = bare_probe(16).groups(rays, groups, FAMILY_GAUSSIAN, static_cast<float>(e * e), quadratic);
        Tally& t = result[quadratic];
        for (std::size_t i = 0; i < kRays; ++i) {
            ProbeRay r;
            for (int k = 0; k < 3; ++k) r.origin[k] = rays[i].origin[k], r.direction[k] = rays[i].direction[k];
            const LinePrimitive line(truth[i], r);
            const bool hit = got[i].t_in[0] < 1e30f;
            if (hit != (line.h > 0)) ++t.wrong_hits;
            // Grazing chords have a square root's sensitivity: left to the tolerance test of the kernels.
            if (!hit || line.h < 0.3) continue;
            for (const double error : {static_cast<double>(got[i].t_in[0]) - line.t_perp + line.h / line.w, static_cast<double>(got[i].t_out[0]) - line.t_perp - line.h / line.w}) {
                const double whitened = std::isfinite(error) ? std::abs(error) * line.w : 1e9;
                ++t.count;
                t.sum2 += whitened * whitened;
                t.worst = std::max(t.worst, whitened);
            }
        }
    }
    return result;
}

}  // namespace

TEST_CASE("Intersections.WhiteningIsTheAccurateOne", "[kernels][quick]") {
    for (const double ratio : {1.0, 10.0, 100.0, 1e3, 1e4}) {
        const auto [whitening, quadratic] = tally(ratio, 31);
        const std::string text = fmt::format("axis ratio {:g}: whitening rms {:.2g} worst {:.2g} wrong hits {}; quadratic rms {:.2g} worst {:.2g} wrong hits {}, of {}", ratio, whitening.rms(),
                                             whitening.worst, whitening.wrong_hits, quadratic.rms(), quadratic.worst, quadratic.wrong_hits, kRays);
        report(text);
        INFO(text);
        CHECK(whitening.count > kRays);
        // Float knows W to 2^-24 of its norm, 50 … 5e5 here, over two units: that times the ratio is what can be had.
        CHECK(whitening.rms() < 2e-5 * ratio);
        CHECK(whitening.rms() <= 1.5 * quadratic.rms());
        if (ratio <= 10) CHECK(quadratic.rms() < 2e-5 * ratio * ratio);
    }
}
