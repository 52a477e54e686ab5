// SPDX-License-Identifier: MIT
// --memory-limit: the process stays within it, or says with figures what does not fit, before it takes it.
#include <catch2/catch.hpp>
#include <fstream>
#include <random>
#include <string>

#include "src/error.h"
#include "src/memory_budget.h"
#include "tests/cli_process.h"

using namespace clume;
using namespace clume::test;

namespace {

struct Measured {
    int code;
    std::string err;
    std::size_t peak_bytes, files;
    Measured(Words words, const fs::path& folder) {
        words.insert(words.begin(), {"render", "--quiet"});
        Process process(words, folder);
        code = process.wait(300);
        err = process.err;
        peak_bytes = process.peak_bytes();
        files = static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
    }
};

/// "needs 812.0 MB" as bytes; 0 if it isn't said.
double needed(const std::string& err) {
    const std::size_t at = err.find("needs ");
    return at == std::string::npos ? 0 : 1e6 * std::atof(err.c_str() + at + 6);
}

std::string bytes(double count) { return std::to_string(static_cast<std::uint64_t>(count)); }

/// Refused within half of what it says it needs; then renders within what it says it needs.
void check_budget(const Words& words, const fs::path& folder, double low) {
    Words little = words, enough = words;
    little.insert(little.end(), {"--memory-limit", bytes(low)});
    const Measured refused(little, folder);
    INFO(refused.err);
    CHECK(refused.code == 3);
    CHECK_THAT(refused.err, Catch::Contains("in use") && Catch::Contains("the limit is") && Catch::Contains("--memory-limit"));
    CHECK(static_cast<double>(refused.peak_bytes) <= low);
    const double need = needed(refused.err);
    REQUIRE(need > low);
    // What it says may grow while it gets further; it may not grow without end.
    double limit = 1.02 * need;
    for (int attempt = 0; attempt < 4; ++attempt) {
        Words given = words;
        given.insert(given.end(), {"--memory-limit", bytes(limit)});
        const Measured run(given, folder);
        INFO("limit " << limit / 1e6 << " MB, peak " << static_cast<double>(run.peak_bytes) / 1e6 << " MB, code " << run.code << "\n" << run.err);
        CHECK(static_cast<double>(run.peak_bytes) <= limit);
        if (run.code == 0) {
            // Not more careful than is of use.
            CHECK(static_cast<double>(run.peak_bytes) > 0.4 * limit);
            return;
        }
        REQUIRE(run.code == 3);
        REQUIRE(needed(run.err) > limit - 1e5);  // it is said to a tenth of a megabyte
        limit = 1.02 * needed(run.err);
    }
    FAIL("refused again and again");
}

}  // namespace

TEST_CASE("Memory.SizesAsTyped", "[quick]") {
    CHECK(parse_byte_size("--memory-limit", "2G") == std::uint64_t{2} << 30);
    CHECK(parse_byte_size("--memory-limit", "512M") == 512u << 20);
    CHECK(parse_byte_size("--memory-limit", "64K") == 64u << 10);
    CHECK(parse_byte_size("--memory-limit", "123456") == 123456);
    for (const char* wrong : {"", "0", "-1", "2g", "2GB", "x", "1.5G", "99999999999T", "M"})
        CHECK_THROWS_AS(parse_byte_size("--memory-limit", wrong), UsageError);
    CHECK(memory_limit() > memory_in_use());
}

TEST_CASE("Memory.BigFilmStaysWithinItsLimit") {
    const SceneFolder folder;
    // Every pixel meets the medium.
    check_budget({"puff.json", "--spp", "1", "-D", "film.width=2048", "-D", "film.height=1024", "-D", "camera.fov=20"}, folder.path, 300e6);
}

TEST_CASE("Memory.BigSceneStaysWithinItsLimit") {
    const SceneFolder folder;
    std::ofstream ply(folder.path / "many.ply", std::ios::binary);
    constexpr int count = 150000;
    ply << "ply\nformat binary_little_endian 1.0\nelement vertex " << count << "\n";
    for (const char* name : {"x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "sigma_t"})
        ply << "property float " << name << "\n";
    ply << "end_header\n";
    std::mt19937 random(3);
    const auto uniform = [&] { return static_cast<float>(random()) / 4294967296.0f; };
    for (int i = 0; i < count; ++i) {
        const float row[11] = {2 * uniform() - 1, 2 * uniform() - 1, 2 * uniform() - 1, -4.5f, -4.5f, -4.0f, 1, 0, 0, 0, uniform()};
        ply.write(reinterpret_cast<const char*>(row), sizeof row);
    }
    ply.close();
    std::ofstream(folder.path / "many.json") << R"({ "camera": { "origin": [0, 0, -4], "target": [0, 0, 0] }, "film": { "width": 32, "height": 24 },
  "render": { "spp": 1, "strategy": "delta" }, "media": [ { "type": "ellipsoids", "kernel": "gaussian", "file": "many.ply" } ],
  "lights": [ { "type": "constant", "radiance": 1 } ] })";
    const std::string strategy = GENERATE("delta", "decomposition", "progressive", "march");
    INFO(strategy);
    check_budget({"many.json", "-D", "render.strategy=" + strategy}, folder.path, 100e6);
}
