// SPDX-License-Identifier: MIT
// One run of the benchmarks: what was asked for, which items that means, and the results, kept for --json.
// An item is called "section/name"; a section prints its header before its first item that is wanted.
#pragma once

#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "runtime/device.h"
#include "src/renderer.h"

namespace clume::bench {

struct Options {
    bool list = false, quick = false;
    bool roofline = false;            ///< peaks and kernels alone
    std::string filter;               ///< regular expression, searched for in "section/name"
    std::string device;               ///< as --device; empty: the best one
    int width = 0;                    ///< of vectors; 0: the device's own (kernels: 16, 8, 4 and 1)
    int rounds = 0;                   ///< 0: the section's own default
    std::string strategy;             ///< of scenes and scaling; empty: auto
    std::string accelerator = "auto";
    std::string json;                 ///< file to write; empty: none
    std::string study;                ///< folder of docs that the study writes into; empty: no study
    std::string report;               ///< folder of docs that the roofline writes into; empty: none
};

/// Named values of one item, in the order printed; NaN becomes null.
using Fields = std::vector<std::pair<std::string, std::variant<double, std::string>>>;

/// What was measured of one item.
struct Result {
    std::string section, item;
    Fields fields;
};

class Session {
public:
    /// Throws UsageError for a filter that is no regular expression.
    explicit Session(Options options);

    const Options& options() const { return options_; }
    int rounds(int by_default) const { return options_.rounds > 0 ? options_.rounds : options_.quick ? 3 : by_default; }
    /// The device that everything runs on. Throws DeviceError.
    const DeviceInfo& device();
    RenderOptions render_options() const;

    /// What comes next; `header` ends in a line that names the columns.
    void section(std::string name, std::string header);
    /// Whether to measure an item of this section. With --list it prints the name instead, and says no.
    bool wants(const std::string& item);
    /// The same question, without printing.
    bool matches(const std::string& item) const;
    /// Keeps an item's result; prints `line`.
    void record(const std::string& item, const std::string& line, Fields fields);
    /// Prints a remark under the table.
    void note(const std::string& text);

    bool any() const { return any_; }
    const std::vector<Result>& results() const { return results_; }
    std::string to_json();

private:
    Options options_;
    std::regex filter_;
    std::optional<DeviceInfo> device_;
    std::string section_, header_;
    bool header_printed_ = false, any_ = false;
    double load_before_;
    std::vector<Result> results_;
};

/// Of a non-empty list.
double median(std::vector<double> values);
double mean(const std::vector<double>& values);

/// Processes that the machine has been running on average over the last minute, this one among them; < 0 if not known.
double load_average();

}  // namespace clume::bench
