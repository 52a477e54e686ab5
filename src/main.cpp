// SPDX-License-Identifier: MIT
// Runs what the command line asks for and turns every outcome into an exit code and one message on stderr.
// stdout carries results only: the paths of the images written, tables of `devices` and `info`.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "bench/bench.h"
#include "runtime/device.h"
#include "runtime/error.h"
#include "runtime/hang.h"
#include "src/bake.h"
#include "src/cli.h"
#include "src/compare.h"
#include "src/compare_report.h"
#include "src/error.h"
#include "src/info.h"
#include "src/interrupt.h"
#include "src/memory_budget.h"
#include "src/output_file.h"
#include "src/pilot.h"
#include "src/printable.h"
#include "src/progress.h"
#include "src/renderer.h"
#include "src/save_image.h"
#include "src/scene_reader.h"
#include "src/stats_json.h"
#include "src/stress.h"
#include "src/stress_report.h"
#include "src/voxel_grid.h"
#include "src/voxel_writer.h"

namespace {

using namespace clume;

/// What it says may quote files.
void say(const std::string& text) { std::fputs(("clume: " + printable(text, true) + "\n").c_str(), stderr); }

std::string join(const std::vector<std::string>& parts, const char* separator) {
    return fmt::format("{}", fmt::join(parts, separator));
}

/// "64", or "12 to 13" where pixels differ.
std::string samples_held(const RenderStats& stats) {
    if (stats.samples_min == stats.samples_max) return fmt::format("{}", stats.samples_max);
    return fmt::format("{} to {}", stats.samples_min, stats.samples_max);
}

/// `known`: the devices as they were listed before the render, since one that failed had better not be asked again.
ImageMetadata describe(const Scene& scene, const RenderCommand& command, const RenderStats& stats, const std::vector<DeviceInfo>& known) {
    std::vector<std::string> devices, drivers;
    for (const DeviceShare& device : stats.devices) devices.push_back(device.name);
    for (const DeviceInfo& device : known) {
        const auto is_this = [&](const DeviceShare& share) { return share.name.find(device.name) != std::string::npos; };
        if (std::any_of(stats.devices.begin(), stats.devices.end(), is_this))
            drivers.push_back(device.name + ": " + device.version + ", driver " + device.driver);
    }
    const RenderOptions& options = command.options;
    const std::uint32_t end = options.sample_end != 0 ? options.sample_end : scene.render.spp;
    ImageMetadata metadata{
        {"software", "clume " CLUME_VERSION},
        {"scene", scene.path},
        {"seed", std::to_string(scene.render.seed)},
        {"samples", samples_held(stats)},
        {"sampleRange", fmt::format("{}:{}", options.sample_begin, end)},
        {"maxDepth", std::to_string(scene.render.max_depth)},
        {"sampler", scene.render.sobol ? "sobol" : "independent"},
        {"strategy", stats.strategy},
        {"transmittance", stats.transmittance},
        {"bound", stats.bound},
        {"devices", join(devices, "; ")},
        {"deviceVersions", join(drivers, "; ")},
        {"layoutHash", stats.layout_hash},
        {"renderTime", fmt::format("{:.3f} s", stats.render_s)},
    };
    std::vector<std::string> overrides;
    for (const Override& o : command.overrides) overrides.push_back(o.key + "=" + o.value);
    if (stats.noise) metadata.emplace_back("noise", stats.noise->summary());
    if (!overrides.empty()) metadata.emplace_back("overrides", join(overrides, " "));
    if (!stats.notes.empty()) metadata.emplace_back("notes", join(stats.notes, "\n"));
    if (!stats.warnings.empty()) metadata.emplace_back("warnings", join(stats.warnings, "\n"));
    if (stats.nonfinite_samples > 0) metadata.emplace_back("nonfiniteSamples", std::to_string(stats.nonfinite_samples));
    return metadata;
}

void print_explanation(const Scene& scene, const RenderOptions& options, const std::optional<Pilot>& pilot) {
    auto table = explain(scene, options);
    if (pilot)
        for (auto& line : pilot->table()) table.push_back(std::move(line));
    std::size_t width = 0;
    for (const auto& [feature, what] : table) width = std::max(width, feature.size());
    for (const auto& [feature, what] : table) std::fputs(fmt::format("{:<{}}  {}\n", feature, width, what).c_str(), stderr);
}

/// Says what is to be known about the render; the exit code.
int report(const RenderStats& stats) {
    for (const std::string& warning : stats.warnings) say("warning: " + warning);
    if (stats.strategy == "progressive")
        for (const std::string& note : stats.notes) say(note);
    if (stats.bound_violations > 0 && stats.strategy != "progressive")
        say(fmt::format("warning: density above its bound {} times: the image may be wrong", stats.bound_violations));
    if (stats.nonfinite_samples > 0)
        say(fmt::format("warning: {} samples were not finite and count as 0", stats.nonfinite_samples));
    if (stats.noise) {
        say(stats.noise->summary());
        say(fmt::format("{} samples per pixel, {:.1f} on average where there is anything; a pilot of {:.1f} % of the paths", samples_held(stats), stats.samples_mean,
                        100 * static_cast<double>(stats.noise->pilot_paths) / std::max(1.0, static_cast<double>(stats.noise->paths + stats.noise->pilot_paths))));
    }
    if (stats.device_lost) {
        say(fmt::format("no device is left: the image holds {} samples per pixel", samples_held(stats)));
        return 4;
    }
    if (stats.interrupted) {
        say(fmt::format("interrupted: the image holds {} samples per pixel", samples_held(stats)));
        return interrupted_exit_code;
    }
    if (stats.time_limited) say(fmt::format("time limit reached: the image holds {} samples per pixel", samples_held(stats)));
    return stats.nonfinite_samples > 0 ? 1 : 0;
}

int interrupted_early() {
    say("interrupted before the first sample: nothing was written");
    return interrupted_exit_code;
}

int render_scene(const RenderCommand& command) {
    if (command.memory_limit) set_memory_limit(*command.memory_limit);
    check_writable(command.exr);
    check_writable(command.png());
    const bool json_on_stdout = command.stats_json && *command.stats_json == "-";
    if (command.stats_json && !json_on_stdout) check_writable(*command.stats_json);

    const Scene scene = read_scene(command.scene, command.overrides);
    if (const auto& crop = command.options.crop; crop && (crop->x1 > scene.film.width || crop->y1 > scene.film.height))
        throw UsageError(fmt::format("--crop {},{},{},{}: reaches beyond the film, which is {} x {}", crop->x0, crop->y0,
                                     crop->x1, crop->y1, scene.film.width, scene.film.height));
    if (stop_requested()) return interrupted_early();
    const std::vector<DeviceInfo> known = list_devices();
    std::optional<Pilot> pilot = run_pilot(scene, command.options, pilot_folder(), stop_requested());
    if (stop_requested()) return interrupted_early();
    RenderOptions options = command.options;
    if (pilot) {
        options.pair = pilot->pair();
        options.shared = std::move(pilot->structures);
    }
    if (pilot && pilot->cut_short) say(pilot->summary());
    if (command.explain) print_explanation(scene, options, pilot);

    ProgressReporter progress(command.quiet, command.options.time_limit_s);
    RenderResult result = render(
        scene, std::move(options), [&](const Progress& p) { progress.update(p); }, stop_requested());
    progress.finish();
    RenderStats& stats = result.stats;
    if (pilot) {
        stats.notes.push_back(pilot->summary());
        const auto table = pilot->table();
        stats.explain.insert(stats.explain.end(), table.begin(), table.end());
    }
    if (stats.samples_max == 0 && stats.device_lost)
        throw DeviceError("no device is left, and no sample was done: nothing was written\n  " + join(stats.warnings, "\n  "));
    if (stats.samples_max == 0 && (stats.interrupted || stop_requested())) return interrupted_early();
    if (stats.samples_max == 0 && stats.time_limited)
        throw RenderError("the time limit was reached before the first sample: nothing was written");

    SavedImage saved = save_image(command.exr, command.png(), result.image, describe(scene, command, stats, known), command.exposure_stops);
    for (const auto& file : saved.files) std::fputs((file.string() + "\n").c_str(), json_on_stdout ? stderr : stdout);
    try {
        if (command.stats_json) write_stats_json(*command.stats_json, stats);
    } catch (const RenderError& error) {
        saved.failures.push_back(error.what());
    }
    const int code = report(stats);
    for (const std::string& failure : saved.failures) say(failure);
    return saved.failures.empty() ? code : 1;
}

int run(const RenderCommand& command) {
    install_interrupt_handlers();
    try {
        return render_scene(command);
    } catch (const DeviceError&) {
        // A compiler inside an OpenCL implementation clears away its files at a signal, and then fails for want of them.
        if (stop_requested()) return interrupted_early();
        throw;
    }
}

int run(const CompareCommand& command) {
    install_interrupt_handlers();
    const Scene scene = read_scene(command.scene, command.overrides);
    const bool fresh = prepare_report_folder(command.folder, command.line);
    ProgressReporter progress(command.quiet);
    Comparison comparison;
    try {
        comparison = compare(
            scene, command.options, [&](const Progress& p) { progress.update(p); }, stop_requested());
    } catch (...) {
        if (fresh) discard_report_folder(command.folder);
        throw;
    }
    progress.finish();
    const CompareSummary summary = summarise(comparison);
    std::vector<std::string> warnings = comparison.warnings;
    bool failed = comparison.reference_refused();
    std::size_t left_out = 0;
    for (const PairRun& run : comparison.pairs) {
        if (run.error.empty()) continue;
        if (run.asked_for) warnings.push_back(run.pair.label() + " was left out: " + run.error);
        else ++left_out;
        failed = failed || run.asked_for;
    }
    if (left_out > 0) warnings.push_back(fmt::format("{} pairs could not run and were left out; the report says why", left_out));
    for (std::string& warning : write_report(command.folder, comparison, summary, command.line)) warnings.push_back(std::move(warning));
    for (const std::string& warning : warnings) say("warning: " + warning);
    for (const std::string& sentence : summary.verdict) std::fputs((sentence + "\n").c_str(), stdout);
    std::fputs(((command.folder / "index.html").string() + "\n").c_str(), stdout);
    if (comparison.interrupted) {
        say("interrupted: the report holds what was done");
        return interrupted_exit_code;
    }
    return failed ? 1 : 0;
}

int run(const DevicesCommand&) {
    const std::vector<DeviceInfo> devices = list_devices();
    if (devices.empty()) select_from(devices, {});  // throws, saying how to get one
    for (const DeviceInfo& device : devices) {
        fmt::print("{}\n  {}, {} compute units, native width {} floats, {:.1f} GiB{}\n", device.id, device.type,
                   device.compute_units, device.native_vector_width, static_cast<double>(device.global_memory) / 0x1p30,
                   device.available ? "" : ", not available");
        fmt::print("  {}\n  {}, {}\n  driver {}\n", device.name, device.platform, device.version, device.driver);
    }
    return 0;
}

int run(const InfoCommand& command) {
    print_info(command.file, command.overrides);
    return 0;
}

int run(const BakeCommand& command) {
    check_writable(command.output);
    install_interrupt_handlers();
    const Scene scene = read_scene(command.scene, command.overrides);
    PartReporter progress("baking", command.quiet);
    const auto grid = bake(
        scene, command.resolution, [&](double part) { progress.update(part); }, stop_requested());
    progress.finish();
    if (grid) write_voxel_file(command.output, *grid);
    if (!grid) {
        say("interrupted: nothing was written");
        return interrupted_exit_code;
    }
    std::fputs((command.output.string() + "\n").c_str(), stdout);
    const auto [least, most] = sample_range(*grid);
    say(fmt::format("{} x {} x {} voxels, density {:.4g} to {:.4g}, {} of {:.0f} bricks hold something", grid->hi.x, grid->hi.y,
                    grid->hi.z, least, most, grid->brick_origins.size(), brick_count(*grid)));
    const std::filesystem::path folder = std::filesystem::absolute(command.scene).parent_path();
    const BakedMedium medium = describe_baked(scene, std::filesystem::absolute(command.output).lexically_proximate(folder));
    say("in a scene: " + medium.json);
    for (const std::string& loss : medium.losses) say("warning: " + loss);
    return 0;
}

int run(const StressCommand& command) {
    const std::vector<DeviceInfo> devices = select_devices(command.devices);
    const bool json_on_stdout = command.json && *command.json == "-";
    if (command.json && !json_on_stdout) check_writable(*command.json);
    if (command.report) check_stress_report(*command.report);
    std::vector<StressResult> results;
    for (const DeviceInfo& device : devices) {
        PartReporter progress("stressing " + device.label(), command.quiet);
        results.push_back(run_stress(device, {.quick = command.quick}, [&](double part) { progress.update(part); }));
        progress.finish();
        std::fputs(stress_table(results.back()).c_str(), json_on_stdout ? stderr : stdout);
    }
    if (command.json) write_stress_json(*command.json, results);
    if (command.report) std::fputs((write_stress_report(*command.report, results).string() + "\n").c_str(), json_on_stdout ? stderr : stdout);
    bool holds = true;
    for (const StressResult& result : results)
        for (const StressRow& row : result.rows) {
            if (row.holds()) continue;
            holds = false;
            say(fmt::format("{}: {} ({}), {}: {}; at {}", result.device, row.quantity, row.function, row.family, row.trouble(), row.worst_at));
        }
    return holds ? 0 : 1;
}

int run(const PrintCommand& command) {
    std::fputs(command.text.c_str(), stdout);
    return 0;
}

int run_all(int argc, char** argv) {
    if (argc > 1 && std::string_view(argv[1]) == "bench") return run_bench(argc - 1, argv + 1);
    return std::visit([](const auto& command) { return run(command); }, parse_command_line(argc, argv));
}

/// Results that did not reach stdout (a full disk) are a failure, too.
int with_flushed_output(int code) {
    std::cout.flush();
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout) return code;
    say("stdout: cannot be written");
    return code == 0 ? 1 : code;
}

/// The exit code, everything said.
int outcome(int argc, char** argv) {
    try {
        return with_flushed_output(run_all(argc, argv));
    } catch (const UsageError& error) {
        const std::vector<std::string_view> arguments(argv + std::min(argc, 1), argv + argc);
        say(in_typed_words(error.what(), arguments));
        return 2;
    } catch (const SceneError& error) {
        std::fputs((printable(error.what()) + "\n").c_str(), stderr);  // file:line:column first, as editors want it
        return 3;
    } catch (const DeviceError& error) {
        say(error.what());
        return 4;
    } catch (const std::bad_alloc&) {
        say("out of memory");
        return 1;
    } catch (const std::exception& error) {
        say(error.what());
        return 1;
    } catch (...) {
        say("an unknown error");
        return 1;
    }
}

}  // namespace

int main(int argc, char** argv) {
    const int code = outcome(argc, argv);
    if (!anything_hangs()) return code;
    std::fflush(nullptr);
    std::_Exit(code);  // the threads left behind and what they hold can't be cleared away
}
