// SPDX-License-Identifier: MIT
#include "src/compare_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace clume {
namespace {

std::string with_interval(const Interval& i) {
    return std::isfinite(i.half_width) ? fmt::format("{:.3g} ± {:.2g}", i.mean, i.half_width) : fmt::format("{:.3g}", i.mean);
}

std::string p_text(double p) { return p < 1e-6 ? "p < 0.000001" : fmt::format("p = {:.2g}", p); }

/// "1.8 (1.6 to 2.0) times": how much more time `slower` takes for the same error, by the seeds that both have.
struct Lead {
    double ratio = 0;
    Interval difference;  ///< of inverse efficiencies, seed by seed
    bool clear() const { return difference.mean - difference.half_width > 0; }
};

std::map<std::uint64_t, double> by_seed(const Comparison& c, std::size_t pair) {
    std::map<std::uint64_t, double> values;
    for (const CompareRow& row : c.rows)
        if (row.pair == pair && row.level == c.level) values[row.seed] = row.inverse_efficiency();
    return values;
}

Lead lead_over(const Comparison& c, const CompareSummary& s, std::size_t faster, std::size_t slower) {
    const auto a = by_seed(c, faster), b = by_seed(c, slower);
    std::vector<double> differences;
    for (const auto& [seed, value] : a)
        if (const auto other = b.find(seed); other != b.end()) differences.push_back(other->second - value);
    Lead lead;
    lead.ratio = s.pairs[slower].last.inverse_efficiency.mean / s.pairs[faster].last.inverse_efficiency.mean;
    lead.difference = mean_interval(differences);
    return lead;
}

void say_fastest(const Comparison& c, CompareSummary& s) {
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < c.pairs.size(); ++k)
        if (s.pairs[k].last.rows > 0 && c.pairs[k].kind == BiasKind::unbiased && s.pairs[k].finding != Finding::biased) order.push_back(k);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return s.pairs[a].last.inverse_efficiency.mean < s.pairs[b].last.inverse_efficiency.mean;
    });
    if (order.empty()) {
        s.verdict.push_back("No unbiased pair was measured.");
        return;
    }
    s.fastest_unbiased = order.front();
    const PairSummary& best = s.pairs[order.front()];
    std::string text = fmt::format("Fastest unbiased: {}. Its mse × seconds is {}", c.pairs[order.front()].pair.label(), with_interval(best.last.inverse_efficiency));
    if (order.size() > 1) {
        const Lead lead = lead_over(c, s, order[0], order[1]);
        text += fmt::format("; {}, the next, takes {:.2f} times as long for the same error", c.pairs[order[1]].pair.label(), lead.ratio);
        text += lead.clear() ? "." : ", a lead that is within the noise.";
    } else {
        text += "; no other unbiased pair was measured.";
    }
    s.verdict.push_back(text);
}

void say_cheapest_biased(const Comparison& c, CompareSummary& s) {
    double mean = c.reference.mean();
    for (std::size_t k = 0; k < c.pairs.size(); ++k) {
        const bool biased = c.pairs[k].kind == BiasKind::biased || s.pairs[k].finding == Finding::biased;
        if (s.pairs[k].last.rows == 0 || !biased) continue;
        if (!s.cheapest_biased || s.pairs[k].last.inverse_efficiency.mean < s.pairs[*s.cheapest_biased].last.inverse_efficiency.mean) s.cheapest_biased = k;
    }
    if (!s.cheapest_biased) {
        s.verdict.push_back("No biased pair was measured.");
        return;
    }
    if (!(mean > 0)) mean = NAN;
    const PairSummary& p = s.pairs[*s.cheapest_biased];
    const Interval& bias = p.last.bias;
    std::string text = fmt::format("Cheapest biased: {}. Its mse × seconds is {}", c.pairs[*s.cheapest_biased].pair.label(), with_interval(p.last.inverse_efficiency));
    if (s.fastest_unbiased)
        text += fmt::format(", {:.2f} times that of the fastest unbiased", p.last.inverse_efficiency.mean / s.pairs[*s.fastest_unbiased].last.inverse_efficiency.mean);
    if (p.finding == Finding::biased) {
        text += fmt::format(". How wrong it is: on the whole {:+.2g} % of the reference's mean ({:+.3g}", 100 * bias.mean / mean, bias.mean);
        if (std::isfinite(bias.half_width)) text += fmt::format(" ± {:.2g}", bias.half_width);
        text += fmt::format("), and {:.2g} % in the root mean square over tiles ({}).", 100 * p.test.rms / mean, p_text(p.test.p));
        if (s.fastest_unbiased && p.test.rms > 0) {
            const double floor_s = s.pairs[*s.fastest_unbiased].last.inverse_efficiency.mean / (p.test.rms * p.test.rms);
            if (floor_s > 0)
                text += fmt::format(" No number of samples takes its error below {:.2g}; {} is there after {:.3g} s.", p.test.rms,
                                    c.pairs[*s.fastest_unbiased].pair.label(), floor_s);
        }
    } else if (p.finding == Finding::no_bias_found) {
        text += fmt::format(". A bias was not found at this precision: on the whole it is within {:.2g} % of the reference's mean.",
                            100 * (std::abs(bias.mean) + bias.half_width) / mean);
    } else {
        text += ". Its bias takes at least two seeds to judge.";
    }
    s.verdict.push_back(text);
}

/// Of those whose bias goes away with the number of samples, and has.
void say_consistent(const Comparison& c, CompareSummary& s) {
    std::optional<std::size_t> best;
    for (std::size_t k = 0; k < c.pairs.size(); ++k) {
        if (c.pairs[k].kind != BiasKind::consistent || s.pairs[k].last.rows == 0 || s.pairs[k].finding == Finding::biased) continue;
        if (!best || s.pairs[k].last.inverse_efficiency.mean < s.pairs[*best].last.inverse_efficiency.mean) best = k;
    }
    if (!best) return;
    const LevelSummary& last = s.pairs[*best].last;
    std::string text = fmt::format("Best consistent: {}. Its mse × seconds is {}", c.pairs[*best].pair.label(), with_interval(last.inverse_efficiency));
    if (s.fastest_unbiased)
        text += fmt::format(", {:.2f} times that of the fastest unbiased", last.inverse_efficiency.mean / s.pairs[*s.fastest_unbiased].last.inverse_efficiency.mean);
    s.verdict.push_back(text + (s.pairs[*best].finding == Finding::no_bias_found ? "; no bias was found." : "."));
}

void say_reference(const Comparison& c, CompareSummary& s) {
    if (c.reference_refused()) {
        s.verdict.push_back(fmt::format("There is no reference: {} and {} should have the same mean image and do not ({}). One of them is wrong, or their "
                                        "noise is too rough to judge. Nothing was compared.",
                                        c.halves[0].pair.label(), c.halves[1].pair.label(), p_text(c.agreement->p)));
    } else if (c.reference.rgb.empty()) {
        s.verdict.push_back("Stopped before there was a reference: nothing was compared.");
    } else if (c.rows.empty()) {
        s.verdict.push_back("Stopped before the first image: nothing was compared.");
    }
}

}  // namespace

const char* name_of(Finding finding) {
    switch (finding) {
        case Finding::no_rows: return "not measured";
        case Finding::untested: return "not tested";
        case Finding::no_bias_found: return "no bias found";
        case Finding::biased: break;
    }
    return "biased";
}

LevelSummary summarise(const Comparison& c, std::size_t pair, std::size_t level) {
    LevelSummary s;
    std::vector<double> mse, bias, efficiency;
    for (const CompareRow& row : c.rows) {
        if (row.pair != pair || row.level != level) continue;
        ++s.rows;
        s.spp += row.spp;
        s.seconds += row.seconds;
        s.mpaths_s += row.mpaths_s;
        s.relmse += row.errors.relmse;
        mse.push_back(row.errors.mse);
        bias.push_back(row.errors.bias);
        efficiency.push_back(row.inverse_efficiency());
    }
    if (s.rows == 0) return s;
    for (double* sum : {&s.spp, &s.seconds, &s.mpaths_s, &s.relmse}) *sum /= static_cast<double>(s.rows);
    s.mse = mean_interval(mse);
    s.inverse_efficiency = mean_interval(efficiency);
    s.bias = mean_interval(bias, c.reference.variance_of_mean());
    return s;
}

CompareSummary summarise(const Comparison& c) {
    CompareSummary s;
    s.pairs.resize(c.pairs.size());
    std::size_t tested = 0;
    for (std::size_t k = 0; k < c.pairs.size(); ++k) {
        PairSummary& p = s.pairs[k];
        p.last = summarise(c, k, c.level);
        if (p.last.rows == 0) continue;
        p.test = test_bias(c.pairs[k].tiles, static_cast<double>(c.pairs[k].samples), c.reference, Tiles(c.width, c.height));
        p.finding = p.test.tested ? Finding::no_bias_found : Finding::untested;
        tested += p.test.tested;
    }
    s.threshold = 1 - std::pow(1 - family_alpha, 1.0 / static_cast<double>(std::max<std::size_t>(1, tested)));
    for (PairSummary& p : s.pairs)
        if (p.test.tested && p.test.p < s.threshold) p.finding = Finding::biased;
    if (c.reference.rgb.empty() || c.reference_refused() || c.rows.empty()) {
        say_reference(c, s);
        return s;
    }
    say_fastest(c, s);
    say_cheapest_biased(c, s);
    say_consistent(c, s);
    for (std::size_t k = 0; k < c.pairs.size(); ++k)
        if (s.pairs[k].finding == Finding::biased && c.pairs[k].kind == BiasKind::unbiased)
            s.verdict.push_back(fmt::format("{} should be unbiased but is not ({}; {:+.2g} % on the whole): please report this scene.", c.pairs[k].pair.label(),
                                            p_text(s.pairs[k].test.p), 100 * s.pairs[k].last.bias.mean / c.reference.mean()));
    if (c.interrupted) s.verdict.push_back(fmt::format("Interrupted: {} of {} seeds were finished.", c.seeds_done, c.seeds));
    return s;
}

}  // namespace clume
