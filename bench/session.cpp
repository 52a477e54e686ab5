// SPDX-License-Identifier: MIT
#include "bench/session.h"

#include <fmt/format.h>
#include <rapidjson/prettywriter.h>
#include <rapidjson/stringbuffer.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "src/error.h"
#include "src/json_text.h"

namespace clume::bench {

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    const std::size_t n = v.size();
    return n % 2 ? v[n / 2] : 0.5 * (v[n / 2 - 1] + v[n / 2]);
}

double mean(const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size()); }

double load_average() {
    double load = -1;
    return getloadavg(&load, 1) == 1 ? load : -1;
}

Session::Session(Options options) : options_(std::move(options)), load_before_(load_average()) {
    try {
        filter_ = std::regex(options_.filter, std::regex::extended);
    } catch (const std::regex_error&) {
        throw UsageError("bench: --filter " + options_.filter + ": is no regular expression");
    }
}

const DeviceInfo& Session::device() {
    if (!device_) device_ = select_devices(options_.device.empty() ? std::vector<std::string>{} : std::vector{options_.device}).front();
    return *device_;
}

RenderOptions Session::render_options() const {
    RenderOptions o;
    if (!options_.device.empty()) o.devices = {options_.device};
    o.vector_width = options_.width;
    o.accelerator = options_.accelerator;
    o.kept_cells = false;  // building them is what is measured
    return o;
}

void Session::section(std::string name, std::string header) {
    section_ = std::move(name);
    header_ = std::move(header);
    header_printed_ = false;
}

bool Session::matches(const std::string& item) const { return std::regex_search(section_ + "/" + item, filter_); }

bool Session::wants(const std::string& item) {
    if (!matches(item)) return false;
    any_ = true;
    if (options_.list) {
        fmt::print("{}/{}\n", section_, item);
        return false;
    }
    if (!header_printed_) fmt::print("\n== {} ==\n{}\n", section_, header_);
    header_printed_ = true;
    std::fflush(stdout);
    return true;
}

void Session::record(const std::string& item, const std::string& line, Fields fields) {
    fmt::print("{}\n", line);
    std::fflush(stdout);
    results_.push_back({section_, item, std::move(fields)});
}

void Session::note(const std::string& text) {
    if (header_printed_) fmt::print("{}\n", text);
    std::fflush(stdout);
}

std::string Session::to_json() {
    rapidjson::StringBuffer buffer;
    rapidjson::PrettyWriter<rapidjson::StringBuffer> out(buffer);
    out.SetIndent(' ', 2);
    const auto key = [&](const std::string& name) { out.Key(name.c_str(), static_cast<rapidjson::SizeType>(name.size())); };
    const auto text = [&](const char* name, const std::string& value) {
        const std::string valid = json_text(value);
        out.Key(name);
        out.String(valid.c_str(), static_cast<rapidjson::SizeType>(valid.size()));
    };
    const auto number = [&](double value) { std::isfinite(value) ? out.Double(value) : out.Null(); };
    out.StartObject();
    text("version", CLUME_VERSION);
    out.Key("device");
    out.StartObject();
    const DeviceInfo& d = device();
    text("name", d.name);
    text("platform", d.platform);
    text("version", d.version);
    text("driver", d.driver);
    out.Key("compute_units");
    out.Uint(d.compute_units);
    out.Key("native_vector_width");
    out.Uint(d.native_vector_width);
    out.EndObject();
    out.Key("quick");
    out.Bool(options_.quick);
    out.Key("load_average_before");
    number(load_before_);
    out.Key("load_average_after");
    number(load_average());
    out.Key("results");
    out.StartArray();
    for (const Result& r : results_) {
        out.StartObject();
        text("section", r.section);
        text("item", r.item);
        for (const auto& [name, value] : r.fields)
            if (const double* v = std::get_if<double>(&value)) {
                key(name);
                number(*v);
            } else {
                text(name.c_str(), std::get<std::string>(value));
            }
        out.EndObject();
    }
    out.EndArray();
    out.EndObject();
    return std::string(buffer.GetString(), buffer.GetSize()) + "\n";
}

}  // namespace clume::bench
