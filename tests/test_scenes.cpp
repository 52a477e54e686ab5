// SPDX-License-Identifier: MIT
// The shipped scenes: every one reads, the analytic ones render to the values in scenes/expected.json (derived in
// scenes/README.md), and the generator makes the committed files again, byte for byte.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "src/environment_reader.h"
#include "src/json_reader.h"
#include "src/renderer.h"
#include "src/scene_reader.h"
#include "tests/temp_folder.h"

using namespace clume;
namespace fs = std::filesystem;

namespace {

const fs::path scenes = fs::path(CLUME_SOURCE_DIR) / "scenes";
/// Room for the rounding of a film that holds sums of single-precision samples.
constexpr double rounding = 2e-6;

std::string file_bytes(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    INFO(path);
    REQUIRE(file);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
}

std::vector<fs::path> files_with(const std::string& extension) {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(scenes))
        if (entry.path().extension() == extension) found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    return found;
}

/// One entry of scenes/expected.json.
struct Expected {
    bool all = false;  ///< every pixel, and their mean
    int x = 0, y = 0;  ///< else this one
    std::optional<double> rgb[3];
    std::optional<double> alpha;
    double tolerance_sigma = 4;
    std::optional<std::uint64_t> spp;  ///< the scene's own if not given
};

Expected read_expected(const JsonValue& value) {
    Expected e;
    for (const JsonMember& m : value.members) {
        if (m.key == "pixel" && m.value.type == JsonType::string) {
            REQUIRE(m.value.text == "all");
            e.all = true;
        } else if (m.key == "pixel") {
            REQUIRE(m.value.items.size() == 2);
            e.x = static_cast<int>(m.value.items[0].number);
            e.y = static_cast<int>(m.value.items[1].number);
        } else if (m.key == "rgb") {
            REQUIRE(m.value.items.size() == 3);
            for (std::size_t c = 0; c < 3; ++c) e.rgb[c] = m.value.items[c].number;
        } else if (m.key == "alpha") {
            e.alpha = m.value.number;
        } else if (m.key == "tolerance_sigma") {
            e.tolerance_sigma = m.value.number;
        } else if (m.key == "spp") {
            e.spp = m.value.integer.value();
        } else {
            FAIL("unknown key in expected.json: " << m.key);
        }
    }
    return e;
}

RenderImage render_for(const fs::path& file, const Expected& e) {
    std::vector<Override> overrides;
    if (e.spp) overrides.push_back({"render.spp", std::to_string(*e.spp)});
    const Scene scene = read_scene(file, overrides);
    RenderOptions options;
    if (!e.all) {
        REQUIRE((e.x >= 0 && e.y >= 0 && e.x < scene.film.width && e.y < scene.film.height));
        options.crop = CropWindow{e.x, e.y, e.x + 1, e.y + 1};
    }
    const RenderResult result = render(scene, options, {}, false);
    CHECK(result.stats.nonfinite_samples == 0);
    CHECK(result.stats.bound_violations == 0);
    return result.image;
}

void check_value(double value, double expected, double variance, double tolerance_sigma) {
    const double sigma = std::sqrt(variance);
    CAPTURE(value, expected, sigma, tolerance_sigma);
    CHECK(std::abs(value - expected) <= tolerance_sigma * sigma + rounding);
}

void check_image(const RenderImage& image, const Expected& e) {
    const std::size_t count = image.alpha.size();
    double mean[3] = {}, variance[3] = {};
    for (std::size_t i = 0; i < count; ++i) {
        const int x = image.window.x0 + static_cast<int>(i) % (image.window.x1 - image.window.x0);
        const int y = image.window.y0 + static_cast<int>(i) / (image.window.x1 - image.window.x0);
        CAPTURE(x, y);
        for (std::size_t c = 0; c < 3; ++c) {
            const double v = image.rgb[3 * i + c], s = image.variance[3 * i + c];
            mean[c] += v / static_cast<double>(count);
            variance[c] += s / static_cast<double>(count * count);
            CAPTURE(c);
            if (e.rgb[c]) check_value(v, *e.rgb[c], s, e.tolerance_sigma);
        }
        // A sample has alpha 0 or 1, so the expected value gives the variance as well.
        if (e.alpha) check_value(image.alpha[i], *e.alpha, *e.alpha * (1 - *e.alpha) / image.samples[i], e.tolerance_sigma);
    }
    INFO("mean of all pixels");
    for (std::size_t c = 0; c < 3; ++c)
        if (e.rgb[c]) check_value(mean[c], *e.rgb[c], variance[c], e.tolerance_sigma);
}

}  // namespace

TEST_CASE("Scenes.analytic_values", "[scenes]") {
    const JsonValue root = parse_json(file_bytes(scenes / "expected.json"), "expected.json");
    REQUIRE(root.members.size() >= 4);
    for (const JsonMember& scene : root.members)
        for (const JsonValue& item : scene.value.items) {
            CAPTURE(scene.key, item.at.line);
            const Expected e = read_expected(item);
            check_image(render_for(scenes / scene.key, e), e);
        }
}

TEST_CASE("Scenes.every_file_reads", "[quick][scenes]") {
    std::size_t read = 0;
    for (const fs::path& file : files_with(".json")) {
        if (file.filename() == "expected.json") continue;
        INFO(file);
        CHECK_NOTHROW(read_scene(file));
        ++read;
    }
    CHECK(read >= 11);
}

TEST_CASE("Scenes.generator_makes_the_committed_files", "[quick][scenes]") {
    const test::TempFolder made;
    const fs::path generator = fs::path(CLUME_BINARY).parent_path() / "clume_scenes";
    REQUIRE(std::system(("'" + generator.string() + "' '" + made.path().string() + "' > /dev/null").c_str()) == 0);
    for (const char* name : {"plume.ply", "fire.ply", "cloud.ply"}) {
        INFO(name);
        CHECK((file_bytes(made.path() / name) == file_bytes(scenes / name)));  // bytes aren't for printing
    }
    // How an EXR is compressed depends on library versions: compare what it holds.
    const EnvironmentImage a = read_environment(made.path() / "sky.exr"), b = read_environment(scenes / "sky.exr");
    CHECK((a.width == b.width && a.height == b.height && a.rgb == b.rgb));
}

TEST_CASE("Scenes.files_are_small", "[quick][scenes]") {
    std::uintmax_t total = 0;
    for (const fs::path& file : files_with(".ply")) {
        INFO(file);
        CHECK(fs::file_size(file) <= 1000000);
        total += fs::file_size(file);
    }
    CHECK(total <= 2500000);
    CHECK(fs::file_size(scenes / "sky.exr") <= 200000);
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(CLUME_SOURCE_DIR) / "docs" / "images")) {
        INFO(entry.path());
        if (entry.is_regular_file()) CHECK(entry.file_size() <= 600000);
    }
}
