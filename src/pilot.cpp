// SPDX-License-Identifier: MIT
#include "src/pilot.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>
#include <limits>
#include <sstream>

#include "runtime/hash.h"
#include "runtime/disk_cache.h"
#include "src/device_lights.h"
#include "src/device_mixture.h"
#include "src/device_renderer.h"
#include "src/device_scene.h"
#include "src/error.h"
#include "src/work_weights.h"

namespace clume {
namespace {

constexpr std::uint32_t kPixels = 1024;     ///< at most
constexpr std::uint32_t kSamples = 16;      ///< of each
constexpr std::uint32_t kFirstSample = 0xc0000000u;  ///< numbers of their own: the image's noise is not what was chosen by
constexpr std::size_t kFewPrimitives = 64;  ///< up to which one bound for the whole scene may be the cheapest
constexpr int kVersion = 8;                 ///< of the candidates and of how they are measured

std::size_t primitive_count(const Scene& scene) {
    std::size_t count = 0;
    for (const auto& m : scene.media) count += m.primitives.size();
    return count;
}

/// When a pilot ends early: it is asked to, or it has taken as long as the whole render may.
struct Until {
    const std::atomic<bool>& stop;
    std::optional<double> limit_s;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

    std::optional<double> left_s() const {
        if (!limit_s) return limit_s;
        return std::max(0.0, *limit_s - std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    bool over() const { return stop.load() || left_s() == 0.0; }
};

std::size_t best_of(const std::vector<PilotRow>& rows) {
    std::size_t best = rows.size();
    for (std::size_t i = 0; i < rows.size(); ++i)
        if (rows[i].measured() && (best == rows.size() || rows[i].inverse_efficiency() < rows[best].inverse_efficiency())) best = i;
    return best;
}

/// A row for the pair by the weights of options.work_limit and so many samples a pixel, given up above `most_ns` of work per path.
/// `pixels` becomes the number rendered. What is given up follows from counted work alone, so it is the same on any device and in batches of any size.
PilotRow measure(const Scene& scene, const RenderOptions& options, const MethodPair& pair, const Until& until, double most_ns, std::uint32_t samples, std::uint32_t& pixels) {
    PilotRow row;
    row.pair = pair;
    try {
        RenderOptions o = options;
        o.count_work = true;
        o.crop.reset();
        o.noise_threshold.reset();
        o.most_pixels = kPixels;
        o.work_limit.ns = std::isfinite(most_ns) ? most_ns * samples * pixels : 0;
        o.pair = pair;
        Renderer renderer(scene, o);
        Accumulation film = renderer.start(scene.render.seed, kFirstSample);
        pixels = renderer.rendered_pixels();
        // Step by step: most of what is too slow shows by its first samples.
        for (std::uint32_t done = 1; !row.too_slow; done = std::min(4 * done, samples)) {
            renderer.extend(film, kFirstSample + done, {{}, &until.stop, until.left_s()});
            if (pixels == 0 || until.over()) return row;
            const RenderResult r = renderer.result(film);
            row.variance = 0;
            row.work_ns = work_ns(o.work_limit.weights, r.stats.work) / (static_cast<double>(pixels) * done);
            row.too_slow = row.work_ns > most_ns;
            if (done < samples) continue;
            for (const float v : r.image.variance) row.variance += static_cast<double>(v) * samples / (3.0 * static_cast<double>(pixels));
            break;
        }
    } catch (const TooMuchWork&) {
        row.too_slow = true;
    } catch (const RenderError& e) {
        row.error = e.what();
    }
    if (row.too_slow) row.work_ns = most_ns;
    return row;
}

/// No rows if there is nothing to measure, or if it is asked to stop. `likely`: the estimator that is measured first.
Pilot measure_all(const Scene& scene, const RenderOptions& options, const std::string& likely, const Until& until) {
    Pilot pilot;
    pilot.spp = kSamples;
    const std::string estimator = scene.render.transmittance == "auto" ? likely : scene.render.transmittance;
    std::vector<MethodPair> candidates;
    const std::size_t primitives = primitive_count(scene);
    for (const Method& s : strategies()) {
        if (s.kind != BiasKind::unbiased || !differs(s, scene)) continue;
        if (!s.null_collisions) candidates.push_back({s.name, estimator});
        else
            for (const char* bound : bounds()) {
                if (scene.render.bound != "auto" && scene.render.bound != bound) continue;
                if (scene.render.majorant_grid && scene.render.bound == "auto" && std::string_view(bound) != "grid") continue;
                if (std::string_view(bound) == "scene" && primitives > kFewPrimitives && scene.render.bound == "auto") continue;
                candidates.push_back({s.name, estimator, bound});
            }
    }
    // Null collisions are most often the fastest, and come first; but they may take for ever in dense or flat media: a sample a pixel
    // of a strategy without tells when to give them up.
    const auto bounded = std::stable_partition(candidates.begin(), candidates.end(), [](const MethodPair& pair) { return find_strategy(pair.strategy)->null_collisions; });
    double most_ns = std::numeric_limits<double>::infinity();
    // What is left of a pilot that took too long.
    const auto cut_short = [&]() -> Pilot {
        if (until.stop) return {};
        pilot.cut_short = true;
        pilot.chosen = best_of(pilot.rows);
        if (pilot.chosen < pilot.rows.size()) return pilot;
        pilot.chosen = 0;
        pilot.rows.assign(1, {{"delta", estimator, scene.render.bound}, 0, 0, false, "no time was left"});
        return pilot;
    };
    if (bounded != candidates.begin() && bounded != candidates.end()) {
        const PilotRow rough = measure(scene, options, *bounded, until, most_ns, 1, pilot.pixels);
        if (rough.measured()) most_ns = pilot_patience * rough.work_ns;
        if (until.over()) return cut_short();
        if (rough.error.empty() && pilot.pixels == 0) return {};
    }
    // Distances drawn by unbiased strategies have one distribution: what tells them apart is work, whatever the estimator.
    for (const MethodPair& pair : candidates) {
        const PilotRow row = measure(scene, options, pair, until, most_ns, kSamples, pilot.pixels);
        if (until.over()) return cut_short();
        if (row.error.empty() && pilot.pixels == 0) return {};
        pilot.rows.push_back(row);
        if (row.measured()) most_ns = std::min(most_ns, strategy_patience * row.work_ns);
    }
    double variance = 0, measured = 0;
    for (const PilotRow& row : pilot.rows)
        if (row.measured()) variance += row.variance, measured += 1;
    if (measured == 0) throw RenderError(fmt::format("{}: no strategy could be tried: {}", scene.path, pilot.rows.front().error));
    for (PilotRow& row : pilot.rows)
        if (row.measured()) row.variance = variance / measured;
    pilot.chosen = best_of(pilot.rows);
    if (scene.render.transmittance != "auto" || !samples_lights(scene)) return pilot;
    const MethodPair winner = pilot.rows[pilot.chosen].pair;
    for (const Method& e : estimators()) {
        if (e.kind != BiasKind::unbiased || e.name == estimator) continue;
        const PilotRow row = measure(scene, options, {winner.strategy, e.name, winner.bound}, until, pilot_patience * pilot.rows[pilot.chosen].work_ns, kSamples, pilot.pixels);
        if (until.over()) return cut_short();
        pilot.rows.push_back(row);
    }
    const std::size_t best = best_of(pilot.rows);
    if (pilot_margin * pilot.rows[best].inverse_efficiency() < pilot.rows[pilot.chosen].inverse_efficiency()) pilot.chosen = best;
    return pilot;
}

std::string to_text(const Pilot& pilot) {
    std::string text = fmt::format("{} {} {} {}\n", pilot.chosen, pilot.pixels, pilot.spp, pilot.rows.size());
    for (const PilotRow& r : pilot.rows) text += fmt::format("{} {} {} {:.17g} {:.17g} {}\n", r.pair.strategy, r.pair.estimator, r.pair.bound, r.variance, r.work_ns, int{r.too_slow});
    return text;
}

std::optional<Pilot> from_text(const std::string& text) {
    std::istringstream in(text);
    Pilot pilot;
    std::size_t rows = 0;
    if (!(in >> pilot.chosen >> pilot.pixels >> pilot.spp >> rows) || rows > 64) return std::nullopt;
    for (std::size_t i = 0; i < rows; ++i) {
        PilotRow r;
        if (!(in >> r.pair.strategy >> r.pair.estimator >> r.pair.bound >> r.variance >> r.work_ns >> r.too_slow)) return std::nullopt;
        if (!find_strategy(r.pair.strategy) || !find_estimator(r.pair.estimator)) return std::nullopt;
        pilot.rows.push_back(std::move(r));
    }
    if (pilot.chosen >= pilot.rows.size()) return std::nullopt;
    return pilot;
}

}  // namespace

std::string Pilot::summary() const {
    if (cut_short) return fmt::format("measuring strategies took as long as the time limit: going on with {}", pair().label());
    return fmt::format("auto chose {} by a pilot of {} x {} paths", pair().label(), pixels, spp);
}

std::vector<std::pair<std::string, std::string>> Pilot::table() const {
    std::vector<std::pair<std::string, std::string>> lines;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const PilotRow& r = rows[i];
        const std::string what = r.too_slow ? fmt::format("given up: work above {:.4g} ns per path", r.work_ns)
                                 : r.error.empty() ? fmt::format("variance {:.4g}, work {:.4g} ns per path, inverse efficiency {:.4g}{}", r.variance, r.work_ns, r.inverse_efficiency(), i == chosen ? "  <- chosen" : "")
                                                 : "not measured: " + r.error;
        lines.emplace_back("pilot " + r.pair.label(), what);
    }
    return lines;
}

std::filesystem::path pilot_folder() {
    const std::filesystem::path cache = cache_folder();
    return cache.empty() ? cache : cache / "pilots";
}

std::optional<Pilot> run_pilot(const Scene& scene, const RenderOptions& options, const std::filesystem::path& folder, const std::atomic<bool>& stop) {
    if (scene.render.strategy != "auto") return std::nullopt;
    if (primitive_count(scene) == 0 && scene.grids.empty()) return std::nullopt;
    // One device is enough, and which one of a kind makes no difference.
    RenderOptions one = options;
    one.cpu_split = 0;
    one.batch_samples = 0;
    std::string key = fmt::format("pilot {} {} seed {} {} {} {} {}", kVersion, scene_hash(scene, one), scene.render.seed, scene.render.transmittance, scene.render.bound,
                                  scene.render.majorant_grid.value_or(0), one.accelerator);
    const std::vector<DeviceInfo> devices = select_devices(options.devices);
    one.work_limit.weights = work_weights(devices);
    for (const double w : one.work_limit.weights) key += fmt::format(" {}", w);
    key = sha256_hex(key);
    if (!folder.empty())
        if (const auto bytes = load_binary(folder, key))
            if (auto pilot = from_text(std::string(bytes->begin(), bytes->end()))) return pilot;
    one.shared = std::make_shared<SharedStructures>();
    Pilot pilot = measure_all(scene, one, all_gpus(devices) ? "binary" : "analytic", {stop, options.time_limit_s});
    if (pilot.rows.empty()) return std::nullopt;
    pilot.structures = std::move(one.shared);
    const bool complete = !pilot.cut_short && std::all_of(pilot.rows.begin(), pilot.rows.end(), [](const PilotRow& r) { return r.error.empty(); });
    if (!folder.empty() && complete) {
        const std::string text = to_text(pilot);
        store_binary(folder, key, {reinterpret_cast<const unsigned char*>(text.data()), text.size()});
    }
    return pilot;
}

}  // namespace clume
