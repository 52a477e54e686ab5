// SPDX-License-Identifier: MIT
// Order of things: programs, pilots (counts, variance, speed), reference, then seed by seed and level by level, each pair in
// turn. A level is a sample count, or a share of the time; the films of one seed are alive at a time.
#include "src/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "runtime/device.h"
#include "runtime/error.h"
#include "src/compare_runner.h"
#include "src/device_lights.h"
#include "src/device_mixture.h"
#include "src/error.h"

namespace clume {
namespace {

constexpr double shortest_level_s = 0.05;
constexpr int most_time_levels = 7;

/// A pair's film of the present seed, and its last two images: that of a level under way and that of the one before.
struct Live {
    struct Shot {
        std::size_t level = SIZE_MAX;
        std::uint32_t spp = 0;
        std::vector<float> image, variance;
    };
    Accumulation film;
    std::size_t row = SIZE_MAX;  ///< its last one
    Shot last, before;
};

class Comparer {
public:
    Comparer(const Scene& scene, const CompareOptions& options, const std::function<void(const Progress&)>& progress, const std::atomic<bool>& stop)
        : scene_(scene), options_(options), plan_(progress, stop) {}

    Comparison run() {
        describe();
        options_.render.shared = std::make_shared<SharedStructures>();  // pairs differ in what they do with them
        prepare();
        if (!plan_.stopped()) pilots();
        if (!plan_.stopped() && !options_.reference) make_reference(scene_, options_, ready_, pilot_spp_, plan_, out_);
        options_.render.shared.reset();
        if (!out_.reference.rgb.empty() && !out_.reference_refused()) seeds();
        out_.interrupted = plan_.stopped();
        check_reference();
        return std::move(out_);
    }

private:
    void describe();
    void prepare();
    void pilots();
    void seeds();
    bool one_seed(std::uint32_t index);
    /// Brings a pair to a level; false if it was stopped on the way.
    bool reach(std::size_t k, std::size_t level, double until_s, std::vector<Live>& live, const std::string& what);
    void add_row(std::size_t k, std::size_t level, Live& live);
    void commit(std::vector<Live>& live, std::size_t level);
    void check_reference();
    void drop(std::size_t k, const std::string& why) {
        out_.pairs[run_of_[k]].error = why;
        ready_[k].renderer.reset();
    }
    bool alive(std::size_t k) const { return ready_[k].renderer != nullptr; }

    const Scene& scene_;
    CompareOptions options_;
    ComparePlan plan_;
    Comparison out_;
    std::vector<ReadyPair> ready_;
    std::vector<std::size_t> run_of_;   ///< index into out_.pairs of each ready pair
    std::vector<double> level_s_;       ///< of equal time: seconds of a seed at the end of each level
    std::uint32_t pilot_spp_ = 2;
};

void Comparer::describe() {
    out_.scene = scene_.path;
    out_.width = scene_.film.width;
    out_.height = scene_.film.height;
    out_.seed = scene_.render.seed;
    out_.seeds = options_.seeds;
    out_.time_s = options_.time_s;
    out_.estimator_matters = samples_lights(scene_);
    for (const DeviceInfo& device : select_devices(options_.render.devices)) {
        out_.devices.push_back(device.label());
        out_.drivers.push_back(device.version + ", driver " + device.driver);
    }
    if (options_.spp.empty()) options_.spp = doubling_counts(scene_.render.spp);
    if (options_.time_s) {
        for (int k = most_time_levels - 1; k >= 0; --k)
            if (const double s = std::ldexp(*options_.time_s, -k); s >= shortest_level_s || k == 0) level_s_.push_back(s);
        pilot_spp_ = 2;
    } else {
        pilot_spp_ = std::clamp(options_.spp.back() / 4, 2u, 8u);
    }
    if (options_.reference) read_reference(scene_, *options_.reference, out_);
}

void Comparer::prepare() {
    std::vector<MethodPair> pairs;
    for (const MethodPair& wanted : options_.pairs) {
        if (!wanted.estimator.empty()) pairs.push_back(wanted);
        else
            for (const MethodPair& p : pairs_of(wanted.strategy, wanted.bound, out_.estimator_matters)) pairs.push_back(p);
    }
    const bool asked_for = !options_.pairs.empty();
    if (!asked_for) pairs = all_pairs(scene_, out_.estimator_matters);
    std::vector<MethodPair> once;
    for (const MethodPair& p : pairs)
        if (std::find(once.begin(), once.end(), p) == once.end()) once.push_back(p);
    std::string failures;
    for (const MethodPair& pair : once) {
        if (plan_.stopped()) return;
        PairRun& run = out_.pairs.emplace_back();
        run.pair = pair;
        run.kind = pair.kind(out_.estimator_matters);
        run.asked_for = asked_for;
        try {
            ready_.push_back(make_ready(scene_, pair, options_.render));
            run_of_.push_back(out_.pairs.size() - 1);
        } catch (const RenderError& error) {
            run.error = error.what();
        } catch (const SceneError& error) {
            run.error = error.what();
        } catch (const DeviceError& error) {
            run.error = error.what();
        }
        if (!run.error.empty()) failures += "\n  " + pair.label() + ": " + run.error;
    }
    if (ready_.empty()) throw RenderError("none of the pairs can run:" + failures);
}

void Comparer::pilots() {
    for (std::size_t k = 0; k < ready_.size();) {
        PairRun& run = out_.pairs[run_of_[k]];
        try {
            run_pilot(ready_[k], scene_, options_, pilot_spp_, plan_, &run);
            ++k;
        } catch (const RenderError& error) {
            run.error = error.what();
        } catch (const DeviceError& error) {
            run.error = error.what();
        }
        if (plan_.stopped()) return;
        if (run.error.empty()) continue;
        ready_.erase(ready_.begin() + static_cast<std::ptrdiff_t>(k));
        run_of_.erase(run_of_.begin() + static_cast<std::ptrdiff_t>(k));
    }
    if (ready_.empty()) throw RenderError("none of the pairs can run: " + out_.pairs.back().error);
    for (const ReadyPair& r : ready_) plan_.add(options_.seeds * (options_.time_s ? *options_.time_s : r.sample_s * options_.spp.back()));
}

bool Comparer::reach(std::size_t k, std::size_t level, double until_s, std::vector<Live>& live, const std::string& what) {
    ReadyPair& ready = ready_[k];
    Accumulation& film = live[k].film;
    if (!options_.time_s) return plan_.extend(*ready.renderer, film, options_.spp[level], ready.sample_s * (options_.spp[level] - film.end()), what);
    const double spent = film.render_s(), sample_s = film.end() > 0 ? spent / film.end() : ready.sample_s;
    // Whole samples only: as many as fit best, but one at least, without which there is no image.
    const double fitting = std::round((until_s - spent) / sample_s);
    if (film.end() > 0 && fitting < 1) return true;
    const auto samples = static_cast<std::uint32_t>(std::clamp(fitting, 1.0, 1e8));
    return plan_.extend(*ready.renderer, film, film.end() + samples, samples * sample_s, what);
}

void Comparer::add_row(std::size_t k, std::size_t level, Live& live) {
    if (live.row != SIZE_MAX && out_.rows[live.row].spp == live.film.end()) {  // nothing new in this level: the row moves on
        out_.rows[live.row].level = live.last.level = level;
        return;
    }
    RenderResult result = ready_[k].renderer->result(live.film);
    CompareRow row;
    row.pair = run_of_[k];
    row.level = level;
    row.seed = live.film.seed();
    row.spp = live.film.end();
    row.seconds = result.stats.render_s;
    row.mpaths_s = row.seconds > 0 ? static_cast<double>(result.stats.paths) / row.seconds / 1e6 : 0;
    row.errors = image_errors(result.image.rgb, out_.reference);
    live.row = out_.rows.size();
    live.before = std::move(live.last);
    live.last = {level, row.spp, std::move(result.image.rgb), std::move(result.image.variance)};
    out_.rows.push_back(row);
    PairRun& run = out_.pairs[run_of_[k]];
    run.nonfinite_samples = std::max(run.nonfinite_samples, result.stats.nonfinite_samples);
    run.bound_violations = std::max(run.bound_violations, result.stats.bound_violations);
    for (const std::string& warning : result.stats.warnings)
        if (std::find(out_.warnings.begin(), out_.warnings.end(), warning) == out_.warnings.end()) out_.warnings.push_back(warning);
}

void Comparer::commit(std::vector<Live>& live, std::size_t level) {
    const Tiles tiles(out_.width, out_.height);
    out_.level = level;
    ++out_.seeds_done;
    for (std::size_t k = 0; k < live.size(); ++k) {
        PairRun& run = out_.pairs[run_of_[k]];
        const Live::Shot& shot = live[k].last.level == level ? live[k].last : live[k].before;
        if (!alive(k) || shot.level != level) continue;
        run.image.resize(shot.image.size());
        run.variance.resize(shot.image.size());
        // Running means: the variance of a mean over n seeds is the sum of theirs over n².
        const auto n = static_cast<double>(run.tiles.size());
        for (std::size_t i = 0; i < run.image.size(); ++i) {
            run.image[i] = (run.image[i] * n + static_cast<double>(shot.image[i])) / (n + 1);
            run.variance[i] = (run.variance[i] * n * n + static_cast<double>(shot.variance[i])) / ((n + 1) * (n + 1));
        }
        run.samples += shot.spp;
        run.tiles.push_back(tiles.differences(shot.image, out_.reference));
    }
}

bool Comparer::one_seed(std::uint32_t index) {
    std::vector<Live> live;
    for (const ReadyPair& r : ready_) {
        // A dropped pair keeps its place with the film of another, which is never run.
        const Renderer* any = r.renderer.get();
        for (const ReadyPair& other : ready_)
            if (!any) any = other.renderer.get();
        if (!any) return false;
        live.push_back({any->start(scene_.render.seed + index), SIZE_MAX, {}, {}});
    }
    const std::size_t levels = options_.time_s ? level_s_.size() : options_.spp.size(), pairs = ready_.size();
    std::size_t turn = index;
    for (std::size_t level = 0; level < levels; ++level) {
        // Equal time goes in slices of at most 2 s, in turns.
        const double begin_s = options_.time_s && level > 0 ? level_s_[level - 1] : 0, end_s = options_.time_s ? level_s_[level] : 0;
        const int slices = std::max(1, static_cast<int>(std::ceil((end_s - begin_s) / 2)));
        for (int slice = 1; slice <= slices; ++slice, ++turn)
            for (std::size_t step = 0; step < pairs; ++step) {
                const std::size_t k = (step + turn) % pairs;
                if (!alive(k)) continue;
                const std::string what = fmt::format("seed {} of {}, {}", index + 1, options_.seeds, ready_[k].pair.label());
                try {
                    if (!reach(k, level, begin_s + (end_s - begin_s) * slice / slices, live, what)) {
                        // Stopped: what the levels before have finished counts if no whole seed does.
                        if (level > 0 && out_.seeds_done == 0) commit(live, level - 1);
                        return false;
                    }
                    if (slice == slices) add_row(k, level, live[k]);
                } catch (const RenderError& error) {
                    drop(k, error.what());
                } catch (const DeviceError& error) {
                    drop(k, error.what());
                }
            }
    }
    commit(live, levels - 1);
    return true;
}

void Comparer::seeds() {
    for (std::uint32_t index = 0; index < options_.seeds; ++index)
        if (plan_.stopped() || !one_seed(index)) return;
}

void Comparer::check_reference() {
    if (out_.reference.rgb.empty() || out_.rows.empty()) return;
    std::vector<double> mse(out_.pairs.size()), count(out_.pairs.size());
    for (const CompareRow& row : out_.rows)
        if (row.level == out_.level) mse[row.pair] += row.errors.mse, ++count[row.pair];
    double least = INFINITY;
    for (std::size_t k = 0; k < mse.size(); ++k)
        if (count[k] > 0) least = std::min(least, mse[k] / count[k]);
    const double share = out_.reference.mean_variance() / least;
    if (std::isfinite(share) && !(share >= 0 && share <= 0.2))
        out_.warnings.push_back(fmt::format("the reference's own variance is {:.2g} of the smallest mse: compare fewer samples, or give a better one by --reference", share));
}

}  // namespace

Comparison compare(const Scene& scene, const CompareOptions& options, const std::function<void(const Progress&)>& progress,
                   const std::atomic<bool>& stop) {
    return Comparer(scene, options, progress, stop).run();
}

}  // namespace clume
