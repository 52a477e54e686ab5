// SPDX-License-Identifier: MIT
#include "src/compare_html.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "src/compare_images.h"
#include "src/html_page.h"

namespace clume {
namespace {

std::string cell(const std::string& text) { return "<td>" + escaped(text) + "</td>"; }
std::string cell(double value) { return cell(std::isfinite(value) ? fmt::format("{:.4g}", value) : "–"); }
std::string cell(const Interval& i) {
    return cell(std::isfinite(i.half_width) ? fmt::format("{:.3g} ± {:.2g}", i.mean, i.half_width) : fmt::format("{:.3g}", i.mean));
}

std::string image(const std::string& uri, const std::string& alt) { return fmt::format("<img src=\"{}\" alt=\"{}\"/>", uri, escaped(alt)); }

std::string figure(const std::string& uri, const std::string& caption) {
    return uri.empty() ? "" : "<figure>" + image(uri, caption) + "<figcaption>" + escaped(caption) + "</figcaption></figure>\n";
}

std::string table(const Comparison& c, const CompareSummary& s) {
    std::string out = "<div class=\"scroll\"><table>\n<thead><tr><th>pair</th><th>known to be</th><th>found</th><th>p of no bias</th><th>seeds</th><th>spp</th>"
                      "<th>seconds</th><th>Mpaths/s</th><th>density evals/path</th><th>primitive tests/path</th><th>mse</th><th>relMSE</th><th>bias</th>"
                      "<th>mse × seconds</th></tr></thead>\n<tbody>\n";
    for (std::size_t k = 0; k < c.pairs.size(); ++k) {
        const PairRun& run = c.pairs[k];
        const PairSummary& p = s.pairs[k];
        out += "<tr>" + cell(run.pair.label());
        if (p.last.rows == 0) {
            out += cell(name_of(run.kind)) + cell(name_of(p.finding)) + fmt::format("<td class=\"text\" colspan=\"11\">{}</td></tr>\n", escaped(run.error));
            continue;
        }
        out += cell(name_of(run.kind)) + cell(name_of(p.finding)) + cell(p.test.tested ? p.test.p : NAN) + cell(std::to_string(p.last.rows)) + cell(p.last.spp) + cell(p.last.seconds) +
               cell(p.last.mpaths_s) + cell(run.density_evals) + cell(run.primitive_tests) + cell(p.last.mse) + cell(p.last.relmse) + cell(p.last.bias) +
               cell(p.last.inverse_efficiency) + "</tr>\n";
        if (!run.error.empty()) out += fmt::format("<tr><td></td><td class=\"text\" colspan=\"13\">then failed: {}</td></tr>\n", escaped(run.error));
    }
    return out + "</tbody></table></div>\n";
}

std::string reference_text(const Comparison& c) {
    if (!c.reference_file.empty())
        return fmt::format("<p>Read from {}; its own variance is {:.3g}.</p>\n", escaped(c.reference_file), c.reference.mean_variance());
    if (c.halves.size() < 2) return "";
    const auto half = [](const ReferenceHalf& h) { return fmt::format("{} ({} samples per pixel, seed {}, {:.1f} s)", escaped(h.pair.label()), h.spp, h.seed, h.seconds); };
    std::string out = fmt::format("<p>The mean of two images by different unbiased pairs, {} and {}", half(c.halves[0]), half(c.halves[1]));
    out += fmt::format("; its own variance is {:.3g}. ", c.reference.mean_variance());
    out += fmt::format("The two {} on one mean image: p = {:.3g}, least accepted {:.0e} (pixels by z-tests {:.3g}, tiles by χ² {:.3g}, the whole {:.3g}; Šidák over all).</p>\n",
                       c.agreement->accepted() ? "agree" : "do not agree", c.agreement->p, Agreement::threshold, c.agreement->p_pixels, c.agreement->p_tiles, c.agreement->p_mean);
    return out;
}

std::string scale_bar(const std::string& gradient, const std::string& low, const std::string& high) {
    return fmt::format("{} <span class=\"bar\" style=\"background:{}\"></span> {}", escaped(low), gradient, escaped(high));
}

std::string images(const Comparison& c, const CompareSummary& s, const ReportFacts& facts, const ReportPictures& pictures) {
    std::string out;
    for (std::size_t k = 0; k < c.pairs.size(); ++k) {
        const PairPictures& p = pictures.pairs[k];
        if (p.image.empty() && p.cost.empty()) continue;
        const LevelSummary& last = s.pairs[k].last;
        out += "<h3>" + escaped(c.pairs[k].pair.label()) + "</h3>\n<div class=\"trio\">\n";
        if (!p.image.empty())
            out += figure(p.image, fmt::format("Mean of {} seeds of {:.4g} samples per pixel, {:.3g} s each", c.pairs[k].tiles.size(), last.spp, last.seconds)) +
                   figure(p.error, "Its signed error");
        out += figure(p.cost, fmt::format("Primitive tests; {:.4g} per path on average", c.pairs[k].primitive_tests)) + "</div>\n";
    }
    if (out.empty()) return "";
    std::string bars = "<p class=\"small\">";
    if (facts.error_scale > 0)
        bars += "Errors: " + scale_bar(error_gradient(), fmt::format("−{:.3g} too dark", facts.error_scale), fmt::format("+{:.3g} too bright", facts.error_scale)) +
                " (mean of the channels; one scale for all, beyond it the colours stay). ";
    if (facts.cost_most > 0)
        bars += "Cost: " + scale_bar(cost_gradient(), fmt::format("{:.3g}", facts.cost_least), fmt::format("{:.3g}", facts.cost_most)) +
                " primitive tests per path, logarithmic, one scale for all.";
    return "<h2>Images</h2>\n" + bars + fmt::format("</p>\n<p class=\"small\">All images at an exposure of {:+.2f} stops.</p>\n", facts.exposure_stops) + out;
}

std::string facts_table(const Comparison& c, const ReportFacts& facts) {
    std::string out = "<h2>How it was run</h2>\n<table><tbody>\n";
    const auto line = [&](const char* key, const std::string& value) { out += fmt::format("<tr><td>{}</td><td class=\"text\">{}</td></tr>\n", key, escaped(value)); };
    line("scene", fmt::format("{}, {} × {} pixels", c.scene, c.width, c.height));
    line("command", facts.command);
    for (std::size_t k = 0; k < c.devices.size(); ++k) line("device", c.devices[k] + ": " + c.drivers[k]);
    line("version", "clume " CLUME_VERSION);
    line("runs", fmt::format("{} seeds from {}; {}", c.seeds, c.seed, c.time_s ? fmt::format("{:g} s per pair and seed, in turns", *c.time_s) : std::string("rising sample counts, in turns")));
    return out + "</tbody></table>\n";
}

constexpr const char* method = R"(<h2>What the numbers are</h2>
<p class="small">mse: mean squared difference from the reference over pixels and channels, less the reference's own variance. relMSE: mean of the squared
difference over (reference² + 0.01 · mean reference²). bias: mean signed difference. ±: 95 % intervals over the seeds by Student's t; that of the bias holds
the reference's error, too. mse × seconds is the inverse efficiency: the time a pair takes for a given error. Density evals: points at which a density was
evaluated; primitive tests: primitives and voxels tested against a ray or a point; both per path, counted in a run of their own that is not timed.</p>
<p class="small">A pair is called biased if its mean image differs from the reference by a test that is wrong about any of all unbiased pairs in at most 1 of
100 reports. Per channel it asks, by Welch's t-test over the seeds, about the whole image, the worst of at most 16 × 16 tiles, and all tiles together (Fisher),
which finds a bias that changes its sign over the image; Šidák's correction is over these questions and over the pairs. No bias found means no more than that
the bias is too small to be seen here.</p>
)";

}  // namespace

std::string report_html(const Comparison& c, const CompareSummary& s, const ReportFacts& facts, const ReportPictures& pictures) {
    std::string out = html_begin("clume compare: " + c.scene) + "<h1>" + escaped(c.scene) + "</h1>\n";
    out += "<div class=\"verdict\">\n";
    for (const std::string& sentence : s.verdict) out += "<p>" + escaped(sentence) + "</p>\n";
    out += "</div>\n";
    if (!c.estimator_matters) out += "<p>No light is sampled directly here, so transmittance estimators make no difference: there is one pair per strategy.</p>\n";
    for (const std::string& warning : c.warnings) out += "<p class=\"warning\">" + escaped(warning) + "</p>\n";
    out += "<h2>Pairs</h2>\n" + table(c, s);
    const char* alternatives[] = {"RMSE against time", "inverse efficiency", "bias"};
    for (std::size_t k = 0; k < pictures.plots.size(); ++k)
        if (!pictures.plots[k].empty()) out += "<p>" + image(pictures.plots[k], alternatives[k % 3]) + "</p>\n";
    out += images(c, s, facts, pictures);
    if (const std::string text = reference_text(c); !text.empty()) {
        out += "<h2>Reference</h2>\n" + text;
        if (!pictures.reference.empty()) out += "<div class=\"trio\">\n" + figure(pictures.reference, "The reference") + "</div>\n";
    }
    return out + facts_table(c, facts) + method + "</body>\n</html>\n";
}

}  // namespace clume
