// SPDX-License-Identifier: MIT
// The command line as data. Parsing only: nothing is read, written or rendered here.
// Flags that stand for a scene key become overrides, in the order typed, so that the last one wins whichever way it is said.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "src/compare.h"
#include "src/renderer.h"
#include "src/scene_reader.h"

namespace clume {

struct RenderCommand {
    std::filesystem::path scene;
    std::filesystem::path exr;  ///< the PNG goes beside it
    RenderOptions options;
    std::vector<Override> overrides;
    double exposure_stops = 0;
    bool explain = false, quiet = false;
    std::optional<std::filesystem::path> stats_json;  ///< "-": stdout
    std::optional<std::uint64_t> memory_limit;        ///< bytes

    std::filesystem::path png() const { return std::filesystem::path(exr).replace_extension(".png"); }
};

struct CompareCommand {
    std::filesystem::path scene;
    std::filesystem::path folder;  ///< of the report
    CompareOptions options;
    std::vector<Override> overrides;
    bool quiet = false;
    std::string line;  ///< the command as typed, quoted for a shell
};

struct DevicesCommand {};

struct InfoCommand {
    std::filesystem::path file;
    std::vector<Override> overrides;
};

struct BakeCommand {
    std::filesystem::path scene, output;
    int resolution = 0;  ///< voxels along the longest axis
    std::vector<Override> overrides;
    bool quiet = false;
};

struct StressCommand {
    std::vector<std::string> devices;
    bool quick = false;
    std::optional<std::filesystem::path> json;    ///< "-": stdout
    std::optional<std::filesystem::path> report;  ///< folder
    bool quiet = false;
};

/// --help and --version: `text` goes to stdout.
struct PrintCommand {
    std::string text;
};

using Command = std::variant<PrintCommand, RenderCommand, CompareCommand, DevicesCommand, InfoCommand, BakeCommand, StressCommand>;

/// Throws UsageError with one line that names the nearest right flag or subcommand. `bench` is the caller's: its arguments
/// are not parsed here.
Command parse_command_line(int argc, const char* const* argv);

/// What is typed after `render`'s flags, before it is checked.
struct RenderTexts {
    std::string scene, output, sample_range, crop, stats_json, memory_limit;
    std::vector<std::string> definitions, devices;
    std::optional<double> time_limit_s, noise_threshold, kernel_timeout_s;
    std::optional<int> cpu_split;
};

/// Adds them to a command that holds the rest. Throws UsageError.
RenderCommand check_render(const RenderTexts& texts, RenderCommand command);

/// What is typed after `compare`'s flags, before it is checked.
struct CompareTexts {
    std::string scene, output, strategies, spp, reference;
    std::optional<double> time_s;
    std::optional<int> seeds;
    std::vector<std::string> devices;
    bool quiet = false;
};

/// Throws UsageError.
CompareCommand check_compare(const CompareTexts& texts);

/// The name at the smallest edit distance (swapped neighbours count once), or at the smallest distance of its beginning
/// plus one; empty without names.
std::string nearest_flag(std::string_view word, std::span<const std::string> names);

/// An override's error in the words that were typed: "-D render.spp=0: ..." becomes "--spp 0: ..." if that flag was used.
std::string in_typed_words(const std::string& message, std::span<const std::string_view> arguments);

}  // namespace clume
