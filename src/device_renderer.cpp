// SPDX-License-Identifier: MIT
#include "src/device_renderer.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "runtime/program.h"

namespace clume {
namespace {

constexpr std::size_t kLocalSize = 8;  // rows of sums that a work-group fills, or as many as one work-item does
constexpr std::size_t kFewestItems = 64;  // of a piece: a device without room for these is of no use
constexpr unsigned kFirstBatchArg = SceneBuffers::kArgs + 1;  // after the scene and the pixels

std::size_t items_wanted(const DeviceInfo& info) {
    return info.type == "gpu" ? std::size_t{2048} * info.compute_units : std::size_t{128} * std::max(1u, info.compute_units);
}

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
      raised_(scene.learned.size(), 0.0f),
      lanes_(scene.lanes ? static_cast<std::size_t>(vector_width_of(info, vector_width)) : 1),
      wanted_items_(items_wanted(info)) {
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
        launch(kLocalSize);
    }
}

std::uint64_t DeviceRenderer::batch_bytes(const DeviceInfo& info, const std::vector<Tile>& tiles) {
    const std::size_t items = std::max<std::size_t>(tiles.empty() ? 0 : tiles.front().count, items_wanted(info));
    return items * (sizeof(device::PathState) + 2 * FILM_WORDS * sizeof(std::uint64_t));
}

void DeviceRenderer::launch(std::size_t rows) {
    queue_.launch(kernel_, (rows + lanes_ - 1) / lanes_, std::max<std::size_t>(1, kLocalSize / lanes_));
}

void DeviceRenderer::aim(FilmSums& film, std::uint64_t seed) {
    film_ = &film;
    params_.seed_lo = static_cast<device::uint>(seed);
    params_.seed_hi = static_cast<device::uint>(seed >> 32);
    aimed_ = false;
}

void DeviceRenderer::set_learned(std::span<const float> bounds, bool explore) {
    learned_.assign(bounds.begin(), bounds.end());
    raised_.assign(bounds.size(), 0.0f);
    params_.explore = explore;
    aimed_ = false;
}

void DeviceRenderer::upload_changes() {
    if (!aimed_) scene_.params.upload(std::span(&params_, 1));
    aimed_ = true;
    if (learned_.empty()) return;
    scene_.learned.upload(learned_);
    scene_.raised.upload(std::vector<device::uint>(learned_.size()));
    learned_.clear();
}

DeviceRenderer::Piece DeviceRenderer::render(std::size_t first, std::size_t count, std::uint32_t begin, std::uint32_t end) {
    const std::size_t wanted = std::min(wanted_items_, most_items_);
    Piece piece{first, count, std::clamp<std::size_t>(wanted / count, 1, end - begin), {}};
    const std::size_t items = count * piece.splits;
    if (states_.size() < items || sums_.size() < items * FILM_WORDS) {
        states_ = {};
        sums_ = {};
        states_ = Buffer<device::PathState>(queue_, items);
        sums_ = Buffer<std::uint64_t>(queue_, items * FILM_WORDS);
    }
    cl_uint resume = 0;
    for (;;) {
        const device::uint none = 0;
        unfinished_.upload(std::span(&none, 1));
        set_args(queue_, kernel_, kFirstBatchArg, states_, sums_, unfinished_, cl_uint(first), cl_uint(count), cl_uint(piece.splits), cl_uint(begin),
                 cl_uint(end), resume);
        launch(items);
        device::uint left = 0;
        unfinished_.download(std::span(&left, 1));
        alive();
        if (left == 0) break;
        if (left > items) throw DeviceError(queue_.label() + " gives nonsense: " + std::to_string(left) + " of " + std::to_string(items) + " paths are unfinished");
        resume = 1;
    }
    piece.sums.resize(items * FILM_WORDS);
    sums_.download(std::span(piece.sums));
    return piece;
}

void DeviceRenderer::run(const Batch& batch) {
    const Tile& tile = tiles_[batch.item];
    pieces_.clear();
    upload_changes();
    for (std::size_t done = 0; done < tile.count;) {
        const std::size_t count = std::min<std::size_t>(tile.count - done, most_items_);
        try {
            pieces_.push_back(render(tile.first + done, count, batch.begin, batch.end));
            done += count;
        } catch (const DeviceMemoryError&) {
            const std::size_t tried = count * std::clamp<std::size_t>(std::min(wanted_items_, most_items_) / count, 1, batch.end - batch.begin);
            if (tried <= kFewestItems) throw;
            most_items_ = short_of_memory_ = std::max(kFewestItems, tried / 2);
            states_ = {};
            sums_ = {};
        }
    }
    if (!raised_.empty()) {
        found_.resize(raised_.size());
        scene_.raised.download(std::span(found_));
    }
    alive();
}

void DeviceRenderer::commit(const Batch& batch) {
    assert(film_ != nullptr);
    for (const Piece& p : pieces_) film_->add(p.first, p.count, p.splits, batch.end - batch.begin, p.sums);
    pieces_.clear();
    for (std::size_t i = 0; i < found_.size(); ++i) raised_[i] = std::max(raised_[i], std::bit_cast<float>(found_[i]));
}

}  // namespace clume
