// SPDX-License-Identifier: MIT
// What the image tests share: rendering through the library, images as means with variances, and the comparison of two of
// them by z-tests (tests/reference/statistics.h). An image that fails is left with its reference and their difference as
// EXR files under <temp>/clume_failed/, named after the comparison.
#pragma once

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "src/image_writer.h"
#include "src/renderer.h"
#include "tests/reference/analytic_scenes.h"
#include "tests/reference/host_tracer.h"
#include "tests/reference/statistics.h"

namespace clume::test {

inline RenderResult render_now(const Scene& scene, const RenderOptions& options = {}) {
    const std::atomic<bool> stop{false};
    return render(scene, options, {}, stop);
}

/// A way to sample distances.
struct Way {
    const char* strategy;
    const char* accelerator;
    std::string name() const { return std::string(strategy) + " on " + accelerator; }
};
inline const Way delta{"delta", "cells"}, decomposition{"decomposition", "cells"}, decomposition_bvh{"decomposition", "bvh"};
inline const std::vector<Way> unbiased_ways{delta, decomposition, decomposition_bvh};

inline RenderResult render_by(const Way& way, Scene scene, std::uint32_t spp, std::uint64_t seed = 0, RenderOptions options = {}) {
    scene.render.strategy = way.strategy;
    scene.render.spp = spp;
    scene.render.seed = seed;
    options.accelerator = way.accelerator;
    return render_now(scene, options);
}

/// RGB means and the variances of these means, row by row.
struct Estimate {
    int width = 0, height = 0;
    std::vector<double> mean, variance;
};

template <class Value>
std::vector<double> doubles(const std::vector<Value>& v) {
    return {v.begin(), v.end()};
}

inline Estimate grey(int width, int height, const std::vector<double>& mean, const std::vector<double>& variance) {
    Estimate e{width, height, {}, {}};
    for (std::size_t i = 0; i < mean.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            e.mean.push_back(mean[i]);
            e.variance.push_back(variance.empty() ? 0 : variance[i]);
        }
    return e;
}

/// Of a share of samples: binomial. One sample more per 16 pixels counts as noise, since a z-test can't judge a few events.
inline Estimate share(int width, int height, const std::vector<double>& a, const std::vector<double>& n) {
    std::vector<double> variance;
    for (std::size_t i = 0; i < a.size(); ++i) variance.push_back(n[i] > 0 ? a[i] * (1 - a[i]) / n[i] + 1 / (16 * n[i] * n[i]) : 0);
    return grey(width, height, a, variance);
}

inline Estimate colour_of(const RenderImage& i) {
    return {i.window.x1 - i.window.x0, i.window.y1 - i.window.y0, doubles(i.rgb), doubles(i.variance)};
}
inline Estimate alpha_of(const RenderImage& i) {
    return share(i.window.x1 - i.window.x0, i.window.y1 - i.window.y0, doubles(i.alpha), doubles(i.samples));
}
inline Estimate colour_of(const reference::HostImage& i) { return {i.width, i.height, i.rgb, i.variance}; }
inline Estimate alpha_of(const reference::HostImage& i, double spp) {
    return share(i.width, i.height, i.alpha, std::vector<double>(i.alpha.size(), spp));
}

inline void keep_image(const std::filesystem::path& path, const Estimate& e, const std::vector<double>& values) {
    RenderImage image;
    image.film_width = e.width;
    image.film_height = e.height;
    image.window = {0, 0, e.width, e.height};
    image.rgb.assign(values.begin(), values.end());
    image.variance.assign(e.variance.begin(), e.variance.end());
    image.alpha.assign(values.size() / 3, 1);
    image.samples.assign(values.size() / 3, 0);
    write_exr(path, image);
}

/// Two estimates by z-tests; float's rounding (a few units of 1e-7) counts as noise, too.
inline reference::ImageTest compare(const Estimate& a, const Estimate& b, double alpha = 1e-4, int block = 4) {
    REQUIRE(a.width == b.width);
    REQUIRE(a.height == b.height);
    std::vector<double> variance = a.variance;
    for (std::size_t i = 0; i < variance.size(); ++i) variance[i] += std::pow(1e-6 * (std::abs(a.mean[i]) + std::abs(b.mean[i])), 2);
    return reference::compare_images(a.mean, variance, b.mean, b.variance, a.width, a.height, block, alpha);
}

/// Checks that two estimates have the same mean everywhere. False alarms: one in 1/alpha of such checks.
inline void check_same(const std::string& name, const Estimate& a, const Estimate& b, double alpha = 1e-4, int block = 4) {
    const reference::ImageTest t = compare(a, b, alpha, block);
    if (!t.pass) {
        std::string file = name;
        for (char& c : file)
            if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
        const auto folder = std::filesystem::temp_directory_path() / "clume_failed";
        std::filesystem::create_directories(folder);
        std::vector<double> difference(a.mean.size());
        for (std::size_t i = 0; i < difference.size(); ++i) difference[i] = a.mean[i] - b.mean[i];
        keep_image(folder / (file + "_image.exr"), a, a.mean);
        keep_image(folder / (file + "_reference.exr"), b, b.mean);
        keep_image(folder / (file + "_difference.exr"), a, difference);
        UNSCOPED_INFO("images in " << folder.string() << "/" << file << "_*.exr");
    }
    INFO(name << ": least p " << t.min_p << " of " << t.tests << " tests, must be " << t.threshold << "; ratio of means "
              << t.global_ratio[0] << " " << t.global_ratio[1] << " " << t.global_ratio[2] << " (z " << t.global_z[0] << " "
              << t.global_z[1] << " " << t.global_z[2] << "); worst z " << t.worst_z << " at " << t.worst_x << ", "
              << t.worst_y << ", channel " << t.worst_channel);
    CHECK(t.pass);
}

/// Nothing went wrong that a good render never shows.
inline void check_clean(const RenderResult& r) {
    CHECK(r.stats.bound_violations == 0);
    CHECK(r.stats.nonfinite_samples == 0);
}

inline double mean_of(const std::vector<double>& v) {
    double sum = 0;
    for (double x : v) sum += x;
    return sum / static_cast<double>(v.size());
}

inline Light light_of(LightKind kind) {
    Light l;
    l.kind = kind;
    return l;
}

inline Light constant_light(const glm::dvec3& radiance, bool visible = false) {
    Light l = light_of(LightKind::constant);
    l.radiance = radiance;
    l.visible_to_camera = visible;
    return l;
}

inline Light point_light(const glm::dvec3& position, const glm::dvec3& intensity) {
    Light l = light_of(LightKind::point);
    l.position = position;
    l.intensity = intensity;
    return l;
}

/// 30 Gaussians under a constant light, grey, nothing sampled: every path carries between 0 and 1.
inline Scene grey_mixture() {
    Scene scene = reference::random_mixture(KernelFamily::gaussian, 30, 6, 6, 3);
    scene.film = {16, 16};
    for (Primitive& p : scene.media[0].primitives) p.albedo = glm::dvec3(0.8);
    return scene;
}

/// 16 × 8 texels of uneven colours; one, 1 % of the sphere, is 80 times brighter than the others.
inline Light contrast_environment(bool visible, double rotate_y_rad) {
    Light l = light_of(LightKind::envmap);
    l.image.width = 16;
    l.image.height = 8;
    for (int i = 0; i < 128; ++i)
        for (int c = 0; c < 3; ++c) l.image.rgb.push_back(0.05f * static_cast<float>((i * (3 + 2 * c) + 5 * c) % 11));
    for (int c = 0; c < 3; ++c) l.image.rgb[3 * (2 * 16 + 5) + static_cast<std::size_t>(c)] = 20.f - 5.f * static_cast<float>(c);
    l.scale = 0.5;
    l.rotate_y_rad = rotate_y_rad;
    l.visible_to_camera = visible;
    return l;
}

}  // namespace clume::test
