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

void CostModel::measured(std::size_t worker, std::size_t item, std::uint32_t units, double seconds) {
    const double per_unit = std::max(seconds, 1e-9) / static_cast<double>(units);
    Item& it = items_[item];
    if (it.reference > 0 && it.by != worker) {
        Speed& own = speeds_[worker];
        Speed& other = speeds_[it.by];
        const double surprise = std::log(per_unit * speed(worker) / it.reference);
        own.log_slowness += surprise / 2 * std::max(0.1, 1 / (own.comparisons + 1));
        other.log_slowness -= surprise / 2 * std::max(0.1, 1 / (other.comparisons + 1));
        own.comparisons += 1;
        other.comparisons += 1;
    }
    const double reference = per_unit * speed(worker);
    // A first batch is small and pays for warming up: later measurements weigh more than what was there.
    const double updated = it.reference > 0 ? 0.3 * it.reference + 0.7 * reference : reference;
    sum_ += updated - it.reference;
    if (it.reference == 0) ++known_;
    it = {updated, worker};
}

bool CostModel::knows(std::size_t worker, std::size_t item) const {
    return speeds_[worker].comparisons > 0 || (items_[item].reference > 0 && items_[item].by == worker);
}

double CostModel::reference_cost(std::size_t item) const {
    return items_[item].reference > 0 ? items_[item].reference : mean_reference_cost();
}

double CostModel::seconds_per_unit(std::size_t worker, std::size_t item) const {
    return reference_cost(item) / speed(worker);
}

}  // namespace clume
