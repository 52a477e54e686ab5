// SPDX-License-Identifier: MIT
// Dense copy of the samples, evaluation, quadrature and null collisions.
#include "tests/reference/host_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace clume::reference {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double node[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526};
constexpr double weight[] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};

}  // namespace

HostGrid::HostGrid(const VoxelGrid& grid, Interpolation interpolation, double factor)
    : nearest_(interpolation == Interpolation::nearest),
      axes_(grid.axes),
      inverse_(glm::inverse(grid.axes)),
      origin_(grid.origin),
      first_(grid.lo - 1),
      size_(grid.hi - grid.lo + 2),
      factor_(factor) {
    const bool wide = grid.sparse && !nearest_;
    lower_ = glm::dvec3(grid.lo) - (wide ? 1.0 : 0.5);
    upper_ = glm::dvec3(grid.hi) - (wide ? 0.0 : 0.5);
    const auto index = [&](const glm::ivec3& p) {
        const glm::ivec3 q = p - first_;
        return static_cast<std::size_t>(q.x) + static_cast<std::size_t>(size_.x) * (static_cast<std::size_t>(q.y) + static_cast<std::size_t>(size_.y) * static_cast<std::size_t>(q.z));
    };
    samples_.assign(static_cast<std::size_t>(size_.x) * size_.y * size_.z, grid.sparse ? grid.background : 0.f);
    for (std::size_t b = 0; b < grid.brick_origins.size(); ++b)
        for (int k = 0; k < 512; ++k) {
            const glm::ivec3 p = grid.brick_origins[b] + glm::ivec3(k % 8, k / 8 % 8, k / 64);
            if (p.x < grid.lo.x || p.y < grid.lo.y || p.z < grid.lo.z || p.x >= grid.hi.x || p.y >= grid.hi.y || p.z >= grid.hi.z) continue;
            samples_[index(p)] = grid.values[512 * b + static_cast<std::size_t>(k)];
        }
    if (!grid.sparse)
        for (int z = first_.z; z < first_.z + size_.z; ++z)
            for (int y = first_.y; y < first_.y + size_.y; ++y)
                for (int x = first_.x; x < first_.x + size_.x; ++x)
                    samples_[index({x, y, z})] = samples_[index({std::clamp(x, grid.lo.x, grid.hi.x - 1), std::clamp(y, grid.lo.y, grid.hi.y - 1), std::clamp(z, grid.lo.z, grid.hi.z - 1)})];
    make_bounds();
}

float HostGrid::sample(int x, int y, int z) const {
    return samples_[static_cast<std::size_t>(x) + static_cast<std::size_t>(size_.x) * (static_cast<std::size_t>(y) + static_cast<std::size_t>(size_.y) * static_cast<std::size_t>(z))];
}

double HostGrid::at_lattice(const glm::dvec3& p) const {
    for (int k = 0; k < 3; ++k)
        if (!(p[k] >= lower_[k] && p[k] <= upper_[k])) return 0;
    const double x = p.x - first_.x, y = p.y - first_.y, z = p.z - first_.z;
    if (nearest_) {
        const auto of = [](double v, int n) { return std::min(static_cast<int>(std::lround(v)), n - 2); };
        return factor_ * static_cast<double>(sample(of(x, size_.x), of(y, size_.y), of(z, size_.z)));
    }
    const int i = std::min(static_cast<int>(x), size_.x - 2), j = std::min(static_cast<int>(y), size_.y - 2), k = std::min(static_cast<int>(z), size_.z - 2);
    const double u = x - i, v = y - j, w = z - k;
    const float* s = samples_.data() + static_cast<std::size_t>(i) + static_cast<std::size_t>(size_.x) * (static_cast<std::size_t>(j) + static_cast<std::size_t>(size_.y) * static_cast<std::size_t>(k));
    const std::size_t dy = static_cast<std::size_t>(size_.x), dz = dy * static_cast<std::size_t>(size_.y);
    const auto mix = [&](std::size_t at) { return (1 - u) * static_cast<double>(s[at]) + u * static_cast<double>(s[at + 1]); };
    return factor_ * ((1 - w) * ((1 - v) * mix(0) + v * mix(dy)) + w * ((1 - v) * mix(dz) + v * mix(dz + dy)));
}

void HostGrid::make_bounds() {
    blocks_ = glm::max(glm::ivec3(glm::ceil((upper_ - lower_) / 8.0)), glm::ivec3(1));
    bounds_.assign(static_cast<std::size_t>(blocks_.x) * blocks_.y * blocks_.z, 0);
    const auto block = [&](double p, int k) { return std::clamp(static_cast<int>(std::floor((p - lower_[k]) / 8)), 0, blocks_[k] - 1); };
    for (int z = 0; z < size_.z; ++z)
        for (int y = 0; y < size_.y; ++y)
            for (int x = 0; x < size_.x; ++x) {
                const float v = sample(x, y, z);
                if (!(v > 0)) continue;
                largest_ = std::max(largest_, factor_ * static_cast<double>(v));
                const glm::dvec3 p(first_ + glm::ivec3(x, y, z));
                const double reach = nearest_ ? 0.5 : 1;
                for (int c = block(p.z - reach, 2); c <= block(p.z + reach, 2); ++c)
                    for (int b = block(p.y - reach, 1); b <= block(p.y + reach, 1); ++b)
                        for (int a = block(p.x - reach, 0); a <= block(p.x + reach, 0); ++a) {
                            float& m = bounds_[static_cast<std::size_t>(a + blocks_.x * (b + blocks_.y * c))];
                            m = std::max(m, static_cast<float>(factor_ * static_cast<double>(v) * (1 + 1e-6)));
                        }
            }
}

bool HostGrid::clip(const glm::dvec3& o, const glm::dvec3& d, double& t0, double& t1) const {
    const glm::dvec3 a = to_lattice(o), b = inverse_ * d;
    for (int k = 0; k < 3; ++k) {
        if (b[k] == 0) {
            if (a[k] < lower_[k] || a[k] > upper_[k]) return false;
            continue;
        }
        const double p = (lower_[k] - a[k]) / b[k], q = (upper_[k] - a[k]) / b[k];
        t0 = std::max(t0, std::min(p, q));
        t1 = std::min(t1, std::max(p, q));
    }
    return t0 < t1;
}

std::vector<double> HostGrid::cuts(const glm::dvec3& o, const glm::dvec3& d, double t0, double t1) const {
    std::vector<double> all;
    if (!clip(o, d, t0, t1)) return all;
    all = {t0, t1};
    const glm::dvec3 a = to_lattice(o), b = inverse_ * d;
    const double shift = nearest_ ? 0.5 : 0;
    for (int k = 0; k < 3; ++k) {
        if (b[k] == 0) continue;
        const double p = a[k] + t0 * b[k] - shift, q = a[k] + t1 * b[k] - shift;
        for (double plane = std::ceil(std::min(p, q)); plane <= std::max(p, q); plane += 1) {
            const double t = (plane + shift - a[k]) / b[k];
            if (t > t0 && t < t1) all.push_back(t);
        }
    }
    std::sort(all.begin(), all.end());
    return all;
}

double HostGrid::integral(const glm::dvec3& o, const glm::dvec3& d, double t0, double t1) const {
    const std::vector<double> c = cuts(o, d, t0, t1);
    double sum = 0;
    for (std::size_t i = 0; i + 1 < c.size(); ++i) {
        const double middle = 0.5 * (c[i] + c[i + 1]), half = 0.5 * (c[i + 1] - c[i]);
        for (int k = 0; k < 4; ++k) sum += half * weight[k] * at(o + (middle + half * node[k]) * d);
    }
    return sum;
}

double HostGrid::inverse(const glm::dvec3& o, const glm::dvec3& d, double t0, double t1, double target) const {
    const std::vector<double> c = cuts(o, d, t0, t1);
    double sum = 0;
    for (std::size_t i = 0; i + 1 < c.size(); ++i) {
        const double part = integral(o, d, c[i], c[i + 1]);
        if (sum + part <= target) {
            sum += part;
            continue;
        }
        double lo = c[i], hi = c[i + 1];
        for (int k = 0; k < 60; ++k) {
            const double middle = 0.5 * (lo + hi);
            (sum + integral(o, d, c[i], middle) < target ? lo : hi) = middle;
        }
        return 0.5 * (lo + hi);
    }
    return infinity;
}

double HostGrid::fly(const glm::dvec3& o, const glm::dvec3& d, double t1, HostRandom& random) const {
    double t = 0;
    if (!clip(o, d, t, t1)) return infinity;
    const glm::dvec3 a = (to_lattice(o) - lower_) / 8.0, b = inverse_ * d / 8.0;
    double next[3], delta[3];
    int step[3], left[3], block = 0;
    const int strides[3] = {1, blocks_.x, blocks_.x * blocks_.y};
    for (int k = 0; k < 3; ++k) {
        const int i = std::clamp(static_cast<int>(a[k] + t * b[k]), 0, blocks_[k] - 1);
        const bool up = b[k] > 0;
        block += i * strides[k];
        next[k] = b[k] == 0 ? infinity : ((up ? i + 1 : i) - a[k]) / b[k];
        delta[k] = b[k] == 0 ? infinity : 1 / std::abs(b[k]);
        left[k] = up ? blocks_[k] - 1 - i : i;
        step[k] = up ? strides[k] : -strides[k];
    }
    double depth = random.exponential();
    for (;;) {
        const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
        const double end = std::min(next[axis], t1), majorant = static_cast<double>(bounds_[static_cast<std::size_t>(block)]);
        while (depth < majorant * (end - t)) {
            t += depth / majorant;
            if (random.uniform() * majorant < at_lattice(lower_ + 8.0 * (a + t * b))) return t;
            depth = random.exponential();
        }
        if (end >= t1 || left[axis]-- == 0) return infinity;
        depth = std::max(0.0, depth - majorant * (end - t));
        t = std::max(t, end);
        block += step[axis];
        next[axis] += delta[axis];
    }
}

}  // namespace clume::reference
