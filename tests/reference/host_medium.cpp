// SPDX-License-Identifier: MIT
// Packing of primitives, the cells with their lists and bounds, and delta tracking through them. A tentative collision is
// real if a uniform fraction of the bound falls below the running sum of extinctions; the primitive at which it does is
// the one collided with, distributed as sigma_i K_i, and the rest of the list need not be looked at.
#include "tests/reference/host_medium.h"

#include "tests/reference/host_cells.h"

#include <limits>

namespace clume::reference {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Upper-triangular W with Wᵀ W = (axes axesᵀ)⁻¹: the R of a QR decomposition of axes⁻¹.
void whitening(const glm::dmat3& axes, double (&w)[6]) {
    const glm::dmat3 inverse = glm::inverse(axes);
    const glm::dvec3 a = inverse[0], b = inverse[1], c = inverse[2];
    w[0] = std::sqrt(glm::dot(a, a));
    const glm::dvec3 q0 = a / w[0];
    w[1] = glm::dot(q0, b);
    w[2] = glm::dot(q0, c);
    const glm::dvec3 b1 = b - q0 * w[1];
    w[3] = std::sqrt(glm::dot(b1, b1));
    const glm::dvec3 q1 = b1 / w[3], c1 = c - q0 * w[2];
    w[4] = glm::dot(q1, c1);
    const glm::dvec3 c2 = c1 - q1 * w[4];
    w[5] = std::sqrt(glm::dot(c2, c2));
}

/// Half size of the axis-aligned box around a primitive's support.
glm::dvec3 half_size(const glm::dmat3& axes, double extent) {
    glm::dvec3 half;
    for (int k = 0; k < 3; ++k)
        half[k] = extent * std::sqrt(axes[0][k] * axes[0][k] + axes[1][k] * axes[1][k] + axes[2][k] * axes[2][k]);
    return half;
}

/// Row k of axes = (WᵀW)^(-1/2) up to a rotation, so the support's half size along axis k from W alone.
glm::dvec3 half_size(const HostPrimitive& p) {
    const double a = 1 / p.w[0], b = 1 / p.w[3], c = 1 / p.w[5];  // W⁻¹, upper triangular too
    const double ab = -p.w[1] * a * b, bc = -p.w[4] * b * c, ac = (p.w[1] * p.w[4] * b - p.w[2]) * a * c;
    return half_size(glm::dmat3(a, 0, 0, ab, b, 0, ac, bc, c), std::sqrt(p.extent_squared));
}

struct Entry {
    std::uint32_t cell, primitive;
    float bound;
};

}  // namespace

HostMedium::HostMedium(const Scene& scene, int cells) {
    pack(scene);
    if (!primitives_.empty()) fill_cells(std::max(1, cells));
    for (const GridMedium& m : scene.grids) {
        grids_.emplace_back(m.density, m.interpolation, m.density_scale);
        if (m.emission_grid) glows_.emplace_back(HostGrid(*m.emission_grid, m.interpolation, 1), m.emission);
        materials_.push_back({m.albedo, m.emission_grid ? glm::dvec3(0) : (1.0 - m.albedo) * m.emission, m.phase});
    }
}

void HostMedium::pack(const Scene& scene) {
    lower_ = glm::dvec3(infinity);
    upper_ = glm::dvec3(-infinity);
    for (const auto& medium : scene.media)
        for (const auto& source : medium.primitives) {
            HostPrimitive p{};
            for (int k = 0; k < 3; ++k) p.mu[k] = source.center[k];
            whitening(source.axes, p.w);
            p.sigma = source.sigma_t * medium.density_scale;
            if (!(p.sigma > 0)) continue;
            p.extent_squared = medium.extent * medium.extent;
            p.inv_extent_squared = 1 / p.extent_squared;
            p.family = medium.kernel;
            gaussian_only_ = gaussian_only_ && p.family == KernelFamily::gaussian;
            const Phase phase = source.has_g ? Phase{PhaseKind::henyey_greenstein, source.g} : medium.phase;
            primitives_.push_back(p);
            materials_.push_back({source.albedo, (1.0 - source.albedo) * source.emission, phase});
            const glm::dvec3 half = half_size(source.axes, medium.extent);
            for (int k = 0; k < 3; ++k) {
                lower_[k] = std::min(lower_[k], source.center[k] - half[k]);
                upper_[k] = std::max(upper_[k], source.center[k] + half[k]);
            }
        }
}

void HostMedium::fill_cells(int cells) {
    const glm::dvec3 margin = (upper_ - lower_) * 1e-9 + 1e-300;
    lower_ -= margin;
    upper_ += margin;
    const glm::dvec3 size = upper_ - lower_;
    const double longest = std::max({size.x, size.y, size.z});
    for (int k = 0; k < 3; ++k) {
        resolution_[k] = std::clamp(static_cast<int>(std::lround(cells * size[k] / longest)), 1, cells);
        cell_size_[k] = size[k] / resolution_[k];
        inv_cell_size_[k] = 1 / cell_size_[k];
    }
    const auto cell_count = static_cast<std::size_t>(resolution_.x) * resolution_.y * resolution_.z;
    std::vector<Entry> entries;
    for (std::uint32_t i = 0; i < primitives_.size(); ++i) {
        const HostPrimitive& p = primitives_[i];
        const glm::dvec3 half = half_size(p);
        glm::ivec3 first, last;
        for (int k = 0; k < 3; ++k) {
            const double a = (p.mu[k] - half[k] - lower_[k]) * inv_cell_size_[k], b = a + 2 * half[k] * inv_cell_size_[k];
            first[k] = std::clamp(static_cast<int>(std::floor(a - 1e-6)), 0, resolution_[k] - 1);
            last[k] = std::clamp(static_cast<int>(std::floor(b + 1e-6)), 0, resolution_[k] - 1);
        }
        const glm::dvec3 half_cell = cell_size_ * (0.5 * (1 + 1e-9));
        for (int z = first.z; z <= last.z; ++z)
            for (int y = first.y; y <= last.y; ++y)
                for (int x = first.x; x <= last.x; ++x) {
                    const glm::dvec3 centre = lower_ + (glm::dvec3(x, y, z) + 0.5) * cell_size_;
                    const double r_squared = min_whitened_distance_squared(p, centre, half_cell);
                    const double bound = kernel_extinction<false>(p, r_squared);
                    if (r_squared >= p.extent_squared) continue;
                    entries.push_back({static_cast<std::uint32_t>((z * resolution_.y + y) * resolution_.x + x), i,
                                       static_cast<float>(bound)});
                }
    }
    std::vector<double> sums(cell_count, 0);
    offsets_.assign(cell_count + 1, 0);
    for (const Entry& e : entries) ++offsets_[e.cell + 1], sums[e.cell] += e.bound;
    for (std::size_t c = 0; c < cell_count; ++c) offsets_[c + 1] += offsets_[c];
    std::vector<std::uint32_t> cursor(offsets_.begin(), offsets_.end() - 1);
    std::vector<Entry> sorted(entries.size());
    for (const Entry& e : entries) sorted[cursor[e.cell]++] = e;
    entries = {};
    lists_.resize(sorted.size());
    majorants_.resize(cell_count);
    for (std::size_t c = 0; c < cell_count; ++c) {
        std::stable_sort(sorted.begin() + offsets_[c], sorted.begin() + offsets_[c + 1],
                         [](const Entry& a, const Entry& b) { return a.bound > b.bound; });
        for (auto i = offsets_[c]; i < offsets_[c + 1]; ++i) lists_[i] = sorted[i].primitive;
        const auto rounded = static_cast<float>(sums[c] * (1 + 1e-6));
        majorants_[c] = rounded > 0 ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : 0;
    }
}

long HostMedium::cell_of(const glm::dvec3& x) const {
    long cell = 0;
    for (int k = 2; k >= 0; --k) {
        if (empty() || x[k] < lower_[k] || x[k] > upper_[k]) return -1;
        const int i = static_cast<int>((x[k] - lower_[k]) * inv_cell_size_[k]);
        cell = cell * resolution_[k] + std::clamp(i, 0, resolution_[k] - 1);
    }
    return cell;
}

double HostMedium::extinction(const glm::dvec3& x) const {
    double sum = 0;
    if (const long cell = cell_of(x); cell >= 0)
        for (std::uint32_t i : list(static_cast<std::size_t>(cell)))
            sum += kernel_extinction<false>(primitives_[i], whitened_distance_squared(primitives_[i], x.x, x.y, x.z));
    return sum;
}

double HostMedium::max_extinction(const glm::dvec3& x) const {
    const long cell = cell_of(x);
    return cell < 0 ? 0 : static_cast<double>(majorants_[static_cast<std::size_t>(cell)]);
}

HostCollision HostMedium::fly(const HostRay& ray, double t_max, HostRandom& random) const {
    HostCollision first = fly_mixture(ray, t_max, random);
    for (std::size_t g = 0; g < grids_.size(); ++g) {
        const double best = first.primitive < 0 ? t_max : first.t, t = grids_[g].fly(ray.origin, ray.direction, best, random);
        if (t < best) first = {static_cast<int>(primitives_.size() + g), t};
    }
    return first;
}

glm::dvec3 HostMedium::glow(const HostRay& ray, double t_max, HostRandom& random) const {
    glm::dvec3 sum(0);
    for (const auto& [grid, factor] : glows_) {
        double t0 = 0, t1 = t_max;
        if (!grid.clip(ray.origin, ray.direction, t0, t1)) continue;
        const double t = t0 + (t1 - t0) * random.uniform();
        sum += factor * grid.at(ray.origin + t * ray.direction) * (t1 - t0);
    }
    return sum;
}

HostCollision HostMedium::fly_mixture(const HostRay& ray, double t_max, HostRandom& random) const {
    if (empty()) return {};
    return gaussian_only_ ? walk<true>(ray, t_max, random) : walk<false>(ray, t_max, random);
}

template <bool gaussian_only>
HostCollision HostMedium::walk(const HostRay& ray, double t_max, HostRandom& random) const {
    const glm::dvec3 o = ray.origin, d = ray.direction;
    double t = 0, inv[3];
    for (int k = 0; k < 3; ++k) {
        inv[k] = 1 / d[k];
        if (d[k] == 0) {
            if (o[k] < lower_[k] || o[k] > upper_[k]) return {};
            continue;
        }
        const double a = (lower_[k] - o[k]) * inv[k], b = (upper_[k] - o[k]) * inv[k];
        t = std::max(t, std::min(a, b));
        t_max = std::min(t_max, std::max(a, b));
    }
    if (!(t < t_max)) return {};

    const long strides[3] = {1, resolution_.x, static_cast<long>(resolution_.x) * resolution_.y};
    double next[3], delta[3];
    int left[3];  // cells still to cross along an axis before the grid ends
    long step[3], cell = 0;
    for (int k = 0; k < 3; ++k) {
        const int i = std::clamp(static_cast<int>((o[k] + t * d[k] - lower_[k]) * inv_cell_size_[k]), 0, resolution_[k] - 1);
        const bool up = d[k] > 0;
        cell += i * strides[k];
        next[k] = d[k] == 0 ? infinity : (lower_[k] + (up ? i + 1 : i) * cell_size_[k] - o[k]) * inv[k];
        delta[k] = d[k] == 0 ? infinity : cell_size_[k] * std::abs(inv[k]);
        left[k] = up ? resolution_[k] - 1 - i : i;
        step[k] = up ? strides[k] : -strides[k];
    }
    const HostPrimitive* const primitives = primitives_.data();
    double depth = random.exponential();
    for (;;) {
        const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
        const double end = std::min(next[axis], t_max), majorant = majorants_[static_cast<std::size_t>(cell)];
        while (depth < majorant * (end - t)) {
            t += depth / majorant;
            const double x = o.x + t * d.x, y = o.y + t * d.y, z = o.z + t * d.z;
            double threshold = random.uniform() * majorant;
            for (std::uint32_t i : list(static_cast<std::size_t>(cell))) {
                threshold -= kernel_extinction<gaussian_only>(primitives[i], whitened_distance_squared(primitives[i], x, y, z));
                if (threshold < 0) return {static_cast<int>(i), t};
            }
            depth = random.exponential();
        }
        if (end >= t_max || left[axis]-- == 0) return {};
        depth = std::max(0.0, depth - majorant * (end - t));
        t = std::max(t, end);
        cell += step[axis];
        next[axis] += delta[axis];
    }
}

}  // namespace clume::reference
