// SPDX-License-Identifier: MIT
// What a comparison comes to: intervals over seeds per pair and level, the test for bias, and the verdict in plain words.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "src/compare.h"

namespace clume {

/// One pair at one level, over its seeds.
struct LevelSummary {
    std::size_t rows = 0;  ///< seeds; what follows means nothing if 0
    double spp = 0, seconds = 0, mpaths_s = 0, relmse = 0;  ///< means
    Interval mse, inverse_efficiency;
    Interval bias;         ///< the reference's error is part of the interval
};
LevelSummary summarise(const Comparison& comparison, std::size_t pair, std::size_t level);

enum class Finding { no_rows, untested, no_bias_found, biased };

/// "biased", "no bias found" and so on.
const char* name_of(Finding finding);

struct PairSummary {
    LevelSummary last;  ///< at Comparison::level
    BiasTest test;
    Finding finding = Finding::no_rows;
};

struct CompareSummary {
    std::vector<PairSummary> pairs;   ///< as Comparison::pairs
    double threshold = 0;             ///< a pair is called biased below this p
    std::optional<std::size_t> fastest_unbiased, cheapest_biased;
    std::vector<std::string> verdict; ///< sentences, the most important first
};

/// The chance that any of all unbiased pairs is called biased; each gets its share by Šidák.
inline constexpr double family_alpha = 0.01;

CompareSummary summarise(const Comparison& comparison);

}  // namespace clume
