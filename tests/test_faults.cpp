// SPDX-License-Identifier: MIT
// Devices that fail, seen from outside: the binary with an OpenCL layer (fault_layer/) that makes real calls fail. Whatever
// happens to a device, the image has the bits it has without the fault, or what was done of it is saved and the exit code is 4.
#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <optional>
#include <string>

#include "runtime/device.h"
#include "src/image_writer.h"
#include "tests/cli_process.h"

using namespace clume;
using namespace clume::test;

namespace {

/// Three tiles; enough samples that a second device gets its share.
const Words job{"render", "puff.json", "--quiet", "--spp", "192", "-D", "film.width=128", "-D", "film.height=96", "-D", "render.max_depth=3"};

Words with(Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

struct FaultRun {
    int code;
    std::string out, err;
    bool left_files = false;  ///< others than scene, EXR and PNG
    std::optional<RenderImage> image;

    /// `fault` as the layer has it.
    FaultRun(const std::string& fault, const Words& words) {
        const SceneFolder folder;
        Process process(words, folder.path, {"OPENCL_LAYERS=" CLUME_FAULT_LAYER, "CLUME_FAULT=" + fault});
        code = process.wait(240);
        out = process.out;
        err = process.err;
        for (const auto& entry : fs::directory_iterator(folder.path)) {
            const std::string name = entry.path().filename().string();
            left_files = left_files || (name != "puff.json" && name != "puff.exr" && name != "puff.png");
        }
        if (fs::exists(folder.path / "puff.exr")) image = read_exr(folder.path / "puff.exr");
    }
    std::size_t warnings() const {
        std::size_t count = 0;
        for (std::size_t at = err.find("warning: "); at != std::string::npos; at = err.find("warning: ", at + 1)) ++count;
        return count;
    }
};

bool same(const RenderImage& a, const RenderImage& b) {
    return a.rgb == b.rgb && a.alpha == b.alpha && a.variance == b.variance && a.samples == b.samples;
}

/// Without any fault; every split gives these bits (Determinism.*), so one will do.
const RenderImage& sound(const std::string& strategy = "delta") {
    static std::map<std::string, RenderImage> images;
    if (images.count(strategy) == 0) {
        const FaultRun run("", with(job, {"--strategy", strategy}));
        INFO(run.err);
        REQUIRE(run.code == 0);
        REQUIRE(run.warnings() == 0);
        REQUIRE(run.image);
        images[strategy] = *run.image;
    }
    return images[strategy];
}

bool two_cores() {
    const DeviceInfo device = select_devices({}).front();
    if (device.type == "cpu" && device.compute_units >= 2) return true;
    WARN(device.label() << " has no sub-devices: nothing tested here");
    return false;
}

const Words split{"--cpu-split", "2"};

}  // namespace

TEST_CASE("Faults.FailedDeviceIsDroppedAndItsBatchesRedone") {
    if (!two_cores()) return;
    for (const char* fault : {"kind=enqueue,n=2,device=1", "kind=enqueue,n=4,device=0", "kind=enqueue,n=3,device=1,code=-36", "kind=lost,n=2,device=1",
                              "kind=lost,n=4,device=0"}) {
        const FaultRun run(fault, with(job, split));
        INFO(fault << "\n" << run.err);
        CHECK(run.code == 0);
        CHECK(run.warnings() == 1);
        CHECK_THAT(run.err, Catch::Contains("failed and was dropped") && Catch::Contains("clEnqueue"));
        CHECK_FALSE(run.left_files);
        REQUIRE(run.image);
        CHECK(same(*run.image, sound()));
    }
}

TEST_CASE("Faults.ProgressiveKeepsWhatALostDeviceHadFound") {
    if (!two_cores()) return;
    const Words progressive = with(job, {"--strategy", "progressive"});
    for (const char* fault : {"kind=lost,n=3,device=1", "kind=lost,n=9,device=0"}) {
        const FaultRun run(fault, with(progressive, split));
        INFO(fault << "\n" << run.err);
        CHECK(run.code == 0);
        CHECK(run.warnings() == 1);
        REQUIRE(run.image);
        CHECK(same(*run.image, sound("progressive")));
    }
}

TEST_CASE("Faults.LittleMemoryMeansSmallerBatches") {
    // No buffer above this: the scene's and the pixels' fit, a batch of 4,096 paths does not.
    const FaultRun small("kind=size,bytes=100000", job);
    INFO(small.err);
    CHECK(small.code == 0);
    CHECK(small.warnings() == 1);
    CHECK_THAT(small.err, Catch::Contains("short of memory: batches of at most"));
    REQUIRE(small.image);
    CHECK(same(*small.image, sound()));
    // Any one allocation that fails: the set-up's end the render, with the call and the bytes; a batch's is made smaller.
    int ended = 0, first_of_batch = 0;
    for (int n = 1; n < 64 && first_of_batch == 0; n += n < 33 ? 8 : 1) {
        const FaultRun run("kind=buffer,times=1,n=" + std::to_string(n), job);
        INFO(n << "\n" << run.err);
        CHECK_FALSE(run.left_files);
        if (run.code == 4) {
            ++ended;
            CHECK_THAT(run.err, Catch::Contains("clCreateBuffer: CL_MEM_OBJECT_ALLOCATION_FAILURE") && Catch::Contains("bytes asked for"));
            CHECK_FALSE(run.image);
        } else {
            first_of_batch = n;
            CHECK(run.code == 0);
            CHECK(run.warnings() == 1);
            REQUIRE(run.image);
            CHECK(same(*run.image, sound()));
        }
    }
    CHECK(ended > 0);
    REQUIRE(first_of_batch > 0);
    // No room for even the smallest batch.
    const FaultRun none("kind=buffer,n=" + std::to_string(first_of_batch), job);
    INFO(none.err);
    CHECK(none.code == 4);
    CHECK_THAT(none.err, Catch::Contains("CL_MEM_OBJECT_ALLOCATION_FAILURE"));
}

TEST_CASE("Faults.BuildFailureNamesTheCall") {
    const FaultRun run("kind=build", job);
    INFO(run.err);
    CHECK(run.code == 4);
    CHECK_THAT(run.err, Catch::Contains("clBuildProgram: CL_BUILD_PROGRAM_FAILURE"));
    CHECK_FALSE(run.image);
    if (!two_cores()) return;
    const FaultRun one("kind=build,device=1", with(job, split));
    INFO(one.err);
    CHECK(one.code == 0);
    CHECK(one.warnings() == 1);
    REQUIRE(one.image);
    CHECK(same(*one.image, sound()));
}

TEST_CASE("Faults.LyingDeviceIsCaughtByTheSelfTest") {
    // The lowest bit of one number of each read.
    const FaultRun alone("kind=wrong", job);
    INFO(alone.err);
    CHECK(alone.code == 4);
    CHECK_THAT(alone.err, Catch::Contains("fails its self-test"));
    CHECK_FALSE(alone.image);
    if (!two_cores()) return;
    for (const char* fault : {"kind=wrong,device=0", "kind=wrong,device=1,n=4"}) {
        const FaultRun run(fault, with(job, split));
        INFO(fault << "\n" << run.err);
        CHECK(run.code == 0);
        CHECK(run.warnings() == 1);
        CHECK_THAT(run.err, Catch::Contains("fails its self-test"));
        REQUIRE(run.image);
        CHECK(same(*run.image, sound()));
    }
}

TEST_CASE("Faults.WithNoDeviceLeftWhatWasDoneIsSaved") {
    for (const Words& words : two_cores() ? std::vector<Words>{job, with(job, split)} : std::vector<Words>{job}) {
        const FaultRun run("kind=lost,n=5", words);
        INFO(run.err);
        CHECK(run.code == 4);
        CHECK_THAT(run.err, Catch::Contains("no device is left: the image holds"));
        CHECK_THAT(run.out, Catch::Contains("puff.exr"));
        CHECK_FALSE(run.left_files);
        REQUIRE(run.image);
        const auto [least, most] = std::minmax_element(run.image->samples.begin(), run.image->samples.end());
        CHECK(*most > 0);
        CHECK(*least < 192);
    }
    const FaultRun nothing("kind=lost,n=2", job);
    INFO(nothing.err);
    CHECK(nothing.code == 4);
    CHECK_FALSE(nothing.image);
}

TEST_CASE("Faults.HungKernelIsNamedAndTheProcessLeaves") {
    sound();  // so that nothing is compiled below
    const Words limited = with(job, {"--kernel-timeout", "3"});
    for (const char* fault : {"kind=hang,n=5", "kind=block,n=5"}) {
        const FaultRun run(fault, limited);
        INFO(fault << "\n" << run.err);
        CHECK(run.code == 4);
        CHECK_THAT(run.err, Catch::Contains("kernel render gave no sign of life for 3 s") && Catch::Contains("the image holds"));
        CHECK_FALSE(run.left_files);
        REQUIRE(run.image);
        CHECK(*std::max_element(run.image->samples.begin(), run.image->samples.end()) > 0);
    }
    const FaultRun at_once("kind=block,kernel=probe_arithmetic", with(job, {"--kernel-timeout", "0.5"}));
    INFO(at_once.err);
    CHECK(at_once.code == 4);
    CHECK_THAT(at_once.err, Catch::Contains("hangs"));
    CHECK_FALSE(at_once.image);
    if (!two_cores()) return;
    for (const char* fault : {"kind=hang,n=3,device=1", "kind=block,n=4,device=0"}) {
        const FaultRun run(fault, with(limited, split));
        INFO(fault << "\n" << run.err);
        CHECK(run.code == 0);
        CHECK(run.warnings() == 1);
        REQUIRE(run.image);
        CHECK(same(*run.image, sound()));
    }
}
