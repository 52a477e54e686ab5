// SPDX-License-Identifier: MIT
#include "src/device_renderer.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "runtime/program.h"

namespace clume {
namespace {

constexpr std::size_t kLocalSize = 8;
constexpr unsigned kFirstBatchArg = SceneBuffers::kArgs + 1;  // after the scene and the pixels

}  // namespace

int vector_width_of(const DeviceInfo& info, int wanted) { return wanted > 0 ? wanted : static_cast<int>(info.native_vector_width); }

DeviceRenderer::DeviceRenderer(const DeviceInfo& info, const DeviceScene& scene, const std::vector<device::uint>& pixels,
                               const std::vector<Tile>& tiles, int vector_width, bool optimised)
    : queue_(info),
      tiles_(tiles),
      params_(scene.params),
      scene_(queue_, scene),
      pixels_(queue_, pixels),
      unfinished_(queue_, 1),
      wanted_items_(info.type == "gpu" ? std::size_t{2048} * info.compute_units : std::size_t{128} * std::max(1u, info.compute_units)) {
    ProgramOptions options;
    options.optimised = optimised;
    for (const auto& [name, value] : scene.defines) options.define(name, value);
    options.define("CLUME_WIDTH", vector_width_of(info, vector_width));
    const cl::Program program = build_program(queue_, "render.cl", options);
    kernel_ = make_kernel(queue_, program, "render");
    scene_.bind(queue_, kernel_);
    set_args(queue_, kernel_, SceneBuffers::kArgs, pixels_);
    // Code is generated at the first launch: pay for it here, on nothing.
    if (!tiles.empty()) {
        states_ = Buffer<device::PathState>(queue_, kLocalSize);
        sums_ = Buffer<std::uint64_t>(queue_, kLocalSize * FILM_WORDS);
        set_args(queue_, kernel_, kFirstBatchArg, states_, sums_, unfinished_, cl_uint(0), cl_uint(1), cl_uint(1), cl_uint(0), cl_uint(0), cl_uint(0));
        queue_.launch(kernel_, kLocalSize, kLocalSize);
    }
}

void DeviceRenderer::aim(FilmSums& film, std::uint64_t seed) {
    film_ = &film;
    params_.seed_lo = static_cast<device::uint>(seed);
    params_.seed_hi = static_cast<device::uint>(seed >> 32);
    scene_.params.upload(std::span(&params_, 1));
}

std::vector<float> DeviceRenderer::raised() const {
    std::vector<float> bounds;
    for (const device::uint b : scene_.raised.download()) bounds.push_back(std::bit_cast<float>(b));
    return bounds;
}

std::size_t DeviceRenderer::render(const Tile& tile, std::uint32_t begin, std::uint32_t end) {
    const std::size_t splits = std::clamp<std::size_t>(wanted_items_ / tile.count, 1, end - begin);
    const std::size_t items = tile.count * splits;
    if (states_.size() < items) {
        states_ = {};
        sums_ = {};
        states_ = Buffer<device::PathState>(queue_, items);
        sums_ = Buffer<std::uint64_t>(queue_, items * FILM_WORDS);
    }
    cl_uint resume = 0;
    for (;;) {
        const device::uint none = 0;
        unfinished_.upload(std::span(&none, 1));
        set_args(queue_, kernel_, kFirstBatchArg, states_, sums_, unfinished_, cl_uint(tile.first), cl_uint(tile.count), cl_uint(splits), cl_uint(begin),
                 cl_uint(end), resume);
        queue_.launch(kernel_, items, kLocalSize);
        device::uint left = 0;
        unfinished_.download(std::span(&left, 1));
        if (left == 0) break;
        resume = 1;
    }
    host_sums_.resize(items * FILM_WORDS);
    sums_.download(std::span(host_sums_));
    return splits;
}

void DeviceRenderer::run(const Batch& batch) {
    const Tile& tile = tiles_[batch.item];
    const std::size_t splits = render(tile, batch.begin, batch.end);
    assert(film_ != nullptr);
    film_->add(tile.first, tile.count, splits, batch.end - batch.begin, host_sums_);
}

}  // namespace clume
