// SPDX-License-Identifier: MIT
#include "src/strategies.h"

#include <algorithm>
#include <array>

#include "kernels/layout.h"

namespace clume {
namespace {

using B = BiasKind;

// Name, program, in grids, kind, null collisions, about; the most useful first: references are made with the first two unbiased.
constexpr std::array strategy_table{
    Method{"delta", STRATEGY_DELTA, STRATEGY_DELTA, B::unbiased, true, "null collisions under a bound of the extinction"},
    Method{"decomposition", STRATEGY_DECOMPOSITION, STRATEGY_REGULAR, B::unbiased, false, "each primitive draws its own collision, the nearest wins"},
    Method{"regular", STRATEGY_REGULAR, STRATEGY_REGULAR, B::unbiased, false, "walks the segments between entries and exits, inverts the last one"},
    Method{"progressive", STRATEGY_PROGRESSIVE, STRATEGY_PROGRESSIVE, B::consistent, false, "null collisions under a bound that is learned"},
    Method{"regular-linear", STRATEGY_REGULAR_LINEAR, STRATEGY_REGULAR, B::biased, false, "as regular, the last segment taken as homogeneous"},
    Method{"march-analytic", STRATEGY_MARCH_ANALYTIC, STRATEGY_REGULAR, B::biased, false, "fixed steps, exact depth of each, collisions spread evenly inside one"},
    Method{"march", STRATEGY_MARCH, STRATEGY_MARCH, B::biased, false, "fixed steps, extinction constant inside one"},
};

constexpr std::array estimator_table{
    Method{"analytic", TRANSMITTANCE_ANALYTIC, TRANSMITTANCE_ANALYTIC, B::unbiased, false, "exact: exp of minus the summed optical depths"},
    Method{"ratio", TRANSMITTANCE_RATIO, TRANSMITTANCE_RATIO, B::unbiased, true, "product of the null collisions' shares"},
    Method{"residual-ratio", TRANSMITTANCE_RESIDUAL_RATIO, TRANSMITTANCE_RESIDUAL_RATIO, B::unbiased, true, "as ratio, over what a control extinction leaves"},
    Method{"binary", TRANSMITTANCE_BINARY, TRANSMITTANCE_BINARY, B::unbiased, false, "a flight that either reaches the light or does not"},
    Method{"march", TRANSMITTANCE_MARCH, TRANSMITTANCE_MARCH, B::biased, false, "fixed steps, extinction constant inside one"},
};

constexpr std::array bound_table{"scene", "grid", "tree"};

template <class Table>
const Method* find(const Table& table, std::string_view name) {
    const auto found = std::find_if(table.begin(), table.end(), [&](const Method& m) { return name == m.name; });
    return found == table.end() ? nullptr : &*found;
}

}  // namespace

const char* name_of(BiasKind kind) {
    return kind == B::unbiased ? "unbiased" : kind == B::consistent ? "consistent" : "biased";
}

std::span<const Method> strategies() { return strategy_table; }
std::span<const Method> estimators() { return estimator_table; }
std::span<const char* const> bounds() { return bound_table; }
const Method* find_strategy(std::string_view name) { return find(strategy_table, name); }
const Method* find_estimator(std::string_view name) { return find(estimator_table, name); }

bool differs(const Method& method, const Scene& scene) {
    const bool mixtures = std::any_of(scene.media.begin(), scene.media.end(), [](const auto& m) { return !m.primitives.empty(); });
    return mixtures || scene.grids.empty() || method.in_grids == method.program;
}

std::string MethodPair::label() const { return strategy + (bound == "auto" ? "" : ":" + bound) + "/" + estimator; }

std::string MethodPair::file_name() const {
    std::string name = label();
    std::replace(name.begin(), name.end(), ':', '-');
    std::replace(name.begin(), name.end(), '/', '_');
    return name;
}

BiasKind MethodPair::kind(bool estimator_matters) const {
    const Method *s = find_strategy(strategy), *e = find_estimator(estimator);
    const BiasKind own = s ? s->kind : B::biased;
    return estimator_matters && e ? std::max(own, e->kind) : own;
}

std::vector<MethodPair> pairs_of(const std::string& strategy, const std::string& bound, bool estimator_matters) {
    std::vector<MethodPair> pairs;
    for (const Method& e : estimator_table) {
        pairs.push_back({strategy, e.name, bound});
        if (!estimator_matters) break;
    }
    return pairs;
}

std::vector<MethodPair> all_pairs(const Scene& scene, bool estimator_matters) {
    std::vector<MethodPair> pairs;
    for (const Method& s : strategy_table)
        if (differs(s, scene))
            for (const MethodPair& p : pairs_of(s.name, "auto", estimator_matters)) pairs.push_back(p);
    return pairs;
}

}  // namespace clume
