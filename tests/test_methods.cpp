// SPDX-License-Identifier: MIT
// The table of strategies and estimators (src/strategies): the scene file knows the same names, and what is left out of the
// methods of a scene is what another one of them does there, bit for bit.
#include <set>
#include <sstream>

#include "src/scene_schema.h"
#include "src/strategies.h"
#include "tests/device_image.h"
#include "tests/pairs.h"

using namespace clume;
using namespace clume::test;

namespace {

std::set<std::string> choices_of(std::string_view name) {
    std::set<std::string> choices;
    for (const KeySpec& key : scene_schema())
        if (key.section == "render" && key.name == name) {
            std::istringstream words{std::string(key.choices)};
            for (std::string word; words >> word;) choices.insert(word);
        }
    return choices;
}

template <class Table>
std::set<std::string> names_of(const Table& table) {
    std::set<std::string> names{"auto"};
    for (const Method& m : table) names.insert(m.name);
    return names;
}

Scene grid_scene() {
    Scene scene = mixed_grid_scene();
    scene.media.clear();
    scene.lights = {sunlight()};
    return scene;
}

}  // namespace

TEST_CASE("Methods.SceneFilesKnowTheSame", "[quick]") {
    CHECK(choices_of("strategy") == names_of(strategies()));
    CHECK(choices_of("transmittance") == names_of(estimators()));
    const std::set<std::string> bound_choices = choices_of("bound");
    CHECK(bound_choices.size() == bounds().size() + 1);
    for (const char* bound : bounds()) CHECK(bound_choices.count(bound) == 1);
}

TEST_CASE("Methods.AllOfThemGoWithEveryMixture", "[quick]") {
    for (const Scene& scene : {mixed_scene(), mixed_grid_scene()}) {
        CHECK(all_pairs(scene, true).size() == strategies().size() * estimators().size());
        CHECK(all_pairs(scene, false).size() == strategies().size());
    }
    CHECK(pairs_of("decomposition", "auto", true).size() == estimators().size());
    CHECK(pairs_of("delta", "scene", false) == std::vector<MethodPair>{{"delta", "analytic", "scene"}});
}

TEST_CASE("Methods.WhatGridsAloneLeaveOutIsRegular") {
    const Scene scene = grid_scene();
    std::set<std::string> left_out;
    for (const Method& m : strategies())
        if (!differs(m, scene)) left_out.insert(m.name);
    CHECK(left_out == std::set<std::string>{"decomposition", "regular-linear", "march-analytic"});
    CHECK(all_pairs(scene, false).size() == strategies().size() - left_out.size());
    const DeviceImage regular = render_device(scene, make_device_scene(with_pair(scene, {"regular", "analytic"}), {}), 8);
    // One stands for all: the program is told the same of grids.
    for (const std::string& name : left_out) {
        const DeviceScene device = make_device_scene(with_pair(scene, {name, "analytic"}), {});
        CHECK(define_of(device, "CLUME_GRID_STRATEGY") == std::to_string(find_strategy("regular")->program));
        if (name == "decomposition") CHECK(render_device(scene, device, 8).same_bits(regular));
    }
    CHECK(std::any_of(regular.values.begin(), regular.values.end(), [](const auto& pixel) { return pixel.mean[0] > 0; }));
}
