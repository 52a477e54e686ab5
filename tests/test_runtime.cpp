// SPDX-License-Identifier: MIT
// runtime/: choosing devices, buffers, source assembly, build errors, the cache's file format. The device tests run on
// whatever device is best here (PoCL in the usual setting).
#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <unistd.h>

#include "runtime/buffer.h"
#include "runtime/device.h"
#include "runtime/error.h"
#include "runtime/hash.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "runtime/program_cache.h"
#include "runtime/queue.h"
#include "runtime/source.h"

using namespace clume;

namespace {

/// The message of the E that `body` throws; fails the test if it throws nothing.
template <class E, class Body>
std::string message_of(Body&& body) {
    try {
        body();
    } catch (const E& error) {
        return error.what();
    }
    FAIL("nothing was thrown");
    return {};
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

DeviceInfo made_up(const std::string& id, const std::string& type, const std::string& platform, unsigned units,
                   bool available = true) {
    DeviceInfo info;
    info.id = id;
    info.name = id.substr(id.find('-') + 1);
    info.type = type;
    info.platform = platform;
    info.compute_units = units;
    info.available = available;
    return info;
}

std::string ids_of(const std::vector<DeviceInfo>& devices) {
    std::string ids;
    for (const DeviceInfo& device : devices) ids += device.id.substr(0, device.id.find('-')) + " ";
    return ids;
}

const DeviceInfo& here() {
    static const DeviceInfo device = select_devices({}).front();
    return device;
}

}  // namespace

TEST_CASE("Device.SelectionByText", "[quick]") {
    const std::vector<DeviceInfo> devices = {
        made_up("p0d0-xeon-gold", "cpu", "Portable Computing Language", 8),
        made_up("p0d10-xeon-silver", "cpu", "Portable Computing Language", 16),
        made_up("p1d0-geforce", "gpu", "CUDA", 4),
        made_up("p1d1-broken", "gpu", "CUDA", 400, false),
    };
    CHECK(ids_of(select_from(devices, {})) == "p1d0 ");
    CHECK(ids_of(select_from(devices, {""})) == "p1d0 ");
    CHECK(ids_of(select_from({devices[0], devices[1]}, {})) == "p0d10 ");
    CHECK(ids_of(select_from(devices, {"cpu"})) == "p0d0 p0d10 ");
    CHECK(ids_of(select_from(devices, {"GPU"})) == "p1d0 ");
    CHECK(ids_of(select_from(devices, {"all"})) == "p0d0 p0d10 p1d0 ");
    CHECK(ids_of(select_from(devices, {"XEON"})) == "p0d0 p0d10 ");
    CHECK(ids_of(select_from(devices, {"cuda, p0d0", "p0d10-xeon-silver", "cpu"})) == "p1d0 p0d0 p0d10 ");
    CHECK_THROWS_AS(select_from(devices, {"p0d1"}), DeviceError);  // not p0d10
}

TEST_CASE("Device.ErrorsListWhatIsThere", "[quick]") {
    const std::vector<DeviceInfo> devices = {made_up("p0d0-xeon", "cpu", "PoCL", 8),
                                             made_up("p0d1-old", "gpu", "PoCL", 1, false)};
    CHECK(contains(message_of<DeviceError>([&] { select_from(devices, {"voodoo"}); }), "voodoo"));
    CHECK(contains(message_of<DeviceError>([&] { select_from(devices, {"voodoo"}); }), "p0d0-xeon"));
    CHECK(contains(message_of<DeviceError>([&] { select_from(devices, {"gpu"}); }), "not available"));
    CHECK(contains(message_of<DeviceError>([&] { select_from({}, {"cpu"}); }), "pocl-opencl-icd"));
}

TEST_CASE("Device.TheOneHere", "[quick]") {
    const DeviceInfo& device = here();
    CHECK(device.available);
    CHECK(device.compute_units >= 1);
    CHECK((device.native_vector_width == 1 || device.native_vector_width == 4 || device.native_vector_width == 8 ||
           device.native_vector_width == 16));
    CHECK(device.max_allocation > 0);
    CHECK(device.max_allocation <= device.global_memory);
    for (const std::string& selector : {device.id, device.name, device.platform, device.type})
        CHECK(select_devices({selector}).front().id.substr(0, 1) == "p");
    CHECK(select_devices({device.id}).front().id == device.id);
}

TEST_CASE("Device.SplitsOrSaysTheLimit", "[quick]") {
    const DeviceInfo& device = here();
    CHECK(split_cpu(device, 1).front().id == device.id);
    CHECK_THROWS_AS(split_cpu(device, 0), DeviceError);
    CHECK_THROWS_AS(split_cpu(device, 1 << 20), DeviceError);
    if (device.type != "cpu" || device.compute_units < 2) return;
    const std::vector<DeviceInfo> halves = split_cpu(device, 2);
    REQUIRE(halves.size() == 2);
    CHECK(halves[0].compute_units + halves[1].compute_units == device.compute_units);
    CHECK(halves[0].id != halves[1].id);
    Queue queue(halves[1]);
    Buffer<float> buffer(queue, std::vector<float>{1, 2, 3});
    CHECK(buffer.download() == std::vector<float>{1, 2, 3});
}

TEST_CASE("Buffer.RoundTrip", "[quick]") {
    Queue queue(here());
    std::vector<std::uint32_t> data(1000);
    std::iota(data.begin(), data.end(), 7u);
    Buffer<std::uint32_t> buffer(queue, data, CL_MEM_READ_WRITE);
    CHECK(buffer.size() == 1000);
    CHECK(buffer.byte_size() == 4000);
    CHECK(buffer.download() == data);
    const std::vector<std::uint32_t> patch = {1, 2, 3};
    buffer.upload(patch, 997);
    std::copy(patch.begin(), patch.end(), data.begin() + 997);
    CHECK(buffer.download() == data);
    buffer.fill(5);
    CHECK(buffer.download() == std::vector<std::uint32_t>(1000, 5));
    buffer.zero();
    CHECK(buffer.download() == std::vector<std::uint32_t>(1000, 0));

    Buffer<float> empty(queue, std::vector<float>{});
    CHECK(empty.size() == 0);
    empty.upload({});
    empty.zero();
    CHECK(empty.download().empty());
    CHECK(empty.memory()() != nullptr);
}

TEST_CASE("Buffer.TooLargeSaysHowMuch", "[quick]") {
    Queue queue(here());
    const std::string message = message_of<DeviceError>([&] { Buffer<char> b(queue, std::size_t(1) << 60); });
    CHECK(contains(message, "clCreateBuffer: CL_"));
    CHECK(contains(message, "1152921504606846976"));
    CHECK(contains(message, here().name));
}

TEST_CASE("Queue.LaunchPadsAndTimes", "[quick]") {
    Queue queue(here());
    const cl::Program program = build_source(
        queue, "__kernel void twice(__global uint* x, uint n) { uint i = get_global_id(0); if (i < n) x[i] *= 2; }\n");
    cl::Kernel kernel = make_kernel(queue, program, "twice");
    std::vector<cl_uint> data(1001);
    std::iota(data.begin(), data.end(), 0u);
    Buffer<cl_uint> buffer(queue, data, CL_MEM_READ_WRITE);
    set_args(queue, kernel, 0, buffer, cl_uint(data.size()));
    CHECK(queue.launch(kernel, data.size(), 16) >= 0);
    queue.enqueue(kernel, data.size(), 16);
    queue.enqueue(kernel, 0, 16);
    queue.finish();
    for (cl_uint& x : data) x *= 4;
    CHECK(buffer.download() == data);
    CHECK(max_local_size(queue, kernel) >= 16);
    CHECK(contains(message_of<DeviceError>([&] { make_kernel(queue, program, "thrice"); }), "CL_INVALID_KERNEL_NAME"));
    const std::string message = message_of<DeviceError>([&] { set_args(queue, kernel, 1, 1.0); });
    CHECK(contains(message, "clSetKernelArg: CL_INVALID_ARG_SIZE"));
    CHECK(contains(message, "argument 1 of kernel twice"));
}

TEST_CASE("Source.EachFileOnceWithMarkers", "[quick]") {
    const EmbeddedFile files[] = {
        {"root.cl", "#include \"a.cl\"\n#include \"b.cl\"\nint root;\n"},
        {"a.cl", "#pragma once\nint a;"},
        {"b.cl", "  # include \"a.cl\"\nint b;\n"},
        {"twice.cl", "#include \"body.inc.cl\"\n#include \"body.inc.cl\"\n"},
        {"body.inc.cl", "int body;\n"},
        {"loop.cl", "int x;\n#include \"loop2.cl\"\n"},
        {"loop2.cl", "#include \"loop.cl\"\n"},
        {"lost.cl", "\n#include \"nowhere.cl\"\n"},
    };
    const std::string text = assemble_source("root.cl", files);
    CHECK(text.find("int a;") == text.rfind("int a;"));
    CHECK(contains(text, "#line 1 \"a.cl\"\n\nint a;\n"));
    CHECK(contains(text, "#line 2 \"b.cl\"\nint b;\n"));
    CHECK(contains(text, "#line 3 \"root.cl\"\nint root;\n"));
    const std::string twice = assemble_source("twice.cl", files);
    CHECK(twice.find("int body;") != twice.rfind("int body;"));
    CHECK(message_of<std::runtime_error>([&] { assemble_source("lost.cl", files); }) == "lost.cl:2: no kernel file 'nowhere.cl'");
    CHECK(contains(message_of<std::runtime_error>([&] { assemble_source("loop.cl", files); }), "loop2.cl:1:"));
    CHECK_THROWS_AS(assemble_source("none.cl", files), std::runtime_error);
}

TEST_CASE("Source.IncludeInsideConditional", "[quick]") {
    const EmbeddedFile files[] = {
        {"root.cl",
         "#if NEVER\n#include \"a.cl\"\n#endif\n#include \"a.cl\"\n#include \"a.cl\"\n#if 1\n#include \"a.cl\"\n#endif\n"
         "__kernel void k(__global int* x) { x[0] = a(); }\n"},
        {"a.cl", "inline int f(void) { return 3; }\nint a(void) { return 4; }\n"},
    };
    Queue queue(here());
    const cl::Program program = build_source(queue, assemble_source("root.cl", files));
    cl::Kernel kernel = make_kernel(queue, program, "k");
    Buffer<cl_int> out(queue, 1);
    set_args(queue, kernel, 0, out);
    queue.launch(kernel, 1, 1);
    CHECK(out.download().front() == 4);
}

TEST_CASE("Program.BuildErrorNamesFileLineAndOptions", "[quick]") {
    const EmbeddedFile files[] = {
        {"good.cl", "int good(void) { return VALUE; }\n"},
        {"bad.cl", "#include \"good.cl\"\n\n__kernel void k(__global int* x) {\n    x[0] = undeclared_thing;\n}\n"},
    };
    Queue queue(here());
    try {
        build_source(queue, assemble_source("bad.cl", files), ProgramOptions().define("VALUE", 3));
        FAIL("built");
    } catch (const BuildError& error) {
        CHECK(contains(error.log, "bad.cl:4:"));
        CHECK(contains(error.log, "undeclared_thing"));
        CHECK(error.options == "-cl-std=CL1.2 -DVALUE=3");
        CHECK(contains(error.what(), error.options));
        CHECK(contains(error.what(), error.log));
        CHECK(contains(error.what(), here().name));
    }
    CHECK_THROWS_AS(ProgramOptions().define("A", "x y").text(), std::invalid_argument);
}

TEST_CASE("Program.KeyDependsOnEverything", "[quick]") {
    DeviceInfo info = made_up("p0d0-xeon", "cpu", "PoCL", 8);
    const std::string key = program_key(info, "source", "options");
    CHECK(key.size() == 64);
    CHECK(key == program_key(info, "source", "options"));
    CHECK(key != program_key(info, "sourceo", "ptions"));
    for (std::string DeviceInfo::*field :
         {&DeviceInfo::name, &DeviceInfo::driver, &DeviceInfo::platform, &DeviceInfo::platform_version}) {
        DeviceInfo other = info;
        other.*field += "!";
        CHECK(key != program_key(other, "source", "options"));
    }
}

TEST_CASE("Hash.KnownDigests", "[quick]") {
    CHECK(sha256_hex("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    CHECK(sha256_hex("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_CASE("ProgramCache.AnyDefectIsAMiss", "[quick]") {
    const Binary binary = {1, 2, 3, 0, 255, 7};
    const std::string entry = encode_cache_entry("key", binary);
    REQUIRE(decode_cache_entry("key", entry) == binary);
    CHECK_FALSE(decode_cache_entry("other key", entry));
    CHECK_FALSE(decode_cache_entry("key", ""));
    CHECK_FALSE(decode_cache_entry("key", entry + "x"));
    for (std::size_t i = 0; i < entry.size(); ++i) {
        std::string damaged = entry;
        damaged[i] = static_cast<char>(damaged[i] ^ 1);
        CHECK_FALSE(decode_cache_entry("key", damaged));
        CHECK_FALSE(decode_cache_entry("key", entry.substr(0, i)));
    }
}

TEST_CASE("ProgramCache.FilesComeBackWholeOrNotAtAll", "[quick]") {
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / ("clume-cache-test-" + std::to_string(::getpid()));
    const std::string key = sha256_hex("some program");
    const Binary binary(5000, 42);
    CHECK_FALSE(load_binary(folder, key));
    REQUIRE(store_binary(folder, key, binary));
    CHECK(load_binary(folder, key) == binary);
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        ++files;
        CHECK(entry.path().extension() == ".clbin");
        fs::resize_file(entry.path(), 3000);
    }
    CHECK(files == 1);
    CHECK_FALSE(load_binary(folder, key));
    REQUIRE(store_binary(folder, key, binary));
    CHECK(load_binary(folder, key) == binary);
    CHECK_FALSE(store_binary({}, key, binary));
    CHECK_FALSE(store_binary("/proc/nowhere", key, binary));
    fs::remove_all(folder);
}
