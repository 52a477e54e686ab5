// SPDX-License-Identifier: MIT
// The generated scenes of the study (bench/study_scenes.h) have the overlap, the anisotropy and the depth that they claim.
#include "bench/study_scenes.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tests/reference/host_phase.h"
#include "tests/reference/host_random.h"

using namespace clume;
using bench::BallSpec;

namespace {

double kernel(const EllipsoidMedium& medium, double r2) {
    if (r2 >= medium.extent * medium.extent) return 0;
    if (medium.kernel == KernelFamily::gaussian) return std::exp(-r2 / 2);
    return medium.kernel == KernelFamily::uniform ? 1 : 1 - r2 / (medium.extent * medium.extent);
}

struct PointMeans {
    double supports = 0, extinction = 0;
};

/// Means over points uniform in the ball of radius 0.5.
PointMeans measure(const Scene& scene, int points) {
    const EllipsoidMedium& medium = scene.media[0];
    std::vector<glm::dmat3> whiten;
    for (const Primitive& p : medium.primitives) whiten.push_back(glm::inverse(p.axes));
    reference::HostRandom random(5, 3);
    PointMeans means;
    for (int i = 0; i < points; ++i) {
        const double radius = 0.5 * std::cbrt(random.uniform());
        const glm::dvec3 x = reference::sample_sphere(random) * radius;
        for (std::size_t k = 0; k < whiten.size(); ++k) {
            const glm::dvec3 z = whiten[k] * (x - medium.primitives[k].center);
            const double r2 = glm::dot(z, z);
            means.supports += (r2 < medium.extent * medium.extent) / static_cast<double>(points);
            means.extinction += medium.density_scale * medium.primitives[k].sigma_t * kernel(medium, r2) / points;
        }
    }
    return means;
}

}  // namespace

TEST_CASE("StudyScenes.OverlapAndDepth", "[quick]") {
    BallSpec spec;
    spec.n = 4000;
    spec.depth = 7;
    spec.overlap = GENERATE(1., 8., 64.);
    spec.family = GENERATE(KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform);
    const PointMeans means = measure(bench::study_ball(spec), 1000);
    CHECK(means.supports == Approx(spec.overlap).epsilon(0.08));
    CHECK(2 * means.extinction == Approx(spec.depth).epsilon(0.1));
}

TEST_CASE("StudyScenes.Anisotropy", "[quick]") {
    BallSpec spec;
    spec.n = 4000;
    spec.overlap = 2;
    spec.needles = GENERATE(false, true);
    spec.anisotropy = GENERATE(1., 10., 100.);
    if (spec.needles && spec.anisotropy > 10) return;  // longer than the ball: they reach out of it
    const Scene scene = bench::study_ball(spec);
    for (const std::size_t i : {0u, 1234u, 3999u}) {
        const glm::dmat3& a = scene.media[0].primitives[i].axes;
        std::vector<double> length{glm::length(a[0]), glm::length(a[1]), glm::length(a[2])};
        std::sort(length.begin(), length.end());
        CHECK(length[2] / length[0] == Approx(spec.anisotropy));
        CHECK(length[1] == Approx(spec.needles ? length[0] : length[2]));
        CHECK(std::cbrt(length[0] * length[1] * length[2]) * scene.media[0].extent == Approx(bench::support_radius(spec)));
    }
    CHECK(measure(scene, 1000).supports == Approx(spec.overlap).epsilon(0.1));
}
