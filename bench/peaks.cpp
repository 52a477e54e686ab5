// SPDX-License-Identifier: MIT
#include "bench/peaks.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "bench/kernels.h"
#include "bench/sections.h"
#include "runtime/buffer.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "tests/cases.h"

namespace clume::bench {
namespace {

constexpr std::size_t kKiB = 1024, kMiB = 1024 * kKiB;
constexpr double kShort = 1e-3;  // seconds of a launch

/// Working sets on either side of the caches that processors have.
std::vector<PeakLevel> working_sets() { return {{"32KiB", 32 * kKiB}, {"1MiB", kMiB}, {"32MiB", 32 * kMiB}, {"512MiB", 512 * kMiB}}; }

/// Which cache of this processor holds that much; empty for other devices, which do not tell.
std::string cache_of(const DeviceInfo& info, std::size_t byte_size) {
    if (info.type != "cpu") return "";
    const std::pair<int, const char*> caches[] = {{_SC_LEVEL1_DCACHE_SIZE, "first-level cache"}, {_SC_LEVEL2_CACHE_SIZE, "second-level cache"}, {_SC_LEVEL3_CACHE_SIZE, "third-level cache"}};
    for (const auto& [name, text] : caches)
        if (const long size = sysconf(name); size > 0 && byte_size <= static_cast<std::size_t>(size)) return text;
    return "memory";
}

/// The program at one width.
struct Program {
    Program(Session& session, int width) : queue(session.device()) {
        ProgramOptions options;
        options.define("CLUME_WIDTH", width).define("PEAK_INTERLEAVED", session.device().type != "cpu");
        program = build_program(queue, "peaks.cl", options);
    }
    Queue queue;
    cl::Program program;
};

/// The highest rate of many short launches: other programs only make them lower. `before` is told how many work-items there were
/// before each.
double best_rate(Session& session, const SizedLaunch& launch, double per_item, const std::function<void(cl_uint)>& before = [](cl_uint) {}) {
    using Clock = std::chrono::steady_clock;
    const auto enough = Clock::now() + std::chrono::milliseconds(session.options().quick ? 100 : 400);
    double best = 0;
    std::size_t done = 0;
    for (int n = 0; n < 8 || Clock::now() < enough; ++n, done += launch.items()) {
        before(static_cast<cl_uint>(done));
        if (const double s = launch.undisturbed(); s > 0) best = std::max(best, per_item * static_cast<double>(launch.items()) / s);
    }
    return best;
}

double fma_rate(Session& session, int width, bool with_additions) {
    constexpr cl_uint rounds = 1024;
    Program p(session, width);
    cl::Kernel kernel = make_kernel(p.queue, p.program, with_additions ? "peak_fma_add" : "peak_fma");
    const SizedLaunch launch(session, p.queue, kernel, [&](std::size_t items, Buffer<float>& out) { set_args(p.queue, kernel, 0, out, cl_uint(items), rounds, 0.999f, 0.001f); }, kShort);
    return best_rate(session, launch, 16.0 * rounds * width);
}

void read_rates(Session& session, PeakLevel& level) {
    // Where vectors are of one, loads are widest of four.
    const int width = std::max(4, static_cast<int>(session.device().native_vector_width));
    Program p(session, width);
    Buffer<float> data(p.queue, level.byte_size / sizeof(float));
    data.fill(1.0f);
    constexpr cl_uint rounds = 32, lines = 64;
    const auto mask = static_cast<cl_uint>(data.size() / static_cast<std::size_t>(width) - 1);
    cl::Kernel read = make_kernel(p.queue, p.program, "peak_read");
    const SizedLaunch reading(session, p.queue, read, [&](std::size_t items, Buffer<float>& out) {
        set_args(p.queue, read, 0, data, out, cl_uint(items), mask, rounds, cl_uint(0));
    }, kShort);
    level.bytes_s = best_rate(session, reading, 8.0 * rounds * width * sizeof(float), [&](cl_uint first) { set_arg(p.queue, read, 5, first); });
    cl::Kernel gather = make_kernel(p.queue, p.program, "peak_gather");
    const SizedLaunch gathering(session, p.queue, gather, [&](std::size_t items, Buffer<float>& out) {
        set_args(p.queue, gather, 0, data, out, cl_uint(items), cl_uint(data.size() / 16 - 1), lines, cl_uint(0));
    }, kShort);
    level.gathers_s = best_rate(session, gathering, 8.0 * lines, [&](cl_uint first) { set_arg(p.queue, gather, 5, first); });
}

/// Seconds from the call of a launch that does nothing until its end is known, median.
double launch_latency(Session& session) {
    Program p(session, 1);
    cl::Kernel kernel = make_kernel(p.queue, p.program, "peak_nothing");
    Buffer<float> out(p.queue, 1);
    set_args(p.queue, kernel, 0, out, cl_uint(1));
    p.queue.launch(kernel, 1, 1);
    std::vector<double> seconds;
    for (int k = 0; k < 200; ++k) {
        const auto begin = std::chrono::steady_clock::now();
        p.queue.enqueue(kernel, 1, 1);
        p.queue.finish();
        seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    return median(seconds);
}

}  // namespace

double Peaks::multiplications_s() const { return *std::ranges::max_element(fma_s); }

double Peaks::operations_s() const { return std::max(multiplications_s(), *std::ranges::max_element(fma_add_s)); }

PeakLevel Peaks::level(double footprint) const {
    for (std::size_t k = 0; k < levels.size(); ++k) {
        const auto upper = static_cast<double>(levels[k].byte_size);
        if (footprint > upper) continue;
        PeakLevel here = levels[k];
        if (k == 0) return here;
        const PeakLevel& below = levels[k - 1];
        const double x = std::log(upper / footprint) / std::log(upper / static_cast<double>(below.byte_size));
        here.bytes_s *= std::pow(below.bytes_s / here.bytes_s, x);
        here.gathers_s *= std::pow(below.gathers_s / here.gathers_s, x);
        return here;
    }
    return levels.back();
}

const Peaks& peaks(Session& session) {
    static std::optional<Peaks> measured;
    if (measured) return *measured;
    Peaks& p = measured.emplace();
    for (std::size_t k = 0; k < p.fma_s.size(); ++k) {
        p.fma_s[k] = fma_rate(session, cases::vector_widths[k], false);
        p.fma_add_s[k] = fma_rate(session, cases::vector_widths[k], true);
    }
    p.levels = working_sets();
    for (PeakLevel& level : p.levels) read_rates(session, level);
    p.launch_s = launch_latency(session);
    return p;
}

std::optional<Share> share_of(const Cost& cost, double items_s, const Peaks& peaks) {
    const PeakLevel level = peaks.level(cost.footprint);
    const std::pair<double, std::string> shares[] = {{cost.operations.all * items_s / peaks.operations_s(), "operations"},
                                                     {cost.operations.multiplications * items_s / peaks.multiplications_s(), "multiplications"},
                                                     {cost.bytes * items_s / level.bytes_s, fmt::format("bytes in {}", level.name)},
                                                     {cost.gathers * items_s / level.gathers_s, fmt::format("gathers in {}", level.name)}};
    const auto& [value, limit] = *std::max_element(std::begin(shares), std::end(shares));
    if (!(value > 0)) return {};
    return Share{value, limit};
}

void bench_peaks_section(Session& session) {
    session.section("peaks", fmt::format("What the device can do at most; the highest of several measurements.\n{:24} {:>12}", "", "G/s"));
    const auto rate = [&](const std::string& item, auto&& value, const std::string& what) {
        if (!session.wants(item)) return;
        const double per_s = value();
        session.record(item, fmt::format("{:24} {:12.3f} {}", item, per_s * 1e-9, what), {{"per_s", per_s}});
    };
    for (std::size_t k = 0; k < cases::vector_widths.size(); ++k) {
        const int width = cases::vector_widths[k];
        rate(fmt::format("fma/w{}", width), [&] { return peaks(session).fma_s[k]; }, fmt::format("fma by vectors of {}", width));
        rate(fmt::format("fma_add/w{}", width), [&] { return peaks(session).fma_add_s[k]; }, fmt::format("fma and additions in turns by vectors of {}", width));
    }
    const std::vector<PeakLevel> sets = working_sets();
    for (std::size_t k = 0; k < sets.size(); ++k) {
        const std::string where = session.options().list ? "" : cache_of(session.device(), sets[k].byte_size);
        rate(fmt::format("read/{}", sets[k].name), [&] { return peaks(session).levels[k].bytes_s; }, "bytes, " + where);
        rate(fmt::format("gather/{}", sets[k].name), [&] { return peaks(session).levels[k].gathers_s; }, "lines of 64 bytes at random, " + where);
    }
    if (session.wants("launch")) {
        const double s = peaks(session).launch_s;
        session.record("launch", fmt::format("{:24} {:12.2f} µs from the call of a kernel that does nothing until its end is known", "launch", s * 1e6), {{"seconds", s}});
    }
}

}  // namespace clume::bench
