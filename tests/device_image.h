// SPDX-License-Identifier: MIT
// Renders a device scene that a test may have changed (defines, buffers) with one work-group of machinery less than
// clume::render: one device, one tile, one batch. What comes back are the film's exact sums.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/device.h"
#include "src/device_camera.h"
#include "src/device_renderer.h"
#include "src/device_scene.h"
#include "src/film.h"
#include "tests/image_test.h"

namespace clume::test {

struct DeviceImage {
    std::vector<device::uint> pixels;  ///< film index of each
    std::vector<FilmSums::Pixel> values;
    std::uint64_t nonfinite = 0, violations = 0;

    bool same_bits(const DeviceImage& other) const {
        return pixels == other.pixels && std::equal(values.begin(), values.end(), other.values.begin(), [](const auto& a, const auto& b) {
                   return std::equal(a.mean, a.mean + 3, b.mean) && std::equal(a.variance, a.variance + 3, b.variance) && a.alpha == b.alpha;
               });
    }
};

inline std::string define_of(const DeviceScene& scene, const std::string& name) {
    for (const auto& [key, value] : scene.defines)
        if (key == name) return value;
    return "";
}

inline void set_define(DeviceScene& scene, const std::string& name, const std::string& value) {
    for (auto& [key, old] : scene.defines)
        if (key == name) {
            old = value;
            return;
        }
    scene.defines.emplace_back(name, value);
}

/// On the best device of the machine, or on `info`; width 0 is the device's own.
inline DeviceImage render_device(const Scene& scene, const DeviceScene& device, std::uint32_t spp, const DeviceInfo& info = select_devices({}).front(), int width = 0) {
    DeviceImage image;
    image.pixels = active_pixels(scene, device, {0, 0, scene.film.width, scene.film.height});
    const std::vector<Tile> tiles{{0, static_cast<std::uint32_t>(image.pixels.size())}};
    FilmSums film(image.pixels.size(), define_of(device, "CLUME_CHANNELS") == "1" ? 1 : 3, static_cast<double>(device.params.film_scale));
    DeviceRenderer renderer(info, std::make_shared<const DeviceScene>(device), image.pixels, tiles, width);
    renderer.aim(film, scene.render.seed);
    renderer.run({0, 0, spp});
    renderer.commit({0, 0, spp});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.values.push_back(film.pixel(i));
    if (!image.values.empty() && image.values[0].samples != spp) throw std::logic_error("an image without its samples proves nothing");
    image.nonfinite = film.nonfinite();
    image.violations = film.violations();
    return image;
}

/// What no path is rendered for counts as black.
inline Estimate colour_of(const DeviceImage& image, const Film& film) {
    Estimate e{film.width, film.height, std::vector<double>(3 * static_cast<std::size_t>(film.width) * static_cast<std::size_t>(film.height)), {}};
    e.variance = e.mean;
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            e.mean[3 * image.pixels[i] + c] = image.values[i].mean[c];
            e.variance[3 * image.pixels[i] + c] = image.values[i].variance[c];
        }
    return e;
}

}  // namespace clume::test
