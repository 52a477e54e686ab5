// SPDX-License-Identifier: MIT
// Transmittances of whole mixtures: fixed-point sums of optical depths. The exact sum is over the floats of every primitive
// that the device has; as with single depths, each line may be off by the intersection's limit.
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>

#include "src/device_mixture.h"
#include "src/device_scene.h"
#include "src/parallel.h"
#include "src/stress_families.h"
#include "src/stress_parts.h"

namespace clume {
namespace {

using oracle::Real;
using oracle::Vector;

struct SumFamily {
    const char* name;
    std::size_t primitives;
    bool coincident;
    double depth[2];  ///< of one primitive along its axis
};
constexpr SumFamily kFamilies[] = {{"4096 coincident", 4096, true, {1e-4, 1e-3}},
                                   {"4096 coincident below one unit of the sum", 4096, true, {1e-13, 1e-12}},
                                   {"200 of densities 1e-12 to 1e12", 200, false, {1e-12, 1e12}},
                                   {"200, thin", 200, false, {1e-9, 1e-3}},
                                   {"sums whose exp underflows", 64, true, {0.5, 4}}};

struct Sum {
    Real exact = 0, lo = 0, hi = 0, rounded = 0;
};

}  // namespace

void stress_sums(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress) {
    const Limit limit = stated_limit("transmittance.cl", "transmittance_analytic");
    const double shift = stated_limit("ellipsoid.cl", "intersect").value * 0x1p-23;
    const std::size_t count = options.quick ? 40 : 400;
    std::uint64_t seed = 7000;
    double done = 0;
    for (const SumFamily& f : kFamilies)
        for (const KernelFamily kernel : {KernelFamily::gaussian, KernelFamily::epanechnikov}) {
            StressRandom random(seed++);
            Scene scene;
            scene.camera.origin = {0, 0, 5};
            scene.render.strategy = "decomposition";
            scene.render.transmittance = "analytic";
            EllipsoidMedium& medium = scene.media.emplace_back();
            medium.kernel = kernel;
            medium.extent = usual_extent(kernel);
            Primitive same;
            for (std::size_t i = 0; i < f.primitives; ++i) {
                if (!f.coincident || i == 0) {
                    same.center = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
                    const double s = f.coincident ? 0.3 : random.spread(0.05, 0.3);
                    same.axes = glm::dmat3(glm::dvec3(s, 0, 0), glm::dvec3(0, 0.7 * s, 0), glm::dvec3(0.1 * s, 0, 0.5 * s));
                    same.sigma_t = random.spread(f.depth[0], f.depth[1]) / s;
                }
                medium.primitives.push_back(same);
            }
            RenderOptions render;
            render.accelerator = "bvh";
            const DeviceScene packed = make_device_scene(scene, render);
            std::vector<oracle::Ellipsoid256> floats, doubles;  // one per kind of primitive
            const std::size_t kinds = f.coincident ? 1 : packed.ellipsoids.size();
            for (std::size_t i = 0; i < kinds; ++i) {
                const Ellipsoid& e = packed.ellipsoids[i];
                float lane[CLUME_GROUP_ROWS];
                pack_lane(e, 0, lane, 1);
                oracle::Ellipsoid256 exact;
                exact.family = kernel;
                exact.e2 = static_cast<double>(packed.media[0].extent_squared);
                exact.mu = oracle::vector(lane);
                exact.sigma = static_cast<double>(lane[CLUME_ROW_SIGMA]);
                for (std::size_t k = 0; k < 6; ++k) exact.w[k] = static_cast<double>(lane[CLUME_ROW_W + k]);
                floats.push_back(exact);
                for (int k = 0; k < 3; ++k) exact.mu[static_cast<std::size_t>(k)] = e.center[k];
                for (std::size_t k = 0; k < 6; ++k) exact.w[k] = e.w[k];
                exact.sigma = e.sigma;
                exact.e2 = e.extent * e.extent;
                doubles.push_back(exact);
            }
            std::vector<ProbeRay> rays(count);
            for (ProbeRay& r : rays) {
                const glm::dvec3 to = packed.ellipsoids[static_cast<std::size_t>(random.below(static_cast<int>(kinds)))].center + 0.2 * glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
                const glm::dvec3 o = 2.0 * glm::normalize(glm::dvec3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1))), d = glm::normalize(to - o);
                for (int k = 0; k < 3; ++k) r.origin[k] = static_cast<float>(o[k]), r.direction[k] = static_cast<float>(d[k]);
                r.t_end = random.below(3) ? 1e30f : static_cast<float>(random.uniform(0.5, 3));
            }
            const std::vector<float> got = device.transmittances(packed, rays);
            std::vector<StressError> errors(count);
            parallel_chunks(count, 4, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    const Vector o = oracle::vector(rays[i].origin), d = oracle::vector(rays[i].direction);
                    const Real stop = static_cast<double>(rays[i].t_end), times = static_cast<double>(f.coincident ? f.primitives : 1);
                    Sum s;
                    for (std::size_t k = 0; k < kinds; ++k) {
                        const oracle::Line256 line(floats[k], o, d), scene_line(doubles[k], o, d);
                        if (line.hit()) s.exact += times * line.depth(0, stop);
                        if (scene_line.hit()) s.rounded += times * scene_line.depth(0, stop);
                        if (!line.hit() && line.tangency() > Real(2 * shift)) continue;
                        const oracle::Range range = line.depth_near(0, stop, shift);
                        s.lo += times * range.lo, s.hi += times * range.hi;
                    }
                    const Real exact = exp(-s.exact), least = exp(-s.hi), most = exp(-s.lo), value = static_cast<double>(got[i]);
                    StressError e = compare_to(static_cast<double>(got[i]), exact, LimitUnit::absolute);
                    if (!e.nonfinite) e.error = static_cast<double>(std::max(Real(0), std::max(Real(least - value), Real(value - most))));
                    e.rounding = static_cast<double>(abs(exact - exp(-s.rounded)));
                    e.at = fmt::format("o ({:.9g}, {:.9g}, {:.9g}), d ({:.9g}, {:.9g}, {:.9g}), t_end {:.9g}: {:.9g} of {:.9g}", rays[i].origin[0], rays[i].origin[1], rays[i].origin[2],
                                       rays[i].direction[0], rays[i].direction[1], rays[i].direction[2], rays[i].t_end, got[i], static_cast<double>(exact));
                    errors[i] = e;
                }
            });
            result.rows.push_back(stress_row("transmittance", "transmittance_analytic", std::string(f.name) + (kernel == KernelFamily::gaussian ? ", gaussian" : ", epanechnikov"), limit, errors, options));
            progress((done += 1) / (2 * std::size(kFamilies)));
        }
}

}  // namespace clume
