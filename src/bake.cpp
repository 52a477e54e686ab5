// SPDX-License-Identifier: MIT
// Primitives are splatted: each adds its density to the samples of its support, slab of z by slab, so that cost follows the
// supports' volumes. A slab's primitives are added in file order, so sums come out the same for any number of threads.
#include "src/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "src/error.h"
#include "src/input_file.h"
#include "src/json_reader.h"
#include "src/parallel.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

/// z = inverse · (x − centre), r = |z|, density = sigma K(r²) inside r < extent.
struct Splat {
    glm::dvec3 center, half;
    glm::dmat3 inverse;
    double sigma, extent;
    KernelFamily kernel;
};

std::vector<Splat> make_splats(const Scene& scene) {
    std::vector<Splat> out;
    for (const EllipsoidMedium& medium : scene.media) {
        if (medium.density_scale == 0) continue;
        for (const Primitive& p : medium.primitives) {
            const glm::dmat3& a = p.axes;
            const glm::dvec3 reach = glm::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
            out.push_back({p.center, medium.extent * reach, glm::inverse(a), medium.density_scale * p.sigma_t, medium.extent,
                           medium.kernel});
        }
    }
    return out;
}

double density_at(const Splat& s, const glm::dvec3& z) {
    const double r2 = glm::dot(z, z), extent2 = s.extent * s.extent;
    if (!(r2 < extent2)) return 0;
    switch (s.kernel) {
        case KernelFamily::gaussian:
            return s.sigma * std::exp(-0.5 * r2);
        case KernelFamily::epanechnikov:
            return s.sigma * (1 - r2 / extent2);
        case KernelFamily::uniform:
            return s.sigma;
    }
    return 0;
}

/// Samples lo ≤ i < hi whose positions origin + i voxel may lie in [from, to]; one more on either side, for rounding.
std::pair<int, int> samples_between(double from, double to, double origin, double voxel, int count) {
    const double lo = std::floor((from - origin) / voxel), hi = std::ceil((to - origin) / voxel) + 1;
    return {static_cast<int>(std::clamp(lo, 0.0, static_cast<double>(count))),
            static_cast<int>(std::clamp(hi, 0.0, static_cast<double>(count)))};
}

/// Adds the primitive to the samples z0 ≤ z < z1 of a lattice with nx · ny samples per layer.
void splat(const Splat& s, const VoxelGrid& grid, int z0, int z1, std::vector<double>& sums) {
    const glm::dvec3 voxel(grid.axes[0].x, grid.axes[1].y, grid.axes[2].z), lo = s.center - s.half, hi = s.center + s.half;
    const auto zs = samples_between(lo.z, hi.z, grid.origin.z, voxel.z, grid.hi.z);
    const auto ys = samples_between(lo.y, hi.y, grid.origin.y, voxel.y, grid.hi.y);
    const glm::dvec3 along = s.inverse[0];
    const double along2 = glm::dot(along, along);
    for (int z = std::max(zs.first, z0); z < std::min(zs.second, z1); ++z)
        for (int y = ys.first; y < ys.second; ++y) {
            const glm::dvec3 across = s.inverse[1] * (grid.origin.y + y * voxel.y - s.center.y) +
                                      s.inverse[2] * (grid.origin.z + z * voxel.z - s.center.z);
            // |along t + across| < extent between the roots of a quadratic; where it isn't met nothing is added.
            const double middle = -glm::dot(along, across) / along2;
            const glm::dvec3 nearest = across + along * middle;
            const double inside = s.extent * s.extent - glm::dot(nearest, nearest);
            if (inside < -1e-6 * s.extent * s.extent) continue;
            const double reach = std::sqrt(std::max(inside, 0.0) / along2);
            const auto xs =
                samples_between(s.center.x + middle - reach, s.center.x + middle + reach, grid.origin.x, voxel.x, grid.hi.x);
            double* row = sums.data() + (static_cast<std::size_t>(z - z0) * static_cast<std::size_t>(grid.hi.y) +
                                         static_cast<std::size_t>(y)) *
                                            static_cast<std::size_t>(grid.hi.x);
            for (int x = xs.first; x < xs.second; ++x)
                row[x] += density_at(s, across + along * (grid.origin.x + x * voxel.x - s.center.x));
        }
}

/// The nearest number that a float can hold. Through memory, because GCC 12 leaves such pairs of conversions out where it makes
/// vectors of them.
double rounded_to_float(double value) {
    volatile float rounded = static_cast<float>(value);
    return static_cast<double>(rounded);
}

/// The lattice, without samples.
VoxelGrid place(const Scene& scene, const std::vector<Splat>& splats, int resolution) {
    glm::dvec3 lo(INFINITY), hi(-INFINITY);
    for (const Splat& s : splats) {
        lo = glm::min(lo, s.center - s.half);
        hi = glm::max(hi, s.center + s.half);
    }
    const glm::dvec3 size = hi - lo;
    if (!std::isfinite(glm::dot(size, size)))
        throw SceneError(fmt::format("{}: the mixture's bounds are not finite", scene.path));
    const double voxel = std::max({size.x, size.y, size.z}) / resolution;
    VoxelGrid grid;
    glm::dvec3 min, max;
    for (int i = 0; i < 3; ++i) {
        // A hair less than the next whole number is rounding.
        grid.hi[i] = std::clamp(static_cast<int>(std::ceil(size[i] / voxel - 1e-9)), 1, resolution);
        const double middle = 0.5 * (lo[i] + hi[i]), half = 0.5 * voxel * grid.hi[i];
        min[i] = rounded_to_float(middle - half);
        max[i] = rounded_to_float(middle + half);
    }
    place_in_box(grid, min, max);
    if (!is_placed(grid) || !glm::all(glm::lessThan(min, max)))
        throw SceneError(
            fmt::format("{}: the mixture is too small for where it is: its bounds are one in single precision", scene.path));
    return grid;
}

}  // namespace

std::optional<VoxelGrid> bake(const Scene& scene, int resolution, const std::function<void(double)>& progress,
                              const std::atomic<bool>& stop) {
    const std::vector<Splat> splats = make_splats(scene);
    if (splats.empty()) throw SceneError(fmt::format("{}: there are no ellipsoids to bake", scene.path));
    const VoxelGrid lattice = place(scene, splats, resolution);
    const glm::ivec3 size = lattice.hi;
    const auto nx = static_cast<std::size_t>(size.x), layer = nx * static_cast<std::size_t>(size.y);
    const std::size_t count = layer * static_cast<std::size_t>(size.z);
    // The samples, their bricks, and the file's bytes with what its writer needs.
    const double needed = 4.0 * sizeof(float) * static_cast<double>(count), held = static_cast<double>(physical_memory_bytes());
    if (needed > held / 2)
        throw RenderError(fmt::format("a grid of {} x {} x {} needs {:.1f} GB, and half of this machine's memory is {:.1f}",
                                      size.x, size.y, size.z, needed * 1e-9, held * 0.5e-9));

    constexpr std::size_t most_slab_bytes = std::size_t{64} << 20;
    const int depth = static_cast<int>(std::clamp<std::size_t>(most_slab_bytes / (layer * sizeof(double)), 1, 8));
    const auto slabs = static_cast<std::size_t>((size.z + depth - 1) / depth);
    std::vector<std::vector<std::uint32_t>> members(slabs);
    for (std::size_t i = 0; i < splats.size(); ++i) {
        const Splat& s = splats[i];
        const auto zs =
            samples_between(s.center.z - s.half.z, s.center.z + s.half.z, lattice.origin.z, lattice.axes[2].z, size.z);
        for (int slab = zs.first / depth; slab * depth < zs.second; ++slab)
            members[static_cast<std::size_t>(slab)].push_back(static_cast<std::uint32_t>(i));
    }

    std::vector<float> values(count);
    std::mutex mutex;
    std::size_t done = 0;
    parallel_chunks(slabs, 1, [&](std::size_t slab, std::size_t) {
        const int z0 = static_cast<int>(slab) * depth, z1 = std::min(z0 + depth, size.z);
        std::vector<double> sums(layer * static_cast<std::size_t>(z1 - z0));
        for (const std::uint32_t i : members[slab]) {
            if (stop) return;
            splat(splats[i], lattice, z0, z1, sums);
        }
        std::transform(sums.begin(), sums.end(),
                       values.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(z0) * layer),
                       [](double sum) { return static_cast<float>(sum); });
        const std::lock_guard lock(mutex);
        progress(static_cast<double>(++done) / static_cast<double>(slabs));
    });
    if (stop) return std::nullopt;
    VoxelGrid grid = make_dense_grid(scene.path, size, [&](int y, int z, float* row) {
        const float* from = values.data() + static_cast<std::size_t>(z) * layer + static_cast<std::size_t>(y) * nx;
        std::copy(from, from + nx, row);
    });
    grid.axes = lattice.axes;
    grid.origin = lattice.origin;
    return grid;
}

BakedMedium describe_baked(const Scene& scene, const std::string& file) {
    BakedMedium out;
    const auto colour = [](const glm::dvec3& v) {
        return v.x == v.y && v.y == v.z ? fmt::format("{}", v.x) : fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
    };
    const Primitive* first = nullptr;
    const EllipsoidMedium* first_medium = nullptr;
    glm::dvec3 albedo_sum(0);  // by the product of peak and volume, which is mass for primitives of one kernel
    double weight_sum = 0;
    bool one_albedo = true, one_emission = true, one_phase = true;
    for (const EllipsoidMedium& medium : scene.media)
        for (const Primitive& p : medium.primitives) {
            if (first == nullptr) first = &p, first_medium = &medium;
            const double weight = medium.density_scale * p.sigma_t * std::abs(glm::determinant(p.axes));
            albedo_sum += weight * p.albedo;
            weight_sum += weight;
            one_albedo = one_albedo && p.albedo == first->albedo;
            one_emission = one_emission && p.emission == first->emission;
            one_phase = one_phase && medium.phase.kind == first_medium->phase.kind && medium.phase.g == first_medium->phase.g &&
                        p.has_g == first->has_g && p.g == first->g;
        }
    out.json = fmt::format(R"({{"type": "grid", "file": {})", json_string(file));
    if (first != nullptr && one_albedo) out.json += fmt::format(R"(, "albedo": {})", colour(first->albedo));
    if (!one_albedo && weight_sum > 0)
        out.json += fmt::format(R"(, "albedo": {})", colour(glm::round(1e4 * albedo_sum / weight_sum) / 1e4));
    if (first != nullptr && one_emission && first->emission != glm::dvec3(0))
        out.json += fmt::format(R"(, "emission": {})", colour(first->emission));
    if (first != nullptr && one_phase) {
        const double g = first->has_g ? static_cast<double>(first->g) : first_medium->phase.g;
        if (first->has_g || first_medium->phase.kind == PhaseKind::henyey_greenstein)
            out.json += fmt::format(R"(, "phase": {{"type": "henyey-greenstein", "g": {}}})", g);
        else if (first_medium->phase.kind == PhaseKind::rayleigh)
            out.json += R"(, "phase": {"type": "rayleigh"})";
    }
    out.json += "}";
    if (!one_albedo) out.losses.push_back("the primitives' own albedos are lost; their mean by mass stands in");
    if (!one_emission) out.losses.push_back("the primitives' own emissions are lost");
    if (!one_phase) out.losses.push_back("the primitives' own phase functions are lost");
    if (!scene.grids.empty()) out.losses.push_back("the scene's voxel media are not in it");
    return out;
}

}  // namespace clume
