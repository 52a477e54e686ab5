// SPDX-License-Identifier: MIT
// Programs of runtime/: assembly of their source, build errors, keys and hashes, the cache's file format and files.
#include <filesystem>
#include <stdexcept>
#include <unistd.h>

#include "runtime/buffer.h"
#include "runtime/error.h"
#include "runtime/hash.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "runtime/disk_cache.h"
#include "runtime/queue.h"
#include "runtime/source.h"
#include "tests/runtime_harness.h"

using namespace clume;
using namespace clume::test;

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
