// SPDX-License-Identifier: MIT
// The tables of docs/performance.md that `clume bench --roofline --report DOCS` makes: peaks, and per kind of kernel a row for
// each kernel and a column for each width.
#include <fmt/format.h>

#include <algorithm>

#include "bench/sections.h"
#include "src/doc_report.h"
#include "tests/cases.h"

namespace clume::bench {
namespace {

double number(const Fields& fields, const char* name) {
    for (const auto& [key, value] : fields)
        if (key == name) return std::get<double>(value);
    return 0;
}

std::string limit(const Fields& fields) {
    for (const auto& [key, value] : fields)
        if (key == "limit") return std::get<std::string>(value);
    return "–";
}

std::string digits(double v) { return v >= 100 ? fmt::format("{:.0f}", v) : v >= 10 ? fmt::format("{:.1f}", v) : v >= 0.1 ? fmt::format("{:.2f}", v) : fmt::format("{:.3f}", v); }

/// "12.3 (45 %)", of the fastest launch.
std::string rate(const Fields& fields) {
    const double share = number(fields, "share");
    return digits(number(fields, "highest")) + (share > 0 ? fmt::format(" ({:.0f} %)", 100 * share) : "");
}

struct Kind {
    const char* table;
    std::vector<const char*> prefixes;  ///< of its items
    bool widths;
};

/// Items of the kernels section that begin so: name, then what an item takes, rate and share, and the limit, at each width.
Table table_of(const std::vector<Result>& results, const Kind& kind) {
    Table table{{"kernel", "operations", "bytes", "gathers"}};
    if (kind.widths)
        for (const int w : cases::vector_widths) table[0].push_back(fmt::format("W = {}", w));
    else table[0].push_back("M/s");
    table[0].push_back("limit");
    const std::size_t columns = table[0].size();
    for (const Result& r : results) {
        if (r.section != "kernels" || std::none_of(kind.prefixes.begin(), kind.prefixes.end(), [&](const char* p) { return r.item.starts_with(p); })) continue;
        const std::size_t at = r.item.rfind("/w");
        const bool has_width = kind.widths && at != std::string::npos && at + 4 >= r.item.size();
        const std::string name = has_width ? r.item.substr(0, at) : r.item;
        auto row = std::find_if(table.begin(), table.end(), [&](const auto& cells) { return cells[0] == name; });
        if (row == table.end()) {
            const bool known = number(r.fields, "share") > 0;
            table.push_back(std::vector<std::string>(columns));
            row = table.end() - 1;
            (*row)[0] = name;
            (*row)[1] = known ? digits(number(r.fields, "operations")) : "–";
            (*row)[2] = known ? digits(number(r.fields, "bytes")) : "–";
            (*row)[3] = known ? digits(number(r.fields, "gathers")) : "–";
            row->back() = limit(r.fields);
        }
        std::size_t column = 4;
        for (std::size_t k = 0; has_width && k < cases::vector_widths.size(); ++k)
            if (r.item.substr(at) == fmt::format("/w{}", cases::vector_widths[k])) column = 4 + k;
        (*row)[column] = rate(r.fields);
    }
    return table;
}

}  // namespace

void write_roofline(Session& session, const std::filesystem::path& docs) {
    const Report report(docs / "performance.md", docs / "images" / "performance", "clume bench --roofline");
    Table peaks{{"peak", "per second"}};
    for (const Result& r : session.results())
        if (r.section == "peaks") peaks.push_back({r.item, r.item == "launch" ? fmt::format("{:.1f} µs", 1e6 * number(r.fields, "seconds")) : fmt::format("{:.3g} G", 1e-9 * number(r.fields, "per_s"))});
    report.table("peaks", peaks);
    Table csv{{"item", "mitems_s", "lowest", "highest", "operations", "multiplications", "bytes", "gathers", "footprint", "share", "limit"}};
    for (const Result& r : session.results()) {
        if (r.section != "kernels") continue;
        std::vector<std::string>& row = csv.emplace_back(1, r.item);
        for (std::size_t k = 1; k + 1 < csv[0].size(); ++k) row.push_back(fmt::format("{:.5g}", number(r.fields, csv[0][k].c_str())));
        row.push_back(limit(r.fields));
    }
    report.csv("roofline", csv);
    const Kind kinds[] = {{"primitives", {"intersect/", "density/", "depth/", "inverse/", "leaf/", "segments"}, true},
                          {"blocks", {"node", "walk/", "sort/", "phase/", "light/", "environment/", "film/", "transfer/"}, false},
                          {"functions", {"math/", "random/"}, true},
                          {"flights", {"flight/"}, true},
                          {"transmittances", {"transmittance/"}, true}};
    for (const Kind& kind : kinds) report.table(kind.table, table_of(session.results(), kind));
}

}  // namespace clume::bench
