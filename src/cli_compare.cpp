// SPDX-License-Identifier: MIT
// The arguments of `compare`: lists of pairs and of sample counts, and what goes with what.
#include <algorithm>
#include <charconv>
#include <cmath>

#include "src/cli.h"
#include "src/compare_runner.h"
#include "src/error.h"

namespace clume {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts{""};
    for (const char c : text) {
        if (c == separator) parts.emplace_back();
        else parts.back() += c;
    }
    return parts;
}

[[noreturn]] void unknown(const std::string& where, const char* kind, const std::string& word, const std::vector<std::string>& names) {
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
    throw UsageError(where + "unknown " + kind + " '" + word + "'; the nearest is '" + nearest_flag(word, names) + "' of " + all);
}

template <class Table>
std::vector<std::string> names_of(const Table& table) {
    std::vector<std::string> names;
    for (const Method& m : table) names.emplace_back(m.name);
    return names;
}

MethodPair parse_pair(const std::string& list, const std::string& text) {
    const std::string where = "--strategies " + list + ": ";
    const std::vector<std::string> halves = split(text, '/'), first = split(halves[0], ':');
    if (text.empty() || halves.size() > 2 || first.size() > 2 || (halves.size() == 2 && halves[1].empty()))
        throw UsageError(where + "'" + text + "' must be strategy, strategy/estimator or strategy:bound/estimator, such as delta/ratio");
    MethodPair pair;
    pair.strategy = first[0];
    const Method* strategy = find_strategy(pair.strategy);
    if (!strategy) unknown(where, "strategy", pair.strategy, names_of(strategies()));
    const Method* estimator = nullptr;
    if (halves.size() == 2) {
        pair.estimator = halves[1];
        estimator = find_estimator(pair.estimator);
        if (!estimator) unknown(where, "estimator", pair.estimator, names_of(estimators()));
    }
    if (first.size() == 2) {
        pair.bound = first[1];
        const std::vector<std::string> names{bounds().begin(), bounds().end()};
        if (std::find(names.begin(), names.end(), pair.bound) == names.end()) unknown(where, "bound", pair.bound, names);
        if (!strategy->null_collisions && !(estimator && estimator->null_collisions))
            throw UsageError(where + "'" + text + "' has no null collisions, so a bound makes no difference to it");
    }
    return pair;
}

std::vector<std::uint32_t> parse_counts(const std::string& text) {
    std::vector<std::uint32_t> counts;
    for (const std::string& word : split(text, ',')) {
        std::uint32_t n = 0;
        const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), n);
        if (error != std::errc() || stop != word.data() + word.size() || n == 0 || (!counts.empty() && n <= counts.back()))
            throw UsageError("--spp " + text + ": must be a number from 1, or several that rise, such as 4,16,64");
        counts.push_back(n);
    }
    return counts.size() == 1 ? doubling_counts(counts.front()) : counts;
}

}  // namespace

CompareCommand check_compare(const CompareTexts& texts) {
    if (texts.scene.empty()) throw UsageError("compare: which scene? Such as: clume compare scenes/plume.json");
    CompareCommand command;
    command.scene = texts.scene;
    command.folder = texts.output.empty() ? command.scene.stem().string() + "_compare" : texts.output;
    command.quiet = texts.quiet;
    CompareOptions& options = command.options;
    if (!texts.strategies.empty())
        for (const std::string& word : split(texts.strategies, ',')) options.pairs.push_back(parse_pair(texts.strategies, word));
    if (texts.time_s && !texts.spp.empty()) throw UsageError("--time and --spp: either equal time or equal sample counts");
    if (texts.time_s && !(*texts.time_s > 0 && std::isfinite(*texts.time_s))) throw UsageError("--time: must be a positive number of seconds");
    options.time_s = texts.time_s;
    if (!texts.spp.empty()) options.spp = parse_counts(texts.spp);
    if (texts.seeds && (*texts.seeds < 2 || *texts.seeds > 100000)) throw UsageError("--seeds: must be at least 2 (intervals need it), at most 100000");
    options.seeds = static_cast<std::uint32_t>(texts.seeds.value_or(8));
    if (!texts.reference.empty()) options.reference = texts.reference;
    options.render.devices = texts.devices;
    return command;
}

}  // namespace clume
