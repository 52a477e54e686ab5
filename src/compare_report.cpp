// SPDX-License-Identifier: MIT
#include "src/compare_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "src/compare_html.h"
#include "src/compare_images.h"
#include "src/compare_plots.h"
#include "src/error.h"
#include "src/image_writer.h"
#include "src/output_file.h"

namespace clume {
namespace {

namespace fs = std::filesystem;

constexpr int embedded_width = 480;  ///< of images inside index.html, so that it stays small
constexpr const char* pairs_folder = "pairs";

void write_file(const fs::path& path, const std::string& bytes) {
    OutputFile file(path);
    if (std::fwrite(bytes.data(), 1, bytes.size(), file.stream()) != bytes.size()) file.fail("a write failed (is the disk full?)");
    file.commit();
}

std::string read_file(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return file ? text.str() : "";
}

bool is_report(const fs::path& folder) { return read_file(folder / "results.json").starts_with(report_mark); }

/// Removes what an earlier report left, and nothing else.
void remove_report(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const char* name : {"index.html", "results.csv", "plot.gp", "reference.exr", "reference.png"}) files.push_back(folder / name);
    for (const char* name : plot_names)
        for (const char* extension : {".svg", ".png"}) files.push_back(folder / (std::string(name) + extension));
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder / pairs_folder, error))
        if (entry.path().extension() == ".exr" || entry.path().extension() == ".png") files.push_back(entry.path());
    for (const auto& entry : fs::directory_iterator(folder, error))
        if (entry.path().filename().string().starts_with("reference_")) files.push_back(entry.path());
    for (const fs::path& file : files) {
        fs::remove(file, error);
        if (error) throw RenderError(file.string() + ": cannot be removed: " + error.message());
    }
    fs::remove(folder / pairs_folder, error);  // if it is empty now
}

RenderImage as_image(const std::vector<double>& rgb, const std::vector<double>& variance, int width, int height, std::uint32_t samples) {
    RenderImage image;
    image.film_width = width;
    image.film_height = height;
    image.window = {0, 0, width, height};
    for (const double v : rgb) image.rgb.push_back(static_cast<float>(v));
    for (const double v : variance) image.variance.push_back(static_cast<float>(v));
    image.alpha.assign(rgb.size() / 3, 1);
    image.samples.assign(rgb.size() / 3, samples);
    return image;
}

class Writer {
public:
    Writer(const fs::path& folder, const Comparison& c, const CompareSummary& s, const std::string& command) : folder_(folder), c_(c), s_(s) {
        facts_.command = command;
        pictures_.pairs.resize(c.pairs.size());
        pictures_.plots.resize(std::size(plot_names));
    }

    std::vector<std::string> run() {
        choose_scales();
        if (!c_.reference.rgb.empty()) {
            write_reference();
            write_pairs();
        }
        std::vector<std::string> warnings = write_plots();
        write_file(folder_ / "results.csv", comparison_to_csv(c_));
        write_file(folder_ / "index.html", report_html(c_, s_, facts_, pictures_));
        write_file(folder_ / "results.json", comparison_to_json(c_, s_, facts_));  // last: it says that the rest is there
        return warnings;
    }

private:
    void choose_scales();
    void write_reference();
    void write_pairs();
    std::vector<std::string> write_plots();
    /// Writes a picture beside its data and returns what is embedded.
    std::string keep(const fs::path& file, const Picture& picture) {
        write_file(folder_ / file, png_bytes(picture));
        return data_uri("image/png", png_bytes(shrunk(picture, embedded_width)));
    }
    ImageMetadata metadata(const std::string& what) const {
        return {{"software", "clume " CLUME_VERSION}, {"scene", c_.scene}, {"command", facts_.command}, {"image", what}};
    }

    const fs::path& folder_;
    const Comparison& c_;
    const CompareSummary& s_;
    ReportFacts facts_;
    ReportPictures pictures_;
};

/// One scale for all maps. Errors: the median over the pairs of the 99th percentile, so that one coarse pair does not bleach
/// the others. Cost: from the cheapest pixels that cost anything to the dearest.
void Writer::choose_scales() {
    std::vector<double> errors, cheap, dear;
    for (const PairRun& run : c_.pairs) {
        if (!run.image.empty()) {
            std::vector<double> e = signed_errors(run.image, c_.reference.rgb);
            for (double& v : e) v = std::abs(v);
            errors.push_back(percentile(std::move(e), 0.99));
        }
        std::vector<double> cost;
        for (const float v : run.cost)
            if (v > 0) cost.push_back(static_cast<double>(v));
        if (cost.empty()) continue;
        cheap.push_back(percentile(cost, 0.01));
        dear.push_back(percentile(std::move(cost), 0.999));
    }
    facts_.error_scale = percentile(errors, 0.5);
    if (!errors.empty() && !(facts_.error_scale > 0)) facts_.error_scale = std::max(1e-6, percentile(errors, 1));
    if (!cheap.empty()) {
        facts_.cost_least = *std::min_element(cheap.begin(), cheap.end());
        facts_.cost_most = std::max(1.01 * facts_.cost_least, *std::max_element(dear.begin(), dear.end()));
    }
    if (!c_.reference.rgb.empty()) facts_.exposure_stops = common_exposure(c_.reference.rgb);
}

void Writer::write_reference() {
    const auto picture = [&](const Reference& r) { return tone_mapped(r.rgb, c_.width, c_.height, facts_.exposure_stops); };
    std::uint32_t samples = 0;
    for (const ReferenceHalf& half : c_.halves) samples += half.spp;
    if (!c_.reference_refused()) {
        write_exr(folder_ / "reference.exr", as_image(c_.reference.rgb, c_.reference.variance, c_.width, c_.height, samples), metadata("reference"));
        pictures_.reference = keep("reference.png", picture(c_.reference));
        return;
    }
    for (const ReferenceHalf& half : c_.halves) {  // both, to be looked at
        const std::string name = "reference_" + half.pair.file_name();
        write_exr(folder_ / (name + ".exr"), as_image(half.image.rgb, half.image.variance, c_.width, c_.height, half.spp), metadata("reference by " + half.pair.label()));
        keep(name + ".png", picture(half.image));
    }
}

void Writer::write_pairs() {
    const fs::path pairs = pairs_folder;
    std::error_code error;
    fs::create_directory(folder_ / pairs, error);
    for (std::size_t k = 0; k < c_.pairs.size(); ++k) {
        const PairRun& run = c_.pairs[k];
        const std::string name = run.pair.file_name();
        PairPictures& p = pictures_.pairs[k];
        if (!run.image.empty()) {
            write_exr(folder_ / pairs / (name + ".exr"),
                      as_image(run.image, run.variance, c_.width, c_.height, static_cast<std::uint32_t>(std::min<std::uint64_t>(run.samples, UINT32_MAX))), metadata(run.pair.label()));
            p.image = keep(pairs / (name + ".png"), tone_mapped(run.image, c_.width, c_.height, facts_.exposure_stops));
            p.error = keep(pairs / (name + "_error.png"), error_map(signed_errors(run.image, c_.reference.rgb), c_.width, c_.height, facts_.error_scale));
        }
        if (!run.cost.empty() && facts_.cost_most > 0)
            p.cost = keep(pairs / (name + "_cost.png"), cost_map(run.cost, c_.width, c_.height, facts_.cost_least, facts_.cost_most));
    }
}

std::vector<std::string> Writer::write_plots() {
    const std::string script = plot_script(c_, s_);
    if (script.empty()) return {};
    write_file(folder_ / "plot.gp", script);
    std::vector<std::string> warnings;
    if (const std::string trouble = run_gnuplot(folder_); !trouble.empty()) warnings.push_back(trouble);
    for (std::size_t k = 0; k < std::size(plot_names); ++k)
        if (const std::string svg = read_file(folder_ / (plot_names[k] + std::string(".svg"))); !svg.empty()) pictures_.plots[k] = data_uri("image/svg+xml", svg);
    return warnings;
}

}  // namespace

bool prepare_report_folder(const fs::path& folder, const std::string& command) {
    std::error_code error;
    if (fs::exists(folder, error)) {
        if (!fs::is_directory(folder, error)) throw RenderError(folder.string() + ": is not a folder");
        if (!fs::is_empty(folder, error)) {
            if (error) throw RenderError(folder.string() + ": cannot be read: " + error.message());
            if (!is_report(folder)) throw RenderError(folder.string() + ": is not empty and holds no report of clume compare; nothing was changed in it");
            check_writable(folder / "results.json");
            return false;
        }
    } else {
        fs::create_directories(folder, error);
        if (error) throw RenderError(folder.string() + ": cannot be made: " + error.message());
    }
    Comparison nothing;
    nothing.interrupted = true;
    ReportFacts facts;
    facts.command = command;
    write_file(folder / "results.json", comparison_to_json(nothing, summarise(nothing), facts));
    return true;
}

void discard_report_folder(const fs::path& folder) {
    std::error_code ignored;
    fs::remove(folder / "results.json", ignored);
    fs::remove(folder, ignored);
}

std::vector<std::string> write_report(const fs::path& folder, const Comparison& comparison, const CompareSummary& summary, const std::string& command) {
    remove_report(folder);
    return Writer(folder, comparison, summary, command).run();
}

}  // namespace clume
