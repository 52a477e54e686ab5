// SPDX-License-Identifier: MIT
// Colours are Okabe and Ito's, one per strategy; estimators differ by point and dash. Names are drawn as they are
// (noenhanced), data stand in here-documents.
#include "src/compare_plots.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

namespace clume {
namespace {

namespace fs = std::filesystem;

constexpr const char* prefix = ".clume-plot-";

/// In the order of strategies(); kept with the name, so that a strategy has one colour in every plot and report.
constexpr std::array colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#777777"};
constexpr std::array points{7, 5, 9, 13, 11};  ///< filled; the one before each is hollow

template <class Table>
std::size_t index_of(const Table& table, const std::string& name) {
    for (std::size_t i = 0; i < table.size(); ++i)
        if (name == table[i].name) return i;
    return 0;
}

std::string style(const MethodPair& p) {
    const std::size_t s = index_of(strategies(), p.strategy) % colours.size(), e = index_of(estimators(), p.estimator) % points.size();
    return fmt::format("lc rgb '{}' lw 2 dt {} pt {} ps 0.9", colours[s], e + 1, points[e] - (p.bound == "auto" ? 0 : 1));
}

/// A number for gnuplot; NaN is a gap.
std::string number(double v) { return std::isfinite(v) ? fmt::format("{:.6g}", v) : "NaN"; }

/// Labelled tics of a logarithmic axis from `least` to `most`: 1, 2 and 5 of each decade, or 1 alone over many decades.
std::string log_tics(double least, double most) {
    const bool many = most > 1e3 * least;
    std::string tics;
    for (int decade = static_cast<int>(std::floor(std::log10(least))); decade <= static_cast<int>(std::ceil(std::log10(most))); ++decade)
        for (const int digit : {1, 2, 5}) {
            const double v = digit * std::pow(10.0, decade);
            if ((many && digit != 1) || v < 0.999 * least || v > 1.001 * most) continue;
            tics += fmt::format("{}'{:.6g}' {:.6g}", tics.empty() ? "(" : ", ", v, v);
        }
    return tics.empty() ? "autofreq" : tics + ")";
}

/// Pairs with rows at the last level, in order of `key`, ascending.
template <class Key>
std::vector<std::size_t> measured(const Comparison& c, const CompareSummary& s, const Key& key) {
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < c.pairs.size(); ++k)
        if (s.pairs[k].last.rows > 0) order.push_back(k);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
    return order;
}

std::string outputs(const char* name, int width, int height, const std::string& commands) {
    std::string out;
    out += fmt::format("set terminal svg size {},{} dynamic noenhanced font 'sans-serif,14' background 'white'\nset output prefix.'{}.svg'\n{}", width, height, name, commands);
    out += fmt::format("set terminal pngcairo size {},{} noenhanced font 'sans,14' fontscale 1.4 linewidth 1.4 pointscale 1.4 background 'white'\nset output prefix.'{}.png'\nreplot\nunset output\n\n",
                       width * 7 / 5, height * 7 / 5, name);
    return out;
}

std::string rmse_plot(const Comparison& c, const CompareSummary& s) {
    std::string data, plot = "plot ";
    const auto order = measured(c, s, [](std::size_t k) { return k; });
    std::size_t levels = 0;
    for (const CompareRow& row : c.rows) levels = std::max(levels, row.level + 1);
    double least_s = INFINITY, most_s = 0, best = INFINITY, least_mse = INFINITY, most_mse = 0;
    for (const std::size_t k : order) {
        data += fmt::format("$rmse{} << EOD\n", k);
        for (std::size_t level = 0; level < levels; ++level) {
            const LevelSummary l = summarise(c, k, level);
            if (l.rows == 0 || !(l.mse.mean > 0) || !(l.seconds > 0)) continue;
            const double spread = std::isfinite(l.mse.half_width) ? l.mse.half_width : 0;
            data += fmt::format("{} {} {} {}\n", number(l.seconds), number(std::sqrt(l.mse.mean)),
                                number(std::sqrt(std::max(l.mse.mean - spread, 0.01 * l.mse.mean))), number(std::sqrt(l.mse.mean + spread)));
            least_s = std::min(least_s, l.seconds);
            most_s = std::max(most_s, l.seconds);
            best = std::min(best, l.mse.mean * l.seconds);
            least_mse = std::min(least_mse, l.mse.mean);
            most_mse = std::max(most_mse, l.mse.mean + spread);
        }
        data += "EOD\n";
        plot += fmt::format("{}$rmse{} using 1:2:3:4 with yerrorlines {} title '{}'", k == order.front() ? "" : ", \\\n     ", k, style(c.pairs[k].pair), c.pairs[k].pair.label());
    }
    if (!(most_s > 0)) return "";
    // The slope is drawn below the best pair, where no data are.
    const double height = 0.7 * std::sqrt(best), low = std::min(0.8 * std::sqrt(least_mse), 0.9 * height / std::sqrt(most_s)), high = 1.25 * std::sqrt(most_mse);
    least_s *= 0.8;
    most_s *= 1.25;
    plot += fmt::format(", \\\n     [{}:{}] {}/sqrt(x) with lines lc rgb '#666666' lw 1.5 dt 2 title 'slope −1/2'\n", number(least_s), number(most_s), number(height));
    const int key_rows = (static_cast<int>(order.size()) + 3) / 3;
    return data + outputs("rmse", 960, 540 + 24 * key_rows,
                          fmt::format("set title 'Error against time'\nset xlabel \"seconds per image\\n \"\nset ylabel 'RMSE'\nset logscale xy\n"
                                      "set xtics {}\nset ytics {}\nset key below left reverse Left samplen 3 maxcols 3\n"
                                      "set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1\nset rmargin 4\nset xrange [{}:{}]\nset yrange [{}:{}]\n",
                                      log_tics(least_s, most_s), log_tics(low, high), number(least_s), number(most_s), number(low), number(high)) + plot) +
           "reset\n";
}

/// Names of pairs on the left, the first on top.
std::string named_rows(const Comparison& c, const std::vector<std::size_t>& order) {
    std::string tics;
    std::size_t widest = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::string label = c.pairs[order[i]].pair.label();
        widest = std::max(widest, label.size());
        tics += fmt::format("{}'{}' {}", i ? ", " : "", label, i);
    }
    return fmt::format("set ytics ({}) nomirror scale 0\nset yrange [{}:-0.7]\nset lmargin {}\n", tics, static_cast<double>(order.size()) - 0.3, widest + 3);
}

std::string efficiency_plot(const Comparison& c, const CompareSummary& s) {
    auto order = measured(c, s, [&](std::size_t k) { return s.pairs[k].last.inverse_efficiency.mean; });
    std::erase_if(order, [&](std::size_t k) { return !(s.pairs[k].last.inverse_efficiency.mean > 0); });
    if (order.empty()) return "";
    double most = 0;
    const double best = s.pairs[order.front()].last.inverse_efficiency.mean;
    std::string data = "$efficiency << EOD\n", plot = "plot ";
    for (std::size_t i = 0; i < order.size(); ++i) {
        const Interval& e = s.pairs[order[i]].last.inverse_efficiency;
        const double spread = std::isfinite(e.half_width) ? e.half_width : 0;
        most = std::max(most, e.mean + spread);
        data += fmt::format("{} {} {} {}\n", i, number(e.mean), number(std::max(e.mean - spread, 0.0)), number(e.mean + spread));
    }
    data += "EOD\n";
    for (std::size_t i = 0; i < order.size(); ++i) {
        const MethodPair& p = c.pairs[order[i]].pair;
        plot += fmt::format("$efficiency every ::{}::{} using (0.5*($2+low)):1:(low):2:($1-0.34):($1+0.34) with boxxyerror fs solid {} lc rgb '{}' notitle, \\\n     ", i, i,
                            p.bound == "auto" ? "0.75" : "0.4", colours[index_of(strategies(), p.strategy) % colours.size()]);
    }
    plot += "$efficiency using 2:1:3:4 with xerrorbars pt 0 lw 2 lc rgb '#000000' notitle, \\\n     "
            "$efficiency using 4:1:(sprintf('%.3g', $2)) with labels left offset 1,0 notitle\n";
    const bool wide = most > 20 * best;
    const std::string axis = wide ? fmt::format("low = {}\nset logscale x\nset xrange [low:{}]\n", number(std::pow(10, std::floor(std::log10(0.7 * best)))), number(3 * most))
                                  : fmt::format("low = 0\nset xrange [0:{}]\n", number(1.2 * most));
    return data + axis +
           outputs("inverse_efficiency", 960, std::max(260, 130 + 34 * static_cast<int>(order.size())),
                   "set title 'Inverse efficiency: time for a given error; shorter is better'\nset xlabel 'mse × seconds, with its 95 % interval'\n"
                   "set format x '%.3g'\nset grid xtics lc rgb '#dddddd' lw 1 dt 1\nset border 1\nset rmargin 4\nset tics nomirror\n" + named_rows(c, order) + plot) +
           "reset\n";
}

std::string bias_plot(const Comparison& c, const CompareSummary& s) {
    const double mean = c.reference.mean();
    auto order = measured(c, s, [](std::size_t k) { return k; });
    std::erase_if(order, [&](std::size_t k) { return !std::isfinite(s.pairs[k].last.bias.half_width); });
    if (order.empty() || !(mean > 0)) return "";
    std::string data = "$bias << EOD\n", plot = "plot ";
    double most = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const Interval& b = s.pairs[order[i]].last.bias;
        most = std::max(most, 100 * (std::abs(b.mean) + b.half_width) / mean);
        data += fmt::format("{} {} {}\n", i, number(100 * b.mean / mean), number(100 * b.half_width / mean));
        plot += fmt::format("{}$bias every ::{}::{} using 2:1:3 with xerrorbars {} notitle", i ? ", \\\n     " : "", i, i, style(c.pairs[order[i]].pair));
    }
    data += "EOD\n";
    most = most > 0 ? 1.15 * most : 1;
    return data +
           outputs("bias", 960, std::max(260, 130 + 34 * static_cast<int>(order.size())),
                   fmt::format("set title 'Bias of the image’s mean'\nset xlabel '% of the reference’s mean, with its 95 % interval'\nset format x '%.3g'\n"
                               "set xrange [{}:{}]\nset grid xtics lc rgb '#dddddd' lw 1 dt 1\nset border 1\nset rmargin 4\nset tics nomirror\n"
                               "set arrow 1 from 0,graph 0 to 0,graph 1 nohead lc rgb '#444444' lw 1.5 back\n",
                               number(-most), number(most)) +
                       named_rows(c, order) + plot + "\n") +
           "reset\n";
}

}  // namespace

std::string plot_script(const Comparison& c, const CompareSummary& s) {
    const std::string plots = rmse_plot(c, s) + efficiency_plot(c, s) + bias_plot(c, s);
    if (plots.empty()) return "";
    return "# Made by clume compare; `gnuplot plot.gp` in this folder makes the plots again.\nset encoding utf8\n"
           "if (!exists('prefix')) prefix = ''\n\n" + plots;
}

std::string run_gnuplot(const fs::path& folder) {
    const auto forget = [&] {
        for (const char* name : plot_names)
            for (const char* extension : {".svg", ".png"}) {
                std::error_code ignored;
                fs::remove(folder / (prefix + std::string(name) + extension), ignored);
            }
    };
    int out[2];
    if (pipe2(out, O_CLOEXEC) != 0) return "no pipe to gnuplot";
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);  // Ctrl-C is for us alone
    const std::string setting = std::string("prefix='") + prefix + "'";
    const char* words[] = {"gnuplot", "-e", setting.c_str(), "plot.gp", nullptr};
    pid_t process = 0;
    const int failed = posix_spawnp(&process, "gnuplot", &actions, &attributes, const_cast<char**>(words), environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    close(out[1]);
    std::string said;
    char block[4096];
    for (ssize_t n = 0; failed == 0 && (n = read(out[0], block, sizeof block)) > 0;) said.append(block, static_cast<std::size_t>(n));
    close(out[0]);
    if (failed != 0) return "gnuplot cannot be run: install it (package gnuplot-nox), then make the plots by `gnuplot plot.gp` in the folder";
    int status = 0;
    waitpid(process, &status, 0);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        forget();
        return "gnuplot failed, there are no plots: " + said.substr(0, 500);
    }
    for (const char* name : plot_names)
        for (const char* extension : {".svg", ".png"}) {
            std::error_code error;
            const fs::path made = folder / (prefix + std::string(name) + extension);
            if (!fs::exists(made, error)) continue;
            fs::rename(made, folder / (std::string(name) + extension), error);
            if (error) return "a plot cannot be renamed: " + error.message();
        }
    return "";
}

}  // namespace clume
