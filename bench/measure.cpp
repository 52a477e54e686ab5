// SPDX-License-Identifier: MIT
#include "bench/measure.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <memory>

#include "runtime/device.h"

namespace clume::bench {
namespace {

double seconds_since(std::chrono::steady_clock::time_point t) { return std::chrono::duration<double>(std::chrono::steady_clock::now() - t).count(); }

double mean_of(const std::vector<float>& values) {
    double sum = 0;
    for (const float v : values) sum += static_cast<double>(v);
    return sum / static_cast<double>(std::max<std::size_t>(1, values.size()));
}

/// A pair being measured; its film grows round by round.
struct Runner {
    std::unique_ptr<Renderer> renderer;
    std::unique_ptr<Accumulation> film;
    double active = 0;          ///< pixels that cost something
    std::uint32_t spp = 1;      ///< of a round
    bool on_cpu = true;
    std::vector<double> cpu_us;

    /// Processor microseconds per path of `samples` more; those of the clock if it is not a processor that renders.
    double run(std::uint32_t samples) {
        const double before = seconds();
        renderer->extend(*film, film->end() + samples);
        return 1e6 * (seconds() - before) / (active * samples);
    }
    double seconds() const { return seconds_of(renderer->result(*film).stats, on_cpu); }
};

Runner make_runner(const Scene& scene, const MethodPair& pair, RenderOptions options, std::uint64_t seed) {
    Runner r;
    options.pair = pair;
    r.renderer = std::make_unique<Renderer>(scene, options);
    r.film = std::make_unique<Accumulation>(r.renderer->start(seed));
    r.on_cpu = std::ranges::all_of(select_devices(options.devices), [](const DeviceInfo& d) { return d.type == "cpu"; });
    r.active = std::max(1.0, static_cast<double>(scene.film.width) * scene.film.height - static_cast<double>(r.renderer->setup().empty_pixels));
    return r;
}

void count(const Scene& scene, RenderOptions options, Measured& m, std::uint32_t spp, std::uint64_t seed) {
    options.count_work = true;
    Runner r = make_runner(scene, m.pair, options, seed);
    r.run(spp);
    const RenderStats stats = r.renderer->result(*r.film).stats;
    for (std::size_t k = 0; k < WORK_KINDS; ++k) m.work[k] = static_cast<double>(stats.work[k]) / (r.active * spp);
}

}  // namespace

MethodPair method(const std::string& text) {
    MethodPair pair{text.substr(0, text.find('/')), text.find('/') == text.npos ? "analytic" : text.substr(text.find('/') + 1)};
    if (const std::size_t colon = pair.strategy.find(':'); colon != std::string::npos) {
        pair.bound = pair.strategy.substr(colon + 1);
        pair.strategy.resize(colon);
    }
    return pair;
}

std::vector<Measured> measure(Session& session, const Scene& scene, std::span<const MethodPair> pairs, const MeasureOptions& options) {
    std::vector<Measured> results(pairs.size());
    std::vector<Runner> runners(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        Measured& m = results[i];
        m.pair = pairs[i];
        try {
            runners[i] = make_runner(scene, m.pair, session.render_options(), options.seed + i);
            m.device_bytes = static_cast<double>(runners[i].renderer->setup().device_bytes);
            m.build_s = runners[i].renderer->setup().build_s;
            const auto timed = [&](std::uint32_t samples) {
                const auto start = std::chrono::steady_clock::now();
                runners[i].run(samples);
                return seconds_since(start);
            };
            // The first launch of a size allocates, and a learned bound is learned then, however long the image.
            const bool slow = timed(1) > options.most_s && m.pair.strategy != "progressive";
            double sample_s = slow ? options.most_s : timed(1);
            if (sample_s < options.round_s / 4) sample_s = timed(4) / 4;
            if (slow || sample_s > options.most_s) m.missing = "too slow";
            runners[i].spp = static_cast<std::uint32_t>(std::clamp(options.round_s / sample_s, 1.0, 65536.0));
        } catch (const std::exception& e) {
            m.missing = e.what();
        }
        if (!m.ok()) runners[i] = {};
    }
    for (int round = 0; round < options.rounds; ++round)
        for (std::size_t i = 0; i < pairs.size(); ++i)
            if (results[i].ok()) runners[i].cpu_us.push_back(runners[i].run(runners[i].spp));
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        Measured& m = results[i];
        if (!m.ok()) continue;
        m.cpu_us = median(runners[i].cpu_us);
        const RenderResult result = runners[i].renderer->result(*runners[i].film);
        m.rgb = result.image.rgb;
        m.variance_of_mean = result.image.variance;
        m.variance = mean_of(m.variance_of_mean) * runners[i].film->end();
        const std::uint32_t spp = std::max(1u, std::min(runners[i].spp, 16u));
        runners[i] = {};
        if (options.count) count(scene, session.render_options(), m, spp, options.seed + i);
    }
    return results;
}

Bias bias_of(const Measured& image, const Measured& truth) {
    Bias b;
    double difference = 0, squares = 0, noise = 0;
    const auto n = static_cast<double>(image.rgb.size());
    for (std::size_t i = 0; i < image.rgb.size(); ++i) {
        const double d = static_cast<double>(image.rgb[i]) - static_cast<double>(truth.rgb[i]);
        difference += d / n;
        squares += d * d / n;
        noise += (static_cast<double>(image.variance_of_mean[i]) + static_cast<double>(truth.variance_of_mean[i])) / n;
    }
    const double mean = mean_of(truth.rgb);
    b.mean = difference / mean;
    b.mean_error = std::sqrt(noise / (n / 3)) / mean;  // the channels of a pixel may be one
    b.rms = std::sqrt(std::max(0.0, squares - noise)) / mean;
    return b;
}

Measured pooled(std::span<const Measured> images) {
    Measured sum;
    double weights = 0;
    for (const Measured& m : images) {
        if (!m.ok()) continue;
        const double w = 1 / std::max(1e-30, mean_of(m.variance_of_mean));
        sum.rgb.resize(m.rgb.size());
        sum.variance_of_mean.resize(m.rgb.size());
        for (std::size_t i = 0; i < m.rgb.size(); ++i) {
            sum.rgb[i] += static_cast<float>(w * static_cast<double>(m.rgb[i]));
            sum.variance_of_mean[i] += static_cast<float>(w * w * static_cast<double>(m.variance_of_mean[i]));
        }
        weights += w;
    }
    for (float& v : sum.rgb) v = static_cast<float>(static_cast<double>(v) / weights);
    for (float& v : sum.variance_of_mean) v = static_cast<float>(static_cast<double>(v) / (weights * weights));
    return sum;
}

}  // namespace clume::bench
