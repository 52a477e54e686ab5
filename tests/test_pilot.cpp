// SPDX-License-Identifier: MIT
// The pilot behind `auto`: least variance × work of what it measured, the same wherever and how often it runs, none where the
// strategy is pinned or nothing is to be seen; and what the command line says of it.
#include <atomic>
#include <catch2/catch.hpp>
#include <filesystem>

#include "src/pilot.h"
#include "src/work_weights.h"
#include "tests/cli_process.h"
#include "tests/reference/analytic_scenes.h"
#include "tests/temp_folder.h"

namespace {

using namespace clume;

const std::atomic<bool> go_on{false};

/// Two lights that are sampled directly, so that estimators matter; small.
Scene lit_mixture(int n, double overlap) {
    Scene scene = reference::random_mixture(KernelFamily::gaussian, n, 9, overlap, 2);
    scene.film = {24, 24};
    scene.lights.clear();
    Light sun;
    sun.kind = LightKind::directional;
    sun.direction = {0.2, -1, 0.3};
    sun.irradiance = glm::dvec3(2);
    scene.lights.push_back(sun);
    return scene;
}

}  // namespace

TEST_CASE("Pilot.ChoosesTheLeastInverseEfficiencyAgainAndAgain") {
    const Scene scene = lit_mixture(120, 10);
    std::optional<Pilot> first;
    for (int run = 0; run < 3; ++run) {
        const test::TempFolder folder;
        RenderOptions options;
        if (run == 1) options.cpu_split = 2, options.vector_width = 4;
        if (run == 2) options.batch_samples = 3, options.crop = CropWindow{3, 3, 9, 9};
        Scene other = scene;
        other.render.spp = 1 + static_cast<std::uint32_t>(run);
        const auto pilot = run_pilot(other, options, folder.path(), go_on);
        REQUIRE(pilot);
        if (!first) first = pilot;
        REQUIRE(pilot->rows.size() == first->rows.size());
        CHECK(pilot->chosen == first->chosen);
        for (std::size_t i = 0; i < pilot->rows.size(); ++i) {
            const PilotRow &row = pilot->rows[i], &same = first->rows[i];
            INFO(row.pair.label());
            CHECK(row.error.empty());
            CHECK(row.variance == same.variance);
            CHECK(row.work_ns == same.work_ns);
            CHECK(row.too_slow == same.too_slow);
            CHECK(row.work_ns > 0);
            if (!row.measured()) continue;
            CHECK(row.variance > 0);
            CHECK(pilot->rows[pilot->chosen].inverse_efficiency() <= pilot_margin * row.inverse_efficiency());
            if (row.pair.estimator == "analytic") CHECK(pilot->rows[pilot->chosen].inverse_efficiency() <= row.inverse_efficiency());
        }
        // Kept: the second time it is read.
        const auto again = run_pilot(other, options, folder.path(), go_on);
        REQUIRE(again);
        CHECK(again->chosen == pilot->chosen);
        CHECK(again->rows.back().work_ns == pilot->rows.back().work_ns);
    }
    std::size_t estimators = 0, bounds = 0;
    for (const PilotRow& row : first->rows) {
        estimators += row.pair.estimator != "analytic";
        bounds += row.pair.strategy == "delta" && row.pair.estimator == "analytic";
    }
    CHECK(estimators == 3);
    CHECK(bounds == 2);
}

TEST_CASE("Pilot.FindsWhatIsCheapest") {
    // Under high overlap every chord of decomposition is dear, and sorting them so dear that it is given up.
    const test::TempFolder folder;
    Scene scene = lit_mixture(400, 40);
    const auto pilot = run_pilot(scene, {}, folder.path(), go_on);
    REQUIRE(pilot);
    CHECK(pilot->rows[pilot->chosen].pair.strategy == "delta");
    double work[3] = {};
    for (const PilotRow& row : pilot->rows) {
        if (row.pair.label() == "delta:tree/analytic") work[0] = row.work_ns;
        if (row.pair.label() == "decomposition/analytic") work[1] = row.work_ns;
        if (row.pair.label() == "regular/analytic") work[2] = row.work_ns;
    }
    CHECK(work[0] > 0);
    CHECK(work[0] < work[1]);
    CHECK(work[1] < work[2]);
    CHECK(work[2] == strategy_patience * work[0]);
}

TEST_CASE("Pilot.GivesUpWhatTakesForEver") {
    // A million mean free paths deep: null collisions beside the ball, where a cell's bound still holds, hardly move a ray.
    const test::TempFolder folder;
    Scene scene = lit_mixture(1, 1);
    scene.media[0].kernel = KernelFamily::uniform;
    scene.media[0].density_scale = 1e7;
    const auto pilot = run_pilot(scene, {}, folder.path(), go_on);
    REQUIRE(pilot);
    CHECK(pilot->rows[pilot->chosen].measured());
    CHECK(pilot->rows[pilot->chosen].pair.strategy == "decomposition");
    std::size_t given_up = 0;
    for (const PilotRow& row : pilot->rows) {
        INFO(row.pair.label() << ", work " << row.work_ns);
        CHECK(row.error.empty());
        given_up += row.too_slow;
        // Null collisions by a rough idea of decomposition's work, from a sample a pixel.
        const double patience = row.pair.strategy == "delta" ? 0.9 * pilot_patience : strategy_patience;
        if (row.too_slow) CHECK(row.work_ns >= patience * pilot->rows[pilot->chosen].work_ns);
    }
    CHECK(given_up >= 1);
    const auto again = run_pilot(scene, {}, folder.path(), go_on);  // kept, with what was given up
    REQUIRE(again);
    for (std::size_t i = 0; i < pilot->rows.size(); ++i) CHECK(again->rows[i].too_slow == pilot->rows[i].too_slow);
}

TEST_CASE("Pilot.NotWhereNothingIsToChoose", "[quick]") {
    const test::TempFolder folder;
    Scene scene = lit_mixture(5, 3);
    scene.render.strategy = "regular";
    CHECK_FALSE(run_pilot(scene, {}, folder.path(), go_on));
    scene.render.strategy = "auto";
    scene.media.clear();
    CHECK_FALSE(run_pilot(scene, {}, folder.path(), go_on));
    scene = lit_mixture(5, 3);
    scene.camera.target = scene.camera.origin + glm::dvec3(0, 0, -1);  // looks away
    CHECK_FALSE(run_pilot(scene, {}, folder.path(), go_on));
    const std::atomic<bool> stop{true};
    CHECK_FALSE(run_pilot(lit_mixture(5, 3), {}, folder.path(), stop));
    // Nor as long as all of the render may take: and what was cut short is not kept.
    RenderOptions hurried;
    hurried.time_limit_s = 1e-3;
    const auto cut = run_pilot(lit_mixture(5, 3), hurried, folder.path(), go_on);
    REQUIRE(cut);
    CHECK(cut->cut_short);
    CHECK(cut->pair().label() == "delta/analytic");
    CHECK_THAT(cut->summary(), Catch::Contains("as long as the time limit"));
    CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("Pilot.IsToldByExplainAndTheImage") {
    const test::SceneFolder folder;
    test::Process run({"render", "puff.json", "--quiet", "--explain", "-D", "render.strategy=auto", "--stats-json", "s.json"}, folder.path);
    CHECK(run.wait() == 0);
    CHECK_THAT(run.err, Catch::Contains("pilot delta:tree/analytic") && Catch::Contains("<- chosen"));
    std::ifstream in(folder.path / "s.json");
    const std::string stats{std::istreambuf_iterator<char>(in), {}};
    CHECK_THAT(stats, Catch::Contains("auto chose "));
    test::Process pinned({"render", "puff.json", "--quiet", "--explain", "-D", "render.strategy=decomposition"}, folder.path);
    CHECK(pinned.wait() == 0);
    CHECK(pinned.err.find("pilot") == std::string::npos);
}

TEST_CASE("Pilot.GpusHaveWeightsOfTheirOwn", "[quick]") {
    DeviceInfo cpu, gpu;
    cpu.type = "cpu";
    gpu.type = "gpu";
    CHECK(work_weights(std::vector{gpu, gpu}) == gpu_work_weights);
    CHECK(work_weights(std::vector{cpu}) == cpu_work_weights);
    CHECK(work_weights(std::vector{gpu, cpu}) == cpu_work_weights);
    // Operations per path as the pilot counts them and nanoseconds per path, of renders on an H100 (docs/performance.md).
    struct Measured {
        const char* what;
        WorkWeights counts;
        double ns;
    };
    const Measured measured[] = {{"plume, delta/binary", {28.7, 0, 0, 19.4, 0, 0, 0, 0, 19.4, 4.02}, 3.64},
                                 {"plume, delta/analytic", {20.3, 12.2, 10.5, 12.0, 0, 0, 0, 0, 12.0, 4.02}, 18.9},
                                 {"cloud, delta/binary", {62.2, 0, 0, 26.4, 0, 0, 0, 0, 26.4, 4.56}, 2.81},
                                 {"fire, delta", {35.5, 0, 0, 8.28, 0, 0, 0, 0, 8.28, 2.09}, 2.19},
                                 {"smoke_dense, delta", {33.3, 0, 0, 10.7, 0, 0, 0, 0, 10.7, 4.01}, 2.90},
                                 {"smoke, regular", {0, 8.23, 11.8, 0, 0, 0, 45.6, 1.79, 1.29, 1.29}, 64}};
    for (const Measured& m : measured) {
        double ns = 0;
        for (std::size_t k = 0; k < WORK_KINDS; ++k) ns += gpu_work_weights[k] * m.counts[k];
        INFO(m.what << ": " << ns << " ns by the weights");
        CHECK(ns < 1.7 * m.ns);
        CHECK(m.ns < 1.7 * ns);
    }
}
