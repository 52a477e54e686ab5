// SPDX-License-Identifier: MIT
// Command line parsing with CLI11. Its own checks of unknown arguments are off: what it does not know is collected and
// reported here in one line with the nearest name, and all its errors become UsageError.
#include "src/cli.h"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <array>
#include <map>
#include <numeric>

#include "src/bake.h"
#include "src/error.h"
#include "src/scene_schema.h"
#include "src/voxel_writer.h"

namespace clume {

namespace {

struct KeyFlag {
    const char* flag;
    const char* key;
    const char* value;
    const char* help;
    bool compare;  ///< goes with `compare` as well
};

/// Flags that are another way to say -D; the scene reader checks their values.
constexpr std::array key_flags{
    KeyFlag{"--spp", "render.spp", "N", "samples per pixel", false},
    KeyFlag{"--seed", "render.seed", "S", "seed of the random numbers", true},
    KeyFlag{"--max-depth", "render.max_depth", "N", "most scattering events on a path; -1: no limit", true},
    KeyFlag{"--strategy", "render.strategy", "NAME", "distance sampling", false},
    KeyFlag{"--transmittance", "render.transmittance", "NAME", "transmittance estimator", false},
    KeyFlag{"--bound", "render.bound", "NAME", "bound of null collisions", false},
    KeyFlag{"--majorant-grid", "render.majorant_grid", "N", "cells along the longest axis of a grid of bounds", true},
};

constexpr const char* overview = "clume renders mixtures of ellipsoids (smoke, fire, clouds) by path tracing, on any OpenCL device.\n";
constexpr const char* exit_codes =
    "Exit codes: 0 done, 1 render failed, 2 wrong command line, 3 wrong scene or asset, 4 no such device or none left, 130 interrupted.";

Override parse_definition(const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
        throw UsageError("-D " + text + ": must be key=value, such as -D render.spp=256");
    return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Overrides in the order typed, of -D and of the flags that stand for keys.
std::vector<Override> collect_overrides(const CLI::App& app, const CLI::Option* definition,
                                        const std::map<const CLI::Option*, const char*>& keys) {
    std::vector<Override> overrides;
    std::map<const CLI::Option*, std::size_t> used;
    for (const CLI::Option* option : app.parse_order()) {
        const auto key = keys.find(option);
        if (option != definition && key == keys.end()) continue;
        const std::string& text = option->results().at(used[option]++);
        overrides.push_back(option == definition ? parse_definition(text) : Override{key->second, text});
    }
    return overrides;
}

/// The flag's help with the names that the scene file allows for its key.
std::string help_of(const KeyFlag& flag) {
    std::string text = flag.help;
    for (const KeySpec& spec : scene_schema())
        if (std::string(spec.section) + "." + std::string(spec.name) == flag.key && !spec.choices.empty())
            text += ": " + std::string(spec.choices);
    return text;
}

std::vector<std::string> flag_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
        for (const std::string& name : option->get_snames()) names.push_back("-" + name);
    }
    return names;
}

bool is_flag(const std::string& word) { return word.size() > 1 && word[0] == '-'; }

/// Throws for the first argument that `app` (a subcommand, or the top level) did not take.
void refuse_leftovers(const CLI::App& app, const CLI::App* top) {
    const std::vector<std::string> left = app.remaining();
    if (left.empty()) return;
    const std::string where = top != nullptr ? app.get_name() + ": " : std::string();
    const auto flag = std::find_if(left.begin(), left.end(), is_flag);
    if (flag == left.end()) {
        if (top != nullptr) throw UsageError(where + "unexpected argument '" + left.front() + "'");
        std::vector<std::string> names;
        for (const CLI::App* sub : app.get_subcommands({})) names.push_back(sub->get_name());
        if (left.front().find(".json") != std::string::npos)
            throw UsageError("unknown subcommand '" + left.front() + "'; to render a scene: clume render " + left.front());
        throw UsageError("unknown subcommand '" + left.front() + "'; the nearest is '" + nearest_flag(left.front(), names) +
                         "'");
    }
    const std::string name = flag->substr(0, flag->find('='));
    if (top == nullptr)
        for (const CLI::App* sub : app.get_subcommands({})) {
            const std::vector<std::string> names = flag_names(*sub);
            if (std::find(names.begin(), names.end(), name) != names.end())
                throw UsageError("flag '" + name + "' belongs after the subcommand: clume " + sub->get_name() + " ... " + name);
        }
    throw UsageError(where + "unknown flag '" + name + "'; the nearest is '" + nearest_flag(name, flag_names(app)) + "'");
}

/// A variable of the shell that isn't set makes an empty value: a mistake, not the default.
void refuse_empty(const CLI::App& app) {
    for (const CLI::Option* option : app.parse_order())
        for (const std::string& value : option->results())
            if (value.empty() && !option->get_positional()) throw UsageError(app.get_name() + ": " + option->get_name() + ": its value is empty");
}

/// The arguments as a shell would take them again.
std::string command_line(int argc, const char* const* argv) {
    std::string line = "clume";
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const bool plain = !word.empty() && word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=.,:/%@") == std::string::npos;
        line += ' ';
        if (plain) {
            line += word;
            continue;
        }
        line += '\'';
        for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
        line += '\'';
    }
    return line;
}

BakeCommand check_bake(const std::string& scene, const std::string& output, std::optional<long long> resolution) {
    if (scene.empty()) throw UsageError("bake: which scene? Such as: clume bake scenes/plume.json --resolution 256 -o plume.nvdb");
    if (output.empty()) throw UsageError("bake: into which file? Such as: -o smoke.vol, smoke.nvdb or smoke.vdb");
    if (!can_write_voxels(output)) throw UsageError("-o " + output + ": must end in .vol, .nvdb or .vdb");
    if (!resolution) throw UsageError("bake: how many voxels along the longest axis? Such as: --resolution 256");
    if (*resolution < 1 || *resolution > most_bake_resolution)
        throw UsageError("--resolution " + std::to_string(*resolution) + ": must lie between 1 and " +
                         std::to_string(most_bake_resolution));
    return {scene, output, static_cast<int>(*resolution), {}, false};
}

}  // namespace

std::string nearest_flag(std::string_view word, std::span<const std::string> names) {
    std::string nearest;
    std::size_t best = static_cast<std::size_t>(-1);
    for (const std::string& name : names) {
        // Optimal string alignment distance, from the last three rows of its table.
        std::vector<std::size_t> before(name.size() + 1), above(name.size() + 1), row(name.size() + 1);
        std::iota(row.begin(), row.end(), std::size_t{0});
        for (std::size_t i = 1; i <= word.size(); ++i) {
            before = above;
            above = row;
            row[0] = i;
            for (std::size_t j = 1; j <= name.size(); ++j) {
                row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (word[i - 1] != name[j - 1] ? 1 : 0)});
                if (i > 1 && j > 1 && word[i - 1] == name[j - 2] && word[i - 2] == name[j - 1])
                    row[j] = std::min(row[j], before[j - 2] + 1);
            }
        }
        // "--samples" is meant for "--sample-range" and "--depth" for "--max-depth": a part counts, at the price of one.
        std::size_t distance = row.back();
        if (word.size() >= 5) distance = std::min(distance, 1 + *std::min_element(row.begin(), row.end()));
        if (word.size() >= 5 && name.find(word.substr(2)) != std::string::npos) distance = std::min<std::size_t>(distance, 1);
        if (distance < best) {
            best = distance;
            nearest = name;
        }
    }
    return nearest;
}

std::string in_typed_words(const std::string& message, std::span<const std::string_view> arguments) {
    for (const KeyFlag& flag : key_flags) {
        const std::string prefix = std::string("-D ") + flag.key + "=";
        const bool typed = std::any_of(arguments.begin(), arguments.end(), [&](std::string_view argument) {
            return argument.substr(0, argument.find('=')) == flag.flag;
        });
        if (typed && message.starts_with(prefix)) return std::string(flag.flag) + " " + message.substr(prefix.size());
    }
    return message;
}

Command parse_command_line(int argc, const char* const* argv) {
    CLI::App app(overview, "clume");
    app.footer(exit_codes);
    app.set_version_flag("--version", "clume " CLUME_VERSION);
    app.allow_extras();
    app.set_help_flag("-h,--help", "print this help");

    RenderTexts texts;
    RenderCommand command;
    CLI::App* render = app.add_subcommand("render", "render a scene to an EXR and a PNG; prints their paths");
    render->allow_extras();
    render->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    render->add_option("SCENE", texts.scene, "scene file (JSON, docs/scene.md)")->type_name("");
    render->add_option("-o,--output", texts.output, "image to write; default: the scene's name, in the current folder")->type_name("OUT.exr");
    std::map<const CLI::Option*, const char*> keys;
    for (const KeyFlag& flag : key_flags) {
        CLI::Option* option = render->add_option(flag.flag)->description(help_of(flag))->type_name(flag.value);
        keys.emplace(option, flag.key);
    }
    render->add_option("--sample-range", texts.sample_range, "only samples A to B - 1 of each pixel")->type_name("A:B");
    render->add_option("--crop", texts.crop, "only this part of the film, half-open")->type_name("x0,y0,x1,y1");
    render->add_option("--time-limit", texts.time_limit_s, "sample no longer than this and write what is done; building and compiling come on top")->type_name("SECONDS");
    render->add_option("--noise-threshold", texts.noise_threshold, "give each tile only the samples it needs for this standard error relative to its mean, such as 0.02; --spp at most")
        ->type_name("E");
    render->add_option("--kernel-timeout", texts.kernel_timeout_s, "a device silent for so long hangs and is given up; default 120; 0: never")->type_name("SECONDS");
    render->add_option("--memory-limit", texts.memory_limit, "most memory to use, such as 512M or 2G; default: what is free")->type_name("SIZE");
    render->add_option("--device", texts.devices, "id, part of a name, cpu, gpu or all; several with commas or repeated")
        ->type_name("DEVICE")
        ->take_all()
        ->allow_extra_args(false);
    render->add_option("--cpu-split", texts.cpu_split, "use each CPU as N sub-devices")->type_name("N");
    render->add_option("--exposure", command.exposure_stops, "brightness of the PNG, in stops; default 0")->type_name("STOPS");
    CLI::Option* render_definition =
        render->add_option("-D", texts.definitions, "override any key of the scene, such as -D film.width=256")
            ->type_name("KEY=VALUE")
            ->take_all()
            ->allow_extra_args(false);
    render->add_flag("--explain", command.explain, "print what the program is specialised to, on stderr");
    render->add_flag("--quiet", command.quiet, "no progress on stderr");
    render->add_option("--stats-json", texts.stats_json, "write statistics; - is stdout (the paths then go to stderr)")
        ->type_name("FILE");

    CLI::App* compare = app.add_subcommand("compare", "measure strategies against each other; writes a report")->allow_extras();
    CompareTexts compare_texts;
    compare->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    compare->add_option("SCENE", compare_texts.scene, "scene file (JSON, docs/scene.md)")->type_name("");
    compare->add_option("-o,--output", compare_texts.output, "folder to write; default: the scene's name and _compare")->type_name("FOLDER");
    compare->add_option("--strategies", compare_texts.strategies,
                        "pairs strategy/estimator with commas, such as delta/ratio,march/march; a strategy alone: with every estimator; delta:scene, "
                        "delta:grid, delta:tree: with that bound; default: all")
        ->type_name("LIST");
    compare->add_option("--time", compare_texts.time_s, "equal time: seconds for each pair and seed")->type_name("SECONDS");
    compare->add_option("--spp", compare_texts.spp, "1, 2, 4 ... N samples per pixel, or the counts given with commas; default: render.spp")
        ->type_name("N|LIST");
    compare->add_option("--seeds", compare_texts.seeds, "seeds for each pair; default 8")->type_name("N");
    compare->add_option("--reference", compare_texts.reference, "image to measure against; default: made with two unbiased pairs")
        ->type_name("FILE.exr");
    compare->add_option("--device", compare_texts.devices, "id, part of a name, cpu, gpu or all; several with commas or repeated")
        ->type_name("DEVICE")
        ->take_all()
        ->allow_extra_args(false);
    std::vector<std::string> compare_definitions;
    CLI::Option* compare_definition = compare->add_option("-D", compare_definitions, "override any key of the scene, such as -D film.width=256")
                                          ->type_name("KEY=VALUE")
                                          ->take_all()
                                          ->allow_extra_args(false);
    std::map<const CLI::Option*, const char*> compare_keys;
    for (const KeyFlag& flag : key_flags)
        if (flag.compare) compare_keys.emplace(compare->add_option(flag.flag)->description(help_of(flag))->type_name(flag.value), flag.key);
    compare->add_flag("--quiet", compare_texts.quiet, "no progress on stderr");

    CLI::App* devices = app.add_subcommand("devices", "list the OpenCL devices of this machine")->allow_extras();
    std::string info_file;
    std::vector<std::string> info_definitions;
    CLI::App* info = app.add_subcommand("info", "say what is in a scene, a PLY file or a voxel file")->allow_extras();
    info->add_option("FILE", info_file, "scene (JSON), ellipsoids (PLY) or voxels (VDB, NVDB, VOL)")->type_name("");
    CLI::Option* info_definition = info->add_option("-D", info_definitions, "override any key of the scene")
                                       ->type_name("KEY=VALUE")
                                       ->take_all()
                                       ->allow_extra_args(false);
    std::string bake_scene, bake_output;
    std::optional<long long> resolution;
    std::vector<std::string> bake_definitions;
    bool bake_quiet = false;
    CLI::App* bake = app.add_subcommand("bake", "turn a scene's ellipsoids into a voxel file; prints its path")->allow_extras();
    bake->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    bake->add_option("SCENE", bake_scene, "scene file (JSON, docs/scene.md)")->type_name("");
    bake->add_option("-o,--output", bake_output, "voxel file to write")->type_name("OUT.vol|.nvdb|.vdb");
    bake->add_option("--resolution", resolution, "voxels along the longest axis of the mixture's bounds")->type_name("N");
    CLI::Option* bake_definition = bake->add_option("-D", bake_definitions, "override any key of the scene")
                                       ->type_name("KEY=VALUE")
                                       ->take_all()
                                       ->allow_extra_args(false);
    bake->add_flag("--quiet", bake_quiet, "no progress on stderr");
    StressCommand stress_command;
    std::string stress_json, stress_report;
    CLI::App* stress = app.add_subcommand("stress", "hold the kernels' arithmetic against 256 bits; prints a table")->allow_extras();
    stress->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    stress->add_option("--device", stress_command.devices, "id, part of a name, cpu, gpu or all; several with commas or repeated")
        ->type_name("DEVICE")
        ->take_all()
        ->allow_extra_args(false);
    stress->add_flag("--quick", stress_command.quick, "fewer cases: seconds");
    stress->add_option("--json", stress_json, "write every figure; - is stdout (the table then goes to stderr)")->type_name("FILE");
    stress->add_option("--report", stress_report, "write a page with plots into this folder; where it holds stability.md, remake that page's tables and plots")
        ->type_name("DIR");
    stress->add_flag("--quiet", stress_command.quiet, "no progress on stderr");
    app.add_subcommand("bench", "measure speed; see clume bench --help");

    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        return PrintCommand{app.help()};
    } catch (const CLI::CallForVersion& version) {
        return PrintCommand{std::string(version.what()) + "\n"};
    } catch (const CLI::ParseError& error) {
        std::string text = error.what();
        std::replace(text.begin(), text.end(), '\n', ' ');
        throw UsageError(text);
    }
    refuse_leftovers(app, nullptr);
    for (const CLI::App* sub : {render, compare, devices, info, bake, stress})
        if (sub->parsed()) {
            refuse_leftovers(*sub, &app);
            refuse_empty(*sub);
        }
    if (app.get_subcommands().size() > 1) throw UsageError("one subcommand at a time");

    if (render->parsed()) {
        command.overrides = collect_overrides(*render, render_definition, keys);
        return check_render(texts, std::move(command));
    }
    if (compare->parsed()) {
        CompareCommand compare_command = check_compare(compare_texts);
        compare_command.overrides = collect_overrides(*compare, compare_definition, compare_keys);
        compare_command.line = command_line(argc, argv);
        return compare_command;
    }
    if (devices->parsed()) return DevicesCommand{};
    if (info->parsed()) {
        if (info_file.empty()) throw UsageError("info: which file? Such as: clume info scenes/plume.json");
        return InfoCommand{info_file, collect_overrides(*info, info_definition, {})};
    }
    if (bake->parsed()) {
        BakeCommand out = check_bake(bake_scene, bake_output, resolution);
        out.overrides = collect_overrides(*bake, bake_definition, {});
        out.quiet = bake_quiet;
        return out;
    }
    if (stress->parsed()) {
        if (!stress_json.empty()) stress_command.json = stress_json;
        if (!stress_report.empty()) stress_command.report = stress_report;
        return stress_command;
    }
    throw UsageError("which subcommand? render, compare, devices, info, bake, stress or bench; see clume --help");
}

}  // namespace clume
