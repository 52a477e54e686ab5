// SPDX-License-Identifier: MIT
// Pass and batch sizes. The first pass is one unit each, which measures the items; later passes are as long as the mean
// item's share needs to fill a batch on the fastest worker, and grow at most eightfold.
#include "runtime/batch_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace clume {

namespace {

constexpr std::uint32_t growth = 8;
constexpr double smallest_share = 1.0 / 16;  ///< of the target: batches aren't cut shorter than that near the end

}  // namespace

BatchPlan::BatchPlan(const DispatchOptions& options, std::size_t workers)
    : begin_(options.begin),
      fixed_chunk_(options.fixed_chunk),
      target_s_(options.target_seconds),
      costs_(options.items, workers),
      live_(workers, 1),
      measured_(workers, 0),
      in_hand_(workers, 0),
      ends_(options.items),
      next_(options.items, options.begin) {
    for (std::uint32_t item = 0; item < options.items; ++item) {
        ends_[item] = options.end_of(item);
        longest_ = std::max(longest_, ends_[item] - begin_);
    }
}

std::uint32_t BatchPlan::goal(std::uint32_t item, std::uint32_t units_of_longest) const {
    const std::uint64_t length = ends_[item] - begin_;
    return begin_ + static_cast<std::uint32_t>((length * units_of_longest + longest_ - 1) / longest_);
}

double BatchPlan::live_speed() const {
    double sum = 0;
    for (std::size_t w = 0; w < live_.size(); ++w) sum += live_[w] ? costs_.speed(w) : 0;
    return sum;
}

double BatchPlan::seconds_left() const {
    const double speed = live_speed();
    if (costs_.mean_reference_cost() == 0 || speed == 0) return -1;
    return (unassigned_ + std::accumulate(in_hand_.begin(), in_hand_.end(), 0.0)) / speed;
}

void BatchPlan::start_pass() {
    const std::uint32_t last = pass_end_ - pass_begin_, left = longest_ - pass_end_;
    std::uint32_t length = 1;
    if (fixed_chunk_ > 0) {
        length = fixed_chunk_;
    } else if (last > 0) {
        double fastest = 0;
        for (std::size_t w = 0; w < live_.size(); ++w) fastest = std::max(fastest, live_[w] ? costs_.speed(w) : 0);
        double cost = 0;  // of a unit of the longest, and what goes with it of the others
        for (std::uint32_t item = 0; item < ends_.size(); ++item) cost += costs_.reference_cost(item) * (ends_[item] - begin_) / longest_;
        const double wanted = target_s_ * fastest / std::max(cost / static_cast<double>(ends_.size()), 1e-12);
        const double most = static_cast<double>(std::min<std::uint64_t>(left, std::uint64_t(growth) * last));
        length = static_cast<std::uint32_t>(std::clamp(wanted, 1.0, std::max(most, 1.0)));
        if (left - std::min(left, length) < length / 2) length = left;  // no short pass at the end
    }
    pass_begin_ = pass_end_;
    pass_end_ += std::min(length, left);
    cursor_ = 0;
    order_.clear();
    for (std::uint32_t item = 0; item < next_.size(); ++item)
        if (next_[item] < goal(item, pass_end_)) order_.push_back(item);
    if (fixed_chunk_ == 0) {
        std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
            return costs_.reference_cost(a) > costs_.reference_cost(b);
        });
    }
    count_unassigned();
}

void BatchPlan::count_unassigned() {
    unassigned_ = 0;
    for (std::uint32_t item = 0; item < next_.size(); ++item)
        unassigned_ += costs_.reference_cost(item) * static_cast<double>(ends_[item] - next_[item]);
    for (const Batch& batch : redo_)
        unassigned_ += costs_.reference_cost(batch.item) * static_cast<double>(batch.end - batch.begin);
}

std::uint32_t BatchPlan::batch_units(std::size_t worker, std::uint32_t item, std::uint32_t available) const {
    if (fixed_chunk_ > 0) return std::min(available, fixed_chunk_);
    const double cost = costs_.seconds_per_unit(worker, item);
    if (cost <= 0 || !costs_.knows(worker, item)) return 1;
    double target = target_s_;
    const auto workers = std::count(live_.begin(), live_.end(), char(1));
    if (workers > 1 && measured_[worker])  // near the end: half of what is left to each, so that all end together
        target = std::clamp(seconds_left() / 2, target_s_ * smallest_share, target_s_);
    const double pieces = std::ceil(static_cast<double>(available) * cost / target * 0.999);
    if (pieces <= 1) return available;
    return std::max(1u, static_cast<std::uint32_t>(std::round(static_cast<double>(available) / pieces)));
}

bool BatchPlan::others_finish_first(std::size_t worker, std::uint32_t item) const {
    if (fixed_chunk_ > 0 || !measured_[worker]) return false;
    double speed = 0, fastest = 0, work = unassigned_;
    bool busy = false;  // without anybody at work nobody would wake this one
    for (std::size_t w = 0; w < live_.size(); ++w) {
        if (!live_[w] || w == worker || !measured_[w]) continue;
        speed += costs_.speed(w);
        fastest = std::max(fastest, costs_.speed(w));
        work += in_hand_[w];
        busy = busy || in_hand_[w] > 0;
    }
    return busy && costs_.seconds_per_unit(worker, item) > work / speed + costs_.reference_cost(item) / fastest;
}

std::optional<Batch> BatchPlan::next(std::size_t worker) {
    const bool redo = !redo_.empty();
    if (!redo) {
        if (exhausted()) return std::nullopt;
        if (cursor_ == order_.size()) start_pass();
    }
    const Batch source = redo ? redo_.back() : Batch{order_[cursor_], next_[order_[cursor_]], goal(order_[cursor_], pass_end_)};
    if (others_finish_first(worker, source.item)) return std::nullopt;
    const std::uint32_t units = batch_units(worker, source.item, source.end - source.begin);
    const Batch batch{source.item, source.begin, source.begin + units};
    if (redo) {
        redo_.back().begin = batch.end;
        if (redo_.back().begin == redo_.back().end) redo_.pop_back();
    } else {
        next_[batch.item] = batch.end;
        if (batch.end == source.end) ++cursor_;
    }
    const double cost = costs_.reference_cost(batch.item) * static_cast<double>(units);
    unassigned_ = std::max(0.0, unassigned_ - cost);
    in_hand_[worker] = cost;
    return batch;
}

void BatchPlan::done(std::size_t worker, const Batch& batch, double seconds) {
    measured_[worker] = 1;
    in_hand_[worker] = 0;
    if (costs_.measured(worker, batch.item, batch.end - batch.begin, seconds)) count_unassigned();
}

void BatchPlan::failed(std::size_t worker, const Batch& batch) {
    unassigned_ += in_hand_[worker];
    in_hand_[worker] = 0;
    live_[worker] = 0;
    redo_.push_back(batch);
}

}  // namespace clume
