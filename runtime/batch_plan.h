// SPDX-License-Identifier: MIT
// Which batch comes next: the dispatcher's decisions, without threads or clocks. A pass gives every item the same share of
// its units; inside a pass an item is cut into batches that take about the target time on the worker that asks.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "runtime/cost_model.h"
#include "runtime/dispatcher.h"

namespace clume {

class BatchPlan {
public:
    BatchPlan(const DispatchOptions& options, std::size_t workers);

    /// Work for this worker; nothing if all is handed out, or if the others will be done before it could do one unit.
    std::optional<Batch> next(std::size_t worker);
    void done(std::size_t worker, const Batch& batch, double seconds);
    /// The batch must be done by another; the worker counts no more.
    void failed(std::size_t worker, const Batch& batch);

    /// Nothing left to hand out (batches may be under way).
    bool exhausted() const { return redo_.empty() && cursor_ == order_.size() && pass_end_ == longest_; }
    /// Seconds until all is done if the live workers share it well; −1 without a measurement.
    double seconds_left() const;
    const std::vector<Batch>& unredone() const { return redo_; }

private:
    void start_pass();
    /// Where the item is to be when the longest has done so many units: the same share of its own, rounded up.
    std::uint32_t goal(std::uint32_t item, std::uint32_t units_of_longest) const;
    void count_unassigned();
    std::uint32_t batch_units(std::size_t worker, std::uint32_t item, std::uint32_t available) const;
    bool others_finish_first(std::size_t worker, std::uint32_t item) const;
    double live_speed() const;

    std::uint32_t begin_, fixed_chunk_;
    std::uint32_t longest_ = 0;                ///< units of the item that has most
    double target_s_;
    CostModel costs_;
    std::vector<char> live_;                   ///< per worker
    std::vector<char> measured_;               ///< per worker: has done a batch
    std::vector<double> in_hand_;              ///< per worker: reference seconds of the batch it holds
    std::vector<std::uint32_t> ends_;          ///< per item
    std::vector<std::uint32_t> next_;          ///< per item: first unit not handed out
    std::vector<std::uint32_t> order_;         ///< items that this pass moves, dearest first
    std::size_t cursor_ = 0;                   ///< into order_
    std::uint32_t pass_begin_ = 0, pass_end_ = 0;  ///< this pass, in units of the longest item from its first
    double unassigned_ = 0;                    ///< reference seconds not handed out, redo_ included
    std::vector<Batch> redo_;
};

}  // namespace clume
