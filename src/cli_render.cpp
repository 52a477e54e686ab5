// SPDX-License-Identifier: MIT
// The arguments of `render`: numbers that go together, ranges, and what excludes what.
#include <fmt/format.h>

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

#include "src/cli.h"
#include "src/error.h"
#include "src/memory_budget.h"

namespace clume {
namespace {

/// `text` as numbers with `separator` between them; false unless there are exactly `count` of them and nothing else.
template <class Number, std::size_t count>
bool parse_list(std::string_view text, char separator, std::array<Number, count>& values) {
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t end = std::min(text.find(separator), text.size());
        const auto [stop, error] = std::from_chars(text.data(), text.data() + end, values[i]);
        if (error != std::errc() || stop != text.data() + end) return false;
        const bool last = i + 1 == count;
        if (last != (end == text.size())) return false;
        text.remove_prefix(last ? end : end + 1);
    }
    return true;
}

}  // namespace

RenderCommand check_render(const RenderTexts& texts, RenderCommand command) {
    if (texts.scene.empty()) throw UsageError("render: which scene? Such as: clume render scenes/plume.json");
    command.scene = texts.scene;
    command.exr = texts.output.empty() ? command.scene.stem().string() + ".exr" : texts.output;
    std::string extension = command.exr.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension != ".exr")
        throw UsageError("-o " + texts.output + ": must end in .exr (the PNG preview is written beside it)");
    if (!texts.stats_json.empty()) command.stats_json = texts.stats_json;
    if (command.stats_json && (*command.stats_json == command.exr || *command.stats_json == command.png()))
        throw UsageError("--stats-json " + texts.stats_json + ": is the name of the image");

    if (!texts.memory_limit.empty()) command.memory_limit = parse_byte_size("--memory-limit", texts.memory_limit);
    RenderOptions& options = command.options;
    std::array<std::uint32_t, 2> range{};
    if (!texts.sample_range.empty()) {
        if (!parse_list(texts.sample_range, ':', range) || range[0] >= range[1])
            throw UsageError("--sample-range " + texts.sample_range + ": must be A:B with 0 <= A < B (B itself is left out)");
        options.sample_begin = range[0];
        options.sample_end = range[1];
    }
    std::array<int, 4> crop{};
    if (!texts.crop.empty()) {
        if (!parse_list(texts.crop, ',', crop) || crop[0] < 0 || crop[1] < 0 || crop[0] >= crop[2] || crop[1] >= crop[3])
            throw UsageError("--crop " + texts.crop + ": must be x0,y0,x1,y1 in pixels with 0 <= x0 < x1 and 0 <= y0 < y1");
        options.crop = CropWindow{crop[0], crop[1], crop[2], crop[3]};
    }
    if (texts.time_limit_s && !(*texts.time_limit_s > 0 && std::isfinite(*texts.time_limit_s)))
        throw UsageError("--time-limit: must be a positive number of seconds");
    options.time_limit_s = texts.time_limit_s;
    if (texts.noise_threshold) {
        if (!(*texts.noise_threshold > 0 && *texts.noise_threshold <= 1))
            throw UsageError(fmt::format("--noise-threshold {:g}: must lie above 0 and be at most 1, such as 0.02 for 2 % of a tile's mean", *texts.noise_threshold));
        if (!texts.sample_range.empty())
            throw UsageError("--noise-threshold and --sample-range " + texts.sample_range + ": one or the other decides which samples are made");
        options.noise_threshold = texts.noise_threshold;
    }
    options.kernel_timeout_s = texts.kernel_timeout_s.value_or(options.kernel_timeout_s);
    if (!(options.kernel_timeout_s >= 0 && options.kernel_timeout_s <= 1e6)) throw UsageError("--kernel-timeout: must be 0 (never) to 1e6 seconds");
    if (texts.cpu_split && *texts.cpu_split < 1) throw UsageError("--cpu-split: must be at least 1");
    options.cpu_split = texts.cpu_split.value_or(0);
    options.devices = texts.devices;
    if (!(std::abs(command.exposure_stops) <= 100)) throw UsageError("--exposure: must lie between -100 and 100 stops");
    return command;
}

}  // namespace clume
