// SPDX-License-Identifier: MIT
// The update: an item measured by one worker and then by another compares the two; the gain of a comparison falls as
// 1/n down to 1/10, so that it settles fast and still follows a device that slows down.
#include "runtime/cost_model.h"

#include <algorithm>
#include <cmath>

namespace clume {

CostModel::CostModel(std::size_t items, std::size_t workers) : items_(items), speeds_(workers) {}

double CostModel::speed(std::size_t worker) const {
    return std::exp(-speeds_[worker].log_slowness);
}

bool CostModel::measured(std::size_t worker, std::size_t item, std::uint32_t units, double seconds) {
    const double per_unit = std::max(seconds, 1e-9) / static_cast<double>(units);
    Item& it = items_[item];
    Speed& own = speeds_[worker];
    Speed& other = speeds_[it.by];
    double moved = 0;
    if (it.seconds > 0 && it.by != worker) {
        const double surprise = std::log(per_unit / seconds_per_unit(worker, item));
        const double own_step = surprise / 2 * std::max(0.1, 1 / (own.comparisons + 1));
        const double other_step = surprise / 2 * std::max(0.1, 1 / (other.comparisons + 1));
        own.log_slowness += own_step;
        other.log_slowness -= other_step;
        own.comparisons += 1;
        other.comparisons += 1;
        moved = std::fabs(own_step) + std::fabs(other_step);
    }
    // A first batch is small and pays for warming up: later measurements weigh more than what was there.
    const double updated = it.seconds > 0 ? 0.3 * seconds_per_unit(worker, item) + 0.7 * per_unit : per_unit;
    if (it.seconds == 0) ++known_;
    other.item_seconds -= it.seconds;
    own.item_seconds += updated;
    it = {updated, worker};
    return moved > 0.1;
}

bool CostModel::knows(std::size_t worker, std::size_t item) const {
    return speeds_[worker].comparisons > 0 || (items_[item].seconds > 0 && items_[item].by == worker);
}

double CostModel::reference_cost(std::size_t item) const {
    const Item& it = items_[item];
    return it.seconds > 0 ? it.seconds * speed(it.by) : mean_reference_cost();
}

double CostModel::mean_reference_cost() const {
    if (known_ == 0) return 0;
    double sum = 0;
    for (std::size_t w = 0; w < speeds_.size(); ++w) sum += std::max(speeds_[w].item_seconds, 0.0) * speed(w);
    return sum / static_cast<double>(known_);
}

double CostModel::seconds_per_unit(std::size_t worker, std::size_t item) const {
    return reference_cost(item) / speed(worker);
}

}  // namespace clume
