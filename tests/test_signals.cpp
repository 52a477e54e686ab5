// SPDX-License-Identifier: MIT
// Signals, full disks and folders that go away, seen from outside: no file under an image's name is ever cut short, no
// temporary file stays, and an image that was finished is not lost.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <thread>

#include "src/image_writer.h"
#include "tests/cli_process.h"

using namespace clume;
using namespace clume::test;

namespace {

const Words job{"render", "puff.json", "--quiet", "--spp", "24", "-D", "film.width=200", "-D", "film.height=150"};

std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// All files are what they should be: the scene, an EXR and a PNG that can be read to their ends. read_exr throws otherwise.
void check_files(const fs::path& folder) {
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        INFO(name);
        CHECK((name == "puff.json" || name == "puff.exr" || name == "puff.png"));
    }
    if (fs::exists(folder / "puff.exr")) CHECK_NOTHROW(read_exr(folder / "puff.exr"));
    if (fs::exists(folder / "puff.png")) {
        const std::string png = bytes_of(folder / "puff.png");
        REQUIRE(png.size() > 12);
        CHECK(png.substr(png.size() - 8, 4) == "IEND");
    }
}

bool same(const RenderImage& a, const RenderImage& b) { return a.rgb == b.rgb && a.alpha == b.alpha && a.samples == b.samples; }

/// The environment of a process that is struck inside a call on a file (fault_layer/file_faults.cpp).
Words struck(const std::string& fault) { return {"LD_PRELOAD=" CLUME_FILE_FAULTS, "CLUME_FILE_FAULT=" + fault, "ASAN_OPTIONS=verify_asan_link_order=0"}; }

struct Ended {
    int code;
    std::string out, err;
    Ended(const Words& words, const fs::path& folder, const Words& environment = {}, const Words& before = {}) {
        Process process(words, folder, environment, before);
        code = process.wait(240);
        out = process.out;
        err = process.err;
    }
};

}  // namespace

TEST_CASE("Signals.AtAHundredRandomMoments") {
    const SceneFolder folder;
    REQUIRE(Ended(job, folder.path).code == 0);  // compiled from now on
    const auto start = std::chrono::steady_clock::now();
    REQUIRE(Ended(job, folder.path).code == 0);
    const double whole_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const RenderImage whole = read_exr(folder.path / "puff.exr");
    const std::string saved = bytes_of(folder.path / "puff.exr");
    std::mt19937 random(11);
    int interrupted = 0;
    for (int k = 0; k < 100; ++k) {
        // Every second time an image is there already, and must outlive this run.
        const bool fresh = k % 2 == 0;
        fs::remove(folder.path / "puff.png");
        if (fresh) fs::remove(folder.path / "puff.exr");
        else std::ofstream(folder.path / "puff.exr", std::ios::binary) << saved;
        const int signal_number = std::array{SIGINT, SIGTERM, SIGHUP}[static_cast<std::size_t>(k % 3)];
        Process process(job, folder.path);
        std::this_thread::sleep_for(std::chrono::duration<double>(1.1 * whole_s * static_cast<double>(random()) / 4294967296.0));
        process.send(signal_number);
        const int code = process.wait(240);
        INFO(k << ": signal " << signal_number << ", code " << code << "\n" << process.err);
        check_files(folder.path);
        if (code == 0) CHECK(same(read_exr(folder.path / "puff.exr"), whole));
        else if (code == -signal_number) CHECK(process.out.empty());  // before clume listens: nothing was begun
        else CHECK(code == 130);
        if (process.out.find("puff.exr") != std::string::npos) CHECK(fs::exists(folder.path / "puff.exr"));
        if (!fresh) CHECK(fs::exists(folder.path / "puff.exr"));
        interrupted += code == 130 ? 1 : 0;
    }
    CHECK(interrupted > 10);
}

TEST_CASE("Signals.SecondInterruptWhileWritingWaitsForTheImage") {
    const SceneFolder folder;
    const Ended twice(job, folder.path, struck("call=fsync,signal=2,again=1"));
    INFO(twice.err);
    CHECK(twice.code == 0);
    CHECK_THAT(twice.err, Catch::Contains("the image is being written"));
    check_files(folder.path);
    CHECK(fs::exists(folder.path / "puff.exr"));
    fs::remove(folder.path / "puff.exr");
    const Ended thrice(job, folder.path, struck("call=fsync,signal=2,again=2"));
    INFO(thrice.err);
    CHECK(thrice.code == 130);
    check_files(folder.path);
}

TEST_CASE("Signals.KilledWhileWritingLeavesTheOldImage") {
    const SceneFolder folder;
    REQUIRE(Ended(job, folder.path).code == 0);
    const std::string exr = bytes_of(folder.path / "puff.exr"), png = bytes_of(folder.path / "puff.png");
    Words other = job;
    other.insert(other.end(), {"--seed", "5"});
    for (const char* fault : {"call=fsync,signal=9", "call=linkat,signal=9", "call=rename,n=1,signal=9", "call=fsync,n=3,signal=9"}) {
        const Ended run(other, folder.path, struck(fault));
        INFO(fault << "\n" << run.err);
        CHECK(run.code == -SIGKILL);
        const bool after_exr = std::string(fault) == "call=fsync,n=3,signal=9";  // its file and folder were synced: now the PNG's
        if (after_exr) CHECK_NOTHROW(read_exr(folder.path / "puff.exr"));
        else CHECK(bytes_of(folder.path / "puff.exr") == exr);
        CHECK(bytes_of(folder.path / "puff.png") == png);
        for (const auto& entry : fs::directory_iterator(folder.path))  // between link and rename a second, whole file is there
            if (entry.path().extension() == ".tmp") fs::remove(entry.path());
    }
}

TEST_CASE("Files.FolderRemovedWhileRendering") {
    const SceneFolder folder;
    fs::create_directory(folder.path / "out");
    Process process({"render", "puff.json", "--spp", "100000000", "-D", "film.width=200", "-D", "film.height=150", "-o", "out/puff.exr"}, folder.path);
    REQUIRE(process.read_until([&] { return process.err.find(" of ") != std::string::npos; }, 180));
    fs::remove_all(folder.path / "out");
    process.send(SIGINT);
    CHECK(process.wait(60) == 1);
    INFO(process.err);
    CHECK_THAT(process.err, Catch::Contains("it does not exist") && Catch::Contains("the image was saved as ./puff-rescued.exr"));
    CHECK(process.out == "./puff-rescued.exr\n./puff-rescued.png\n");
    CHECK(folder.files() == 3);
    CHECK(read_exr(folder.path / "puff-rescued.exr").samples.size() == 200 * 150);
    // Nothing that was there is overwritten.
    fs::create_directory(folder.path / "out");
    Process again({"render", "puff.json", "--spp", "100000000", "-D", "film.width=200", "-D", "film.height=150", "-o", "out/puff.exr"}, folder.path);
    REQUIRE(again.read_until([&] { return again.err.find(" of ") != std::string::npos; }, 180));
    fs::remove_all(folder.path / "out");
    again.send(SIGTERM);
    CHECK(again.wait(60) == 1);
    CHECK(fs::exists(folder.path / "puff-rescued-2.exr"));
}

TEST_CASE("Files.FullDisk") {
    const SceneFolder folder;
    fs::create_directory(folder.path / "disk");
    // A disk of its own of 64 KiB, seen by this process only; the image has 960 kB before compression.
    const Words small_disk{"unshare", "-m", "sh", "-c", "mount -t tmpfs -o size=64k none disk && \"$@\"; code=$?; ls -A disk; exit $code", "sh"};
    Words words = job;
    words.insert(words.end(), {"-o", "disk/puff.exr"});
    if (std::system("unshare -m true 2>/dev/null") == 0) {
        const Ended run(words, folder.path, {}, small_disk);
        INFO(run.err);
        CHECK(run.code == 1);
        CHECK_THAT(run.err, Catch::Contains("disk/puff.exr: cannot be written") && Catch::Contains("the image was saved as ./puff-rescued.exr"));
        CHECK(run.out == "./puff-rescued.exr\n./puff-rescued.png\n");  // and nothing of it is left on the full disk
        CHECK_NOTHROW(read_exr(folder.path / "puff-rescued.exr"));
    } else {
        WARN("no right to mount: the small disk was left out");
    }
    // No room anywhere.
    const Ended nowhere(job, folder.path, struck("call=fsync,code=28,times=1000000"));
    INFO(nowhere.err);
    CHECK(nowhere.code == 1);
    CHECK_THAT(nowhere.err, Catch::Contains("puff.exr: cannot be written") && Catch::Contains("nor elsewhere"));
    CHECK_FALSE(fs::exists(folder.path / "puff.exr"));
    for (const auto& entry : fs::directory_iterator(folder.path)) CHECK(entry.path().extension() != ".tmp");
    // A disk that fails only in the end: nothing under the name.
    const Ended late(job, folder.path, struck("call=fsync,code=28"));
    INFO(late.err);
    CHECK(late.code == 1);
    CHECK_THAT(late.err, Catch::Contains("No space left on device") && Catch::Contains("the image was saved as ./puff-rescued"));
    CHECK_FALSE(fs::exists(folder.path / "puff.exr"));
}

TEST_CASE("Files.ReaderOfTheProgressGoesAway") {
    const SceneFolder folder;
    Words loud = job;
    loud.erase(std::find(loud.begin(), loud.end(), "--quiet"));
    // stderr goes to a pipe whose reader has gone.
    const Ended run(loud, folder.path, {}, {"bash", "-c", "exec \"$@\" 2> >(:)", "bash"});
    CHECK(run.code == 0);
    CHECK(run.out == "puff.exr\npuff.png\n");
    check_files(folder.path);
}

TEST_CASE("Binary.FlightsThatNeverEndAreNoHangAndCanBeStopped") {
    // Scattering without absorption ten thousand million mean free paths deep: batches that take for ever, in launches that don't. A device that
    // does them lives; who asks it to stop does not wait for them.
    const SceneFolder folder;
    std::ofstream(folder.path / "deep.json") << R"({ "camera": { "origin": [0,0,-4], "target": [0,0,0] }, "film": { "width": 16, "height": 16 }, "lights": [{ "type": "constant", "radiance": 1 }],
        "media": [{ "type": "ellipsoids", "kernel": "uniform", "albedo": 1, "primitives": [{ "center": [0,0,0], "scale": 0.3, "density": 1e10 }] }] })";
    for (const char* strategy : {"delta", "decomposition"})
        for (const bool signal : {false, true}) {
            INFO(strategy << (signal ? ", SIGINT" : ", time limit"));
            Words words{"render", "deep.json", "--quiet", "--strategy", strategy, "--kernel-timeout", "10"};
            if (!signal) words.insert(words.end(), {"--time-limit", "12"});
            Process process(words, folder.path);
            if (signal) {
                std::this_thread::sleep_for(std::chrono::seconds(6));
                process.send(SIGINT);
            }
            const int code = process.wait(60);
            CHECK((signal ? code == 130 : code == 0 || code == 1));  // with a sample or without
            CHECK_THAT(process.err, Catch::Contains(signal ? "interrupted" : "time limit"));
            CHECK_THAT(process.err, !Catch::Contains("hangs"));
        }
}
