// SPDX-License-Identifier: MIT
// Progress of a render on stderr: a bar redrawn in place on a terminal, a plain line every few seconds elsewhere.
// update() and finish() are called from one thread at a time.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "src/renderer.h"

namespace clume {

class ProgressReporter {
  public:
    /// `quiet` silences it. `time_limit_s` bounds the time left that is shown.
    explicit ProgressReporter(bool quiet, std::optional<double> time_limit_s = {});
    ~ProgressReporter() { finish(); }
    ProgressReporter(const ProgressReporter&) = delete;
    ProgressReporter& operator=(const ProgressReporter&) = delete;

    void update(const Progress& progress);
    /// Shows the last state once more and ends the line; later updates are ignored.
    void finish();

  private:
    void draw();

    enum class Mode { silent, lines, bar };
    Mode mode_;
    std::optional<double> time_limit_s_;
    std::optional<Progress> last_;
    std::chrono::steady_clock::time_point drawn_;
    bool drawn_last_ = false;
};

/// The same for work that has no paths: what is done in percent.
class PartReporter {
  public:
    /// `name` is what is going on, such as "baking"; `quiet` silences it.
    PartReporter(std::string name, bool quiet);
    ~PartReporter() { finish(); }
    PartReporter(const PartReporter&) = delete;
    PartReporter& operator=(const PartReporter&) = delete;

    /// `part` of it is done, 0 to 1.
    void update(double part);
    /// Ends the line; later updates are ignored.
    void finish();

  private:
    std::string name_;
    bool silent_, bar_, open_line_ = false;
    std::chrono::steady_clock::time_point drawn_;
};

/// "0:07", "12:34", "3:04:05"; "-:--" for what isn't finite or negative.
std::string format_duration(double seconds);

/// One line without line end, at most `width` columns (ASCII only); width 0: as long as needed, without a bar.
std::string format_progress(const Progress& progress, std::optional<double> time_limit_s, int width);

}  // namespace clume
