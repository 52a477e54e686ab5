// SPDX-License-Identifier: MIT
// What a measurement leaves in the documentation: in a folder of images a CSV file, a gnuplot script with its data, and an SVG
// and a PNG per plot; in a page tables, between `<!-- table NAME -->` and `<!-- end -->`. The page's prose is left alone.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace clume {

/// A line of a plot; a y that is no finite number is a gap.
struct Series {
    std::string name;
    std::vector<std::pair<double, double>> points;
};

struct Plot {
    std::string title, x_label, y_label;
    bool log_x = true, log_y = true;
    std::vector<Series> series = {};
};

using Table = std::vector<std::vector<std::string>>;  ///< the first row is the header

class Report {
public:
    /// Makes the folder for images. `made_by`: the command, for the scripts. Throws RenderError.
    Report(std::filesystem::path page, std::filesystem::path images, std::string made_by);

    void csv(const std::string& name, const Table& rows) const;
    /// The path of the SVG, which is not there, with a remark on standard error, if gnuplot cannot be run; the script is there then.
    std::filesystem::path plot(const std::string& name, const Plot& plot) const;
    /// Throws RenderError if the page has no place for it. A page that is not there is not written.
    void table(const std::string& name, const Table& rows) const { text(name, markdown(rows)); }
    void text(const std::string& name, const std::string& text) const;

    static std::string markdown(const Table& rows);

private:
    std::filesystem::path page_, images_;
    std::string made_by_;
};

}  // namespace clume
