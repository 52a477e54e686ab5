// SPDX-License-Identifier: MIT
#include "src/stress.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <map>

#include "src/stress_parts.h"

namespace clume {
namespace {

/// Worst and 99.9 % of what is not NaN.
StressSpread spread_of(const std::vector<StressError>& errors, double StressError::*member) {
    std::vector<double> v;
    for (const StressError& e : errors)
        if (!std::isnan(e.*member)) v.push_back(e.*member);
    if (v.empty()) return {};
    const auto at = v.begin() + static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(v.size() - 1));
    std::nth_element(v.begin(), at, v.end());
    const double most = *at;
    return {*std::max_element(v.begin(), v.end()), most};
}

}  // namespace

StressRow stress_row(std::string quantity, std::string function, std::string family, Limit limit, const std::vector<StressError>& errors, const StressOptions& options) {
    StressRow row;
    row.quantity = std::move(quantity);
    row.function = std::move(function);
    row.family = std::move(family);
    row.limit = limit;
    row.limit.value /= options.strictness;
    row.cases = errors.size();
    std::vector<StressError> judged = errors;
    if (options.naive)
        for (StressError& e : judged)
            if (!std::isnan(e.naive)) e.error = e.naive;
    row.error = spread_of(judged, &StressError::error);
    row.relative = spread_of(errors, &StressError::relative);
    row.ulp = spread_of(errors, &StressError::ulp);
    row.rounding = spread_of(errors, &StressError::rounding);
    row.naive = spread_of(errors, &StressError::naive);
    double worst = -1;
    for (const StressError& e : judged) {
        row.nonfinite += e.nonfinite;
        if (e.error > worst) worst = e.error, row.worst_at = e.at;
    }
    return row;
}

std::string StressRow::trouble() const {
    std::string text;
    const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
    if (nonfinite > 0) add(fmt::format("{} not finite", nonfinite));
    if (!(error.worst <= limit.value) && cases > 0) add(fmt::format("error {:.3g} {} of {:.3g} stated", error.worst, name_of(limit.unit), limit.value));
    const std::pair<const char*, const StressCount&> counts[] = {{"hits lost", lost_beyond}, {"hits invented", invented_beyond}, {"additivity violated", additivity},
                                                                 {"monotonicity violated", monotonicity}, {"round trips missed", round_trip}};
    for (const auto& [what, c] : counts)
        if (c.count > 0) add(fmt::format("{} {} of {}{}", c.count, what, c.of, c.at.empty() ? "" : ", first at " + c.at));
    return text;
}

bool StressRow::holds() const { return trouble().empty(); }

bool StressResult::holds() const {
    return std::all_of(rows.begin(), rows.end(), [](const StressRow& r) { return r.holds(); });
}

void bin_plot(StressPlot& plot, double share) {
    std::map<int, std::vector<double>> bins[3];
    for (const auto& p : plot.points) {
        const int k = static_cast<int>(std::floor(2 * std::log10(p.x)));
        const double values[] = {p.used, p.naive, p.other};
        for (int i = 0; i < 3; ++i) {
            auto& bin = bins[i][k];
            if (!std::isnan(values[i])) bin.push_back(values[i]);
        }
    }
    const auto quantile = [&](std::vector<double>& v) {
        if (v.empty()) return static_cast<double>(NAN);
        const auto at = v.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(v.size() - 1));
        std::nth_element(v.begin(), at, v.end());
        return *at;
    };
    plot.points.clear();
    for (auto& [k, used] : bins[0]) plot.points.push_back({std::pow(10.0, 0.5 * k + 0.25), quantile(used), quantile(bins[1][k]), quantile(bins[2][k])});
}

StressResult run_stress(const DeviceInfo& info, const StressOptions& options, const std::function<void(double)>& progress) {
    const auto begin = std::chrono::steady_clock::now();
    StressResult result;
    result.device = info.label();
    result.driver = info.version + ", driver " + info.driver;
    StressDevice device(info);
    const auto part = [&](double from, double to) { return [&progress, from, to](double share) { progress(from + share * (to - from)); }; };
    stress_math(device, options, result, part(0, 0.2));
    stress_chords(device, options, result, part(0.2, 0.65));
    stress_given(device, options, result, part(0.65, 0.85));
    stress_sums(device, options, result, part(0.85, 0.9));
    stress_sampling(device, options, result, part(0.9, 0.93));
    stress_lights(device, options, result, part(0.93, 0.96));
    stress_environment(device, options, result, part(0.96, 1));
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return result;
}

}  // namespace clume
