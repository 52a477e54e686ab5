// SPDX-License-Identifier: MIT
// `clume compare`: on a small scene with a coarse marching step, what it finds; then the built binary: its report's files, bad
// arguments, folders that are not its own, and Ctrl-C.
#include <rapidjson/document.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "src/compare_summary.h"
#include "src/image_writer.h"
#include "src/scene_reader.h"
#include "tests/cli_process.h"

using namespace clume;
using namespace clume::test;

namespace {

std::string read_text(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

/// What is wrong with the nesting of a page's tags, or nothing.
std::string nesting_error(const std::string& html) {
    std::vector<std::string> open;
    for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
        const std::size_t end = html.find('>', at);
        if (end == std::string::npos) return "a tag without end";
        const std::string tag = html.substr(at + 1, end - at - 1);
        if (tag.starts_with('!') || tag.ends_with('/')) continue;
        if (!tag.starts_with('/')) {
            open.push_back(tag.substr(0, tag.find_first_of(" \n")));
            continue;
        }
        if (open.empty() || open.back() != tag.substr(1)) return "</" + tag.substr(1) + "> closes " + (open.empty() ? "nothing" : open.back());
        open.pop_back();
    }
    return open.empty() ? "" : open.back() + " is left open";
}

void check_page(const std::string& html) {
    CHECK_THAT(html, Catch::StartsWith("<!DOCTYPE html>"));
    CHECK(nesting_error(html) == "");
    for (const char* outside : {"http:", "https:", "file:", "<script", "<link", "@import", "url(", "href="}) {
        INFO(outside);
        CHECK(html.find(outside) == std::string::npos);
    }
    for (std::size_t at = html.find("src=\""); at != std::string::npos; at = html.find("src=\"", at + 1)) REQUIRE(html.compare(at + 5, 5, "data:") == 0);
}

rapidjson::Document parse_json(const std::string& text) {
    rapidjson::Document json;
    json.Parse(text.c_str());
    REQUIRE_FALSE(json.HasParseError());
    return json;
}

constexpr const char* columns = "strategy,estimator,device,seed,spp,seconds,mpaths_s,density_evals,primitive_tests,mse,relmse,bias,bias_ci,inverse_efficiency";

}  // namespace

TEST_CASE("Compare.CoarseMarchingIsFoundBiasedAndTheUnbiasedAreNot") {
    const SceneFolder folder;
    const Scene scene = read_scene(folder.path / "puff.json", std::vector<Override>{{"render.step", "0.7"}});
    CompareOptions options;
    options.pairs = {{"delta", "analytic"}, {"decomposition", "analytic"}, {"march", "analytic"}};
    options.spp = {1, 4, 32};
    const std::atomic<bool> stop{false};
    const Comparison c = compare(scene, options, {}, stop);
    REQUIRE(c.rows.size() == 3 * 3 * 8);
    REQUIRE(c.agreement);
    CHECK(c.agreement->accepted());
    CHECK(c.halves[0].pair.strategy != c.halves[1].pair.strategy);
    CHECK(c.seeds_done == 8);
    CHECK_FALSE(c.estimator_matters);
    const CompareSummary s = summarise(c);
    CHECK(s.pairs[0].finding == Finding::no_bias_found);
    CHECK(s.pairs[1].finding == Finding::no_bias_found);
    CHECK(s.pairs[2].finding == Finding::biased);
    REQUIRE(s.fastest_unbiased);
    CHECK(*s.fastest_unbiased < 2);
    CHECK(s.cheapest_biased == std::size_t{2});
    CHECK_THAT(s.verdict[0], Catch::StartsWith("Fastest unbiased: "));
    CHECK_THAT(s.verdict[1], Catch::StartsWith("Cheapest biased: march/analytic") && Catch::Contains("How wrong it is"));
    for (std::size_t k = 0; k < 2; ++k) {
        // 32 times the samples, a 32nd of the error; and the error is the variance that the images themselves state.
        const double first = summarise(c, k, 0).mse.mean, last = summarise(c, k, 2).mse.mean;
        CHECK(first / last == Approx(32).epsilon(0.3));
        double variance = 0;
        for (const double v : c.pairs[k].variance) variance += v;
        CHECK(last == Approx(8 * variance / static_cast<double>(c.pairs[k].variance.size())).epsilon(0.15));
        CHECK(c.pairs[k].primitive_tests > 0);
    }
    CHECK(c.pairs[0].density_evals > 0);
    CHECK(c.pairs[2].density_evals > 0);
    for (const CompareRow& row : c.rows) {
        CHECK(row.seconds > 0);
        CHECK(row.inverse_efficiency() == row.errors.mse * row.seconds);
    }
}

TEST_CASE("Compare.EqualTimeIsSharedOutEvenly") {
    const SceneFolder folder;
    const Scene scene = read_scene(folder.path / "puff.json", {});
    CompareOptions options;
    options.pairs = {{"delta", "analytic"}, {"march", "analytic"}};
    options.time_s = 0.4;
    options.seeds = 2;
    const std::atomic<bool> stop{false};
    const Comparison c = compare(scene, options, {}, stop);
    for (std::size_t k = 0; k < 2; ++k) {
        const LevelSummary last = summarise(c, k, c.level);
        CHECK(last.rows == 2);
        CHECK(last.seconds > 0.2);
        CHECK(last.seconds < 1.6);  // a busy machine
        CHECK(summarise(c, k, 0).seconds < 0.7 * last.seconds);
    }
}

TEST_CASE("Compare.ReferenceFromAFile") {
    const SceneFolder folder;
    const Scene scene = read_scene(folder.path / "puff.json", {});
    RenderOptions render_options;
    const std::atomic<bool> stop{false};
    Scene long_scene = scene;
    long_scene.render.spp = 256;
    long_scene.render.seed = 99;
    RenderImage truth = render(long_scene, render_options, {}, stop).image;
    write_exr(folder.path / "truth.exr", truth);
    CompareOptions options;
    options.pairs = {{"delta", "analytic"}};
    options.spp = {4};
    options.seeds = 2;
    options.reference = folder.path / "truth.exr";
    const Comparison c = compare(scene, options, {}, stop);
    CHECK(c.halves.empty());
    CHECK(c.reference.rgb[3 * 400] == static_cast<double>(truth.rgb[3 * 400]));
    CHECK(c.reference.mean_variance() > 0);
    CHECK(c.rows.size() == 2);
    for (float& v : truth.rgb) v *= 1.5f;
    write_exr(folder.path / "wrong.exr", truth);
    options.reference = folder.path / "wrong.exr";
    const Comparison wrong = compare(scene, options, {}, stop);
    CHECK(wrong.rows[0].errors.bias < 0);
    CHECK(summarise(wrong).pairs[0].finding == Finding::biased);
}

TEST_CASE("Binary.CompareWritesAWholeReport") {
    const SceneFolder folder;
    Process process({"compare", "puff.json", "-o", "out/report", "--strategies", "delta,march:tree", "--seeds", "2"}, folder.path);
    CHECK(process.wait() == 2);
    CHECK_THAT(process.err, Catch::Contains("a bound makes no difference"));

    const Words words{"compare", "puff.json", "-o", "out/report", "--strategies", "delta/analytic,decomposition", "--seeds", "3", "--spp", "2,5"};
    Process run(words, folder.path);
    const int code = run.wait();
    INFO(run.err);
    REQUIRE(code == 0);
    CHECK_THAT(run.out, Catch::StartsWith("Fastest unbiased: ") && Catch::EndsWith("out/report/index.html\n"));
    const fs::path report = folder.path / "out/report";
    const std::vector<std::string> csv = lines_of(read_text(report / "results.csv"));
    REQUIRE(csv.size() == 1 + 2 * 3 * 2);
    CHECK(csv[0] == columns);
    for (const std::string& line : csv) CHECK(std::count(line.begin(), line.end(), ',') == 13);
    const rapidjson::Document json = parse_json(read_text(report / "results.json"));
    CHECK(json["rows"].Size() == 12);
    CHECK(json["pairs"].Size() == 2);
    CHECK(json["reference"]["accepted"].GetBool());
    CHECK_FALSE(json["interrupted"].GetBool());
    CHECK(json["command"] == "clume compare puff.json -o out/report --strategies delta/analytic,decomposition --seeds 3 --spp 2,5");
    CHECK(json["rows"][0]["inverse_efficiency"].GetDouble() == Approx(json["rows"][0]["mse"].GetDouble() * json["rows"][0]["seconds"].GetDouble()));
    const std::string page = read_text(report / "index.html");
    check_page(page);
    CHECK_THAT(page, Catch::Contains("delta/analytic") && Catch::Contains("Fastest unbiased"));
    for (const char* name : {"reference.exr", "reference.png", "pairs/delta_analytic.exr", "pairs/delta_analytic.png", "pairs/delta_analytic_error.png",
                             "pairs/delta_analytic_cost.png", "pairs/decomposition_analytic_error.png", "plot.gp"})
        CHECK(fs::file_size(report / name) > 0);
    const RenderImage image = read_exr(report / "pairs/delta_analytic.exr");
    CHECK(image.samples[0] == 15);
    if (run.err.find("gnuplot cannot be run") == std::string::npos)
        for (const char* name : {"rmse", "inverse_efficiency", "bias"}) {
            CHECK(read_text(report / (std::string(name) + ".svg")).find("</svg>") != std::string::npos);
            CHECK(read_text(report / (std::string(name) + ".png")).substr(1, 3) == "PNG");
        }
    for (const auto& entry : fs::recursive_directory_iterator(report)) CHECK_FALSE(entry.path().filename().string().starts_with(".clume"));

    // Its own folder is written again, and what the new report does not hold is gone; a pair that cannot run is told.
    Process again({"compare", "puff.json", "-o", "out/report", "--strategies", "decomposition", "--seeds", "2", "--spp", "1", "--quiet", "--reference", "out/report/reference.exr"},
                  folder.path);
    CHECK(again.wait() == 0);
    CHECK_FALSE(fs::exists(report / "pairs/delta_analytic.exr"));
    CHECK(lines_of(read_text(report / "results.csv")).size() == 3);
    CHECK_THAT(again.err, !Catch::Contains("Mpaths/s"));
}

TEST_CASE("Binary.CompareRefusesWhatIsNotItsOwn") {
    const SceneFolder folder;
    fs::create_directory(folder.path / "mine");
    std::ofstream(folder.path / "mine/thesis.txt") << "years of work";
    std::ofstream(folder.path / "mine/results.json") << "{\"mine\": 1}";
    write_exr(folder.path / "small.exr", [] {
        RenderImage image;
        image.film_width = image.film_height = 2;
        image.window = {0, 0, 2, 2};
        image.rgb.resize(12);
        image.variance.resize(12);
        image.alpha.resize(4);
        image.samples.resize(4);
        return image;
    }());
    check_wrong_uses(folder.path, {
        {{"compare"}, 2, "which scene?"},
        {{"compare", "puff.json", "--strategies", "dleta"}, 2, "the nearest is 'delta'"},
        {{"compare", "puff.json", "--strategies", "delta/ration"}, 2, "the nearest is 'ratio'"},
        {{"compare", "puff.json", "--strategies", "delta:gird/ratio"}, 2, "the nearest is 'grid'"},
        {{"compare", "puff.json", "--strategies", "delta/ratio/x"}, 2, "must be strategy"},
        {{"compare", "puff.json", "--strategies", "delta,,march"}, 2, "must be strategy"},
        {{"compare", "puff.json", "--spp", "8,4"}, 2, "that rise"},
        {{"compare", "puff.json", "--spp", "many"}, 2, "--spp many"},
        {{"compare", "puff.json", "--spp", "4", "--time", "1"}, 2, "either"},
        {{"compare", "puff.json", "--time", "0"}, 2, "positive"},
        {{"compare", "puff.json", "--seeds", "1"}, 2, "at least 2"},
        {{"compare", "puff.json", "--strategy", "delta"}, 2, "'--strategies'"},
        {{"compare", "puff.json", "--reference", "small.exr", "-o", "new"}, 2, "is 2 x 2 pixels, the film is 32 x 24"},
        {{"compare", "puff.json", "--reference", "none.exr", "-o", "new"}, 1, "none.exr"},
        {{"compare", "none.json"}, 3, "none.json"},
        {{"compare", "puff.json", "--device", "nosuchdevice", "-o", "new"}, 4, "nosuchdevice"},
        {{"compare", "puff.json", "-o", "mine"}, 1, "nothing was changed"},
        {{"compare", "puff.json", "-o", "puff.json"}, 1, "is not a folder"},
    });
    CHECK(read_text(folder.path / "mine/thesis.txt") == "years of work");
    CHECK(read_text(folder.path / "mine/results.json") == "{\"mine\": 1}");
}

TEST_CASE("Binary.InterruptedCompareLeavesAValidReport") {
    const SceneFolder folder;
    Process process({"compare", "puff.json", "-o", "report", "--strategies", "delta,decomposition", "--spp", "4", "--seeds", "100000"}, folder.path);
    // The second seed is under way: the first has its rows.
    const bool started = process.read_until(
        [&] {
            const std::size_t at = process.err.rfind("  seed ");
            return at != std::string::npos && std::atoi(process.err.c_str() + at + 7) >= 2;
        },
        120);
    INFO(process.err);
    REQUIRE(started);
    process.send(SIGINT);
    CHECK(process.wait() == 130);
    CHECK_THAT(process.err, Catch::Contains("interrupted: the report holds what was done"));
    const fs::path report = folder.path / "report";
    const std::vector<std::string> csv = lines_of(read_text(report / "results.csv"));
    CHECK(csv.size() > 1 + 2 * 3);
    CHECK(csv.size() < 1 + 2 * 3 * 100000);
    const rapidjson::Document json = parse_json(read_text(report / "results.json"));
    CHECK(json["interrupted"].GetBool());
    CHECK(json["rows"].Size() == csv.size() - 1);
    check_page(read_text(report / "index.html"));
    CHECK_THAT(process.out, Catch::Contains("Interrupted: "));
}
