// SPDX-License-Identifier: MIT
// Seconds that one unit of an item takes on a worker, learned from the batches done. Items differ in cost by 100 and more,
// workers too: an item is known by its last measurement, and carried over to another worker by the ratio of their speeds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace clume {

class CostModel {
public:
    CostModel(std::size_t items, std::size_t workers);

    /// A batch of `units` ≥ 1 of `item` took `seconds` on `worker`. True if that moved what is known of the workers' speeds
    /// by over a tenth: reference seconds told before are stale then.
    bool measured(std::size_t worker, std::size_t item, std::uint32_t units, double seconds);

    /// Expected seconds per unit; the mean item where this one isn't known; 0 before any measurement.
    double seconds_per_unit(std::size_t worker, std::size_t item) const;
    /// Whether that is more than a guess: the worker measured the item, or was compared with the others.
    bool knows(std::size_t worker, std::size_t item) const;
    /// The same in reference seconds, which divide by `speed` to a worker's.
    double reference_cost(std::size_t item) const;
    double mean_reference_cost() const;
    /// Reference seconds a worker gets done in a second.
    double speed(std::size_t worker) const;

private:
    struct Item {
        double seconds = 0;  ///< per unit, by the clock of who measured it last; 0: not measured
        std::size_t by = 0;
    };
    struct Speed {
        double log_slowness = 0;  ///< ln(own seconds / reference seconds)
        double comparisons = 0;   ///< items measured after another worker had
        double item_seconds = 0;  ///< summed over the items it measured last
    };
    std::vector<Item> items_;
    std::vector<Speed> speeds_;
    std::size_t known_ = 0;
};

}  // namespace clume
