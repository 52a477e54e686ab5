// SPDX-License-Identifier: MIT
#include "bench/bench.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "bench/sections.h"
#include "src/cli.h"
#include "src/error.h"
#include "src/output_file.h"
#include "src/strategies.h"

namespace clume {
namespace {

constexpr const char* overview =
    "Measures speed on one device. Sections: scenes (the renderer beside a plain host tracer), peaks (of the device), kernels (and the share\nof the peaks that they reach), specialisation, lamps, samplers, scaling,\nadaptive (what a noise threshold saves), devices (that share a render), work (what an operation costs); with --study the study of strategies instead.\n"
    "An item is called section/name: --list prints them, --filter chooses. Everything takes about ten minutes on two cores,\nthe study 15 to 30.\n";
constexpr const char* examples =
    "Examples: clume bench --filter ^scenes/          clume bench --filter 'flight/ball.*w16'\n"
    "          clume bench --quick --json speed.json\n"
    "          clume bench --study docs          (remakes what docs/strategies.md shows)";

std::vector<std::string> flag_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    return names;
}

/// Nothing if --help was asked for (and printed).
std::optional<bench::Options> parse(int argc, char** argv) {
    CLI::App app(overview, "clume bench");
    app.footer(examples);
    app.allow_extras();
    app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    bench::Options o;
    app.add_flag("--list", o.list, "print the names of the items and measure nothing");
    app.add_option("--filter", o.filter, "only items in whose name this regular expression is found")->type_name("REGEX");
    app.add_option("--device", o.device, "id or part of a name; default: the best one")->type_name("DEVICE");
    app.add_option("--width", o.width, "primitives per vector: 16, 8, 4 or 1; default: the device's own, and all four for kernels")->type_name("W");
    app.add_option("--rounds", o.rounds, "measurements of which the median is printed; default: 7")->type_name("N");
    app.add_option("--strategy", o.strategy, "distance sampling of scenes and scaling: delta, decomposition, regular, progressive, march …")->type_name("NAME");
    app.add_option("--accelerator", o.accelerator, "of what visits chords, in scenes and scaling: cells, bvh or auto")->type_name("NAME");
    app.add_option("--study", o.study, "measure what docs/strategies.md shows instead, and put it there: 15 to 30 minutes")->type_name("DOCS");
    app.add_option("--json", o.json, "write the results to this file, too")->type_name("FILE");
    app.add_flag("--roofline", o.roofline, "only peaks and kernels: what the device can do at most, and the share of it that every kernel reaches");
    app.add_option("--report", o.report, "with --roofline: put its tables into DOCS/performance.md")->type_name("DOCS");
    app.add_flag("--quick", o.quick, "smaller samples and three rounds: a minute, to see that it works");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        std::fputs(app.help().c_str(), stdout);
        return {};
    } catch (const CLI::ParseError& error) {
        std::string text = error.what();
        std::replace(text.begin(), text.end(), '\n', ' ');
        throw UsageError("bench: " + text);
    }
    if (const std::vector<std::string> left = app.remaining(); !left.empty()) {
        const std::string& word = left.front();
        if (word.empty() || word[0] != '-') throw UsageError("bench: unexpected argument '" + word + "'; to choose items: --filter '" + word + "'");
        throw UsageError("bench: unknown flag '" + word + "'; the nearest is '" + nearest_flag(word.substr(0, word.find('=')), flag_names(app)) + "'");
    }
    const auto one_of = [](const char* flag, const std::string& value, const std::vector<const char*>& names) {
        if (std::none_of(names.begin(), names.end(), [&](const char* name) { return value == name; }))
            throw UsageError(fmt::format("bench: {} {}: must be one of {}", flag, value, fmt::join(names, ", ")));
    };
    if (app.count("--width") > 0) one_of("--width", std::to_string(o.width), {"16", "8", "4", "1"});
    if (app.count("--rounds") > 0 && (o.rounds < 1 || o.rounds > 1000)) throw UsageError("bench: --rounds: must lie between 1 and 1000");
    if (app.count("--strategy") > 0) {
        std::vector<const char*> names{"auto"};
        for (const Method& m : strategies()) names.push_back(m.name);
        one_of("--strategy", o.strategy, names);
    }
    if (!o.report.empty() && !o.roofline) throw UsageError("bench: --report: only with --roofline");
    one_of("--accelerator", o.accelerator, {"auto", "cells", "bvh"});
    return o;
}

}  // namespace

int run_bench(int argc, char** argv) {
    const std::optional<bench::Options> options = parse(argc, argv);
    if (!options) return 0;
    bench::Session session(*options);
    if (!options->list) {
        if (!options->json.empty()) check_writable(options->json);
        const DeviceInfo& d = session.device();
        fmt::print("{} ({}, {} units, native width {}); load average {:.1f}\n", d.label(), d.platform_version, d.compute_units, d.native_vector_width, bench::load_average());
    }
    if (!options->study.empty()) {
        bench_study_section(session);
    } else if (options->roofline) {
        bench_peaks_section(session);
        bench_kernels_section(session);
        if (!options->report.empty() && !options->list) write_roofline(session, options->report);
    } else {
        bench_scenes_section(session);
        bench_peaks_section(session);
        bench_kernels_section(session);
        bench_specialisation_section(session);
        bench_lamps_section(session);
        bench_samplers_section(session);
        bench_scaling_section(session);
        bench_adaptive_section(session);
        bench_devices_section(session);
        bench_work_section(session);
    }
    if (!session.any()) throw UsageError("bench: --filter " + options->filter + ": is found in no item's name; see clume bench --list");
    if (!options->list) fmt::print("\nload average {:.1f}\n", bench::load_average());
    if (!options->json.empty() && !options->list) {
        OutputFile file(options->json);
        const std::string text = session.to_json();
        std::fwrite(text.data(), 1, text.size(), file.stream());
        file.commit();
    }
    return 0;
}

}  // namespace clume
