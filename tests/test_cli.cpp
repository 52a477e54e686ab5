// SPDX-License-Identifier: MIT
// The command line, first as parsed, then as the built binary behaves: exit codes, the line said on stderr, what is on
// stdout, what is left in the folder, and Ctrl-C.
#include <algorithm>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "src/cli.h"
#include "src/error.h"
#include "src/image_writer.h"
#include "tests/cli_process.h"

using namespace clume;
using namespace clume::test;

namespace {

Command parse(Words words) {
    words.insert(words.begin(), "clume");
    std::vector<const char*> argv;
    for (const std::string& word : words) argv.push_back(word.c_str());
    return parse_command_line(static_cast<int>(argv.size()), argv.data());
}

std::string usage_error(const Words& words) {
    try {
        parse(words);
    } catch (const UsageError& error) {
        return error.what();
    }
    return "no error";
}

}  // namespace

TEST_CASE("CommandLine.LastOverrideWins", "[quick]") {
    const auto command = std::get<RenderCommand>(
        parse({"render", "--spp", "1", "-D", "render.spp=2", "a/b.json", "-Dfilm.width=9", "--max-depth", "-1", "--spp=3"}));
    CHECK(command.scene == "a/b.json");
    CHECK(command.exr == "b.exr");
    CHECK(command.png() == "b.png");
    Words overrides;
    for (const Override& o : command.overrides) overrides.push_back(o.key + "=" + o.value);
    CHECK(overrides == Words{"render.spp=1", "render.spp=2", "film.width=9", "render.max_depth=-1", "render.spp=3"});
}

TEST_CASE("CommandLine.RenderFlagsReachTheOptions", "[quick]") {
    const auto command = std::get<RenderCommand>(parse({"render",
                                                        "s.json",
                                                        "-o",
                                                        "x.exr",
                                                        "-o",
                                                        "d/y.exr",
                                                        "--sample-range",
                                                        "3:8",
                                                        "--crop",
                                                        "1,2,30,20",
                                                        "--time-limit",
                                                        "2.5",
                                                        "--device",
                                                        "cpu,gpu",
                                                        "--device",
                                                        "p0d1",
                                                        "--cpu-split",
                                                        "2",
                                                        "--exposure",
                                                        "-1.5",
                                                        "--quiet",
                                                        "--stats-json",
                                                        "-"}));
    CHECK(command.exr == "d/y.exr");
    CHECK(command.png() == "d/y.png");
    CHECK(command.options.sample_begin == 3);
    CHECK(command.options.sample_end == 8);
    REQUIRE(command.options.crop);
    CHECK(command.options.crop->x0 == 1);
    CHECK(command.options.crop->y1 == 20);
    CHECK(command.options.time_limit_s == 2.5);
    CHECK(command.options.devices == Words{"cpu,gpu", "p0d1"});
    CHECK(command.options.cpu_split == 2);
    CHECK(command.exposure_stops == -1.5);
    CHECK(command.quiet);
    CHECK_FALSE(command.explain);
    CHECK(command.stats_json == fs::path("-"));
}

TEST_CASE("CommandLine.WrongWordsNameTheNearestRightOne", "[quick]") {
    CHECK_THAT(usage_error({"render", "s.json", "--sppp", "3"}), Catch::EndsWith("the nearest is '--spp'"));
    CHECK_THAT(usage_error({"render", "--sedd=3", "s.json"}), Catch::EndsWith("the nearest is '--seed'"));
    CHECK_THAT(usage_error({"render", "s.json", "--samples", "3"}), Catch::EndsWith("the nearest is '--sample-range'"));
    CHECK_THAT(usage_error({"render", "s.json", "--depth", "3"}), Catch::EndsWith("the nearest is '--max-depth'"));
    CHECK_THAT(usage_error({"rendr", "s.json"}), Catch::EndsWith("the nearest is 'render'"));
    CHECK_THAT(usage_error({"device"}), Catch::EndsWith("the nearest is 'devices'"));
    CHECK_THAT(usage_error({"s.json"}), Catch::EndsWith("clume render s.json"));
    CHECK_THAT(usage_error({"--spp", "3", "render", "s.json"}), Catch::Contains("belongs after"));
    CHECK(in_typed_words("-D render.spp=0: too small", std::vector<std::string_view>{"--spp", "0"}) == "--spp 0: too small");
    CHECK(in_typed_words("-D render.spp=0: too small", std::vector<std::string_view>{"-D", "x=0"}) ==
          "-D render.spp=0: too small");
}

TEST_CASE("CommandLine.WrongUseIsOneLine", "[quick]") {
    const std::vector<Words> wrong{{},
                                   {"render"},
                                   {"info"},
                                   {"render", "a.json", "b.json"},
                                   {"render", "a.json", "--spp"},
                                   {"render", "a.json", "-D", "spp"},
                                   {"render", "a.json", "-D", "=3"},
                                   {"render", "a.json", "-o", "a.png"},
                                   {"render", "a.json", "--crop", "1,2,3"},
                                   {"render", "a.json", "--crop", "1,2,3,4,5"},
                                   {"render", "a.json", "--crop", "5,0,5,9"},
                                   {"render", "a.json", "--crop", "-1,0,5,9"},
                                   {"render", "a.json", "--sample-range", "5:5"},
                                   {"render", "a.json", "--sample-range", "5"},
                                   {"render", "a.json", "--sample-range", "1:99999999999"},
                                   {"render", "a.json", "--time-limit", "0"},
                                   {"render", "a.json", "--time-limit", "nan"},
                                   {"render", "a.json", "--noise-threshold", "0"},
                                   {"render", "a.json", "--noise-threshold", "-0.1"},
                                   {"render", "a.json", "--noise-threshold", "nan"},
                                   {"render", "a.json", "--noise-threshold", "inf"},
                                   {"render", "a.json", "--noise-threshold", "5"},
                                   {"render", "a.json", "--noise-threshold", "5%"},
                                   {"render", "a.json", "--noise-threshold", "0.1", "--sample-range", "0:8"},
                                   {"render", "a.json", "--noise-threshold", ""},
                                   {"render", "a.json", "--time-limit", ""},
                                   {"render", "a.json", "--device", ""},
                                   {"compare", "a.json", "--seeds", ""},
                                   {"render", "a.json", "--cpu-split", "0"},
                                   {"render", "a.json", "--exposure", "bright"},
                                   {"render", "a.json", "--stats-json", "a.exr"},
                                   {"devices", "all"}};
    for (const Words& words : wrong) {
        const std::string message = usage_error(words);
        INFO(message);
        CHECK(message != "no error");
        CHECK(message.find('\n') == std::string::npos);
    }
}

TEST_CASE("CommandLine.HelpAndVersionSucceed", "[quick]") {
    CHECK_THAT(std::get<PrintCommand>(parse({"--help"})).text, Catch::Contains("devices"));
    CHECK_THAT(std::get<PrintCommand>(parse({"render", "--help"})).text, Catch::Contains("--spp"));
    CHECK_THAT(std::get<PrintCommand>(parse({"--version"})).text, Catch::StartsWith("clume "));
}

TEST_CASE("Binary.ExitCodes") {
    const SceneFolder folder;
    std::ofstream(folder.path / "broken.json") << "{\n  \"film\": {";
    check_wrong_uses(folder.path, {
        {{"render", "puff.json", "--sppp", "3"}, 2, "'--spp'"},
        {{"nosuch"}, 2, "unknown subcommand"},
        {{"render", "puff.json", "--spp", "zero"}, 2, "--spp zero"},
        {{"render", "puff.json", "--crop", "0,0,33,24"}, 2, "32 x 24"},
        {{"render", "none.json"}, 3, "none.json"},
        {{"render", "broken.json"}, 3, "broken.json:2:"},
        {{"render", "puff.json", "--device", "nosuchdevice"}, 4, "nosuchdevice"},
        {{"render", "puff.json", "-o", "none/a.exr"}, 1, "none: cannot write in this folder"},
        {{"render", "puff.json", "--stats-json", "none/a.json"}, 1, "none: cannot write in this folder"},
    });
}

TEST_CASE("Binary.UnknownDeviceListsThoseThereAre") {
    const SceneFolder folder;
    Process devices({"devices"}, folder.path);
    REQUIRE(devices.wait() == 0);
    const std::string id = devices.out.substr(0, devices.out.find_first_of(" \n"));
    Process process({"render", "puff.json", "--device", "nosuchdevice"}, folder.path);
    CHECK(process.wait() == 4);
    CHECK_THAT(process.err, Catch::Contains(id));
}

TEST_CASE("Binary.RenderPrintsThePathsOfTwoWholeImages") {
    const SceneFolder folder;
    Process process({"render", "puff.json", "--stats-json", "stats.json", "--crop", "4,4,20,16", "--quiet"}, folder.path);
    const int code = process.wait();
    INFO(process.err);
    REQUIRE(code == 0);
    CHECK(process.out == "puff.exr\npuff.png\n");
    CHECK(folder.files() == 4);
    ImageMetadata metadata;
    const RenderImage image = read_exr(folder.path / "puff.exr", &metadata);
    CHECK(image.film_width == 32);
    CHECK(image.window.x0 == 4);
    CHECK(image.rgb.size() == 3 * 16 * 12);
    const auto spp = std::find_if(metadata.begin(), metadata.end(), [](const auto& entry) { return entry.first == "samples"; });
    REQUIRE(spp != metadata.end());
    CHECK(spp->second == "4");
}

TEST_CASE("Binary.InterruptWritesWhatIsDone") {
    const SceneFolder folder;
    const int signal_number = GENERATE(SIGINT, SIGTERM);
    Process process({"render", "puff.json", "--spp", "100000000"}, folder.path);
    // The first progress line that has samples, so that there is something to write.
    const bool started = process.read_until(
        [&] {
            const std::size_t at = process.err.rfind(" of ");
            return at != std::string::npos && at >= 3 && process.err.substr(at - 3, 3) != "  0";
        },
        180);
    INFO(process.err);
    REQUIRE(started);
    process.send(signal_number);
    CHECK(process.wait() == 130);
    INFO(process.err);
    CHECK_THAT(process.err, Catch::Contains("interrupted: the image holds "));
    CHECK(process.out == "puff.exr\npuff.png\n");
    CHECK(folder.files() == 3);
    const RenderImage image = read_exr(folder.path / "puff.exr");
    CHECK(*std::max_element(image.samples.begin(), image.samples.end()) > 0);
}

TEST_CASE("Binary.TimeLimitWritesWhatIsDone") {
    const SceneFolder folder;
    Process process({"render", "puff.json", "--spp", "100000000", "--time-limit", "2"}, folder.path);
    const int code = process.wait();
    INFO(process.err);
    CHECK(code == 0);
    CHECK_THAT(process.err, Catch::Contains("time limit reached"));
    CHECK(fs::exists(folder.path / "puff.exr"));
}
