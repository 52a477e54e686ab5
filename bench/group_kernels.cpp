// SPDX-License-Identifier: MIT
// One ray against vectors of primitives held in the cache: whitened and direct quadratic intersection and the one behind an
// icosphere, and density, optical depth and its inverse of each kernel family. Depths and inverses include the whitened
// intersection. An item is one ray against one primitive.
#include <cmath>
#include <map>
#include <random>
#include <tuple>

#include "bench/kernels.h"
#include "bench/operations.h"
#include "bench/proxy.h"
#include "bench/rays.h"
#include "tests/cases.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {
namespace {

constexpr std::size_t kGroups = 32;  // 22 kB: in the first-level cache
constexpr std::size_t kRays = 4096;

struct Data {
    std::vector<float> groups, quadratic;
    std::vector<ProbeGroupRay> rays;
    float e2 = 0;
};

/// Ellipsoids of half the unit ball's size about the rays, so that about half of the lanes are hit.
/// `copies` times kRays rays through ellipsoids of the family.
Data make_data(KernelFamily family, std::size_t copies) {
    Scene scene = reference::random_mixture(family, static_cast<int>(kGroups * CLUME_GROUP_SIZE), 3, 60, 2);
    scene.render.strategy = "decomposition";
    RenderOptions options;
    options.accelerator = "bvh";
    const DeviceScene device = make_device_scene(scene, options);
    Data data;
    data.e2 = static_cast<float>(scene.media[0].extent * scene.media[0].extent);
    data.groups.resize(kGroups * CLUME_GROUP_FLOATS);
    data.quadratic.resize(data.groups.size());
    for (std::size_t i = 0; i < device.ellipsoids.size(); ++i) {
        const Ellipsoid& e = device.ellipsoids[i];
        const auto put = [&](std::vector<float>& to, std::size_t row, double v) {
            to[i / CLUME_GROUP_SIZE * CLUME_GROUP_FLOATS + row * CLUME_GROUP_SIZE + i % CLUME_GROUP_SIZE] = static_cast<float>(v);
        };
        const double *w = e.w, s[] = {w[0] * w[0], w[0] * w[1], w[0] * w[2], w[1] * w[1] + w[3] * w[3], w[1] * w[2] + w[3] * w[4], w[2] * w[2] + w[4] * w[4] + w[5] * w[5]};
        for (auto* to : {&data.groups, &data.quadratic}) {
            for (int k = 0; k < 3; ++k) put(*to, CLUME_ROW_MU + static_cast<std::size_t>(k), e.center[k]);
            put(*to, CLUME_ROW_SIGMA, e.sigma);
        }
        for (std::size_t k = 0; k < 6; ++k) {
            put(data.groups, CLUME_ROW_W + k, w[k]);
            put(data.quadratic, CLUME_ROW_W + k, s[k]);  // Σ⁻¹ = Wᵀ W
        }
    }
    std::mt19937_64 engine(5);
    std::uniform_real_distribution<float> u(0, 1);
    for (const ProbeRay& r : inside_rays(device, copies * kRays, 4)) {
        ProbeGroupRay g;
        for (int k = 0; k < 3; ++k) {
            g.origin[k] = r.origin[k];
            g.direction[k] = r.direction[k];
        }
        g.t1 = u(engine);
        g.tau = -std::log(1 - u(engine));
        data.rays.push_back(g);
    }
    return data;
}

}  // namespace

void add_group_benchmarks(Session& session) {
    struct Work {
        GroupWork what;
        const char* item;   ///< before the family's name, if it depends on one
        bool by_family;
        double bytes;       ///< of a primitive that are read
    };
    static constexpr Work works[] = {{GroupWork::intersect, "intersect/whitened", false, 40},
                                     {GroupWork::intersect_quadratic, "intersect/quadratic", false, 40},
                                     {GroupWork::density, "density/", true, 40},
                                     {GroupWork::depth, "depth/", true, 40},
                                     {GroupWork::flight, "inverse/", true, 40}};
    static std::map<device::uint, Data> data;
    static std::map<int, Probe> probes;
    for (const Work& work : works)
        for (const cases::FamilyCase& family : cases::families) {
            if (!work.by_family && family.bit != FAMILY_GAUSSIAN) continue;
            for (const int width : kernel_widths(session)) {
                const std::string name = work.by_family ? std::string(work.item) + family.name : work.item;
                add_kernel_benchmark(session, with_width(name, width), [=, &session](std::uint32_t) {
                    auto d = data.find(family.bit);
                    if (d == data.end()) d = data.emplace(family.bit, make_data(family.kernel, copies_to_fill(session))).first;
                    auto p = probes.find(width);
                    if (p == probes.end()) p = probes.try_emplace(width, session.device(), width).first;
                    const auto& groups = work.what == GroupWork::intersect_quadratic ? d->second.quadratic : d->second.groups;
                    const auto run = p->second.group_work(work.what, d->second.rays, groups, family.bit, d->second.e2);
                    const bool chord = work.what != GroupWork::density;
                    const Operations own = work.by_family ? operations(name) : Operations{};
                    const Operations intersection = chord ? operations(work.what == GroupWork::intersect_quadratic ? "intersect_quadratic" : "intersect_whitened") : Operations{};
                    return Launch{static_cast<double>(d->second.rays.size() * kGroups * CLUME_GROUP_SIZE), run.device_s, {own + intersection, work.bytes, 0, static_cast<double>(groups.size() * sizeof(float))}};
                });
            }
        }
    for (const auto& [what, block, name] : {std::tuple{ProxyWork::mesh, "proxy_mesh", "intersect/icosphere_mesh"}, {ProxyWork::instanced, "proxy_instance", "intersect/icosphere_shared"}})
        for (const int width : kernel_widths(session))
            add_kernel_benchmark(session, with_width(name, width), [=, &session, what = what, block = block](std::uint32_t) {
                // Half of the lines meet an ellipsoid: at least so many of the analytic tests follow.
                static auto& lines = *new std::map<int, ProxyLines>;  // never destroyed: the implementation may be gone by then
                ProxyLines& l = lines.try_emplace(width, session.device(), width, 60, copies_to_fill(session)).first->second;
                const double s = l.launch(what);
                return Launch{l.tests(), s, {operations(block) + operations("intersect_whitened") * 0.5, what == ProxyWork::mesh ? 36.0 * 4 : 40, 0, l.byte_size(what)}};
            });
}

}  // namespace clume::bench
