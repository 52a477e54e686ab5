// SPDX-License-Identifier: MIT
// The reference of a comparison: read from a file, or the mean of two images by different unbiased pairs with seeds of their
// own, which must agree. How many samples it gets follows from the variances that the pilots found, not from the clock, when
// sample counts are compared, so that results can be had again.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/error.h"
#include "src/compare_runner.h"
#include "src/error.h"
#include "src/image_writer.h"

namespace clume {
namespace {

/// The reference's variance is to be this part of the smallest mse expected.
constexpr double wanted_share = 1.0 / 16;
constexpr std::uint32_t least_samples = 64;  ///< of each half, so that its variance is well known

/// The film squares samples in float: a variance below 2^-24 of the square (a sky that hardly changes inside a pixel) is lost in
/// rounding, and is taken for that much.
Reference reference_of(const RenderImage& image) {
    Reference r{image.film_width, image.film_height, {image.rgb.begin(), image.rgb.end()}, {image.variance.begin(), image.variance.end()}, {}};
    r.sample_variance.resize(r.rgb.size());
    for (std::size_t i = 0; i < r.rgb.size(); ++i)
        if (const std::uint32_t n = image.samples[i / 3]; n > 0) {
            r.variance[i] += 0x1p-24 * r.rgb[i] * r.rgb[i] / n;
            r.sample_variance[i] = r.variance[i] * n;
        }
    return r;
}

/// Unbiased pairs, the best second half for `first` in front: another strategy, then another estimator too.
std::vector<MethodPair> candidates(const Scene& scene, bool estimator_matters, const MethodPair* first) {
    std::vector<MethodPair> pairs = all_pairs(scene, estimator_matters);
    std::erase_if(pairs, [&](const MethodPair& p) { return p.kind(estimator_matters) != BiasKind::unbiased || (first && p == *first); });
    if (first)
        std::stable_sort(pairs.begin(), pairs.end(), [&](const MethodPair& a, const MethodPair& b) {
            const auto likeness = [&](const MethodPair& p) { return 2 * (p.strategy == first->strategy) + (p.estimator == first->estimator); };
            return likeness(a) < likeness(b);
        });
    return pairs;
}

/// Two unbiased pairs, those made ready already being used as they are; `extra` holds the others.
std::vector<ReadyPair*> choose(const Scene& scene, const CompareOptions& options, bool estimator_matters, std::vector<ReadyPair>& ready,
                               std::vector<ReadyPair>& extra, std::uint32_t pilot_spp, ComparePlan& plan) {
    std::vector<ReadyPair*> chosen;
    extra.reserve(2);
    std::string failures;
    for (int half = 0; half < 2; ++half) {
        for (const MethodPair& pair : candidates(scene, estimator_matters, half ? &chosen.front()->pair : nullptr)) {
            const auto found = std::find_if(ready.begin(), ready.end(), [&](const ReadyPair& r) { return r.pair == pair; });
            if (found != ready.end()) {
                chosen.push_back(&*found);
                break;
            }
            try {
                ReadyPair made = make_ready(scene, pair, options.render);
                run_pilot(made, scene, options, pilot_spp, plan, nullptr);
                extra.push_back(std::move(made));
                chosen.push_back(&extra.back());
                break;
            } catch (const std::runtime_error& error) {
                failures += "\n  " + pair.label() + ": " + error.what();
            }
        }
        if (static_cast<int>(chosen.size()) <= half)
            throw RenderError("a reference needs two unbiased pairs, which this scene does not have; give one by --reference FILE.exr" + failures);
    }
    return chosen;
}

}  // namespace

void read_reference(const Scene& scene, const std::filesystem::path& file, Comparison& out) {
    const RenderImage image = read_exr(file, nullptr, true);
    const CropWindow& w = image.window;
    if (w.x1 - w.x0 != scene.film.width || w.y1 - w.y0 != scene.film.height)
        throw UsageError(fmt::format("--reference {}: is {} x {} pixels, the film is {} x {}", file.string(), w.x1 - w.x0, w.y1 - w.y0,
                                     scene.film.width, scene.film.height));
    for (const auto* values : {&image.rgb, &image.variance})
        if (!std::all_of(values->begin(), values->end(), [](float v) { return std::isfinite(v); }))
            throw RenderError(file.string() + ": is no reference: it has values that are not finite");
    out.reference = reference_of(image);
    out.reference.width = scene.film.width;
    out.reference.height = scene.film.height;
    out.reference_file = file.string();
}

void make_reference(const Scene& scene, const CompareOptions& options, std::vector<ReadyPair>& ready, std::uint32_t pilot_spp,
                    ComparePlan& plan, Comparison& out) {
    std::vector<ReadyPair> extra;
    const std::vector<ReadyPair*> chosen = choose(scene, options, out.estimator_matters, ready, extra, pilot_spp, plan);
    const auto pairs = static_cast<double>(std::max<std::size_t>(2, ready.size()));
    const double last_spp = options.time_s ? 0 : options.spp.back();
    // The smallest mse that any pair is expected to reach.
    double expected = INFINITY;
    for (const ReadyPair& r : ready)
        if (r.sample_variance > 0) expected = std::min(expected, r.sample_variance / (options.time_s ? std::max(1.0, *options.time_s / r.sample_s) : last_spp));
    std::vector<std::uint32_t> spp;
    for (const ReadyPair* half : chosen) {
        const double wanted = std::isfinite(expected) ? std::ceil(half->sample_variance / (2 * wanted_share * expected)) : least_samples;
        // Together no more than all that is compared.
        const double most = 0.5 * pairs * options.seeds * (options.time_s ? *options.time_s / half->sample_s : last_spp);
        spp.push_back(static_cast<std::uint32_t>(std::clamp(std::min(wanted, most), static_cast<double>(least_samples), 1e9)));
        plan.add(half->sample_s * spp.back());
    }
    for (std::size_t k = 0; k < 2; ++k) {
        ReadyPair& half = *chosen[k];
        Accumulation film = half.renderer->start(scene.render.seed - 2 - k);
        if (!plan.extend(*half.renderer, film, spp[k], half.sample_s * spp[k], "reference by " + half.pair.label())) {
            out.halves.clear();
            return;
        }
        const RenderResult result = half.renderer->result(film);
        out.halves.push_back({half.pair, film.seed(), spp[k], result.stats.render_s, reference_of(result.image)});
    }
    const Reference &a = out.halves[0].image, &b = out.halves[1].image;
    out.agreement = test_agreement(a, b);
    out.reference = a;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) {
        out.reference.rgb[i] = 0.5 * (a.rgb[i] + b.rgb[i]);
        out.reference.variance[i] = 0.25 * (a.variance[i] + b.variance[i]);
        out.reference.sample_variance[i] = 0.5 * (a.sample_variance[i] + b.sample_variance[i]);
    }
}

}  // namespace clume
