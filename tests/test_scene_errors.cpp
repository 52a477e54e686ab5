// SPDX-License-Identifier: MIT
// What is wrong in a scene and what is said about it: the message for every kind of mistake, with its place.
// Each case replaces a piece of one good scene's text.
#include <catch2/catch.hpp>
#include <string>

#include "src/error.h"
#include "src/scene_reader.h"
#include "tests/scene_text.h"
#include "tests/temp_folder.h"

using namespace clume;
using namespace clume::test;

TEST_CASE("Scene.BadOverridesAreUsageErrors", "[quick]") {
    const auto check = [](const std::string& key, const std::string& value, const std::string& part) {
        const std::string message = usage_error(key, value);
        INFO(message);
        CHECK(message.find(part) != std::string::npos);
    };
    check("render.sp", "1", "did you mean \"spp\"?");
    check("rendr.spp", "1", "did you mean \"render\"?");
    check("render.spp", "0", "must be in [1,4294967295]");
    check("render.spp", "many", "must be an integer, not a string \"many\"");
    check("render.spp", "NaN", "must be an integer");
    check("render.spp.x", "1", "it has no \"x\"");
    check("render.strategy", "delt", "did you mean \"delta\"?");
    check("camera.origin", "[0,0", "broken JSON");
    check("camera.origin", "[0,0]", "must be a list of 3 numbers");
    check("media.x.albedo", "1", "expected an index");
    check("media.7.albedo", "1", "has 1 items, no item 7");
    check("media.0.albedo", "2", "must be in [0,1]");
    check("media..albedo", "2", "not a dotted path");
    check("", "2", "not a dotted path");
    check("lights.1.type", "point", "missing key \"position\"");
}

TEST_CASE("Scene.UnknownAndDuplicateKeys", "[quick]") {
    check_error("\"film\"", "\"flim\"", "s.json:3:3: unknown key \"flim\" in scene; did you mean \"film\"?");
    check_error("\"origin\"", "\"orgin\"",
                "s.json:2:15: unknown key \"orgin\" in camera of type \"perspective\"; did you mean \"origin\"?");
    check_error("\"spp\"", "\"quality\"", "s.json:4:15: unknown key \"quality\" in render", "known: spp, seed");
    check_error("\"spp\"", "\"samples\"", "s.json:4:15: unknown key \"samples\" in render; did you mean \"sampler\"?");
    check_error("\"density\"", "\"denisty\"", "s.json:7:66: unknown key \"denisty\" in primitive; did you mean \"density\"?");
    check_error("\"height\"", "\"width\"", "s.json:3:26: duplicate key \"width\"");
    check_error(camera, camera + R"(, "width": 2)",
                "s.json:2:58: key \"width\" does not belong to camera of type \"perspective\"");
    check_error("\"spp\": 8", "\"spp\": 8,", "s.json:4:25: expected a key in double quotes");
}

TEST_CASE("Scene.TypesAndRanges", "[quick]") {
    check_error("[0, 0, -4]", "[0, 0]", "s.json:2:25: \"origin\" must be a list of 3 numbers, not a list of 2");
    check_error("[0, 0, -4]", "7", "s.json:2:25: \"origin\" must be a list of 3 numbers, not a number");
    check_error("\"width\": 32", "\"width\": \"32\"", "s.json:3:22: \"width\" must be an integer, not a string \"32\"");
    check_error("\"width\": 32", "\"width\": 32.5", "s.json:3:22: \"width\" must be an integer, not 32.5");
    check_error("\"width\": 32", "\"width\": 0", "s.json:3:22: \"width\" must be in [1,65536], not 0");
    check_error("\"width\": 32", "\"width\": null", "s.json:3:22: \"width\" must be an integer, not null");
    check_error("\"spp\": 8", "\"spp\": 4294967296", "s.json:4:22: ");
    check_error("\"spp\": 8", "\"seed\": -1", "s.json:4:23: ");
    check_error("\"spp\": 8", "\"max_depth\": -2", "s.json:4:28: ");
    check_error("\"spp\": 8", "\"step\": 0", "s.json:4:23: \"step\" must be in (0,inf), not 0");
    check_error("\"spp\": 8", "\"strategy\": \"dleta\"", "s.json:4:27: unknown strategy \"dleta\"", "did you mean \"delta\"?");
    check_error("\"spp\": 8", "\"transmittance\": \"tracking\"",
                "s.json:4:32: unknown transmittance \"tracking\"; known: auto, analytic, march, ratio, residual-ratio, binary");
    check_error("\"radiance\": 1", "\"radiance\": -1", "s.json:9:49: \"radiance\" must be in [0,inf), not -1");
    check_error("\"radiance\": 1", "\"radiance\": [1, 1e999, 1]", "s.json:9:53: number too large");
    check_error("\"radiance\": 1", "\"radiance\": [1, 2]", "s.json:9:49: ");
    check_error("\"radiance\": 1", "\"radiance\": 1, \"visible_to_camera\": 1",
                "s.json:9:73: \"visible_to_camera\" must be true or false");
    check_error("\"radiance\": 1", "\"radiance\": NaN", "s.json:9:49: not a JSON value");
    check_error(", \"radiance\": 1", "", "s.json:9:15: missing key \"radiance\" in lights");
    check_error("\"type\": \"constant\", ", "", "s.json:9:15: missing key \"type\" in lights");
    check_error("\"constant\"", "\"constnt\"", "s.json:9:25: unknown type \"constnt\"", "did you mean \"constant\"?");
    check_error(light, "1", "s.json:9:15: lights must be a section");
    check_error(camera, "\"origin\": [0, 0, -4]", "s.json:2:13: missing key \"target\" in camera");
    CHECK(scene_error("[]") == "s.json:1:1: scene must be a section in braces, not a list");
    CHECK(scene_error("{}") == "s.json:1:1: missing key \"camera\" in scene");
    CHECK(scene_error(std::string(200000, '[')).starts_with("s.json:1:65: brackets nested deeper"));
}

TEST_CASE("Scene.CameraAndFilmChecks", "[quick]") {
    check_error("[0, 0, -4]", "[0, 0, 0]", "s.json:2:46: the camera's target must not be its origin");
    check_error("[0, 0, -4]", "[0, 0, -1e200]", "s.json:2:51: the camera's target is too far from its origin");
    check_error(camera, camera + ", \"up\": [0, 0, -2]", "s.json:2:64: \"up\" is parallel");
    check_error(camera, camera + ", \"up\": [0, 0, 0]", "s.json:2:64: \"up\" must not be zero");
    check_error(camera, camera + ", \"fov\": 180", "s.json:2:65: \"fov\" must be in (0,180)");
    check_error(camera, camera + ", \"fov\": 0", "s.json:2:65: ");
    check_error(camera, camera + ", \"type\": \"orthographic\"", "s.json:2:13: missing key \"width\"");
    check_error("\"width\": 32, \"height\": 16", "\"width\": 65536, \"height\": 65536",
                "s.json:3:22: a film of 65536 x 65536 needs 1099.5 GB of memory; this machine has ");
}

TEST_CASE("Scene.LightChecks", "[quick]") {
    const auto check = [](const std::string& text, const std::string& part) {
        INFO(text);
        const std::string message = scene_error(changed(light, text));
        INFO(message);
        CHECK(message.starts_with("s.json:9:"));
        CHECK(message.find(part) != std::string::npos);
    };
    check(R"({"type":"spot","position":[1,2,3],"target":[1,2,3],"intensity":4})", "must not be its position");
    check(R"({"type":"spot","position":[1,2,3],"target":[0,0,0],"intensity":4,"beam":30})", "at most \"cutoff\"");
    check(R"({"type":"spot","position":[1,2,3],"target":[0,0,0],"intensity":4,"cutoff":180})", "must be in (0,180)");
    check(R"({"type":"spot","position":[1,2,3],"target":[0,0,0],"intensity":4,"cutoff":0})", "must be in (0,180)");
    check(R"({"type":"directional","direction":[0,0,0],"irradiance":3})", "must not be zero");
    check(R"({"type":"sphere","center":[1,0,0],"radius":0,"radiance":1})", "must be in (0,inf)");
    check(R"({"type":"rectangle","corner":[0,1,0],"edge_u":[1,0,0],"edge_v":[-2,0,0],"radiance":3})", "are parallel");
    check(R"({"type":"rectangle","corner":[0,1,0],"edge_u":[0,0,0],"edge_v":[-2,0,0],"radiance":3})",
          "\"edge_u\" must not be zero");
    check(R"({"type":"envmap","file":"none.exr"})", "no such file");
    for (const char* text : {R"({"type":"point","position":[1,2,3],"intensity":4})",
                             R"({"type":"spot","position":[1,2,3],"target":[0,0,0],"intensity":4})",
                             R"({"type":"directional","direction":[0,1,0],"irradiance":3})"})
        CHECK(scene_error(changed(light, text, changed("\"spp\": 8", "\"light_sampling\": \"phase\"")))
                  .starts_with("s.json:4:33: \"light_sampling\" phase cannot find"));
    CHECK_NOTHROW(parse(changed("\"spp\": 8", "\"light_sampling\": \"phase\"")));
}

TEST_CASE("Scene.MediaChecks", "[quick]") {
    const auto check = [](const std::string& text, const std::string& part) {
        INFO(text);
        const std::string message = scene_error(changed(primitive, text));
        INFO(message);
        CHECK(message.starts_with("s.json:7:"));
        CHECK(message.find(part) != std::string::npos);
    };
    check(R"({"center":[0,0,0],"scale":1,"density":1,"rotation":[0,0,0,0]})", "primitive 0: zero quaternion");
    check(primitive + R"(,{"center":[0,0,0],"covariance":[1,0,0,-1,0,1],"density":1})",
          "primitive 1: the covariance is not positive definite");
    check(R"({"center":[0,0,0],"covariance":[1,1,0,1,0,1],"density":1})", "not positive definite");
    check(R"({"center":[0,0,0],"covariance":[1,2,0,1,0,1],"density":1})", "not positive definite");
    check(R"({"center":[0,0,0],"covariance":[1,0,1,1,0,1],"density":1})", "not positive definite");
    check(R"({"center":[0,0,0],"covariance":[0,0,0,1,0,1],"density":1})", "not positive definite");
    check(R"({"center":[0,0,0],"covariance":[1,0,0,1,0],"density":1})", "must be a list of 6 numbers");
    check(R"({"center":[0,0,0],"covariance":[1,0,0,1,0,1],"scale":1,"density":1})", "exclude each other");
    check(R"({"center":[0,0,0],"density":1})", "missing key \"scale\" or \"covariance\"");
    check(R"({"center":[0,0,0],"scale":[1,0,1],"density":1})", "must be in (0,inf)");
    check(R"({"center":[0,0,0],"scale":1,"density":-1})", "must be in [0,inf)");
    check(R"({"center":[0,0,0],"scale":1,"density":1,"albedo":1.01})", "must be in [0,1]");
    check(R"({"center":[0,0,0],"scale":1,"density":1,"g":1})", "must be in (-1,1)");

    const auto medium = [](const std::string& keys, const std::string& begin) { check_error(kernel, kernel + keys, begin); };
    medium(R"("transform": {"scale": [1, 0, 1]},)", "s.json:6:73: \"scale\" of a transform must not be 0");
    medium(R"("transform": {"rotate": {"axis": [0, 0, 0], "angle": 3}},)", "s.json:6:83: \"axis\" must not be zero");
    medium(R"("transform": {"matrix": [[1,0,0,0],[0,1,0,0],[1,1,0,0],[0,0,0,1]]},)", "s.json:6:74: \"matrix\" is singular");
    medium(R"("transform": {"matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,2]]},)", "s.json:6:112: the last row");
    medium(R"("transform": {"matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]},)", "s.json:6:74: \"matrix\" must be four rows");
    medium(R"("transform": {"matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], "scale": 2},)",
           "s.json:6:126: \"scale\" and \"matrix\" exclude");
    medium(R"("phase": {"type": "henyey-greenstein"},)", "s.json:6:59: missing key \"g\" in phase");
    medium(R"("phase": {"type": "henyey-greenstein", "g": 1},)", "s.json:6:94: \"g\" must be in (-1,1)");
    medium(R"("phase": {"type": "mie"},)", "s.json:6:68: unknown type \"mie\"; known: isotropic, henyey-greenstein, rayleigh");
    medium(R"("extent": 0,)", "s.json:6:60: \"extent\" must be in [1e-15,1e15]");
    medium(R"("file": "a.ply",)", "s.json:7:21: \"file\" and \"primitives\" exclude");
    medium(R"("scale_encoding": "log",)", "s.json:6:68: \"scale_encoding\" speaks about a file");
    check_error("\"gaussian\"", "\"gausian\"", "s.json:6:39: unknown kernel \"gausian\"", "did you mean \"gaussian\"?");
    check_error("\"primitives\": [ " + primitive + " ]", "\"file\": \"none.ply\"", "s.json:7:15: no such file: \"none.ply\"");
    check_error("\"ellipsoids\"", "\"grid\"", "s.json:6:23: key \"kernel\" does not belong to media of type \"grid\"");
    check_error("\"ellipsoids\"", "\"elipsoids\"", "s.json:6:15: unknown type \"elipsoids\"", "did you mean \"ellipsoids\"?");
    const std::string rayleigh = changed(kernel, kernel + R"("phase": {"type": "rayleigh"},)");
    CHECK(scene_error(changed("\"density\": 2", "\"density\": 2, \"g\": 0", rayleigh))
              .find("primitive 0: its own \"g\" has no meaning in a Rayleigh medium") != std::string::npos);
}

TEST_CASE("Scene.NothingToSeeIsAnError", "[quick]") {
    const std::string dark = changed(" " + light + " ", "");
    CHECK(scene_error(dark).starts_with("s.json:9:13: no light, no emission and no opaque surface"));
    const auto emitting = [&](const std::string& albedo) {
        return changed("\"density\": 2", "\"density\": 2, \"emission\": 1, \"albedo\": " + albedo, dark);
    };
    CHECK_NOTHROW(parse(emitting("0.5")));
    CHECK(scene_error(emitting("1")).find("no emission") != std::string::npos);
    CHECK_NOTHROW(with_light(R"({"type":"sphere","center":[1,0,0],"radius":1,"radiance":0})"));
}

TEST_CASE("Scene.MissingFileAndCutPly", "[quick]") {
    const TempFolder folder;
    CHECK_THROWS_AS(read_scene(folder.path() / "none.json"), SceneError);
    CHECK_THROWS_AS(read_scene(folder.path()), SceneError);
    folder.write("a.ply", "ply\nformat ascii 1.0\n");
    const auto file = folder.write("s.json", changed("\"primitives\": [ " + primitive + " ]", "\"file\": \"a.ply\""));
    CHECK_THROWS_WITH(read_scene(file), (folder.path() / "a.ply").string() + ":2: the header has no end_header");
}
