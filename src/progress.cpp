// SPDX-License-Identifier: MIT
// Formatting and pacing of progress: at most ten redraws a second on a terminal, a line every five seconds elsewhere.
#include "src/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace clume {

namespace {

using namespace std::chrono_literals;

constexpr auto redraw_interval = 100ms;
constexpr auto line_interval = 5s;

int terminal_width() {
    winsize size{};
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
    return 80;
}

bool on_terminal() {
    const char* kind = std::getenv("TERM");
    return isatty(STDERR_FILENO) == 1 && kind != nullptr && std::string_view(kind) != "dumb";
}

/// 950, 12.3 k, 4.56 M, 7.89 G
std::string format_count(double count) {
    if (count < 1e3) return fmt::format("{:.0f}", count);
    if (count < 1e6) return fmt::format("{:.3g} k", count / 1e3);
    if (count < 1e9) return fmt::format("{:.3g} M", count / 1e6);
    return fmt::format("{:.3g} G", count / 1e9);
}

}  // namespace

std::string format_duration(double seconds) {
    if (!(seconds >= 0) || seconds > 1e8) return "-:--";
    const auto total = static_cast<long>(std::ceil(seconds));
    const long hours = total / 3600, minutes = total / 60 % 60;
    if (hours > 0) return fmt::format("{}:{:02}:{:02}", hours, minutes, total % 60);
    return fmt::format("{}:{:02}", minutes, total % 60);
}

std::string format_progress(const Progress& progress, std::optional<double> time_limit_s, int width) {
    const auto done = static_cast<double>(progress.paths_done), total = static_cast<double>(progress.paths_total);
    const double part = total > 0 ? std::clamp(done / total, 0.0, 1.0) : 0;
    double left_s = progress.mpaths_s > 0 ? (total - done) / (progress.mpaths_s * 1e6) : NAN;
    if (progress.paths_done >= progress.paths_total) left_s = progress.paths_total > 0 || progress.what.empty() ? 0 : NAN;
    if (time_limit_s) left_s = std::fmin(left_s, std::max(0.0, *time_limit_s - progress.elapsed_s));

    // From the most to the least important: what doesn't fit is left out from the right.
    const std::string percent = fmt::format("{:3.0f} %", std::floor(100 * part));
    const std::string fields[] = {fmt::format("  {} left", format_duration(left_s)), progress.what.empty() ? "" : "  " + progress.what,
                                  progress.mpaths_s < 1000 ? fmt::format("  {:.3g} Mpaths/s", progress.mpaths_s) : fmt::format("  {:.0f} Mpaths/s", progress.mpaths_s),
                                  fmt::format("  {} of {} samples", format_count(done), total > 0 ? format_count(total) : "?")};
    std::string line = percent;
    for (const std::string& field : fields)
        if (width <= 0 || line.size() + field.size() <= static_cast<std::size_t>(width)) line += field;
    const int room = width - static_cast<int>(line.size()) - 3;
    if (room >= 8) {
        const int cells = std::min(room, 40), filled = static_cast<int>(part * cells);
        line.insert(percent.size(), fmt::format(" [{:<{}}]", std::string(static_cast<std::size_t>(filled), '='), cells));
    }
    if (width > 0 && line.size() > static_cast<std::size_t>(width)) line.resize(static_cast<std::size_t>(width));
    return line;
}

ProgressReporter::ProgressReporter(bool quiet, std::optional<double> time_limit_s)
    : mode_(quiet           ? Mode::silent
            : on_terminal() ? Mode::bar
                            : Mode::lines),
      time_limit_s_(time_limit_s),
      drawn_(std::chrono::steady_clock::now()) {
    if (mode_ == Mode::bar) drawn_ -= redraw_interval;
}

void ProgressReporter::update(const Progress& progress) {
    if (mode_ == Mode::silent) return;
    last_ = progress;
    drawn_last_ = false;
    const auto now = std::chrono::steady_clock::now();
    if (now - drawn_ < (mode_ == Mode::bar ? std::chrono::nanoseconds(redraw_interval) : line_interval)) return;
    drawn_ = now;
    draw();
}

void ProgressReporter::finish() {
    if (mode_ != Mode::silent && last_) {
        if (!drawn_last_) draw();
        if (mode_ == Mode::bar) std::fputc('\n', stderr);
    }
    mode_ = Mode::silent;
}

PartReporter::PartReporter(std::string name, bool quiet)
    : name_(std::move(name)), silent_(quiet), bar_(on_terminal()), drawn_(std::chrono::steady_clock::now()) {}

void PartReporter::update(double part) {
    const auto now = std::chrono::steady_clock::now();
    if (silent_ || now - drawn_ < (bar_ ? std::chrono::nanoseconds(redraw_interval) : line_interval)) return;
    drawn_ = now;
    const std::string text = fmt::format("{} {:3.0f} %", name_, std::floor(100 * part));
    std::fputs((bar_ ? "\r" + text + "\x1b[K" : text + "\n").c_str(), stderr);
    std::fflush(stderr);
    open_line_ = bar_;
}

void PartReporter::finish() {
    if (open_line_) std::fputs("\r\x1b[K", stderr);
    open_line_ = false;
    silent_ = true;
}

void ProgressReporter::draw() {
    drawn_last_ = true;
    if (mode_ == Mode::bar)
        std::fputs(("\r" + format_progress(*last_, time_limit_s_, terminal_width() - 1) + "\x1b[K").c_str(), stderr);
    else
        std::fputs((format_progress(*last_, time_limit_s_, 0) + "\n").c_str(), stderr);
    std::fflush(stderr);
}

}  // namespace clume
