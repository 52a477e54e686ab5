// SPDX-License-Identifier: MIT
// Colours are Okabe and Ito's, one per strategy whatever the plot.
#include "src/doc_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "src/error.h"
#include "src/output_file.h"

namespace clume {
namespace {

namespace fs = std::filesystem;

/// `text` as the whole of a file.
void write(const fs::path& path, const std::string& text) {
    OutputFile file(path);
    std::fwrite(text.data(), 1, text.size(), file.stream());
    file.commit();
}

constexpr std::array<std::pair<const char*, const char*>, 9> styles{{{"delta:tree", "lc rgb '#0072b2' pt 7"},
                                                                     {"delta:grid", "lc rgb '#0072b2' dt 2 pt 6"},
                                                                     {"delta:scene", "lc rgb '#0072b2' dt 4 pt 8"},
                                                                     {"decomposition", "lc rgb '#d55e00' pt 5"},
                                                                     {"regular", "lc rgb '#009e73' pt 9"},
                                                                     {"regular-linear", "lc rgb '#e69f00' dt 2 pt 8"},
                                                                     {"march-analytic", "lc rgb '#56b4e9' pt 11"},
                                                                     {"march", "lc rgb '#777777' pt 13"},
                                                                     {"progressive", "lc rgb '#cc79a7' pt 15"}}};
constexpr std::array others{"lc rgb '#0072b2' pt 7", "lc rgb '#d55e00' pt 5", "lc rgb '#009e73' pt 9", "lc rgb '#cc79a7' pt 13", "lc rgb '#e69f00' pt 11", "lc rgb '#56b4e9' pt 15", "lc rgb '#777777' pt 3"};

std::string style(const std::string& name, std::size_t index) {
    const auto found = std::find_if(styles.begin(), styles.end(), [&](const auto& s) { return name == s.first; });
    return found != styles.end() ? found->second : others[index % others.size()];
}

/// Inside gnuplot's single quotes.
std::string quoted(std::string text) {
    for (std::size_t at = 0; (at = text.find('\'', at)) != std::string::npos; at += 2) text.insert(at, 1, '\'');
    return text;
}

std::string script(const std::string& name, const Plot& p, const std::string& made_by) {
    std::string data, plots;
    double least = INFINITY, most = -INFINITY;
    std::set<double> tics;  // where something was measured
    for (std::size_t i = 0; i < p.series.size(); ++i) {
        data += fmt::format("$data{} << EOD\n", i);
        for (const auto& [x, y] : p.series[i].points) {
            if (!std::isfinite(y) || (p.log_y && y <= 0)) continue;
            data += fmt::format("{:.6g} {:.6g}\n", x, y);
            tics.insert(x);
            least = std::min(least, p.log_x ? x / 1.25 : x);
            most = std::max(most, p.log_x ? x * 1.25 : x);
        }
        data += "EOD\n";
        plots += fmt::format("{}$data{} using 1:2 with linespoints {} lw 2 ps 1 title '{}'", i ? ", \\\n     " : "plot ", i, style(p.series[i].name, i), p.series[i].name);
    }
    const std::string labels = fmt::format("{:g}", fmt::join(tics, ", "));
    const std::string axes = fmt::format(
        "set title '{}'\nset xlabel '{}'\nset ylabel '{}'\n{}{}set format x '%g'\nset format y '%g'\nset grid xtics ytics lc rgb '#dddddd' lw 1 dt 1\n"
        "set key outside right center reverse Left samplen 2\nset xrange [{:.6g}:{:.6g}]\nset xtics {}\n{}\n",
        quoted(p.title), quoted(p.x_label), quoted(p.y_label), p.log_x ? "set logscale x\n" : "", p.log_y ? "set logscale y\n" : "", least, most,
        labels.size() > 72 ? std::string("autofreq") : "(" + labels + ")", plots);
    return fmt::format("# Made by {3}; `gnuplot {0}.gp` in this folder makes the plot again.\nset encoding utf8\n{1}"
                       "set terminal svg size 900,480 dynamic noenhanced font 'sans-serif,14' background 'white'\nset output '{0}.svg'\n{2}"
                       "set terminal pngcairo size 1260,672 noenhanced font 'sans,14' fontscale 1.3 linewidth 1.4 pointscale 1.4 background 'white'\n"
                       "set output '{0}.png'\nreplot\nunset output\n",
                       name, data, axes, made_by);
}

}  // namespace

Report::Report(fs::path page, fs::path images, std::string made_by) : page_(std::move(page)), images_(std::move(images)), made_by_(std::move(made_by)) {
    std::error_code error;
    fs::create_directories(images_, error);
    if (error) throw RenderError(fmt::format("{}: cannot be made: {}", images_.string(), error.message()));
}

void Report::csv(const std::string& name, const Table& rows) const {
    std::string text;
    for (const auto& row : rows) text += fmt::format("{}\n", fmt::join(row, ","));
    write(images_ / (name + ".csv"), text);
}

fs::path Report::plot(const std::string& name, const Plot& plot) const {
    write(images_ / (name + ".gp"), script(name, plot, made_by_));
    const std::string folder = images_.string();
    if (folder.find('\'') != std::string::npos || std::system(fmt::format("cd '{}' && gnuplot '{}.gp'", folder, name).c_str()) != 0)
        fmt::print(stderr, "{}: no plot: gnuplot (package gnuplot-nox) cannot be run, or failed\n", name);
    return images_ / (name + ".svg");
}

std::string Report::markdown(const Table& rows) {
    std::string text;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        text += "|";
        for (std::string cell : rows[i]) {
            for (std::size_t at = 0; (at = cell.find('|', at)) != std::string::npos; at += 2) cell.insert(at, 1, '\\');
            text += " " + cell + " |";
        }
        text += "\n";
        if (i > 0) continue;
        text += "|";
        for (std::size_t k = 0; k < rows[0].size(); ++k) text += "---|";
        text += "\n";
    }
    return text;
}

void Report::text(const std::string& name, const std::string& text) const {
    std::ifstream in(page_);
    if (!in) return;
    std::stringstream buffer;
    buffer << in.rdbuf();
    std::string all = buffer.str();
    const std::string opening = fmt::format("<!-- table {} -->\n", name);
    const std::size_t begin = all.find(opening), end = begin == std::string::npos ? begin : all.find("<!-- end -->", begin);
    if (end == std::string::npos) throw RenderError(fmt::format("{}: has no place for table {}: a line <!-- table {} -->, one <!-- end -->", page_.string(), name, name));
    write(page_, all.replace(begin + opening.size(), end - begin - opening.size(), text));
}

}  // namespace clume
