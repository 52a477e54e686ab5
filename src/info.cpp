// SPDX-License-Identifier: MIT
#include "src/info.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "src/bvh.h"
#include "src/device_scene.h"
#include "src/error.h"
#include "src/json_reader.h"
#include "src/printable.h"
#include "src/renderer.h"
#include "src/voxel_file.h"
#include "src/voxel_info.h"

namespace clume {
namespace {

const char* name_of(KernelFamily k) {
    return k == KernelFamily::gaussian ? "gaussian" : k == KernelFamily::epanechnikov ? "epanechnikov" : "uniform";
}

std::string triple(const glm::dvec3& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z); }

double kernel_at(const Ellipsoid& e, double r2) {
    if (r2 >= e.extent * e.extent) return 0;
    return e.family == KernelFamily::gaussian ? std::exp(-0.5 * r2) : e.family == KernelFamily::epanechnikov ? 1 - r2 / (e.extent * e.extent) : 1;
}

double whitened2(const Ellipsoid& e, const glm::dvec3& p) {
    const glm::dvec3 x = p - e.center;
    const double a = e.w[0] * x.x + e.w[1] * x.y + e.w[2] * x.z, b = e.w[3] * x.y + e.w[4] * x.z, c = e.w[5] * x.z;
    return a * a + b * b + c * c;
}

/// How many supports hold p.
std::size_t overlap_at(std::span<const Ellipsoid> ellipsoids, const BvhTree& tree, const glm::dvec3& p) {
    std::size_t n = 0;
    tree.overlapping(ellipsoids, Box{p, p}, [&](std::uint32_t i) { n += whitened2(ellipsoids[i], p) < ellipsoids[i].extent * ellipsoids[i].extent; });
    return n;
}

/// ∫ σ_t along the line through the middle of the bounds, by composite Simpson on 20,000 steps.
double depth_through_middle(std::span<const Ellipsoid> ellipsoids, const Box& bounds, int axis) {
    const glm::dvec3 middle = 0.5 * (bounds.lo + bounds.hi);
    constexpr int steps = 20000;
    double depth = 0;
    glm::dvec3 d(0);
    d[axis] = 1;
    for (const auto& e : ellipsoids) {
        // Only along this primitive's own box.
        glm::dvec3 p = middle;
        const double lo = e.center[axis] - e.half[axis], hi = e.center[axis] + e.half[axis];
        bool near = true;
        for (int k = 0; k < 3; ++k) near = near && (k == axis || std::abs(middle[k] - e.center[k]) <= e.half[k]);
        if (!near) continue;
        const int n = std::max(200, steps / static_cast<int>(std::min<std::size_t>(ellipsoids.size(), 100)));
        const double h = (hi - lo) / n;
        for (int i = 0; i < n; ++i) {
            p[axis] = lo + (i + 0.5) * h;
            depth += h * e.sigma * kernel_at(e, whitened2(e, p));
        }
    }
    return depth;
}

}  // namespace

void print_info(const std::filesystem::path& file, std::span<const Override> overrides) {
    if (is_voxel_file(file)) {
        if (!overrides.empty()) throw UsageError("-D " + overrides[0].key + ": a voxel file has no keys of a scene");
        print_voxel_info(file);
        return;
    }
    Scene scene;
    if (file.extension() == ".ply") {
        const std::string text = fmt::format(
            R"({{"camera": {{"origin": [0, 0, -4], "target": [0, 0, 0]}}, "lights": [{{"type": "constant", "radiance": 1}}], "media": [{{"type": "ellipsoids", "kernel": "gaussian", "file": {}}}]}})",
            json_string(std::filesystem::absolute(file).string()));
        scene = parse_scene(text, file, overrides);
    } else {
        scene = read_scene(file, overrides);
    }
    fmt::print("{}\n", file.string());
    fmt::print("  film            {} x {}, {} spp, seed {}\n", scene.film.width, scene.film.height, scene.render.spp, scene.render.seed);
    for (std::size_t m = 0; m < scene.media.size(); ++m) {
        const auto& medium = scene.media[m];
        fmt::print("  medium {}        {}: {}, extent {:g}, density_scale {:g}\n", m, printable(medium.source), name_of(medium.kernel), medium.extent, medium.density_scale);
        fmt::print("    primitives    {} ({} dropped: no density)\n", medium.primitives.size(), medium.dropped);
        if (medium.primitives.empty()) continue;
        glm::dvec3 lo(1e300), hi(-1e300);
        double least = 1e300, most = 0;
        for (const auto& p : medium.primitives) {
            const glm::dvec3 half = medium.extent * glm::sqrt(p.axes[0] * p.axes[0] + p.axes[1] * p.axes[1] + p.axes[2] * p.axes[2]);
            lo = glm::min(lo, p.center - half);
            hi = glm::max(hi, p.center + half);
            least = std::min(least, p.sigma_t * medium.density_scale);
            most = std::max(most, p.sigma_t * medium.density_scale);
        }
        fmt::print("    bounds        {} to {}\n", triple(lo), triple(hi));
        fmt::print("    extinction    peaks of {:.4g} to {:.4g} per world unit\n", least, most);
    }
    for (std::size_t g = 0; g < scene.grids.size(); ++g) print_grid_medium(scene.media.size() + g, scene.grids[g]);
    const DeviceScene device = make_device_scene(scene, {});
    const auto& ellipsoids = device.ellipsoids;
    if (!ellipsoids.empty()) {
        const BvhTree tree = build_bvh(ellipsoids);
        // Centres are where overlap is greatest, or nearly; the mean is over points drawn from the primitives' volumes.
        std::size_t most = 0;
        double sum = 0;
        const std::size_t stride = std::max<std::size_t>(1, ellipsoids.size() / 20000);
        std::size_t samples = 0;
        for (std::size_t i = 0; i < ellipsoids.size(); i += stride, ++samples) {
            const std::size_t n = overlap_at(ellipsoids, tree, ellipsoids[i].center);
            most = std::max(most, n);
            sum += static_cast<double>(n);
        }
        fmt::print("  overlap         mean {:.1f}, at most {} supports at one point (over {} primitives' centres)\n", sum / static_cast<double>(samples), most, samples);
        Box bounds = {glm::dvec3(1e300), glm::dvec3(-1e300)};
        for (const auto& e : ellipsoids) bounds.lo = glm::min(bounds.lo, e.center - e.half), bounds.hi = glm::max(bounds.hi, e.center + e.half);
        fmt::print("  optical depth   through the middle along x {:.4g}, y {:.4g}, z {:.4g}\n", depth_through_middle(ellipsoids, bounds, 0),
                   depth_through_middle(ellipsoids, bounds, 1), depth_through_middle(ellipsoids, bounds, 2));
    }
    fmt::print("  accelerator     ");
    for (const auto& [feature, what] : device.explain)
        if (feature == "accelerator") fmt::print("{}, built in {:.3f} s\n", what, device.accelerator_s);
    fmt::print("  on the device   {} bytes\n", device.byte_size());
}

}  // namespace clume
