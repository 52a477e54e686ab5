// SPDX-License-Identifier: MIT
#include "src/stress_report.h"

#include <fmt/format.h>
#include <rapidjson/prettywriter.h>
#include <rapidjson/stringbuffer.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "src/compare_images.h"
#include "src/doc_report.h"
#include "src/error.h"
#include "src/html_page.h"
#include "src/json_text.h"
#include "src/output_file.h"

namespace clume {
namespace {

namespace fs = std::filesystem;
using Writer = rapidjson::PrettyWriter<rapidjson::StringBuffer>;

constexpr const char* kMadeBy = "clume stress --report";

std::string figure(double v) { return std::isnan(v) ? "–" : std::isinf(v) ? "inf" : fmt::format("{:.2g}", v); }
std::string figure(const StressCount& c) { return c.of == 0 ? "–" : fmt::format("{}", c.count); }

void write_file(const fs::path& path, const std::string& text) {
    OutputFile file(path);
    if (std::fwrite(text.data(), 1, text.size(), file.stream()) != text.size()) file.fail("a write failed (is the disk full?)");
    file.commit();
}

std::string read_file(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return file ? text.str() : "";
}

/// Every row of a result, one line each.
Table all_rows(const StressResult& result) {
    Table rows{{"quantity", "family", "cases", "limit", "unit", "worst", "99.9 %", "worst relative", "99.9 %", "worst ulp", "99.9 %", "rounding the scene", "not finite", "lost", "invented", "additivity", "monotone",
                "round trip", "verdict"}};
    for (const StressRow& r : result.rows)
        rows.push_back({r.quantity, r.family, std::to_string(r.cases), figure(r.limit.value), name_of(r.limit.unit), figure(r.error.worst), figure(r.error.most), figure(r.relative.worst), figure(r.relative.most),
                        figure(r.ulp.worst), figure(r.ulp.most), figure(r.rounding.worst), std::to_string(r.nonfinite), figure(r.lost), figure(r.invented), figure(r.additivity), figure(r.monotonicity), figure(r.round_trip),
                        r.holds() ? "holds" : "EXCEEDED"});
    return rows;
}

/// One line per quantity: its worst family.
Table limits_table(const StressResult& result) {
    Table rows{{"quantity", "kernel function", "limit stated", "worst", "in the family", "99.9 % there", "rounding the scene, worst", "cases"}};
    std::vector<const StressRow*> worst;
    std::vector<double> rounding;
    std::vector<std::size_t> cases;
    for (const StressRow& r : result.rows) {
        const auto same = std::find_if(worst.begin(), worst.end(), [&](const StressRow* w) { return w->quantity == r.quantity && w->function == r.function; });
        const auto at = static_cast<std::size_t>(same - worst.begin());
        if (same == worst.end()) worst.push_back(&r), rounding.push_back(NAN), cases.push_back(0);
        if (r.error.worst > worst[at]->error.worst) worst[at] = &r;
        if (!(r.rounding.worst <= rounding[at]) && !std::isnan(r.rounding.worst)) rounding[at] = r.rounding.worst;
        cases[at] += r.cases;
    }
    for (std::size_t i = 0; i < worst.size(); ++i) {
        const StressRow& r = *worst[i];
        rows.push_back({r.quantity, "`" + r.function + "`", fmt::format("{} {}", figure(r.limit.value), name_of(r.limit.unit)), figure(r.error.worst), r.family, figure(r.error.most), figure(rounding[i]), std::to_string(cases[i])});
    }
    return rows;
}

/// Gaussian chords by family: the method used and the textbook's.
Table families_table(const StressResult& result) {
    Table rows{{"family (Gaussian)", "ends [ulp of the radius]", "by c − b²/a", "hits lost / invented", "depth, relative", "nothing forgiven", "by erf(b) − erf(a)", "flight, relative of τ", "inverted from t = 0",
                "additivity, monotonicity, round trip"}};
    const std::string suffix = ", gaussian";
    const auto find = [&](const char* quantity, const std::string& family) {
        return std::find_if(result.rows.begin(), result.rows.end(), [&](const StressRow& r) { return r.quantity == quantity && r.family == family; });
    };
    for (const StressRow& ends : result.rows) {
        if (ends.function != "intersect" || !ends.family.ends_with(suffix)) continue;
        const auto depth = find("optical depth", ends.family), flight = find("free flight", ends.family);
        rows.push_back({ends.family.substr(0, ends.family.size() - suffix.size()), figure(ends.error.worst), figure(ends.naive.worst), fmt::format("{} / {} of {}", ends.lost.count, ends.invented.count, ends.cases), figure(depth->error.worst),
                        figure(depth->relative.worst), figure(depth->naive.worst), figure(flight->error.worst), figure(flight->naive.worst),
                        fmt::format("{}, {}, {}", depth->additivity.count, depth->monotonicity.count, flight->round_trip.count)});
    }
    return rows;
}

Plot plot_of(const StressPlot& p) {
    Plot plot{p.title, p.x_label, p.y_label};
    plot.series = {{"clume", {}}, {p.naive_name, {}}};
    for (const auto& point : p.points) {
        plot.series[0].points.push_back({point.x, point.used});
        plot.series[1].points.push_back({point.x, point.naive});
    }
    if (!p.other_name.empty()) {
        plot.series.push_back({p.other_name, {}});
        for (const auto& point : p.points) plot.series[2].points.push_back({point.x, point.other});
    }
    return plot;
}

std::string html_table(const Table& rows) {
    std::string out = "<div class=\"scroll\"><table>\n";
    for (std::size_t i = 0; i < rows.size(); ++i) {
        out += "<tr>";
        for (const std::string& cell : rows[i]) out += (i == 0 ? "<th>" : "<td>") + escaped(cell) + (i == 0 ? "</th>" : "</td>");
        out += "</tr>\n";
    }
    return out + "</table></div>\n";
}

std::string verdict(const StressResult& result) {
    const auto bad = std::count_if(result.rows.begin(), result.rows.end(), [](const StressRow& r) { return !r.holds(); });
    std::size_t cases = 0;
    for (const StressRow& r : result.rows) cases += r.cases;
    return fmt::format("{} of {} rows hold their limits; {} comparisons in {:.0f} s.", result.rows.size() - static_cast<std::size_t>(bad), result.rows.size(), cases, result.seconds);
}

std::string page(std::span<const StressResult> results, const std::vector<std::pair<std::string, std::string>>& plots) {
    std::string out = html_begin("clume stress") + "<h1>clume stress</h1>\n";
    for (const StressResult& r : results) {
        out += "<h2>" + escaped(r.device) + "</h2>\n<p class=\"small\">" + escaped(r.driver) + "</p>\n<div class=\"verdict\"><p>" + escaped(verdict(r)) + "</p></div>\n";
        for (const StressRow& row : r.rows)
            if (!row.holds()) out += "<p class=\"warning\">" + escaped(row.quantity + ", " + row.family + ": " + row.trouble() + "; at " + row.worst_at) + "</p>\n";
        out += "<h3>Worst of each quantity</h3>\n" + html_table(limits_table(r)) + "<h3>Chords, beside the textbook’s formulas</h3>\n" + html_table(families_table(r));
    }
    out += "<h2>Why not the textbook’s formulas</h2>\n<p>Worst error in each half decade, against arithmetic of 256 bits on the very floats that the device has.</p>\n";
    for (const auto& [title, uri] : plots)
        if (!uri.empty()) out += "<p><img src=\"" + uri + "\" alt=\"" + escaped(title) + "\"/></p>\n";
    for (const StressResult& r : results) out += "<h2>All rows: " + escaped(r.device) + "</h2>\n" + html_table(all_rows(r));
    return out + "</body>\n</html>\n";
}

void put(Writer& out, const char* key, double v) {
    out.Key(key);
    if (std::isfinite(v)) out.Double(v);
    else out.Null();
}

void put(Writer& out, const char* key, const std::string& text) {
    out.Key(key);
    out.String(text.c_str(), static_cast<rapidjson::SizeType>(text.size()));
}

void put(Writer& out, const char* key, const StressSpread& s) {
    out.Key(key);
    out.StartObject();
    put(out, "worst", s.worst);
    put(out, "most_999", s.most);
    out.EndObject();
}

void put(Writer& out, const char* key, const StressCount& c) {
    if (c.of == 0) return;
    out.Key(key);
    out.StartObject();
    put(out, "count", static_cast<double>(c.count));
    put(out, "of", static_cast<double>(c.of));
    out.EndObject();
}

}  // namespace

std::string stress_table(const StressResult& result) {
    // Columns on a terminal, where a character may be several bytes.
    const auto columns = [](const std::string& text) { return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; })); };
    const Table rows = all_rows(result);
    std::vector<std::size_t> widths(rows[0].size());
    for (const auto& row : rows)
        for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], columns(row[k]));
    std::string text = fmt::format("{}, {}\n", result.device, result.driver);
    for (const auto& row : rows) {
        for (std::size_t k = 0; k < row.size(); ++k) {
            const std::string pad(widths[k] - columns(row[k]), ' ');
            text += (k ? "  " : "") + (k < 2 ? row[k] + pad : pad + row[k]);
        }
        text += "\n";
    }
    return text + verdict(result) + "\n";
}

void write_stress_json(const fs::path& path, std::span<const StressResult> results) {
    rapidjson::StringBuffer buffer;
    Writer out(buffer);
    out.SetIndent(' ', 2);
    out.StartObject();
    put(out, "made_by", std::string("clume stress"));
    put(out, "version", std::string(CLUME_VERSION));
    out.Key("devices");
    out.StartArray();
    for (const StressResult& r : results) {
        out.StartObject();
        put(out, "device", json_text(r.device));
        put(out, "driver", json_text(r.driver));
        put(out, "seconds", r.seconds);
        out.Key("holds");
        out.Bool(r.holds());
        out.Key("rows");
        out.StartArray();
        for (const StressRow& row : r.rows) {
            out.StartObject();
            put(out, "quantity", row.quantity);
            put(out, "function", row.function);
            put(out, "family", row.family);
            put(out, "limit", row.limit.value);
            put(out, "unit", std::string(name_of(row.limit.unit)));
            put(out, "cases", static_cast<double>(row.cases));
            put(out, "error", row.error);
            put(out, "relative", row.relative);
            put(out, "ulp", row.ulp);
            put(out, "rounding", row.rounding);
            put(out, "naive", row.naive);
            put(out, "nonfinite", static_cast<double>(row.nonfinite));
            const std::pair<const char*, const StressCount&> counts[] = {{"lost", row.lost}, {"invented", row.invented}, {"lost_beyond_limit", row.lost_beyond}, {"invented_beyond_limit", row.invented_beyond},
                                                                         {"additivity_violations", row.additivity}, {"monotonicity_violations", row.monotonicity}, {"round_trip_violations", row.round_trip}};
            for (const auto& [key, count] : counts) put(out, key, count);
            out.Key("holds");
            out.Bool(row.holds());
            put(out, "trouble", row.trouble());
            put(out, "worst_at", row.worst_at);
            out.EndObject();
        }
        out.EndArray();
        out.Key("plots");
        out.StartArray();
        for (const StressPlot& p : r.plots) {
            out.StartObject();
            put(out, "name", p.name);
            put(out, "naive_is", p.naive_name);
            if (!p.other_name.empty()) put(out, "other_is", p.other_name);
            out.Key("points");
            out.StartArray();
            for (const auto& point : p.points) {
                out.StartObject();
                put(out, "x", point.x);
                put(out, "used", point.used);
                put(out, "naive", point.naive);
                if (!p.other_name.empty()) put(out, "other", point.other);
                out.EndObject();
            }
            out.EndArray();
            out.EndObject();
        }
        out.EndArray();
        out.EndObject();
    }
    out.EndArray();
    out.EndObject();
    const std::string text = std::string(buffer.GetString(), buffer.GetSize()) + "\n";
    if (path == "-") std::fwrite(text.data(), 1, text.size(), stdout);
    else write_file(path, text);
}

void check_stress_report(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw RenderError(folder.string() + ": cannot be made: " + error.message());
    if (fs::exists(folder / "stability.md")) return check_writable(folder / "stability.md");
    const fs::path page = folder / "index.html";
    if (fs::exists(page) && read_file(page).find("<title>clume stress</title>") == std::string::npos) throw RenderError(page.string() + ": is no page of clume stress; nothing was changed");
    check_writable(page);
}

fs::path write_stress_report(const fs::path& folder, std::span<const StressResult> results) {
    fs::path markdown = folder / "stability.md";
    const bool documented = fs::exists(markdown);
    const Report report(markdown, documented ? folder / "images" / "stability" : folder, kMadeBy);
    std::vector<std::pair<std::string, std::string>> plots;
    for (const StressPlot& p : results.front().plots) {  // of the first device: the arithmetic is one
        if (p.points.empty()) continue;
        const std::string svg = read_file(report.plot(p.name, plot_of(p)));
        plots.emplace_back(p.title, svg.empty() ? "" : data_uri("image/svg+xml", svg));
    }
    if (!documented) {
        write_file(folder / "index.html", page(results, plots));
        return folder / "index.html";
    }
    std::string conditions;
    for (const StressResult& r : results) conditions += fmt::format("{}, {}: {}\n\n", r.device, r.driver, verdict(r));
    report.text("conditions", conditions);
    report.table("limits", limits_table(results.front()));
    report.table("families", families_table(results.front()));
    report.csv("rows", all_rows(results.front()));
    return markdown;
}

}  // namespace clume
