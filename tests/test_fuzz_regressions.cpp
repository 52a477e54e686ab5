// SPDX-License-Identifier: MIT
// Every input that was once trouble, through the fuzzers' own targets: an answer or an error, in bounded memory.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "src/error.h"
#include "tests/fuzz/targets.h"
#include "tests/memory_limit.h"

using namespace clume;
namespace fs = std::filesystem;

namespace {

std::string bytes_of(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("FuzzRegressions.EveryInputIsAnswered", "[quick]") {
    const fs::path kept = fs::path(CLUME_SOURCE_DIR) / "tests/fuzz/regressions";
    std::size_t inputs = 0, folders = 0;
    for (const fuzz::Target* target : fuzz::targets) {
        const fs::path folder = kept / target->name;
        if (!fs::is_directory(folder)) continue;
        ++folders;
        for (const auto& entry : fs::directory_iterator(folder)) {
            const std::string bytes = bytes_of(entry.path());
            INFO(entry.path().string());
            const test::MemoryLimit limit(target->memory.of(bytes.size()) + (256 << 20));
            CHECK_NOTHROW(target->run(bytes));
            ++inputs;
        }
    }
    CHECK(inputs > 0);
    // No folder is of a target that isn't.
    CHECK(static_cast<std::size_t>(std::distance(fs::directory_iterator(kept), {})) == folders);
}

TEST_CASE("FuzzRegressions.TargetsNoticeTrouble", "[quick]") {
    // A reader's refusal is fine, anything else isn't.
    CHECK_NOTHROW(fuzz::read_as_file("", [](const std::string&) { throw SceneError("refused"); }));
    CHECK_THROWS(fuzz::read_as_file("", [](const std::string&) { throw std::bad_alloc(); }));
    std::string seen;
    fuzz::read_as_file("long", [](const std::string&) {});
    fuzz::read_as_file("abc", [&](const std::string& path) { seen = bytes_of(path); });
    CHECK(seen == "abc");
}
