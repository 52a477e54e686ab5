// SPDX-License-Identifier: MIT
// The one table of distance sampling strategies and transmittance estimators: what each is called and is to a program, whether
// it is biased, and what it makes of voxel media. Everything that lists, chooses or describes them reads it here.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "src/scene.h"

namespace clume {

enum class BiasKind { unbiased, consistent, biased };  ///< in the order of trust: a pair is what its worse half is

/// "unbiased", "consistent" or "biased".
const char* name_of(BiasKind kind);

struct Method {
    const char* name;
    int program;            ///< STRATEGY_* or TRANSMITTANCE_* of kernels/layout.h
    int in_grids;           ///< by which of them it goes through voxel media
    BiasKind kind;
    bool null_collisions;   ///< needs a bound of the extinction (render.bound)
    const char* about;
};

std::span<const Method> strategies();
std::span<const Method> estimators();
/// What `render.bound` can be beside auto.
std::span<const char* const> bounds();

/// nullptr if there is none of that name.
const Method* find_strategy(std::string_view name);
const Method* find_estimator(std::string_view name);

/// Whether it is a method of its own in the scene: with voxel media alone, one that goes through them as another does is that
/// other one. Any method can handle any scene.
bool differs(const Method& method, const Scene& scene);

/// A strategy and an estimator that are run together, and the bound of null collisions that they use.
struct MethodPair {
    std::string strategy, estimator;
    std::string bound = "auto";

    /// "delta/ratio", "delta:scene/ratio" unless the bound is auto: as typed after --strategies.
    std::string label() const;
    /// The label as a file name.
    std::string file_name() const;
    /// `estimator_matters`: some light is sampled directly.
    BiasKind kind(bool estimator_matters) const;
    bool operator==(const MethodPair&) const = default;
};

/// The strategy with every estimator, or with the first alone if an estimator does not matter.
std::vector<MethodPair> pairs_of(const std::string& strategy, const std::string& bound, bool estimator_matters);
/// The same for every strategy that is one of its own in the scene.
std::vector<MethodPair> all_pairs(const Scene& scene, bool estimator_matters);

}  // namespace clume
