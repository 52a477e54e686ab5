// SPDX-License-Identifier: MIT
#include "src/device_renderer.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <numeric>

#include "runtime/program.h"
#include "src/error.h"
#include "src/work_weights.h"

namespace clume {
namespace {

constexpr std::size_t kMostInPool = std::size_t{1} << 31;  // paths, counted in 32 bits
constexpr std::size_t kSamplesPerLane = 64;  // that a work-item has at least, so that few of its lanes idle at its end
constexpr std::size_t kItemsPerUnit = 16;    // at least, if there are rows enough: work-items differ in length
constexpr std::size_t kFewestItems = 64;  // of a piece: a device without room for these is of no use
constexpr unsigned kFirstBatchArg = SceneBuffers::kArgs + 1;  // after the scene and the pixels

std::size_t items_wanted(const DeviceInfo& info) {
    return info.type == "gpu" ? std::size_t{2048} * info.compute_units : std::size_t{128} * std::max(1u, info.compute_units);
}

}  // namespace

int vector_width_of(const DeviceInfo& info, int wanted) { return wanted > 0 ? wanted : static_cast<int>(info.native_vector_width); }

DeviceRenderer::DeviceRenderer(const DeviceInfo& info, const std::shared_ptr<const DeviceScene>& scene, const std::vector<device::uint>& pixels,
                               const std::vector<Tile>& tiles, int vector_width, bool optimised)
    : queue_(info),
      active_(pixels),
      order_(pixels.size()),
      tiles_(tiles),
      params_(scene->params),
      scene_(queue_, scene),
      pixels_(queue_, pixels),
      progress_(queue_, 2),
      raised_(scene->learned.size(), 0.0f),
      pool_(vector_width_of(info, vector_width) == 1),
      lanes_(scene->lanes ? static_cast<std::size_t>(vector_width_of(info, vector_width)) : 1),
      wanted_items_(items_wanted(info)),
      units_(std::max(1u, info.compute_units)) {
    std::iota(order_.begin(), order_.end(), 0u);
    ProgramOptions options;
    options.optimised = optimised || info.type == "gpu";  // there code is made soon, and slow without
    for (const auto& [name, value] : scene->defines) options.define(name, value);
    options.define("CLUME_WIDTH", vector_width_of(info, vector_width));
    const cl::Program program = build_program(queue_, "render.cl", options);
    kernel_ = make_kernel(queue_, program, "render");
    scene_.bind(queue_, kernel_);
    set_args(queue_, kernel_, SceneBuffers::kArgs, pixels_);
    // Code is generated at the first launch: pay for it here, on nothing.
    if (!tiles.empty()) {
        states_ = Buffer<device::PathState>(queue_, lanes_);
        sums_ = Buffer<std::uint64_t>(queue_, FILM_WORDS);
        sums_.upload(std::vector<std::uint64_t>(FILM_WORDS));
        set_args(queue_, kernel_, kFirstBatchArg, states_, sums_, progress_, cl_uint(0), cl_uint(1), cl_uint(1), cl_uint(0), cl_uint(0), cl_uint(pool_ ? 1 : lanes_), cl_uint(0));
        progress_.upload(std::vector<device::uint>(2));
        launch(1);
    }
}

std::uint64_t DeviceRenderer::batch_bytes(const DeviceInfo& info, const std::vector<Tile>& tiles) {
    const std::size_t items = std::max<std::size_t>(tiles.empty() ? 0 : tiles.front().count, items_wanted(info));
    return items * (sizeof(device::PathState) + 2 * FILM_WORDS * sizeof(std::uint64_t));
}

void DeviceRenderer::launch(std::size_t items) { queue_.launch(kernel_, items, std::max<std::size_t>(1, queue_.info().group_size() / lanes_)); }

std::size_t DeviceRenderer::rows_per_item(std::size_t rows, std::size_t samples) const {
    if (lanes_ == 1) return 1;
    const std::size_t enough = (kSamplesPerLane + samples - 1) / samples, balanced = rows / (lanes_ * kItemsPerUnit * units_);
    return lanes_ * std::clamp<std::size_t>(enough, 1, std::max<std::size_t>(1, balanced));
}

void DeviceRenderer::aim(FilmSums& film, std::uint64_t seed) {
    film_ = &film;
    paths_ = 0;
    params_.seed_lo = static_cast<device::uint>(seed);
    params_.seed_hi = static_cast<device::uint>(seed >> 32);
    aimed_ = false;
}

void DeviceRenderer::choose(std::vector<std::uint32_t> order, std::vector<Tile> tiles) {
    order_ = std::move(order);
    tiles_ = std::move(tiles);
    chosen_ = false;
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
    if (!chosen_) {
        std::vector<device::uint> pixels;
        for (const std::uint32_t k : order_) pixels.push_back(active_[k]);
        pixels_.upload(std::span<const device::uint>(pixels));
    }
    chosen_ = true;
    if (learned_.empty()) return;
    scene_.learned.upload(learned_);
    scene_.raised.upload(std::vector<device::uint>(learned_.size()));
    learned_.clear();
}

DeviceRenderer::Piece DeviceRenderer::render(std::size_t first, std::size_t count, std::uint32_t begin, std::uint32_t end) {
    const std::size_t wanted = std::min(wanted_items_, most_items_), samples = end - begin;
    Piece piece{first, count, pool_ ? 1 : std::clamp<std::size_t>(wanted / count, 1, samples), {}};
    const std::size_t rows = count * piece.splits, rows_each = rows_per_item(rows, samples / piece.splits);
    const std::size_t items = pool_ ? std::min(wanted, count * samples) : (rows + rows_each - 1) / rows_each;
    if (states_.size() < items * lanes_ || sums_.size() < rows * FILM_WORDS) {
        states_ = {};
        sums_ = {};
        states_ = Buffer<device::PathState>(queue_, items * lanes_);
        sums_ = Buffer<std::uint64_t>(queue_, rows * FILM_WORDS);
    }
    if (pool_ || lanes_ > 1) sums_.zero();  // work-items add to them
    progress_.upload(std::vector<device::uint>(2));
    cl_uint resume = 0;
    for (;;) {
        set_args(queue_, kernel_, kFirstBatchArg, states_, sums_, progress_, cl_uint(first), cl_uint(count), cl_uint(piece.splits), cl_uint(begin),
                 cl_uint(end), cl_uint(pool_ ? items : rows_each), resume);
        launch(items);
        device::uint left = 0;
        progress_.download(std::span(&left, 1));
        alive();
        if (left == 0) break;
        if (left > items) throw DeviceError(queue_.label() + " gives nonsense: " + std::to_string(left) + " of " + std::to_string(items) + " work-items are unfinished");
        check_work(rows);
        if (unwanted()) throw BatchAbandoned();
        const device::uint none = 0;
        progress_.upload(std::span(&none, 1));
        resume = 1;
    }
    piece.sums.resize(rows * FILM_WORDS);
    sums_.download(std::span(piece.sums));
    return piece;
}

double DeviceRenderer::work_of(std::span<const std::uint64_t> sums) const {
    double ns = 0;
    for (std::size_t row = 0; row < sums.size(); row += FILM_WORDS)
        ns += work_ns(work_limit_.weights, sums.subspan(row + FILM_WORK).first<WORK_KINDS>());
    return ns;
}

void DeviceRenderer::check_work(std::size_t rows) {
    if (!(work_limit_.ns > 0)) return;
    std::vector<std::uint64_t> sums(rows * FILM_WORDS);
    sums_.download(std::span(sums));
    if (work_ns_ + work_of(sums) > work_limit_.ns) throw TooMuchWork();
}

void DeviceRenderer::run(const Batch& batch) {
    const Tile& tile = tiles_[batch.item];
    pieces_.clear();
    upload_changes();
    for (std::size_t done = 0; done < tile.count;) {
        const std::size_t fitting = std::max<std::size_t>(1, kMostInPool / std::max(1u, batch.end - batch.begin));
        const std::size_t count = std::min({std::size_t{tile.count} - done, most_items_, pool_ ? fitting : SIZE_MAX});
        try {
            pieces_.push_back(render(tile.first + done, count, batch.begin, batch.end));
            done += count;
        } catch (const DeviceMemoryError&) {
            const std::size_t most = std::min(wanted_items_, most_items_), tried = pool_ ? std::max(count, most) : count * std::clamp<std::size_t>(most / count, 1, batch.end - batch.begin);
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
    if (work_limit_.ns > 0)
        for (const Piece& p : pieces_) work_ns_ += work_of(p.sums);
    for (const Piece& p : pieces_) {
        film_->add(std::span(order_).subspan(p.first, p.count), p.splits, batch.end - batch.begin, p.sums);
        paths_ += p.count * std::uint64_t{batch.end - batch.begin};
    }
    pieces_.clear();
    for (std::size_t i = 0; i < found_.size(); ++i) raised_[i] = std::max(raised_[i], std::bit_cast<float>(found_[i]));
}

}  // namespace clume
