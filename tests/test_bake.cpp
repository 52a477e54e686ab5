// SPDX-License-Identifier: MIT
// clume bake: samples are the mixture's density, every format holds the same ones, and files are whole or not there.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "src/bake.h"
#include "src/voxel_file.h"
#include "src/voxel_grid.h"
#include "src/voxel_writer.h"
#include "tests/cli_process.h"
#include "tests/temp_folder.h"
#include "tests/voxel_scene.h"

using namespace clume;
using namespace clume::test;

namespace {

const std::atomic<bool> never{false};

/// Media of all kernels, with turned, thin, tiny and mirrored primitives, far from the origin.
std::string mixture(const std::string& more = "") {
    return R"({ "camera": { "origin": [0, 0, -4], "target": [0, 0, 0] }, "lights": [ { "type": "constant", "radiance": 1 } ], "media": [
    { "type": "ellipsoids", "kernel": "gaussian", "density_scale": 2.5, "transform": { "scale": [1, -2, 1], "translate": [100, 0, 0] },
      "primitives": [ { "center": [0, 0, 0], "scale": [1, 0.2, 0.02], "rotation": [0.9, 0.3, -0.5, 0.2], "density": 3 },
                      { "center": [1, 0.5, 0], "scale": 0.4, "density": 1 } ] },
    { "type": "ellipsoids", "kernel": "epanechnikov", "primitives": [ { "center": [99, 0.3, 0.7], "scale": [0.1, 0.5, 0.3], "density": 2 } ] },
    { "type": "ellipsoids", "kernel": "uniform", "extent": 1, "primitives": [ { "center": [101, -1, 1], "scale": 0.7, "density": 0.5 },
                      { "center": [101, -1, 1], "scale": 0.001, "density": 9 } ] })" +
           more + " ] }";
}

Scene scene_of(const std::string& text) { return parse_scene(text, "s.json"); }

/// σ_t at a world point by the definition: r² = (x − μ)ᵀ Σ⁻¹ (x − μ), Σ = A Aᵀ. `edge`: the least |r² − E²| / E² met.
double density_at(const Scene& scene, const glm::dvec3& x, double& edge) {
    double sum = 0;
    edge = 1;
    for (const EllipsoidMedium& m : scene.media)
        for (const Primitive& p : m.primitives) {
            const glm::dvec3 d = x - p.center;
            const double r2 = glm::dot(d, glm::inverse(p.axes * glm::transpose(p.axes)) * d), e2 = m.extent * m.extent;
            edge = std::min(edge, std::abs(r2 - e2) / e2);
            if (r2 >= e2) continue;
            const double k = m.kernel == KernelFamily::gaussian       ? std::exp(-r2 / 2)
                             : m.kernel == KernelFamily::epanechnikov ? 1 - r2 / e2
                                                                      : 1;
            sum += m.density_scale * p.sigma_t * k;
        }
    return sum;
}

VoxelGrid bake_all(const Scene& scene, int resolution) {
    const auto grid = bake(
        scene, resolution, [](double) {}, never);
    REQUIRE(grid);
    return *grid;
}

}  // namespace

TEST_CASE("Bake.SamplesAreTheDensityAtVoxelCentres", "[quick]") {
    const Scene scene = scene_of(mixture());
    for (const int resolution : {1, 7, 48}) {
        const VoxelGrid grid = bake_all(scene, resolution);
        CHECK(std::max({grid.hi.x, grid.hi.y, grid.hi.z}) == resolution);
        CHECK_FALSE(grid.sparse);
        // Cubes, up to the float bounds 100 from the origin.
        CHECK(grid.axes[1].y == Approx(grid.axes[0].x).epsilon(1e-4));
        CHECK(grid.axes[2].z == Approx(grid.axes[0].x).epsilon(1e-4));
        std::size_t wrong = 0, compared = 0, nonzero = 0;
        for (const glm::ivec3& i : lattice_points(grid.lo, grid.hi)) {
            double edge = 0;
            const double expected = density_at(scene, grid.origin + grid.axes * glm::dvec3(i), edge);
            if (edge < 1e-6) continue;  // on a support's surface rounding decides
            ++compared;
            nonzero += expected > 0;
            // A needle of axis ratio 50 loses some digits of r² in either form.
            wrong += !(std::abs(sample_at(grid, i) - expected) <= 1e-6 * expected + 1e-12);
        }
        CHECK(wrong == 0);
        CHECK(compared > 0);
        if (resolution == 48) CHECK(nonzero > 1000);
    }
}

TEST_CASE("Bake.BoundsHoldTheSupports", "[quick]") {
    const Scene scene = scene_of(mixture());
    const VoxelGrid grid = bake_all(scene, 40);
    const auto [lo, hi] = world_box(grid);
    for (const EllipsoidMedium& m : scene.media)
        for (const Primitive& p : m.primitives)
            for (int axis = 0; axis < 3; ++axis) {
                const double half = m.extent * std::sqrt(p.axes[0][axis] * p.axes[0][axis] + p.axes[1][axis] * p.axes[1][axis] +
                                                         p.axes[2][axis] * p.axes[2][axis]);
                CHECK(p.center[axis] - half > lo[axis] - 2e-5);
                CHECK(p.center[axis] + half < hi[axis] + 2e-5);
            }
    const glm::dvec3 voxel(grid.axes[0].x, grid.axes[1].y, grid.axes[2].z);
    for (int axis = 0; axis < 3; ++axis) CHECK((hi - lo)[axis] == Approx(voxel[axis] * grid.hi[axis]));
}

TEST_CASE("Bake.EveryFormatHoldsTheSameSamples", "[quick]") {
    const TempFolder folder;
    const VoxelGrid baked = bake_all(scene_of(mixture()), 40);
    for (const char* name : {"a.vol", "a.nvdb", "a.vdb"}) {
        INFO(name);
        write_voxel_file(folder.path() / name, baked);
        const VoxelGrid grid = open_voxel_file(folder.path() / name)->read(0);
        std::size_t wrong = 0, misplaced = 0;
        for (const glm::ivec3& i : lattice_points(glm::ivec3(-2), baked.hi + 2)) {
            const bool inside = glm::all(glm::greaterThanEqual(i, glm::ivec3(0))) && glm::all(glm::lessThan(i, baked.hi));
            if (inside || grid.sparse) wrong += sample_at(grid, i) != (inside ? sample_at(baked, i) : 0);
            const glm::dvec3 there = grid.origin + grid.axes * glm::dvec3(i), here = baked.origin + baked.axes * glm::dvec3(i);
            misplaced += !(glm::distance(there, here) < 1e-12);
        }
        CHECK(wrong == 0);
        CHECK(misplaced == 0);
    }
}

TEST_CASE("Bake.StopAndNothing", "[quick]") {
    const std::atomic<bool> stop{true};
    CHECK_FALSE(bake(
        scene_of(mixture()), 16, [](double) {}, stop));
    const std::string empty =
        R"({ "camera": { "origin": [0, 0, -4], "target": [0, 0, 0] }, "lights": [ { "type": "constant", "radiance": 1 } ] })";
    CHECK_THROWS_WITH(bake(
                          scene_of(empty), 16, [](double) {}, never),
                      "s.json: there are no ellipsoids to bake");
    CHECK_THROWS_WITH(bake(
                          scene_of(mixture()), 1 << 20, [](double) {}, never),
                      Catch::Contains("GB, and half of this machine's memory is"));
    double last = 0;
    bake(
        scene_of(mixture()), 16, [&](double part) { last = part; }, never);
    CHECK(last == 1);
}

TEST_CASE("Bake.DescribesTheMediumThatShowsTheFile", "[quick]") {
    const auto one = [](const std::string& medium_keys, const std::string& keys) {
        return scene_of(
            R"({ "camera": { "origin": [0, 0, -4], "target": [0, 0, 0] }, "lights": [ { "type": "constant", "radiance": 1 } ], "media": [
            { "type": "ellipsoids", "kernel": "gaussian")" +
            medium_keys + R"(, "primitives": [
                { "center": [0, 0, 0], "scale": 1, "density": 3)" +
            keys + R"( }, { "center": [0, 0, 0], "scale": 1, "density": 1 } ] } ] })");
    };
    BakedMedium plain = describe_baked(one("", ""), "a \"b\".vol");
    CHECK(plain.json == R"({"type": "grid", "file": "a \"b\".vol", "albedo": 0.9})");
    CHECK(plain.losses.empty());
    plain = describe_baked(
        one(R"(, "albedo": [0.1, 0.2, 0.3], "emission": 2, "phase": {"type": "henyey-greenstein", "g": 0.25})", ""), "a.vol");
    CHECK(
        plain.json ==
        R"({"type": "grid", "file": "a.vol", "albedo": [0.1, 0.2, 0.3], "emission": 2, "phase": {"type": "henyey-greenstein", "g": 0.25}})");
    CHECK(plain.losses.empty());
    CHECK(describe_baked(one(R"(, "phase": {"type": "rayleigh"})", ""), "a.vol").json ==
          R"({"type": "grid", "file": "a.vol", "albedo": 0.9, "phase": {"type": "rayleigh"}})");
    plain = describe_baked(one("", R"(, "albedo": 0.5, "emission": 1, "g": 0.1)"), "a.vol");
    CHECK(plain.json == R"({"type": "grid", "file": "a.vol", "albedo": 0.6})");  // (3 · 0.5 + 0.9) / 4
    CHECK(plain.losses.size() == 3);
}

TEST_CASE("Bake.CommandWritesAFileThatScenesCanUse") {
    const TempFolder folder;
    folder.write("s.json", mixture());
    for (const std::string name : {"out.vol", "out.nvdb", "out.vdb"}) {
        const Run out({"bake", "s.json", "--resolution", "24", "-o", name}, folder.path());
        INFO(out.err);
        REQUIRE(out.code == 0);
        CHECK(out.out == name + "\n");
        const auto at = out.err.find("in a scene: {");
        REQUIRE(at != std::string::npos);
        std::string medium = out.err.substr(at + 12);
        medium = medium.substr(0, medium.find('\n'));
        const Scene scene = parse_scene(R"({ "camera": { "origin": [0, 0, -4], "target": [0, 0, 0] }, "media": [ )" + medium +
                                            R"( ], "lights": [ { "type": "constant", "radiance": 1 } ] })",
                                        folder.path() / "t.json");
        REQUIRE(scene.grids.size() == 1);
        CHECK(scene.grids[0].density.values == bake_all(scene_of(mixture()), 24).values);
        const Run info({"info", name}, folder.path());
        INFO(info.out);
        CHECK(info.code == 0);
        CHECK(info.out.find(name == "out.vol" ? "float32" : "\"density\", float") != std::string::npos);
        CHECK(info.out.find("stored        ") != std::string::npos);
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) CHECK(entry.path().extension() != ".tmp");
}

TEST_CASE("Bake.InterruptLeavesNothing") {
    const TempFolder folder;
    // Minutes of work, however many cores there are.
    std::string text = mixture();
    const std::string one = R"({ "center": [100, 0, 0], "scale": 1, "density": 1 }, )";
    std::string many;
    for (int i = 0; i < 5000; ++i) many += one;
    text.insert(text.find(R"({ "center": [101, -1, 1], "scale": 0.7)"), many);
    folder.write("s.json", text);
    Process process({"bake", "s.json", "--resolution", "300", "-o", "a.vol"}, folder.path());
    process.read_until([] { return false; }, 1);
    process.send(SIGINT);
    const int code = process.wait(60);
    INFO(process.err);
    CHECK(code == 130);
    CHECK(process.out.empty());
    CHECK(process.err.find("interrupted: nothing was written") != std::string::npos);
    CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("Bake.WrongUseIsOneLine") {
    const TempFolder folder;
    folder.write("s.json", mixture());
    check_wrong_uses(folder.path(), {
        {{"bake"}, 2, "bake: which scene?"},
        {{"bake", "s.json", "--resolution", "8"}, 2, "bake: into which file?"},
        {{"bake", "s.json", "-o", "a.vol"}, 2, "how many voxels"},
        {{"bake", "s.json", "-o", "a.png", "--resolution", "8"}, 2, "must end in .vol, .nvdb or .vdb"},
        {{"bake", "s.json", "-o", "a.vol", "--resolution", "0"}, 2, "must lie between 1 and 4096"},
        {{"bake", "s.json", "-o", "a.vol", "--resolution", "4097"}, 2, "must lie between 1 and 4096"},
        {{"bake", "s.json", "-o", "a.vol", "--resolution", "many"}, 2, "many"},
        {{"bake", "s.json", "-o", "a.vol", "--resolutio", "8"}, 2, "the nearest is '--resolution'"},
        {{"bake", "none.json", "-o", "a.vol", "--resolution", "8"}, 3, "no such file"},
        {{"bake", "s.json", "-o", "none/a.vol", "--resolution", "8"}, 1, "it does not exist"},
        {{"bake", "s.json", "-o", "a.vol", "--resolution", "8", "-D", "render.sp=1"}, 2, "did you mean \"spp\"?"},
    });
}
