// SPDX-License-Identifier: MIT
// Renders a scene on one or several OpenCL devices: chooses what the program is specialised to, hands out batches,
// adds up the film exactly and returns means. Nothing here reads or writes files.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kernels/layout.h"
#include "src/scene.h"
#include "src/strategies.h"

namespace clume {

/// Half-open pixel rectangle inside the film.
struct CropWindow {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// Operations by kind: WORK_* of layout.h.
using WorkCounts = std::array<std::uint64_t, WORK_KINDS>;
inline constexpr std::array<const char*, WORK_KINDS> work_names = {"cells", "nodes", "groups", "primitives", "densities", "voxels", "segments", "roots", "draws", "events"};
/// Nanoseconds that an operation of each kind costs.
using WorkWeights = std::array<double, WORK_KINDS>;

struct SharedStructures;

struct WorkLimit {
    double ns = 0;  ///< 0: none
    WorkWeights weights{};
};

struct RenderOptions {
    std::vector<std::string> devices;          ///< as on the command line: ids, name parts, cpu, gpu, all; empty: the best one
    int cpu_split = 0;                         ///< > 1: each CPU device becomes that many sub-devices
    std::uint32_t sample_begin = 0;            ///< samples [begin, end) of each pixel; end 0 means render.spp
    std::uint32_t sample_end = 0;
    std::optional<CropWindow> crop;            ///< default: the whole film
    double kernel_timeout_s = 120;             ///< a device that gives no sign for so long hangs and is given up; 0: never
    std::optional<double> time_limit_s;        ///< stop handing out batches after this long; the image holds what was done
    std::optional<double> noise_threshold;     ///< > 0: a tile of the film gets the samples it needs for that relative error (src/adaptive.h), no more
    std::uint32_t batch_samples = 0;           ///< samples of a pixel per batch; 0: sized to 100–200 ms by measurement
    std::shared_ptr<SharedStructures> shared;  ///< of several renderers of one scene (src/device_mixture.h): what one has built, the next one uses; a renderer lets go of it once it is made
    std::optional<MethodPair> pair;            ///< instead of the scene's own strategy, transmittance and bound
    int vector_width = 0;                      ///< 16, 8, 4, 1; 0: the device's own
    std::uint32_t most_pixels = 0;             ///< > 0: a pilot: at most so many of the pixels that meet something, by a program that is sooner built
    bool count_work = false;                   ///< count operations (stats.work, image.tests): costs a few per cent of speed
    WorkLimit work_limit;                      ///< of a pilot: extend() throws TooMuchWork (src/device_renderer.h) once its paths cost more
    bool kept_cells = true;                    ///< cells that took long to build are kept on disk, and read from there (src/cell_cache.h)
    std::string accelerator = "auto";          ///< of what visits chords (decomposition, analytic, march): "cells", "bvh" or "auto"
    double progressive_start = 1;              ///< factor on the first bounds of `progressive`
    int progressive_warm_up = 24;              ///< passes at most by which `progressive` learns before the image begins
};

/// What was rendered; arrays cover the crop window, row 0 on top.
struct RenderImage {
    int film_width = 0, film_height = 0;
    CropWindow window;
    std::vector<float> rgb;                    ///< premultiplied, 3 per pixel
    std::vector<float> alpha;                  ///< 1 per pixel
    std::vector<float> variance;               ///< of the mean, 3 per pixel (NaN-free; 0 with fewer than 2 samples)
    std::vector<std::uint32_t> samples;        ///< samples held, 1 per pixel
    std::vector<std::uint64_t> tests;          ///< primitives (or voxels) tested, 1 per pixel; empty unless counted
};

/// What became of RenderOptions::noise_threshold, by the variance of the samples that the image holds.
struct NoiseStats {
    double threshold = 0;
    std::uint32_t tiles = 0;                   ///< of the film, as far as it isn't empty
    std::uint32_t above = 0;                   ///< tiles with more noise than that
    std::uint32_t capped = 0;                  ///< of these, how many hold as many samples as were allowed
    double worst = 0;                          ///< relative error of the noisiest tile
    std::uint64_t paths = 0;                   ///< of these tiles
    std::uint64_t pilot_paths = 0;             ///< that the image does not hold
    std::string summary() const;               ///< one line
};

struct DeviceShare {
    std::string name;
    std::uint64_t paths = 0;  ///< traced, those of pilots too
    double busy_s = 0;
};

struct RenderStats {
    std::string strategy, transmittance, bound;  ///< what `auto` became
    std::vector<DeviceShare> devices;
    std::uint64_t paths = 0;                   ///< samples × pixels of the window
    std::uint64_t empty_pixels = 0;            ///< proven empty, or of constant background: cost nothing
    std::uint64_t nonfinite_samples = 0;       ///< counted, added as 0
    std::uint64_t bound_violations = 0;        ///< density above its majorant; 0 unless a bound was wrong
    std::uint64_t primitives = 0;
    WorkCounts work{};                         ///< operations of all paths, if RenderOptions::count_work
    double excess = 0;                         ///< optical depth that bounds below the density left out: Σ of (density − bound) / bound
    std::uint64_t device_bytes = 0;            ///< scene buffers on one device
    std::string layout_hash;                   ///< SHA-256 of the device buffers
    double build_s = 0, compile_s = 0, render_s = 0;
    double cpu_s = 0;                          ///< of this process while rendering, all threads
    bool interrupted = false, time_limited = false;
    bool device_lost = false;                  ///< no device was left before the end; the image holds what was done
    std::uint32_t samples_min = 0, samples_max = 0;  ///< held per pixel
    double samples_mean = 0;                   ///< over the pixels that are not empty
    std::optional<NoiseStats> noise;           ///< with a threshold
    std::vector<std::string> notes;            ///< what a strategy has to say of this image, such as how often a learned bound was too low
    std::vector<std::string> warnings;         ///< e.g. a dropped device, a device outside the bit-exact set
    std::vector<std::pair<std::string, std::string>> explain;  ///< feature → what the program does about it
};

struct Progress {
    std::uint64_t paths_done = 0, paths_total = 0;
    double elapsed_s = 0;
    double mpaths_s = 0;
    std::string what = {};  ///< part of a longer job
};

struct RenderResult {
    RenderImage image;
    RenderStats stats;
};

/// How a run is watched and ended. `progress` is called from one thread, a few times a second. `stop` set to true, or the
/// time up: batches under way are finished, then the run returns with what is done.
struct RunControl {
    std::function<void(const Progress&)> progress;
    const std::atomic<bool>* stop = nullptr;
    std::optional<double> time_limit_s;
};

/// The film of one seed: exact sums over the samples run so far, to which further ones add as if all had been run at once.
class Accumulation {
public:
    ~Accumulation();
    Accumulation(Accumulation&&) noexcept;
    Accumulation& operator=(Accumulation&&) noexcept;

    std::uint64_t seed() const;
    std::uint32_t begin() const;  ///< samples [begin, end) were asked for
    std::uint32_t end() const;
    double render_s() const;      ///< spent rendering them, all runs together
    bool complete() const;        ///< no run was stopped before its end: every pixel holds end − begin samples, or what its noise asks for

private:
    friend class Renderer;
    struct State;
    explicit Accumulation(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// A scene made ready on its devices (accelerator, self-tests, programs, buffers), which then renders any number of seeds and
/// sample ranges; nothing is built again. render.seed and render.spp are not used. One thread at a time.
class Renderer {
public:
    /// Keeps no reference to `scene`. Throws RenderError, SceneError (a film too large), DeviceError (runtime/error.h; no
    /// device, none passes).
    Renderer(const Scene& scene, RenderOptions options);
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    /// An empty film, whose first sample is to be `begin`.
    Accumulation start(std::uint64_t seed, std::uint32_t begin = 0) const;
    /// Runs samples [accumulation.end(), end). Only this is in stats.render_s. With a noise threshold the first call decides
    /// how many samples each tile gets, `end` at most; later ones add nothing. Throws DeviceError if no device is left and the
    /// film is empty.
    void extend(Accumulation& accumulation, std::uint32_t end, const RunControl& control = {});
    /// Means, variances and statistics of what the film holds now.
    RenderResult result(const Accumulation& accumulation) const;

    /// What is known before the first path: names that `auto` became, build and compile times, sizes, explanation.
    const RenderStats& setup() const;
    /// Pixels that paths are traced for; the others are known.
    std::uint32_t rendered_pixels() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// One run of a Renderer made for it, with the scene's seed. Throws what its functions throw.
RenderResult render(const Scene& scene, RenderOptions options, const std::function<void(const Progress&)>& progress,
                    const std::atomic<bool>& stop);

/// What `--explain` prints without rendering.
std::vector<std::pair<std::string, std::string>> explain(const Scene& scene, const RenderOptions& options);

}  // namespace clume
