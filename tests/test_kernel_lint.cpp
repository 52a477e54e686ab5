// SPDX-License-Identifier: MIT
// Every kernel program, assembled as the renderer assembles it, through clang's OpenCL C 1.2 front end with warnings as errors:
// an implementation that forgives (PoCL does) is not the one that decides what is OpenCL C.
#include <unistd.h>

#include <sys/wait.h>
#include <array>
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "runtime/embedded.h"
#include "runtime/source.h"

namespace {

struct LintResult {
    bool passed = false;
    std::string output;
};

LintResult lint(const std::string& source, const std::string& defines) {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() / ("clume-lint-" + std::to_string(getpid()) + ".cl");
    std::ofstream(file) << source;
    const std::string command =
        "clang -x cl -cl-std=CL1.2 --target=spir64 -fsyntax-only -Wall -Wpedantic -Werror " + defines + " '" + file.string() + "' 2>&1";
    LintResult result;
    std::FILE* pipe = popen(command.c_str(), "r");
    REQUIRE(pipe != nullptr);
    std::array<char, 4096> block{};
    while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe)) result.output.append(block.data(), count);
    const int status = pclose(pipe);
    result.passed = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    std::filesystem::remove(file);
    return result;
}

bool has_clang() { return std::system("command -v clang >/dev/null 2>&1") == 0; }

/// .cl files that no other one includes: the roots of programs.
std::vector<std::string> program_roots() {
    std::string all;
    for (const clume::EmbeddedFile& file : clume::embedded_kernels()) all += file.text;
    std::vector<std::string> roots;
    for (const clume::EmbeddedFile& file : clume::embedded_kernels()) {
        const std::string name(file.name);
        if (name.ends_with(".cl") && all.find("#include \"" + name + "\"") == std::string::npos) roots.push_back(name);
    }
    return roots;
}

}  // namespace

TEST_CASE("Kernels.LintIsClean") {
    if (!has_clang()) {
        WARN("SKIPPED: clang is not installed, kernels are not linted");
        return;
    }
    const std::vector<std::string> roots = program_roots();
    REQUIRE_FALSE(roots.empty());
    const int width = GENERATE(16, 8, 4, 1), strategy = GENERATE(1, 2, 3, 4, 5, 6, 7), accelerator = GENERATE(1, 2);
    const std::string defines = "-DCLUME_WIDTH=" + std::to_string(width) + " -DCLUME_STRATEGY=" + std::to_string(strategy) +
                                " -DCLUME_ACCEL=" + std::to_string(accelerator) + " -DCLUME_TRANSMITTANCE=" + std::to_string(1 + strategy % 5) +
                                " -DCLUME_COUNT=" + std::to_string(strategy % 2) + " -DCLUME_LANES=" + std::to_string(strategy == 2) + " -DCLUME_SCENE_BOUND=" + std::to_string(accelerator - 1);
    for (const std::string& root : roots) {
        const LintResult result = lint(clume::assemble_source(root), defines);
        INFO(root << " " << defines << "\n" << result.output);
        CHECK(result.passed);
    }
}

TEST_CASE("Kernels.LintIsCleanWithGrids") {
    if (!has_clang()) {
        WARN("SKIPPED: clang is not installed, kernels are not linted");
        return;
    }
    const int strategy = GENERATE(1, 2, 3), transmittance = GENERATE(1, 2, 3, 4, 5), mixture = GENERATE(0, 1);
    // Bounds, interpolations, levels, emission and counting go round with the others.
    const int k = strategy + 3 * transmittance + mixture;
    const std::string defines = "-DCLUME_GRIDS=" + std::to_string(1 + k % 3) + " -DCLUME_STRATEGY=" + std::to_string(strategy) + " -DCLUME_TRANSMITTANCE=" + std::to_string(transmittance) +
                                " -DCLUME_MIXTURE=" + std::to_string(mixture) + " -DCLUME_SCENE_BOUND=" + std::to_string(k % 2) + " -DCLUME_GRID_BOUNDS=" + std::to_string(k / 2 % 2) +
                                " -DCLUME_GRID_KINDS=" + std::to_string(1 + k % 3) + " -DCLUME_GRID_LEVELS=" + std::to_string(k % 4) + " -DCLUME_GRID_EMISSION=" + std::to_string(k % 2) +
                                " -DCLUME_COUNT=" + std::to_string(k % 2) + " -DCLUME_BISECTION=" + std::to_string(k / 3 % 2);
    for (const std::string& root : program_roots()) {
        const LintResult result = lint(clume::assemble_source(root), defines);
        INFO(root << " " << defines << "\n" << result.output);
        CHECK(result.passed);
    }
}

TEST_CASE("Kernels.LintFindsWhatOpenClForbids") {
    if (!has_clang()) {
        WARN("SKIPPED: clang is not installed, kernels are not linted");
        return;
    }
    CHECK(lint("__kernel void k(__global float* a) { a[get_global_id(0)] = fma(a[0], a[1], convert_float_rte(1)); }\n", "")
              .passed);
    CHECK_FALSE(lint("__kernel void k(__global float* a) { int unused; a[0] = 1; }\n", "").passed);
    CHECK_FALSE(lint("__kernel void k(__global float* a) { a[0] = nosuchfunction(1); }\n", "").passed);
    CHECK_FALSE(lint("__kernel void k(float* a) { a[0] = 1; }\n", "").passed);
    CHECK_FALSE(lint("#define F(...) fma(__VA_ARGS__)\n__kernel void k(__global float* a) { a[0] = F(a[0], a[1], 1.0f); }\n", "").passed);
}
