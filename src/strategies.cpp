// SPDX-License-Identifier: MIT
#include "src/strategies.h"

#include <algorithm>
#include <array>

namespace clume {
namespace {

using B = BiasKind;

// name, kind, mixtures, grids, null collisions, about; the most useful first: references are made with the first two unbiased
constexpr std::array strategy_table{
    Method{"delta", B::unbiased, true, true, true, "null collisions under a bound of the extinction"},
    Method{"decomposition", B::unbiased, true, false, false, "each primitive draws its own collision, the nearest wins"},
    Method{"regular", B::unbiased, true, true, false, "walks the segments between entries and exits, inverts the last one"},
    Method{"progressive", B::consistent, true, true, false, "null collisions under a bound that is learned"},
    Method{"regular-linear", B::biased, true, false, false, "as regular, the last segment taken as homogeneous"},
    Method{"march-analytic", B::biased, true, false, false, "fixed steps, exact depth of each, collisions spread evenly inside one"},
    Method{"march", B::biased, true, true, false, "fixed steps, extinction constant inside one"},
};

constexpr std::array estimator_table{
    Method{"analytic", B::unbiased, true, true, false, "exact: exp of minus the summed optical depths"},
    Method{"ratio", B::unbiased, true, true, true, "product of the null collisions' shares"},
    Method{"residual-ratio", B::unbiased, true, true, true, "as ratio, over what a control extinction leaves"},
    Method{"binary", B::unbiased, true, true, false, "a flight that either reaches the light or does not"},
    Method{"march", B::biased, true, true, false, "fixed steps, extinction constant inside one"},
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

bool fits(const Method& method, const Scene& scene) {
    const bool mixtures = std::any_of(scene.media.begin(), scene.media.end(), [](const auto& m) { return !m.primitives.empty(); });
    return (method.mixtures || !mixtures) && (method.grids || scene.grids.empty());
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

std::vector<MethodPair> all_pairs(const Scene& scene, bool estimator_matters) {
    std::vector<MethodPair> pairs;
    for (const Method& s : strategy_table) {
        if (!fits(s, scene)) continue;
        for (const Method& e : estimator_table) {
            if (!fits(e, scene)) continue;
            pairs.push_back({s.name, e.name});
            if (!estimator_matters) break;
        }
    }
    return pairs;
}

Scene with_pair(Scene scene, const MethodPair& pair) {
    scene.render.strategy = pair.strategy;
    scene.render.transmittance = pair.estimator;
    scene.render.bound = pair.bound;
    return scene;
}

}  // namespace clume
