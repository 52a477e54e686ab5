// SPDX-License-Identifier: MIT
// One good scene as text, ways to change a piece of it, and the message that reading the result gives.
// For the tests of the scene reader; positions in messages are those of the changed text.
#pragma once

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "src/error.h"
#include "src/scene_reader.h"

namespace clume::test {

inline const std::string good = R"({
  "camera": { "origin": [0, 0, -4], "target": [0, 0, 0] },
  "film": { "width": 32, "height": 16 },
  "render": { "spp": 8 },
  "media": [
    { "type": "ellipsoids", "kernel": "gaussian",
      "primitives": [ { "center": [1, 2, 3], "scale": [1, 2, 4], "density": 2 } ] }
  ],
  "lights": [ { "type": "constant", "radiance": 1 } ]
}
)";

inline std::string changed(const std::string& from, const std::string& to, std::string text = good) {
    REQUIRE(text.find(from) != std::string::npos);
    return text.replace(text.find(from), from.size(), to);
}

inline Scene parse(const std::string& text, const std::vector<Override>& overrides = {}) {
    return parse_scene(text, "s.json", overrides);
}

inline std::string scene_error(const std::string& text, const std::vector<Override>& overrides = {}) {
    try {
        parse(text, overrides);
    } catch (const SceneError& error) {
        CHECK(std::string(error.what()).find('\n') == std::string::npos);
        return error.what();
    }
    return "no SceneError";
}

inline std::string usage_error(const std::string& key, const std::string& value) {
    try {
        parse(good, {{key, value}});
    } catch (const UsageError& error) {
        CHECK(std::string(error.what()).starts_with("-D " + key + "=" + value + ": "));
        return error.what();
    }
    return "no UsageError";
}

/// A scene error whose text begins and ends as told.
inline void check_error(const std::string& from, const std::string& to, const std::string& begin,
                        const std::string& part = "") {
    const std::string message = scene_error(changed(from, to));
    INFO(message);
    INFO(to);
    CHECK(message.starts_with(begin));
    CHECK(message.find(part) != std::string::npos);
}

inline const std::string camera = R"("origin": [0, 0, -4], "target": [0, 0, 0])",
                         light = R"({ "type": "constant", "radiance": 1 })",
                         primitive = R"({ "center": [1, 2, 3], "scale": [1, 2, 4], "density": 2 })",
                         kernel = R"("kernel": "gaussian",)";

inline Scene with_light(const std::string& text) { return parse(changed(light, text)); }
inline Primitive with_primitive(const std::string& text, const std::string& medium_keys = "") {
    return parse(changed(primitive, text, changed(kernel, kernel + medium_keys))).media.at(0).primitives.at(0);
}

}  // namespace clume::test
