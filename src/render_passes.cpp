// SPDX-License-Identifier: MIT
// The order in which samples are made. An image of so many samples for all pixels takes one pass; `progressive` takes passes
// that double; a noise threshold takes the first samples, a pilot that the image does not hold, and then to each tile its own.
#include <algorithm>
#include <bit>
#include <ctime>
#include <fmt/format.h>
#include <limits>
#include <numeric>

#include "runtime/error.h"
#include "runtime/hang.h"
#include "src/renderer_impl.h"

namespace clume {
namespace {

using Clock = std::chrono::steady_clock;

/// Samples of which the image holds none have numbers of their own (src/pilot.cpp has others).
constexpr std::uint32_t first_warm_up_sample = 0x80000000u;
constexpr std::uint32_t first_noise_pilot_sample = 0xa0000000u;
/// Every tile of the image gets so many; the first pilot has half of them.
constexpr std::uint32_t least_samples = 16;
/// Image to pilot: where that much more is needed the pilot is doubled.
constexpr double pilot_share = 16;
/// A tile's pilot has at least so many, as one of 16 x 16 pixels has by 8 of each: few pixels alone would tell too little.
constexpr std::uint64_t least_pilot_paths = 2048;

double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

}  // namespace

PassWork Renderer::Impl::work(const std::vector<std::uint32_t>& counts, std::uint32_t begin, std::uint32_t end) const {
    PassWork w;
    if (counts.empty()) {
        w.order.resize(pixels.size());
        std::iota(w.order.begin(), w.order.end(), 0u);
        w.tiles = tiles;
        w.ends.assign(tiles.size(), end);
        return w;
    }
    std::vector<std::size_t> some;
    for (std::size_t t = 0; t < noise.size(); ++t)
        if (std::min(counts[t], end) > begin) some.push_back(t);
    std::stable_sort(some.begin(), some.end(), [&](std::size_t i, std::size_t j) { return std::min(counts[i], end) > std::min(counts[j], end); });
    const std::uint32_t most_pixels = tiles.empty() ? 0 : tiles.front().count;
    for (const std::size_t t : some) {
        const std::uint32_t own_end = std::min(counts[t], end);
        if (w.tiles.empty() || w.ends.back() != own_end || w.tiles.back().count + noise[t].count > most_pixels) {
            w.tiles.push_back({static_cast<std::uint32_t>(w.order.size()), 0});
            w.ends.push_back(own_end);
        }
        w.tiles.back().count += noise[t].count;
        for (std::uint32_t k = 0; k < noise[t].count; ++k) w.order.push_back(noise[t].first + k);
    }
    return w;
}

void Renderer::Impl::run_pass(Accumulation::State& a, FilmSums& sums, PassWork work, std::uint32_t begin, const PassControl& control) {
    std::uint64_t paths = 0;
    for (std::size_t i = 0; i < work.tiles.size(); ++i) paths += work.tiles[i].count * std::uint64_t{work.ends[i] - begin};
    if (paths == 0) return;
    for (const auto& w : workers) {
        static_cast<DeviceRenderer&>(*w).aim(sums, a.seed);
        static_cast<DeviceRenderer&>(*w).choose(work.order, work.tiles);
        static_cast<DeviceRenderer&>(*w).limit_work(options.work_limit);
    }
    const auto start = Clock::now();
    const std::clock_t cpu_start = std::clock();
    DispatchOptions o;
    o.items = static_cast<std::uint32_t>(work.tiles.size());
    o.begin = begin;
    o.ends = std::move(work.ends);
    o.fixed_chunk = options.batch_samples;
    o.hang_seconds = options.kernel_timeout_s;
    o.stop = [&] { return control.stop_asked() || control.time_up(); };
    // Pixels that are known count as if they took paths, too: the film is what one waits for.
    const double scale = static_cast<double>(all_pixels()) / static_cast<double>(pixels.size());
    const std::uint64_t held = sums.paths();
    o.progress = [&](const DispatchProgress& p) {
        const auto done = static_cast<std::uint64_t>(scale * static_cast<double>(sums.paths() - held)), total = static_cast<std::uint64_t>(scale * static_cast<double>(paths));
        if (control.run.progress)
            control.run.progress({done, total, control.elapsed_s(), p.elapsed_s > 0 ? static_cast<double>(done) / p.elapsed_s / 1e6 : 0, control.what});
    };
    const DispatchReport report = dispatch(workers, o);
    a.render_s += seconds_since(start);
    a.cpu_s += static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
    setup.warnings.insert(setup.warnings.end(), report.warnings.begin(), report.warnings.end());
    for (std::size_t k = report.workers.size(); k-- > 0;) {
        const WorkerReport& w = report.workers[k];
        const auto& renderer = static_cast<const DeviceRenderer&>(*workers[k]);
        auto share = std::find_if(a.devices.begin(), a.devices.end(), [&](const DeviceShare& d) { return d.name == w.name; });
        if (share == a.devices.end()) share = a.devices.insert(a.devices.begin(), DeviceShare{w.name, 0, 0});
        share->paths += renderer.paths();
        share->busy_s += w.busy_s;
        if (const std::size_t items = renderer.short_of_memory(); items > 0 && told_short_of_memory.insert(w.name).second)
            setup.warnings.push_back(fmt::format("device {} is short of memory: batches of at most {} paths at a time", w.name, items));
        for (std::size_t i = 0; i < a.raised.size(); ++i) a.raised[i] = std::max(a.raised[i], renderer.raised()[i]);
        if (w.hung) note_hang(w.name);
        if (w.dropped) workers.erase(workers.begin() + static_cast<std::ptrdiff_t>(k));
    }
    if (report.failed && sums.paths() == 0 && a.film.paths() == 0)
        throw DeviceError("every device failed:\n  " + fmt::format("{}", fmt::join(report.warnings, "\n  ")));
    a.device_lost = a.device_lost || report.failed;
    a.interrupted = a.interrupted || (report.stopped && control.stop_asked());
    a.time_limited = a.time_limited || (report.stopped && !control.stop_asked());
}

void Renderer::Impl::run_to(Accumulation::State& a, std::uint32_t end, const PassControl& control) {
    if (a.end >= end || a.stopped()) return;
    if (!first_bounds.empty()) return run_learning(a, end, control);
    run_pass(a, a.film, work(a.counts, a.end, end), a.end, control);
    a.end = end;
}

// A first look at how high the density goes: passes that the image does not hold, until little exceeds its bound.
// Then passes that double, each under what all before it have found, so that the share of the image made under low bounds
// vanishes. Everything is a function of seed and sample numbers, and so are the bounds: a pass that ends early goes on under
// the same ones the next time.
void Renderer::Impl::run_learning(Accumulation::State& a, std::uint32_t end, const PassControl& control) {
    // Optical depth left out, of the bounds'. Not the share of look-ups above their bound: where bounds are far too low there
    // are hardly any look-ups, and those that are stand for much.
    constexpr double enough = 1e-3;
    constexpr float margin = 1.25f;      // over what was found: the highest density is seldom hit
    const auto set_bounds = [&](bool explore) {
        for (const auto& w : workers) static_cast<DeviceRenderer&>(*w).set_learned(a.learned, explore);
    };
    const auto learn = [&] {
        for (std::size_t i = 0; i < a.learned.size(); ++i) a.learned[i] = std::max(a.learned[i], margin * a.raised[i]);
    };
    if (a.learned.empty()) {
        a.learned = first_bounds;
        a.raised.assign(first_bounds.size(), 0.0f);
        const auto samples = static_cast<std::uint32_t>(std::max<std::size_t>(1, 16384 / pixels.size()));
        for (int k = 0; k < options.progressive_warm_up; ++k) {
            const std::uint32_t begin = first_warm_up_sample + static_cast<std::uint32_t>(k) * samples;
            FilmSums scratch(pixels.size(), channels, film_scale);
            set_bounds(true);
            run_pass(a, scratch, work({}, begin, begin + samples), begin, control);
            learn();
            if (a.stopped() || scratch.excess() <= enough * static_cast<double>(scratch.work()[WORK_DENSITIES])) break;
        }
    }
    while (a.end < end && !a.stopped()) {
        const std::uint32_t done = a.end - a.begin;
        const std::uint64_t pass_end = std::uint64_t{a.begin} + (done == 0 ? 1 : 2 * std::uint64_t{std::bit_floor(done)});
        const auto stop = static_cast<std::uint32_t>(std::min<std::uint64_t>(end, pass_end));
        set_bounds(false);
        run_pass(a, a.film, work(a.counts, a.end, stop), a.end, control);
        a.end = stop;
        if (stop == pass_end) learn();
    }
}

void Renderer::Impl::choose_counts(Accumulation::State& a, std::uint32_t most, PassControl control) {
    std::vector<double> needed(noise.size(), std::numeric_limits<double>::infinity());
    if (most > least_samples) {
        FilmSums pilot(pixels.size(), channels, film_scale);
        control.what = "measuring noise";
        std::vector<std::uint32_t> held(noise.size(), 0);
        for (std::uint32_t begin = 0, end = least_samples / 2; begin < end; begin = end, end *= 2) {
            std::vector<std::uint32_t> ends(noise.size(), 0);
            for (std::size_t t = 0; t < noise.size(); ++t) {
                const bool too_few = begin < most && std::uint64_t{begin} * noise[t].count < least_pilot_paths;
                if (held[t] == begin && (too_few || std::min<double>(needed[t], most) > pilot_share * begin)) ends[t] = first_noise_pilot_sample + (held[t] = end);
            }
            PassWork chosen = work(ends, first_noise_pilot_sample + begin, UINT32_MAX);
            if (chosen.tiles.empty()) break;
            run_pass(a, pilot, std::move(chosen), first_noise_pilot_sample + begin, control);
            a.noise_pilot_paths = pilot.paths();
            if (a.stopped()) return;
            needed = samples_needed(noise, measure_noise(noise, pilot), *options.noise_threshold);
        }
    }
    for (const double n : needed) a.counts.push_back(sample_count(n, least_samples, most));
}

void Renderer::Impl::run(Accumulation::State& a, std::uint32_t end, const RunControl& run) {
    PassControl control{run, Clock::now()};
    if (options.noise_threshold && a.counts.empty() && !tiles.empty()) {
        control.what = "first samples";
        run_to(a, std::min(end, a.begin + least_samples), control);
        if (!a.stopped()) choose_counts(a, end - a.begin, control);
        for (std::uint32_t& n : a.counts) n += a.begin;
        control.what = "";
    }
    if (!tiles.empty()) run_to(a, end, control);
    a.end = std::max(a.end, end);
}

}  // namespace clume
