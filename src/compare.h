// SPDX-License-Identifier: MIT
// `clume compare`: many (strategy, estimator) pairs on one scene, several seeds each, run in turns so that a noisy machine
// hurts all alike, and measured against a reference. This runs and measures; compare_report.h says what came out.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "src/compare_statistics.h"
#include "src/renderer.h"
#include "src/scene.h"
#include "src/strategies.h"

namespace clume {

struct CompareOptions {
    std::vector<MethodPair> pairs;      ///< empty: all that differ in the scene; an empty estimator stands for every one
    std::optional<double> time_s;       ///< seconds that each pair gets per seed; else sample counts
    std::vector<std::uint32_t> spp;     ///< rising; empty: 1, 2, 4 … render.spp
    std::uint32_t seeds = 8;            ///< render.seed and those after it
    std::optional<std::filesystem::path> reference;  ///< EXR; else two unbiased pairs make one
    RenderOptions render;               ///< devices and the like
};

/// One image of one seed after `spp` samples per pixel.
struct CompareRow {
    std::size_t pair = 0;   ///< index into Comparison::pairs
    std::size_t level = 0;  ///< rises with spp; rows of one level are compared with each other
    std::uint64_t seed = 0;
    std::uint32_t spp = 0;
    double seconds = 0;     ///< spent rendering these samples
    double mpaths_s = 0;
    ImageErrors errors;

    double inverse_efficiency() const { return errors.mse * seconds; }
};

struct PairRun {
    MethodPair pair;
    BiasKind kind = BiasKind::unbiased;  ///< what it is known to be
    std::string error;                   ///< why it has no rows, or no more of them
    bool asked_for = false;              ///< named by the user, who is told if it fails
    double density_evals = 0;            ///< per path: points at which a density was evaluated
    double primitive_tests = 0;          ///< per path: primitives and voxels tested
    std::vector<float> cost;             ///< per pixel: primitive tests of one path
    std::vector<double> image, variance; ///< at the level of the images: mean over seeds, variance of that mean
    std::vector<std::vector<double>> tiles;  ///< per seed: Tiles::differences of its image at that level
    std::uint64_t samples = 0;           ///< per pixel, in all of these images
    std::uint64_t nonfinite_samples = 0, bound_violations = 0;
};

/// One of the two images that a reference is the mean of.
struct ReferenceHalf {
    MethodPair pair;
    std::uint64_t seed = 0;
    std::uint32_t spp = 0;
    double seconds = 0;
    Reference image;
};

struct Comparison {
    std::string scene;
    int width = 0, height = 0;
    std::uint64_t seed = 0;
    std::uint32_t seeds = 0;
    std::optional<double> time_s;
    bool estimator_matters = true;
    std::vector<PairRun> pairs;
    std::vector<CompareRow> rows;
    std::size_t level = 0;           ///< of the images and of the verdict
    std::uint32_t seeds_done = 0;    ///< at that level
    Reference reference;             ///< empty if there is none yet
    std::string reference_file;      ///< if it was read
    std::vector<ReferenceHalf> halves;
    std::optional<Agreement> agreement;
    bool interrupted = false;
    std::vector<std::string> devices, drivers;
    std::vector<std::string> warnings;

    bool reference_refused() const { return agreement && !agreement->accepted(); }
};

/// A pair that fails is kept with its error, and the rest goes on. Stopped early, it returns what was finished. Throws
/// UsageError (a reference of another size, no pair fits), RenderError (no pair ran, no two unbiased pairs for a reference),
/// DeviceError.
Comparison compare(const Scene& scene, const CompareOptions& options, const std::function<void(const Progress&)>& progress,
                   const std::atomic<bool>& stop);

}  // namespace clume
