// SPDX-License-Identifier: MIT
// `clume render` and `clume info` as a user meets them: what bad scenes get, overrides, crops and sample ranges in the files
// written, statistics, an empty frame, samples that are not finite, and folders that can't be written.
#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <string>
#include <sys/stat.h>

#include "src/image_writer.h"
#include "tests/cli_process.h"

using namespace clume;
using namespace clume::test;

namespace {

const std::string media = R"("media": [ { "type": "ellipsoids", "kernel": "gaussian", "primitives": [ { "center": [0, 0, 0], "scale": 0.5, "density": 4 } ] } ])";
const std::string rest = R"("camera": { "origin": [0, 0, -4], "target": [0, 0, 0] }, "film": { "width": 16, "height": 12 })";
const std::string lights = R"("lights": [ { "type": "constant", "radiance": 1 } ])";

void write(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

std::string value_of(const ImageMetadata& metadata, const std::string& key) {
    for (const auto& [k, v] : metadata)
        if (k == key) return v;
    return "none";
}

}  // namespace

TEST_CASE("Binary.BadScenesExitThreeWithOneLineThatNamesThePlace") {
    const SceneFolder folder;
    const std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n";
    std::string properties;
    for (const char* name : {"x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "sigma_t"})
        properties += std::string("property float ") + name + "\n";
    write(folder.path / "promise.ply", header + properties + "end_header\n" + std::string(100, '\0'));
    write(folder.path / "cut.ply", "ply\nformat ascii 1.0\nelement vertex 3\n" + properties + "end_header\n0 0 0 0 0 0 1 0 0 0 1\n");
    write(folder.path / "zero.ply", "ply\nformat ascii 1.0\nelement vertex 1\n" + properties + "end_header\n0 0 0 0 0 0 0 0 0 0 1\n");
    write(folder.path / "text.ply", "not a ply at all\n");
    const auto with_file = [&](const std::string& file) {
        return "{ " + rest + ", " + lights + R"(, "media": [ { "type": "ellipsoids", "kernel": "gaussian", "file": ")" + file + "\" } ] }";
    };
    const auto with_primitive = [&](const std::string& primitive) {
        return "{ " + rest + ", " + lights + R"(, "media": [ { "type": "ellipsoids", "kernel": "gaussian", "primitives": [ )" + primitive + " ] } ] }";
    };
    struct Case {
        std::string text, place, says;
    };
    const std::vector<Case> cases{
        {"{ " + rest + ", \"media\": [ }", "bad.json:1:", ""},
        {std::string(200000, '['), "bad.json:1:", "nested"},
        {"{\n \"camra\": {} }", "bad.json:2:", "camera"},
        {"{ " + rest + ", " + media + ", " + media + ", " + lights + " }", "bad.json:1:", "media"},
        {"{ " + rest + ", \"render\": { \"spp\": \"many\" }, " + media + ", " + lights + " }", "bad.json:1:", "spp"},
        {"{ " + rest + ", \"render\": { \"spp\": 0 }, " + media + ", " + lights + " }", "bad.json:1:", "spp"},
        {"{ " + rest + ", \"render\": { \"spp\": NaN }, " + media + ", " + lights + " }", "bad.json:1:", ""},
        {with_file("none.ply"), "bad.json:1:", "none.ply"},
        {with_file("promise.ply"), "", "promise.ply"},
        {with_file("cut.ply"), "", "cut.ply"},
        {with_file("zero.ply"), "", "zero.ply"},
        {with_file("text.ply"), "", "text.ply"},
        {with_file("puff.json"), "", "puff.json"},
        {with_primitive(R"({ "center": [0,0,0], "scale": 1, "density": 1, "rotation": [0,0,0,0] })"), "bad.json:1:", "quaternion"},
        {with_primitive(R"({ "center": [0,0,0], "covariance": [1,2,0,1,0,1], "density": 1 })"), "bad.json:1:", "covariance"},
        {"{ " + media + ", " + rest.substr(0, rest.find(", \"film\"")) + R"(, "film": { "width": 65536, "height": 65536 }, )" + lights + " }", "", "film"},
        {"{ " + rest + ", " + media + " }", "bad.json", "light"},
    };
    for (const Case& c : cases) {
        write(folder.path / "bad.json", c.text);
        const Run run({"render", "bad.json"}, folder.path);
        INFO(c.text.substr(0, 300) << "\n" << run.err.substr(0, 300));
        CHECK(run.code == 3);
        CHECK(run.out.empty());
        CHECK_THAT(run.err, Catch::StartsWith(c.place));
        CHECK_THAT(run.err, Catch::Contains(c.says));
        CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
        CHECK(folder.files() == 6);
    }
    const Run info({"info", "bad.json"}, folder.path), missing({"info", "nothing.json"}, folder.path), ply({"info", "cut.ply"}, folder.path);
    for (const Run* run : {&info, &missing, &ply}) {
        CHECK(run->code == 3);
        CHECK(std::count(run->err.begin(), run->err.end(), '\n') == 1);
    }
}

TEST_CASE("Binary.UnwritableFoldersAreToldBeforeRendering") {
    const SceneFolder folder;
    fs::create_directory(folder.path / "shut");
    chmod((folder.path / "shut").c_str(), 0500);
    const bool root = access((folder.path / "shut").c_str(), W_OK) == 0;  // root may write anywhere
    write(folder.path / "file", "");
    for (const char* output : {"shut/a.exr", "file/a.exr", "none/a.exr"}) {
        if (root && std::string(output).starts_with("shut")) continue;
        // So many samples that only telling it before rendering ends in time.
        Process process({"render", "puff.json", "--spp", "100000000", "-o", output}, folder.path);
        CHECK(process.wait(30) == 1);
        INFO(process.err);
        CHECK_THAT(process.err, Catch::Contains("cannot write in this folder"));
        CHECK(std::count(process.err.begin(), process.err.end(), '\n') == 1);
    }
    CHECK(folder.files() == 3);
    chmod((folder.path / "shut").c_str(), 0700);
}

TEST_CASE("Binary.CropSampleRangeAndOverridesReachTheImage") {
    const SceneFolder folder;
    const Run whole({"render", "puff.json", "--quiet", "-D", "film.width=40", "--spp", "6", "-o", "whole.exr"}, folder.path);
    INFO(whole.err);
    REQUIRE(whole.code == 0);
    const Run part({"render", "puff.json", "--quiet", "-Dfilm.width=40", "--spp", "6", "--crop", "10,4,31,20", "-o", "part.exr"}, folder.path);
    REQUIRE(part.code == 0);
    const Run range({"render", "puff.json", "--quiet", "-Dfilm.width=40", "--spp", "6", "--sample-range", "2:5", "--seed", "3", "-o", "range.exr"}, folder.path);
    REQUIRE(range.code == 0);
    ImageMetadata metadata;
    const RenderImage a = read_exr(folder.path / "whole.exr"), b = read_exr(folder.path / "part.exr"), c = read_exr(folder.path / "range.exr", &metadata);
    REQUIRE(a.film_width == 40);
    REQUIRE(b.alpha.size() == 21 * 16);
    std::size_t different = 0;
    for (std::size_t y = 0; y < 16; ++y)
        for (std::size_t x = 0; x < 21; ++x) different += b.rgb[3 * (x + 21 * y)] != a.rgb[3 * (x + 10 + 40 * (y + 4))];
    CHECK(different == 0);
    CHECK(c.samples.front() == 3);
    CHECK(value_of(metadata, "sampleRange") == "2:5");
    CHECK(value_of(metadata, "seed") == "3");
    CHECK_THAT(value_of(metadata, "overrides"), Catch::Contains("film.width=40"));
    CHECK(value_of(metadata, "strategy") == "delta");
    CHECK(value_of(metadata, "layoutHash").size() == 64);
}

TEST_CASE("Binary.StatisticsAndExplanation") {
    const SceneFolder folder;
    const Run run({"render", "puff.json", "--quiet", "--explain", "--stats-json", "-"}, folder.path);
    INFO(run.err);
    REQUIRE(run.code == 0);
    CHECK_THAT(run.out, Catch::StartsWith("{"));  // stdout is the statistics, whole
    CHECK_THAT(run.out, Catch::EndsWith("}\n"));
    for (const char* key : {"\"strategy\": \"delta\"", "\"paths\": 3072", "\"nonfinite_samples\": 0", "\"bound_violations\": 0", "\"samples_max\": 4", "\"layout_hash\"", "\"explain\""})
        CHECK_THAT(run.out, Catch::Contains(key));
    CHECK_THAT(run.err, Catch::Contains("puff.exr\npuff.png\n"));
    CHECK_THAT(run.err, Catch::Contains("next-event estimation") && Catch::Contains("left out"));
    CHECK_THAT(run.err, !Catch::Contains("Mpaths/s"));  // --quiet
}

TEST_CASE("Binary.EmptyFrameIsNoError") {
    const SceneFolder folder;
    const Run run({"render", "puff.json", "--quiet", "-D", "camera.target=[0,0,-9]"}, folder.path);
    INFO(run.err);
    CHECK(run.code == 0);
    CHECK(run.err.empty());
    const RenderImage image = read_exr(folder.path / "puff.exr");
    for (float v : image.rgb) REQUIRE(v == 0);
    for (float v : image.alpha) REQUIRE(v == 0);
}

TEST_CASE("Binary.SamplesThatAreNotFiniteExitOneWithTheImage") {
    const SceneFolder folder;
    write(folder.path / "bright.json", "{ " + rest + ", " + media + R"(, "lights": [ { "type": "constant", "radiance": 3e38 }, { "type": "constant", "radiance": 3e38 } ] })");
    const Run run({"render", "bright.json", "--quiet", "--spp", "8", "--stats-json", "s.json"}, folder.path);
    CHECK(run.code == 1);
    CHECK_THAT(run.err, Catch::Contains("samples were not finite"));
    CHECK(run.out == "bright.exr\nbright.png\n");
    ImageMetadata metadata;
    const RenderImage image = read_exr(folder.path / "bright.exr", &metadata);
    for (float v : image.rgb) REQUIRE(std::isfinite(v));
    CHECK(value_of(metadata, "nonfiniteSamples") != "none");
}

TEST_CASE("Binary.InfoTellsWhatIsInAFile") {
    const SceneFolder folder;
    const Run scene({"info", "puff.json"}, folder.path);
    CHECK(scene.code == 0);
    CHECK(scene.err.empty());
    for (const char* what : {"primitives    1 ", "bounds        (-1.5, -1.5, -1.5) to (1.5, 1.5, 1.5)", "gaussian", "dropped", "overlap         mean 1.0, at most 1",
                             "optical depth", "on the device"})
        CHECK_THAT(scene.out, Catch::Contains(what));
    // √(2π) erf(3/√2) · 0.5 · 4 through the middle.
    CHECK_THAT(scene.out, Catch::Contains("along x 5, y 5, z 5") || Catch::Contains("along x 4.999") || Catch::Contains("along x 5.0"));
    const Run ply({"info", std::string(CLUME_SOURCE_DIR) + "/scenes/smoke.ply"}, folder.path);
    CHECK(ply.code == 0);
    CHECK_THAT(ply.out, Catch::Contains("primitives    835"));
    const Run density({"info", "puff.json", "-D", "film.width=77"}, folder.path);
    CHECK_THAT(density.out, Catch::Contains("77 x 24"));
}

TEST_CASE("Binary.InterruptLeavesNoTemporaryFile") {
    const SceneFolder folder;
    Process process({"render", "puff.json", "--spp", "100000000", "-D", "film.width=512", "-D", "film.height=512"}, folder.path);
    REQUIRE(process.read_until([&] { return process.err.find(" of ") != std::string::npos; }, 180));
    process.send(SIGINT);
    const bool ended = process.wait(60) == 130;
    CHECK(ended);
    for (const auto& entry : fs::directory_iterator(folder.path)) {
        const std::string name = entry.path().filename().string();
        INFO(name);
        CHECK((name == "puff.json" || name == "puff.exr" || name == "puff.png"));  // no temporary file
    }
}
