// SPDX-License-Identifier: MIT
// The scene reader: every section's meaning, every form and override, and the page that documents them.
// Scenes are made from one good scene by replacing a piece of its text.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "src/error.h"
#include "src/scene_reader.h"
#include "src/scene_schema.h"
#include "tests/scene_text.h"
#include "tests/temp_folder.h"

using namespace clume;
using namespace clume::test;

namespace {

constexpr double pi = std::numbers::pi;

double distance(const glm::dmat3& a, const glm::dmat3& b) {
    return glm::length(a[0] - b[0]) + glm::length(a[1] - b[1]) + glm::length(a[2] - b[2]);
}

}  // namespace

TEST_CASE("Scene.DefaultsHold", "[quick]") {
    const Scene s =
        parse(R"({"camera": {"origin": [0,0,1], "target": [0,0,0]}, "lights": [{"type":"constant","radiance":[1,2,3]}]})");
    const Scene model;
    CHECK(s.path == "s.json");
    CHECK(s.camera.kind == CameraKind::perspective);
    CHECK(s.camera.up == model.camera.up);
    CHECK(s.camera.fov_rad == Approx(model.camera.fov_rad));
    CHECK(s.film.width == model.film.width);
    CHECK(s.film.height == model.film.height);
    CHECK(s.render.spp == model.render.spp);
    CHECK(s.render.seed == model.render.seed);
    CHECK(s.render.max_depth == model.render.max_depth);
    CHECK(s.render.rr_depth == model.render.rr_depth);
    CHECK(s.render.strategy == model.render.strategy);
    CHECK(s.render.transmittance == model.render.transmittance);
    CHECK(s.render.light_sampling == model.render.light_sampling);
    CHECK_FALSE(s.render.step);
    CHECK(s.media.empty());
    REQUIRE(s.lights.size() == 1);
    CHECK(s.lights[0].radiance == glm::dvec3(1, 2, 3));
    CHECK_FALSE(s.lights[0].visible_to_camera);
    const Scene list = parse(good);
    CHECK(list.media[0].extent == 3);
    CHECK(list.media[0].source == "scene");
    CHECK(list.media[0].primitives[0].albedo == glm::dvec3(0.9));
    CHECK(list.media[0].primitives[0].emission == glm::dvec3(0));
    CHECK_FALSE(list.media[0].primitives[0].has_g);
    CHECK(parse(changed("gaussian", "epanechnikov")).media[0].extent == Approx(std::sqrt(7.0)));
    CHECK(parse(changed("gaussian", "uniform")).media[0].extent == Approx(std::sqrt(5.0)));
}

TEST_CASE("Scene.CameraAndRender", "[quick]") {
    const Scene s = parse(changed(
        camera, camera + R"(, "type": "orthographic", "width": 3, "up": [1, 1, 0])",
        changed(
            "\"spp\": 8",
            R"("spp": 4294967295, "seed": 9007199254740993, "max_depth": 1, "rr_depth": 0, "strategy": "march", "transmittance": "analytic", "light_sampling": "nee", "step": 0.5)")));
    CHECK(s.camera.kind == CameraKind::orthographic);
    CHECK(s.camera.width == 3);
    CHECK(s.camera.up == glm::dvec3(1, 1, 0));
    CHECK(s.render.spp == 4294967295u);
    CHECK(s.render.seed == 9007199254740993u);
    CHECK(s.render.max_depth == 1);
    CHECK(s.render.rr_depth == 0);
    CHECK(s.render.strategy == "march");
    CHECK(s.render.light_sampling == LightSampling::nee);
    CHECK(s.render.step == 0.5);
    CHECK(parse(good, {{"render.seed", "9223372036854775807"}}).render.seed == 9223372036854775807u);
}

TEST_CASE("Scene.EveryLight", "[quick]") {
    CHECK(with_light(R"({"type":"constant","radiance":2,"visible_to_camera":true})").lights[0].visible_to_camera);
    Light l = with_light(R"({"type":"point","position":[1,2,3],"intensity":[4,5,6]})").lights[0];
    CHECK(l.kind == LightKind::point);
    CHECK(l.position == glm::dvec3(1, 2, 3));
    CHECK(l.intensity == glm::dvec3(4, 5, 6));
    l = with_light(R"({"type":"spot","position":[1,2,3],"target":[0,0,0],"intensity":4})").lights[0];
    CHECK(l.kind == LightKind::spot);
    CHECK(l.beam_rad == Approx(pi / 12));
    CHECK(l.cutoff_rad == Approx(pi / 9));
    l = with_light(R"({"type":"directional","direction":[0,-1,0],"irradiance":3})").lights[0];
    CHECK(l.direction == glm::dvec3(0, -1, 0));
    CHECK(l.irradiance == glm::dvec3(3));
    l = with_light(R"({"type":"sphere","center":[1,0,0],"radius":2,"radiance":0})").lights[0];
    CHECK(l.kind == LightKind::sphere);
    CHECK(l.radius == 2);
    l = with_light(R"({"type":"rectangle","corner":[0,1,0],"edge_u":[1,0,0],"edge_v":[0,0,2],"radiance":3})").lights[0];
    CHECK(l.edge_v == glm::dvec3(0, 0, 2));
    const TempFolder folder;
    std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n";
    hdr += {static_cast<char>(128), 0, 0, static_cast<char>(129)};
    folder.write("sky.hdr", hdr);
    const Scene s =
        parse_scene(changed(light, R"({"type":"envmap","file":"sky.hdr","scale":2,"rotate_y":90})"), folder.path() / "s.json");
    CHECK(s.lights[0].image.rgb == std::vector<float>{1, 0, 0});
    CHECK(s.lights[0].scale == 2);
    CHECK(s.lights[0].rotate_y_rad == Approx(pi / 2));
}

TEST_CASE("Scene.PrimitiveForms", "[quick]") {
    Primitive p = with_primitive(primitive);
    CHECK(p.center == glm::dvec3(1, 2, 3));
    CHECK(distance(p.axes, glm::dmat3(1, 0, 0, 0, 2, 0, 0, 0, 4)) < 1e-15);
    CHECK(p.sigma_t == 2);
    // a quarter turn about z, not normalised, takes the first axis to +y
    p = with_primitive(
        R"({"center":[0,0,0],"scale":[1,2,4],"rotation":[3,0,0,3],"density":2,"albedo":[0,0.5,1],"emission":7,"g":-0.5})");
    CHECK(glm::distance(p.axes[0], glm::dvec3(0, 1, 0)) < 1e-15);
    CHECK(glm::distance(p.axes[1], glm::dvec3(-2, 0, 0)) < 1e-15);
    CHECK(p.albedo == glm::dvec3(0, 0.5, 1));
    CHECK(p.emission == glm::dvec3(7));
    CHECK(p.has_g);
    CHECK(p.g == -0.5f);
    // any axes with the same product are right
    p = with_primitive(R"({"center":[0,0,0],"covariance":[2,0.5,-0.25,3,0.125,4],"density":1})");
    CHECK(distance(p.axes * glm::transpose(p.axes), glm::dmat3(2, 0.5, -0.25, 0.5, 3, 0.125, -0.25, 0.125, 4)) < 1e-14);
    const Scene s = parse(changed(
        primitive, primitive + R"(, {"center":[0,0,0],"scale":1,"density":0}, {"center":[0,0,0],"scale":1,"density":0.0})"));
    CHECK(s.media[0].primitives.size() == 1);
    CHECK(s.media[0].dropped == 2);
}

TEST_CASE("Scene.MassBecomesPeak", "[quick]") {
    const double cube = 27;
    const auto peak = [](const std::string& name, const std::string& more) {
        return parse(changed("\"gaussian\",", "\"" + name + "\", \"extent\": 3, \"normalization\": \"mass\"," + more))
            .media[0]
            .primitives[0]
            .sigma_t;
    };
    CHECK(peak("gaussian", "") == Approx(2 / (8 * std::pow(2 * pi, 1.5))));
    CHECK(peak("epanechnikov", "") == Approx(2 / (8 * 8 * pi * cube / 15)));
    CHECK(peak("uniform", "") == Approx(2 / (8 * 4 * pi * cube / 3)));
    CHECK(peak("uniform", R"("transform": {"scale": 5},)") == Approx(2 / (8 * 4 * pi * cube / 3)));
    CHECK(
        with_primitive(R"({"center":[0,0,0],"covariance":[1,0,0,4,0,16],"density":2})", R"("normalization":"mass",)").sigma_t ==
        Approx(2 / (8 * std::pow(2 * pi, 1.5))));
}

TEST_CASE("Scene.TransformOrderAndMirrors", "[quick]") {
    Primitive p = with_primitive(
        primitive,
        R"("transform": {"scale": [2, 1, 1], "rotate": {"axis": [0, 0, 5], "angle": 90}, "translate": [10, 0, 0]},)");
    CHECK(glm::distance(p.center, glm::dvec3(10 - 2, 2, 3)) < 1e-14);
    CHECK(glm::distance(p.axes[0], glm::dvec3(0, 2, 0)) < 1e-14);
    CHECK(glm::distance(p.axes[1], glm::dvec3(-2, 0, 0)) < 1e-14);
    CHECK(p.sigma_t == 2);
    p = with_primitive(primitive, R"("transform": {"matrix": [[0,-1,0,10],[2,0,0,0],[0,0,-1,0],[0,0,0,1]]},)");
    CHECK(p.center == glm::dvec3(8, 2, -3));
    CHECK(p.axes[0] == glm::dvec3(0, 2, 0));
    CHECK(glm::determinant(p.axes) < 0);
    CHECK(with_primitive(primitive, R"("transform": {"scale": -1},)").center == glm::dvec3(-1, -2, -3));
}

TEST_CASE("Scene.MediumOverridesEveryPrimitive", "[quick]") {
    const std::string own = R"({"center":[0,0,0],"scale":1,"density":1,"albedo":0.1,"emission":[1,2,3]})";
    const Primitive p = with_primitive(own, R"("albedo": [0.2, 0.3, 0.4], "emission": 0,)");
    CHECK(p.albedo == glm::dvec3(0.2, 0.3, 0.4));
    CHECK(p.emission == glm::dvec3(0));
    const Scene s =
        parse(changed(kernel, kernel + R"("phase": {"type": "henyey-greenstein", "g": 0.75}, "density_scale": 5,)"));
    CHECK(s.media[0].phase.kind == PhaseKind::henyey_greenstein);
    CHECK(s.media[0].phase.g == 0.75);
    CHECK(s.media[0].density_scale == 5);
    CHECK(parse(changed(kernel, kernel + R"("phase": {"type": "rayleigh"},)")).media[0].phase.kind == PhaseKind::rayleigh);
}

TEST_CASE("Scene.PlyEncodings", "[quick]") {
    const TempFolder folder;
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty float "
        "scale_0\nproperty float scale_1\nproperty float scale_2\nproperty float ";
    const auto medium = [&](const std::string& name, const std::string& keys) {
        std::string text = changed("\"primitives\": [ " + primitive + " ]", keys + "\"file\": \"" + name + "\"",
                                   changed("gaussian", "uniform"));
        return parse_scene(text, folder.path() / "s.json").media[0];
    };
    folder.write("a.ply", head + "sigma_t\nend_header\n0 0 0 0 0 0 3\n1 1 1 0 0 0 0\n");
    EllipsoidMedium m = medium("a.ply", "");
    REQUIRE(m.primitives.size() == 1);
    CHECK(m.dropped == 1);
    CHECK(m.primitives[0].sigma_t == 3);
    CHECK(m.source == (folder.path() / "a.ply").string());
    CHECK(medium("a.ply", R"("normalization": "mass", "extent": 1, )").primitives[0].sigma_t == Approx(3 / (4 * pi / 3)));
    CHECK(medium("a.ply", R"("density_encoding": "opacity", )").primitives.size() == 2);
    // opacity: the ray through the centre sees 1/(1 + e^-o), whatever the normalization
    folder.write("b.ply", head + "opacity\nend_header\n0 0 0 2 2 2 1\n0 0 0 2 2 2 1\n");
    for (const char* keys : {"", R"("normalization": "mass", )", R"("normalization": "mass", "scale_encoding": "linear", )"}) {
        m = medium("b.ply", keys);
        const Primitive& p = m.primitives[0];
        const double depth = p.sigma_t * 2 * m.extent * glm::length(p.axes[0]);
        CHECK(1 - std::exp(-depth) == Approx(1 / (1 + std::exp(-1.0))));
    }
    CHECK(glm::length(m.primitives[0].axes[0]) == Approx(2));
    // depth through the centre of a unit sphere of peak 1: √(2π) gaussian, 4E/3 epanechnikov
    folder.write("d.ply", head + "opacity\nend_header\n0 0 0 0 0 0 1\n0 0 0 0 0 0 1\n");
    const auto peak = [&](const std::string& name) {
        const std::string file = R"("extent": 2, "file": "d.ply")";
        return parse_scene(changed("\"primitives\": [ " + primitive + " ]", file, changed("gaussian", name)),
                           folder.path() / "s.json")
            .media[0]
            .primitives[0]
            .sigma_t;
    };
    CHECK(peak("gaussian") == Approx(std::log1p(std::exp(1.0)) / std::sqrt(2 * pi)));
    CHECK(peak("epanechnikov") == Approx(std::log1p(std::exp(1.0)) / (8.0 / 3)));
    // own g in a Rayleigh medium
    folder.write("c.ply", head + "sigma_t\nproperty float g\nend_header\n0 0 0 0 0 0 3 0\n1 1 1 0 0 0 0 0\n");
    CHECK(medium("c.ply", "").primitives[0].has_g);
    CHECK_THROWS_AS(medium("c.ply", R"("phase": {"type": "rayleigh"}, )"), SceneError);
}

TEST_CASE("Scene.OverridesReachEveryKey", "[quick]") {
    Scene s = parse(good, {{"render.spp", "256"},
                           {"render.spp", "17"},
                           {"camera.origin", "[0,0,1]"},
                           {"media.0.density_scale", "5"},
                           {"camera.target.1", "2"},
                           {"media.0.phase.type", "rayleigh"},
                           {"render.strategy", "delta"},
                           {"lights.1.type", "sphere"},
                           {"lights.1.center", "[0,0,0]"},
                           {"lights.1.radius", "1"},
                           {"lights.1.radiance", "3"}});
    CHECK(s.render.spp == 17);
    CHECK(s.camera.origin == glm::dvec3(0, 0, 1));
    CHECK(s.camera.target == glm::dvec3(0, 2, 0));
    CHECK(s.media[0].density_scale == 5);
    CHECK(s.media[0].phase.kind == PhaseKind::rayleigh);
    CHECK(s.render.strategy == "delta");
    REQUIRE(s.lights.size() == 2);
    CHECK(s.lights[1].radiance == glm::dvec3(3));
    CHECK(parse(changed(R"(  "render": { "spp": 8 },)"
                        "\n",
                        ""),
                {{"render.spp", "9"}})
              .render.spp == 9);
    CHECK(parse(good, {{"media", "[]"}}).media.empty());
    CHECK(parse(changed(R"("lights": [ )" + light + " ]", R"("lights": [])"), {{"lights.0", light}}).lights.size() == 1);
}

TEST_CASE("Scene.BundledScenesRead", "[quick]") {
    for (const char* name : {"wide", "close", "dense", "point"}) {
        const Scene s = read_scene(std::string(CLUME_SOURCE_DIR) + "/scenes/smoke_" + name + ".json");
        REQUIRE(s.media.size() == 1);
        CHECK(s.media[0].primitives.size() == 835);
        CHECK(s.film.width == 256);
        CHECK(s.lights.size() == 1);
    }
}

TEST_CASE("Schema.DocumentationIsInStep", "[quick]") {
    std::ifstream in(std::string(CLUME_SOURCE_DIR) + "/docs/scene.md");
    const std::string page{std::istreambuf_iterator<char>(in), {}}, begin = "<!-- schema begin -->\n",
                                                                    end = "<!-- schema end -->";
    const auto from = page.find(begin), to = page.find(end);
    REQUIRE(from != std::string::npos);
    REQUIRE(to != std::string::npos);
    CHECK(page.substr(from + begin.size(), to - from - begin.size()) == schema_markdown());
}

TEST_CASE("Schema.TableIsSound", "[quick]") {
    for (const KeySpec& key : scene_schema()) {
        INFO(key.section << "." << key.name);
        CHECK_FALSE((key.required && !key.default_json.empty()));
        CHECK((key.type == KeyType::choice) == !key.choices.empty());
        if (!key.default_json.empty()) CHECK_NOTHROW(parse_json(key.default_json, "default"));
        // A key means one thing in each variant of its section.
        const auto words = [](std::string_view text) {
            std::istringstream in{std::string(text)};
            return std::set<std::string>{std::istream_iterator<std::string>(in), {}};
        };
        int same = 0;
        for (const KeySpec& other : scene_schema()) {
            if (other.section != key.section || other.name != key.name) continue;
            const auto mine = words(key.variants), others = words(other.variants);
            same += mine.empty() || others.empty() ||
                    std::any_of(mine.begin(), mine.end(), [&](const std::string& v) { return others.count(v) > 0; });
        }
        CHECK(same == 1);
    }
    const std::vector<std::string_view> names{"origin", "target", "up"};
    CHECK(nearest_name("orgin", names) == "origin");
    CHECK(nearest_name("traget", names) == "target");
    CHECK(nearest_name("zzzzzz", names).empty());
    CHECK(nearest_name(std::string(100000, 'x'), names).empty());
}
