// SPDX-License-Identifier: MIT
#include "src/compare_tables.h"

#include <fmt/format.h>
#include <rapidjson/prettywriter.h>
#include <rapidjson/stringbuffer.h>

#include <cmath>
#include <map>

#include "src/json_text.h"

namespace clume {
namespace {

using Writer = rapidjson::PrettyWriter<rapidjson::StringBuffer>;

/// A field of a CSV file (RFC 4180).
std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string out = "\"";
    for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + "\"";
}

/// Shortest digits that read back as the same number; empty if it is not finite.
std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : std::string(); }

std::string joined(const std::vector<std::string>& parts) { return fmt::format("{}", fmt::join(parts, "; ")); }

/// "delta", or "delta:scene" with a bound of its own.
std::string strategy_name(const MethodPair& p) { return p.strategy + (p.bound == "auto" ? "" : ":" + p.bound); }

/// Half-widths of the bias intervals, by (pair, level).
std::map<std::pair<std::size_t, std::size_t>, double> bias_intervals(const Comparison& c) {
    std::map<std::pair<std::size_t, std::size_t>, double> out;
    for (const CompareRow& row : c.rows)
        if (out.count({row.pair, row.level}) == 0) out[{row.pair, row.level}] = summarise(c, row.pair, row.level).bias.half_width;
    return out;
}

void put(Writer& out, const char* key, double value) {
    out.Key(key);
    if (std::isfinite(value)) out.Double(value);
    else out.Null();
}
void put(Writer& out, const char* key, const std::string& value) {
    const std::string text = json_text(value);
    if (key) out.Key(key);
    out.String(text.c_str(), static_cast<rapidjson::SizeType>(text.size()));
}
void put(Writer& out, const char* key, const char* value) { put(out, key, std::string(value)); }
void put(Writer& out, const char* key, std::uint64_t value) {
    out.Key(key);
    out.Uint64(value);
}
void put(Writer& out, const char* key, bool value) {
    out.Key(key);
    out.Bool(value);
}
void put(Writer& out, const char* key, const std::vector<std::string>& values) {
    out.Key(key);
    out.StartArray();
    for (const std::string& value : values) put(out, nullptr, value);
    out.EndArray();
}
void put(Writer& out, const char* key, const Interval& interval) {
    put(out, key, interval.mean);
    put(out, (std::string(key) + "_ci").c_str(), interval.half_width);
}

void put_pair(Writer& out, const MethodPair& p) {
    put(out, "strategy", strategy_name(p));
    put(out, "estimator", p.estimator);
}

void put_reference(Writer& out, const Comparison& c) {
    out.Key("reference");
    out.StartObject();
    if (!c.reference_file.empty()) put(out, "file", c.reference_file);
    if (!c.reference.rgb.empty()) {
        put(out, "mean", c.reference.mean());
        put(out, "mean_variance", c.reference.mean_variance());
    }
    out.Key("halves");
    out.StartArray();
    for (const ReferenceHalf& half : c.halves) {
        out.StartObject();
        put_pair(out, half.pair);
        put(out, "seed", half.seed);
        put(out, "spp", std::uint64_t{half.spp});
        put(out, "seconds", half.seconds);
        out.EndObject();
    }
    out.EndArray();
    if (c.agreement) {
        put(out, "accepted", c.agreement->accepted());
        put(out, "p", c.agreement->p);
        put(out, "p_threshold", Agreement::threshold);
        put(out, "p_pixels", c.agreement->p_pixels);
        put(out, "p_tiles", c.agreement->p_tiles);
        put(out, "p_mean", c.agreement->p_mean);
        put(out, "tests", static_cast<std::uint64_t>(c.agreement->tests));
    }
    out.EndObject();
}

void put_pairs(Writer& out, const Comparison& c, const CompareSummary& s) {
    out.Key("pairs");
    out.StartArray();
    for (std::size_t k = 0; k < c.pairs.size(); ++k) {
        const PairRun& run = c.pairs[k];
        const PairSummary& p = s.pairs[k];
        out.StartObject();
        put_pair(out, run.pair);
        put(out, "kind", name_of(run.kind));
        put(out, "finding", name_of(p.finding));
        if (!run.error.empty()) put(out, "error", run.error);
        if (p.last.rows > 0) {
            put(out, "seeds", static_cast<std::uint64_t>(p.last.rows));
            put(out, "spp", p.last.spp);
            put(out, "seconds", p.last.seconds);
            put(out, "mpaths_s", p.last.mpaths_s);
            put(out, "density_evals", run.density_evals);
            put(out, "primitive_tests", run.primitive_tests);
            put(out, "mse", p.last.mse);
            put(out, "relmse", p.last.relmse);
            put(out, "bias", p.last.bias);
            put(out, "inverse_efficiency", p.last.inverse_efficiency);
            put(out, "nonfinite_samples", run.nonfinite_samples);
            put(out, "bound_violations", run.bound_violations);
        }
        if (p.test.tested) {
            put(out, "bias_p", p.test.p);
            put(out, "bias_p_mean", p.test.p_mean);
            put(out, "bias_p_worst_tile", p.test.p_worst_tile);
            put(out, "bias_p_all_tiles", p.test.p_all_tiles);
            put(out, "bias_rms_tiles", p.test.rms);
        }
        out.EndObject();
    }
    out.EndArray();
}

void put_rows(Writer& out, const Comparison& c) {
    const auto intervals = bias_intervals(c);
    out.Key("rows");
    out.StartArray();
    for (const CompareRow& row : c.rows) {
        const PairRun& run = c.pairs[row.pair];
        out.StartObject();
        put_pair(out, run.pair);
        put(out, "device", joined(c.devices));
        put(out, "seed", row.seed);
        put(out, "spp", std::uint64_t{row.spp});
        put(out, "seconds", row.seconds);
        put(out, "mpaths_s", row.mpaths_s);
        put(out, "density_evals", run.density_evals);
        put(out, "primitive_tests", run.primitive_tests);
        put(out, "mse", row.errors.mse);
        put(out, "relmse", row.errors.relmse);
        put(out, "bias", row.errors.bias);
        put(out, "bias_ci", intervals.at({row.pair, row.level}));
        put(out, "inverse_efficiency", row.inverse_efficiency());
        out.EndObject();
    }
    out.EndArray();
}

}  // namespace

std::string comparison_to_csv(const Comparison& c) {
    std::string out = "strategy,estimator,device,seed,spp,seconds,mpaths_s,density_evals,primitive_tests,mse,relmse,bias,bias_ci,inverse_efficiency\n";
    const auto intervals = bias_intervals(c);
    for (const CompareRow& row : c.rows) {
        const PairRun& run = c.pairs[row.pair];
        out += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", quoted(strategy_name(run.pair)), quoted(run.pair.estimator), quoted(joined(c.devices)),
                           row.seed, row.spp, number(row.seconds), number(row.mpaths_s), number(run.density_evals), number(run.primitive_tests),
                           number(row.errors.mse), number(row.errors.relmse), number(row.errors.bias), number(intervals.at({row.pair, row.level})),
                           number(row.inverse_efficiency()));
    }
    return out;
}

std::string comparison_to_json(const Comparison& c, const CompareSummary& s, const ReportFacts& facts) {
    rapidjson::StringBuffer buffer;
    Writer out(buffer);
    out.SetIndent(' ', 2);
    out.StartObject();
    put(out, "made_by", "clume compare");
    put(out, "version", CLUME_VERSION);
    put(out, "scene", c.scene);
    put(out, "command", facts.command);
    put(out, "devices", c.devices);
    put(out, "drivers", c.drivers);
    put(out, "width", static_cast<std::uint64_t>(c.width));
    put(out, "height", static_cast<std::uint64_t>(c.height));
    put(out, "first_seed", c.seed);
    put(out, "seeds", std::uint64_t{c.seeds});
    put(out, "seeds_done", std::uint64_t{c.seeds_done});
    put(out, "seconds_per_seed", c.time_s ? *c.time_s : NAN);
    put(out, "estimator_matters", c.estimator_matters);
    put(out, "interrupted", c.interrupted);
    put(out, "verdict", s.verdict);
    put(out, "warnings", c.warnings);
    put(out, "bias_p_threshold", s.threshold);
    put(out, "exposure_stops", facts.exposure_stops);
    put(out, "error_map_scale", facts.error_scale);
    put(out, "cost_map_least", facts.cost_least);
    put(out, "cost_map_most", facts.cost_most);
    put_reference(out, c);
    put_pairs(out, c, s);
    put_rows(out, c);
    out.EndObject();
    return std::string(buffer.GetString(), buffer.GetSize()) + "\n";
}

}  // namespace clume
