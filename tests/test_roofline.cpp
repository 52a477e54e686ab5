// SPDX-License-Identifier: MIT
// `clume bench --roofline`: the operations that it counts are those of the code, its sorts sort, items are listed and chosen by
// name, and what it writes is complete: finite, and no kernel does more than the device can.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

#include <rapidjson/document.h>

#include "bench/operations.h"
#include "runtime/buffer.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "src/strategies.h"
#include "tests/cli_process.h"
#include "tests/probe_harness.h"

using namespace clume;
using namespace clume::probing;
using namespace clume::test;

namespace {

std::string text_of(const std::string& command) {
    std::FILE* pipe = popen(command.c_str(), "r");
    REQUIRE(pipe != nullptr);
    std::string text;
    std::array<char, 4096> block{};
    while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe)) text.append(block.data(), count);
    pclose(pipe);
    return text;
}

/// Lanes of the first type in an instruction.
double lanes(const std::string& instruction) {
    std::smatch found;
    return std::regex_search(instruction, found, std::regex("<([0-9]+) x")) ? std::stod(found[1]) : 1;
}

/// Operations of one instruction of LLVM's intermediate code: as bench/operations.h counts them.
bench::Operations operations_of(const std::string& line) {
    static const std::set<std::string> counted = {"fadd", "fsub", "fmul", "fdiv", "fcmp", "icmp", "add", "sub", "mul", "shl", "lshr", "ashr", "and", "or", "xor", "select", "sitofp", "uitofp", "fptosi", "fptoui", "udiv"};
    static const std::regex free_calls("@(llvm\\.(lifetime|assume|dbg)|_Z4fabs|_Z3any)");
    const std::string right = line.substr(line.find(" = ") == std::string::npos ? 0 : line.find(" = ") + 3);
    std::istringstream words(right);
    std::string name;
    words >> name;
    if (name == "tail") words >> name;
    if (name == "call") {
        const double n = std::regex_search(right, free_calls) ? 0 : lanes(right.substr(0, right.find('@')));
        return {n, right.find("fma") != std::string::npos ? n : 0};
    }
    if (counted.count(name) == 0) return {};
    const double n = lanes(name == "select" ? right.substr(right.find(',') + 1) : right);
    return {n, name == "fmul" || name == "fdiv" || name == "mul" ? n : 0};
}

/// A basic block: its operations and where it leads.
struct Basic {
    bench::Operations operations;
    std::vector<std::string> next;
};

/// Operations of the way from `name` to a return that takes least, or, with `longest`, most; none visits a block twice.
std::optional<bench::Operations> along(const std::map<std::string, Basic>& code, const std::string& name, bool longest, std::set<std::string>& open, std::map<std::string, bench::Operations>& known) {
    if (const auto k = known.find(name); k != known.end()) return k->second;
    const Basic& here = code.at(name);
    std::optional<bench::Operations> best;
    open.insert(name);
    for (const std::string& to : here.next) {
        if (open.count(to) > 0) continue;
        const auto rest = along(code, to, longest, open, known);
        if (rest && (!best || (longest ? rest->all > best->all : rest->all < best->all))) best = rest;
    }
    open.erase(name);
    if (!best && !here.next.empty()) return std::nullopt;
    return known[name] = here.operations + best.value_or(bench::Operations{});
}

/// The count for a block, per lane, by clang; nothing if its output was not understood.
std::optional<bench::Operations> counted(const bench::Block& block) {
    // An fma as an intrinsic, which what is constant can be folded through, as implementations do; a call can't.
    static const EmbeddedFile all{"counted.cl", R"(#define OVER __attribute__((overloadable)) static
OVER float own_fma(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
#define LANES(N) OVER float##N own_fma(float##N a, float##N b, float##N c) { float##N r; for (int i = 0; i < N; ++i) r[i] = __builtin_fmaf(a[i], b[i], c[i]); return r; }
LANES(3) LANES(4) LANES(8) LANES(16)
#define fma own_fma
)"
                                               "#include \"roofline.cl\"\n#include \"proxy.cl\"\n#include \"sorts.cl\"\n"};
    std::vector<EmbeddedFile> files(embedded_kernels().begin(), embedded_kernels().end());
    files.push_back(all);
    // Without the entry points, of which clang would make code, too.
    std::string source = std::regex_replace(assemble_source("counted.cl", files), std::regex("__kernel void"), "static void");
    source += "\n__kernel void counted(SCENE_ARGS, __global const float* a, __global float* out, __constant const uint* faces, __constant const float4* normals) {\n"
              "const float3 o = (float3)(a[300], a[301], a[302]), d = (float3)(a[303], a[304], a[305]);\n" +
              std::string(block.code) + "\n}\n";
    const fs::path file = fs::temp_directory_path() / ("clume-count-" + std::to_string(getpid()) + ".cl");
    std::ofstream(file) << source;
    const std::string code = text_of("clang -x cl -cl-std=CL1.2 --target=spir64 -O2 -w -fno-vectorize -fno-slp-vectorize -mllvm -unroll-threshold=100000 -mllvm -inline-threshold=1000000 -S -emit-llvm -DCLUME_WIDTH=" +
                                     std::to_string(block.width) + " " + block.defines + " -o - '" + file.string() + "'");
    fs::remove(file);
    std::istringstream lines(code);
    std::map<std::string, Basic> blocks;
    std::string line, name;
    const std::regex label("^([A-Za-z0-9_.]+):"), target("label %([A-Za-z0-9_.]+)");
    bool inside = false;
    while (std::getline(lines, line)) {
        if (!inside) {
            inside = line.starts_with("define") && line.find("@counted(") != std::string::npos;
            name = "entry";
            continue;
        }
        if (line == "}") break;
        std::smatch found;
        if (std::regex_search(line, found, label)) {
            name = found[1];
            continue;
        }
        Basic& b = blocks[name];
        line.erase(0, line.find_first_not_of(' '));
        if (line.find("phi ") == std::string::npos)
            for (std::sregex_iterator t(line.begin(), line.end(), target), end; t != end; ++t) b.next.push_back((*t)[1]);
        b.operations = b.operations + operations_of(line);
    }
    if (blocks.count("entry") == 0) return std::nullopt;
    std::set<std::string> open;
    std::map<std::string, bench::Operations> known;
    const auto sum = along(blocks, "entry", block.longest, open, known);
    if (!sum) return std::nullopt;
    return *sum * (1.0 / block.width);
}

std::vector<std::string> lines_of(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

}  // namespace

TEST_CASE("Roofline.OperationsAreThoseOfTheCode") {
    if (std::system("command -v clang >/dev/null 2>&1") != 0) {
        WARN("SKIPPED: clang is not installed, operations are not counted");
        return;
    }
    for (const bench::Block& block : bench::blocks()) {
        const auto now = counted(block);
        REQUIRE(now);
        INFO(block.name << ": bench/operations.cpp says " << block.operations.all << ", " << block.operations.multiplications << ", clang's code has " << now->all << ", " << now->multiplications);
        // Versions of clang differ by an instruction or two.
        CHECK(std::abs(now->all - block.operations.all) <= std::max(2.0, 0.04 * block.operations.all));
        CHECK(std::abs(now->multiplications - block.operations.multiplications) <= std::max(2.0, 0.04 * block.operations.multiplications));
    }
}

TEST_CASE("Roofline.SortsSort", "[kernels]") {
    Queue queue(test_device());
    TestRandom random(4);
    for (const int n : {8, 16, 32, 64, 128, 256}) {
        constexpr std::size_t lists = 16;
        ProgramOptions options;
        options.define("CLUME_WIDTH", 1).define("SORT_COUNT", n);
        const cl::Program program = build_program(queue, "sorts.cl", options);
        // Random orders, many equal keys, all equal, ascending and descending.
        std::vector<float> in;
        for (std::size_t list = 0; list < lists; ++list)
            for (int k = 0; k < n; ++k)
                in.push_back(list < 6 ? static_cast<float>(random.uniform(-1, 1)) : list < 12 ? static_cast<float>(random.below(5)) : list == 12 ? 1.0f : static_cast<float>(list % 2 ? k : -k));
        const Buffer<float> from(queue, in);
        for (const char* name : {"bitonic", "odd_even", "insertion"}) {
            const Buffer<float> t_out(queue, in.size());
            const Buffer<std::uint32_t> id_out(queue, in.size());
            cl::Kernel kernel = make_kernel(queue, program, name);
            set_args(queue, kernel, 0, from, t_out, id_out, cl_uint(lists), cl_uint(lists));
            queue.launch(kernel, lists, queue.info().group_size());
            const std::vector<float> t = t_out.download();
            const std::vector<std::uint32_t> id = id_out.download();
            INFO(name << " of " << n);
            std::size_t wrong = 0;
            for (std::size_t list = 0; list < lists; ++list) {
                const std::size_t first = list * static_cast<std::size_t>(n);
                std::vector<std::uint32_t> order(static_cast<std::size_t>(n));
                std::iota(order.begin(), order.end(), 0u);
                std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return in[first + a] < in[first + b]; });
                for (std::size_t k = 0; k < order.size(); ++k) wrong += id[first + k] != order[k] || t[first + k] != in[first + order[k]];
            }
            CHECK(wrong == 0);
        }
    }
}

TEST_CASE("Roofline.EveryKernelIsListed", "[quick]") {
    const SceneFolder folder;
    const Run run({"bench", "--roofline", "--list"}, folder.path);
    REQUIRE(run.code == 0);
    const std::vector<std::string> lines = lines_of(run.out);
    const std::set<std::string> items(lines.begin(), lines.end());
    CHECK(items.size() == lines.size());
    const auto listed = [&](const std::string& item) {
        INFO(item);
        CHECK(items.count(item) == 1);
    };
    for (const int width : kWidths) {
        const std::string w = "/w" + std::to_string(width);
        listed("peaks/fma" + w);
        listed("peaks/fma_add" + w);
        for (const char* how : {"whitened", "quadratic", "icosphere_mesh", "icosphere_shared"}) listed(std::string("kernels/intersect/") + how + w);
        for (const cases::FamilyCase& f : cases::families)
            for (const char* what : {"density", "depth", "inverse"}) listed(std::string("kernels/") + what + "/" + f.name + w);
        for (const char* item : {"leaf/flight", "leaf/depth", "segments", "random/philox", "random/sobol", "random/primitive_bits"}) listed(std::string("kernels/") + item + w);
        for (const char* from : {"coherent", "incoherent", "inside"}) {
            for (const char* strategy : {"delta", "decomposition_cells", "decomposition_bvh", "regular", "march"}) listed(std::string("kernels/flight/ball/") + strategy + "/" + from + w);
            for (const char* estimator : {"analytic_cells", "analytic_bvh", "march"}) listed(std::string("kernels/transmittance/ball/") + estimator + "/" + from + w);
        }
    }
    const auto any = [&](const std::string& pattern) { return std::any_of(lines.begin(), lines.end(), [&](const std::string& l) { return std::regex_search(l, std::regex(pattern)); }); };
    for (const Method& m : strategies()) CHECK(any(std::string("^kernels/flight/ball/") + m.name));
    for (const Method& m : estimators()) CHECK(any(std::string("^kernels/transmittance/close/") + m.name));
    for (const cases::MathCase& f : cases::math_functions) CHECK(any(std::string("^kernels/math/") + f.name + "/own"));
    for (const char* level : {"32KiB", "1MiB", "32MiB", "512MiB"})
        for (const char* what : {"read", "gather"}) listed(std::string("peaks/") + what + "/" + level);
    for (const char* item : {"peaks/launch", "kernels/node", "kernels/phase/sample/rayleigh", "kernels/phase/value/henyey_greenstein", "kernels/light/envmap",
                             "kernels/environment/envmap", "kernels/film/sample", "kernels/transfer/to_device", "kernels/transfer/from_device", "kernels/walk/ball/bvh/inside"})
        listed(item);
    for (const char* sort : {"bitonic", "odd_even", "insertion"})
        for (const int n : {8, 16, 32, 64, 128, 256}) listed("kernels/sort/" + std::string(sort) + "/" + std::to_string(n));
    CHECK_FALSE(any("^(scenes|scaling|work|specialisation)/"));
}

TEST_CASE("Roofline.WritesSharesOfWhatTheDeviceCanDo") {
    const SceneFolder folder;
    const std::string width = std::to_string(test_device().native_vector_width);
    // One of each kind, at the width that the device likes.
    const std::string filter = "^peaks/|/(intersect/whitened|density/gaussian|depth/epanechnikov|inverse/uniform|leaf/depth|segments|flight/close/decomposition_bvh/inside|flight/close/delta/incoherent|transmittance/close/analytic_cells/coherent|math/exp/own|random/philox)/w" +
                               width + "$|/(math/asin/(own|built_in)|phase/sample/rayleigh|light/sphere|environment/envmap|film/sample|sort/bitonic/64|sort/insertion/8|node|walk/close/bvh/inside|transfer/to_device)$";
    Process run({"bench", "--roofline", "--quick", "--filter", filter, "--json", "speed.json"}, folder.path);
    const int code = run.wait(900);  // a dozen programs to compile
    INFO(run.out << run.err);
    REQUIRE(code == 0);
    std::ifstream file(folder.path / "speed.json");
    std::stringstream text;
    text << file.rdbuf();
    rapidjson::Document json;
    json.Parse(text.str().c_str());
    REQUIRE_FALSE(json.HasParseError());
    std::map<std::string, const rapidjson::Value*> results;
    for (const auto& r : json["results"].GetArray()) {
        const std::string item = std::string(r["section"].GetString()) + "/" + r["item"].GetString();
        results[item] = &r;
        for (const auto& field : r.GetObject()) {
            INFO(item << " " << field.name.GetString());
            CHECK_FALSE(field.value.IsNull());  // how a number that is not finite is written
            if (field.value.IsNumber()) CHECK(field.value.GetDouble() >= 0);
        }
        if (item.starts_with("peaks/")) CHECK(r[item == "peaks/launch" ? "seconds" : "per_s"].GetDouble() > 0);
        if (!item.starts_with("kernels/")) continue;
        INFO(item);
        CHECK(r["mitems_s"].GetDouble() > 0);
        if (item.find("built_in") != std::string::npos) continue;
        REQUIRE(r.HasMember("share"));
        CHECK(r["share"].GetDouble() > 0);
        CHECK(r["share"].GetDouble() < 1.2);
        CHECK(r["operations"].GetDouble() + r["bytes"].GetDouble() > 0);
    }
    CHECK(results.size() == 17 + 11 + 11);
    // What the peaks must have in common with any device.
    const auto peak = [&](const std::string& name) { return (*results.at("peaks/" + name))["per_s"].GetDouble(); };
    CHECK(peak("read/32KiB") > 0.5 * peak("read/512MiB"));
    CHECK(peak("gather/32KiB") > peak("gather/512MiB"));
    CHECK(peak("fma/w16") > 1e8);
    CHECK(peak("fma_add/w16") > 0.9 * peak("fma/w16"));
}
