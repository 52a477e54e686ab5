// SPDX-License-Identifier: MIT
// One arithmetic: every OpenCL implementation that this process sees gives the same bits, at every vector width, in batches of
// any size, split or shared. With one implementation it is compared with itself; ./clume test --all-implementations shows the
// process several (docs/design.md, "One arithmetic"). Oclgrind interprets, so it gets the smallest inputs.
#include <catch2/catch.hpp>
#include <regex>

#include "runtime/embedded.h"
#include "src/pilot.h"
#include "tests/cases.h"
#include "tests/entry_points.h"
#include "tests/temp_folder.h"

using namespace clume;
using namespace clume::test;

namespace {

constexpr auto& kAllWidths = cases::vector_widths;
constexpr std::size_t kFew = 32, kMany = 4096;
constexpr std::uint32_t kSamples = 32;  // 8,192 paths: a rounding that differs in one of them shows in the exact sums

bool interprets(const DeviceInfo& device) { return device.platform == "Oclgrind"; }

/// One of each implementation, the fastest first.
std::vector<DeviceInfo> one_of_each() {
    std::vector<DeviceInfo> found;
    for (const DeviceInfo& d : list_devices())
        if (d.available && std::none_of(found.begin(), found.end(), [&](const DeviceInfo& other) { return other.platform == d.platform; })) found.push_back(d);
    std::stable_sort(found.begin(), found.end(), [](const DeviceInfo& a, const DeviceInfo& b) { return interprets(a) < interprets(b); });
    REQUIRE_FALSE(found.empty());
    return found;
}

/// Words of `b` that differ from those of `a`, which may be longer; each output of `b` must be in `a`.
void check_same_words(const Outputs& a, const Outputs& b) {
    for (const auto& [name, words] : b) {
        INFO(name);
        const auto there = a.find(name);
        if (there == a.end()) continue;  // of one width only
        REQUIRE(words.size() <= there->second.size());
        REQUIRE_FALSE(words.empty());
        std::size_t different = 0, first = words.size();
        for (std::size_t i = 0; i < words.size(); ++i)
            if (words[i] != there->second[i] && different++ == 0) first = i;
        INFO("the first at word " << first << " of " << words.size());
        CHECK(different == 0);
    }
}

bool same_bits(const RenderImage& a, const RenderImage& b) {
    return a.rgb == b.rgb && a.alpha == b.alpha && a.variance == b.variance && a.samples == b.samples;
}

/// Case k on every implementation: at all widths and with probes of its flights, or images at its own width and, of every fourth
/// case, one more. What takes the time is compiling.
void check_method(std::size_t k, bool all_widths) {
    const MethodCase& c = method_cases()[k];
    const Scene scene = scene_of(c);
    const std::vector<DeviceInfo> devices = one_of_each();
    Outputs reference;
    for (std::size_t d = 0; d < devices.size(); ++d) {
        const int own = static_cast<int>(devices[d].native_vector_width), other = kAllWidths[(k / 4 + 1 + d) % 4];
        for (const int width : kAllWidths) {
            if (!all_widths && width != own && (interprets(devices[d]) || k % 4 != 0 || width != other)) continue;
            INFO(devices[d].label() << ", width " << width);
            Outputs got = run_method(devices[d], width, scene, c.pair, all_widths && !interprets(devices[d]) ? kMany : 0);
            if (!interprets(devices[d])) got.merge(run_method(devices[d], width, scene, c.pair, 0, kSamples));
            if (reference.empty()) reference = got;
            check_same_words(reference, got);
        }
    }
    // And it is a picture of something.
    const std::vector<std::uint32_t>& image = reference.at("render 1 spp " + c.pair.name());
    CHECK(std::count(image.begin(), image.end(), 0u) < static_cast<std::ptrdiff_t>(image.size() / 2));
}

}  // namespace

TEST_CASE("Implementations.BuildingBlocksGiveTheSameBits", "[.][implementations]") {
    Outputs reference;
    for (const DeviceInfo& device : one_of_each())
        for (const int width : kAllWidths) {
            INFO(device.label() << ", width " << width);
            const Outputs got = run_building_blocks(device, width, interprets(device) ? kFew : kMany);
            if (reference.empty()) reference = got;
            check_same_words(reference, got);
        }
}

TEST_CASE("Implementations.MethodsGiveTheSameBits", "[.][implementations]") {
    for (std::size_t k = 0; k < method_cases().size(); ++k) check_method(k, false);
}

TEST_CASE("Implementations.MethodsGiveTheSameBitsAtEveryWidth", "[.deep]") {
    for (std::size_t k = 0; k < method_cases().size(); ++k) check_method(k, true);
}

TEST_CASE("Implementations.SpecialisedProgramsGiveTheSameBits", "[.][implementations]") {
    Outputs reference;
    for (const DeviceInfo& device : one_of_each())
        for (const int width : kAllWidths) {  // its paths go side by side
            Outputs got;
            for (const char* sampler : {"independent", "sobol"}) got.merge(run_method(device, width, hardly_anything(), {"delta", "analytic", "auto", "newton", "auto", sampler}, interprets(device) ? 0 : kMany));
            if (reference.empty()) reference = got;
            INFO(device.label() << ", width " << width);
            check_same_words(reference, got);
        }
}

TEST_CASE("Implementations.ShareARender", "[.][implementations]") {
    // Batches of one sample go to whoever is free, so that most of them take part in most images; whoever does, the image is the same.
    for (const Pair& pair : {Pair{"delta", "ratio", "grid"}, Pair{"progressive", "analytic", "scene"}}) {
        const std::vector<DeviceInfo> devices = one_of_each();
        RenderOptions alone;
        alone.kernel_timeout_s = 0;  // an interpreter is slow, and does not hang
        alone.progressive_warm_up = 2;
        RenderOptions shared = alone;
        alone.devices = {devices[0].id};
        const RenderResult reference = render_pair(pair, everything(true), 6, 5, alone);
        for (const DeviceInfo& d : devices) shared.devices.push_back(d.id);
        for (const std::uint32_t batch : {0u, 1u, 2u}) {
            for (const int split : {0, 2}) {
                if (split > 0 && batch != 1) continue;
                if (split > 0 && std::any_of(devices.begin(), devices.end(), [](const DeviceInfo& d) { return d.type == "cpu" && d.compute_units < 2; })) continue;
                shared.batch_samples = batch;
                shared.cpu_split = split;
                const RenderResult r = render_pair(pair, everything(true), 6, 5, shared);
                INFO(pair.name() << ", batches of " << batch << ", split " << split);
                for (const std::string& warning : r.stats.warnings) UNSCOPED_INFO(warning);
                CHECK(r.stats.warnings.empty());
                CHECK(r.stats.devices.size() >= devices.size());
                CHECK(same_bits(r.image, reference.image));
                CHECK(r.stats.layout_hash == reference.stats.layout_hash);
            }
        }
    }
}

TEST_CASE("Implementations.ThePilotChoosesTheSame", "[.][implementations]") {
    const std::atomic<bool> go_on{false};
    Scene scene = reference::random_mixture(KernelFamily::gaussian, 60, 9, 6, 2);
    scene.film = {16, 16};
    scene.lights = {sunlight()};
    std::optional<Pilot> first;
    for (const DeviceInfo& device : one_of_each()) {
        if (interprets(device)) continue;  // every method there is
        const TempFolder folder;
        RenderOptions options;
        options.devices = {device.id};
        const auto pilot = run_pilot(scene, options, folder.path(), go_on);
        REQUIRE(pilot);
        if (!first) first = pilot;
        CHECK(pilot->chosen == first->chosen);
        REQUIRE(pilot->rows.size() == first->rows.size());
        for (std::size_t i = 0; i < pilot->rows.size(); ++i) {
            INFO(device.label() << ": " << pilot->rows[i].pair.label());
            CHECK(pilot->rows[i].error.empty());
            CHECK(pilot->rows[i].variance == first->rows[i].variance);
            CHECK(pilot->rows[i].work_ns == first->rows[i].work_ns);
        }
    }
}

TEST_CASE("EntryPoints.AreAllRun", "[.][entry]") {
    // Under a checker of memory, races and uninitialised values (./clume test --deep) this is the program checked, so it is tiny.
    const DeviceInfo device = select_devices({}).front();
    Outputs all = run_building_blocks(device, 4, 8);
    all.merge(run_building_blocks(device, 16, 8));
    all.merge(run_stress_kernels(device, 8));
    for (const int width : {1, 4}) all.merge(run_bench_kernels(device, width));
    for (const MethodCase& c : method_cases()) all.merge(run_method(device, 4, scene_of(c), c.pair, 8));
    for (const int width : {1, 4}) all.merge(run_method(device, width, hardly_anything(), {"delta", "analytic", "auto", "newton", "auto", width == 4 ? "sobol" : "independent"}, 8));
    Scene sunny = hardly_anything();
    sunny.lights = {sunlight()};
    for (const char* estimator : {"analytic", "binary"}) all.merge(run_method(device, 1, sunny, {"delta", estimator, "tree"}, 0));  // shadow rays beside neighbours' flights
    std::size_t kernels = 0;
    for (const EmbeddedFile& file : embedded_kernels()) {
        const std::string text(file.text);
        const std::regex entry("\n__kernel void (\\w+)\\(");  // those made by macros are indented
        for (std::sregex_iterator it(text.begin(), text.end(), entry), end; it != end; ++it, ++kernels) {
            const std::string name = (*it)[1];
            INFO(name);
            CHECK(std::any_of(all.begin(), all.end(), [&](const auto& output) { return output.first.substr(0, output.first.find(' ')) == name; }));
        }
    }
    CHECK(kernels > 5);
}
