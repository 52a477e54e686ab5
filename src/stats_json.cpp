// SPDX-License-Identifier: MIT
// RenderStats to JSON with RapidJSON's writer.
#include "src/stats_json.h"

#include <rapidjson/prettywriter.h>
#include <rapidjson/stringbuffer.h>

#include <cmath>
#include <cstdint>
#include <cstdio>

#include "src/error.h"
#include "src/json_text.h"
#include "src/output_file.h"

namespace clume {

namespace {

using Writer = rapidjson::PrettyWriter<rapidjson::StringBuffer>;

void put(Writer& out, double value) {
    if (std::isfinite(value))
        out.Double(value);
    else
        out.Null();
}
void put(Writer& out, bool value) { out.Bool(value); }
void put(Writer& out, std::uint32_t value) { out.Uint(value); }
void put(Writer& out, std::uint64_t value) { out.Uint64(value); }

void put(Writer& out, const std::string& value) {
    const std::string text = json_text(value);
    out.String(text.c_str(), static_cast<rapidjson::SizeType>(text.size()));
}

void put(Writer& out, const DeviceShare& device);

template <class Value>
void put(Writer& out, const std::vector<Value>& values) {
    out.StartArray();
    for (const Value& value : values) put(out, value);
    out.EndArray();
}

template <class Value>
void put_member(Writer& out, const char* key, const Value& value) {
    out.Key(key);
    put(out, value);
}

void put(Writer& out, const DeviceShare& device) {
    out.StartObject();
    put_member(out, "name", device.name);
    put_member(out, "paths", device.paths);
    put_member(out, "busy_s", device.busy_s);
    out.EndObject();
}

}  // namespace

std::string stats_to_json(const RenderStats& stats) {
    rapidjson::StringBuffer buffer;
    Writer out(buffer);
    out.SetIndent(' ', 2);
    out.StartObject();
    put_member(out, "version", std::string(CLUME_VERSION));
    put_member(out, "strategy", stats.strategy);
    put_member(out, "transmittance", stats.transmittance);
    put_member(out, "bound", stats.bound);
    put_member(out, "devices", stats.devices);
    put_member(out, "paths", stats.paths);
    put_member(out, "empty_pixels", stats.empty_pixels);
    put_member(out, "nonfinite_samples", stats.nonfinite_samples);
    put_member(out, "bound_violations", stats.bound_violations);
    out.Key("work");  // zeros unless counted
    out.StartObject();
    for (std::size_t k = 0; k < WORK_KINDS; ++k) put_member(out, work_names[k], stats.work[k]);
    out.EndObject();
    put_member(out, "primitives", stats.primitives);
    put_member(out, "device_bytes", stats.device_bytes);
    put_member(out, "layout_hash", stats.layout_hash);
    put_member(out, "build_s", stats.build_s);
    put_member(out, "compile_s", stats.compile_s);
    put_member(out, "render_s", stats.render_s);
    put_member(out, "cpu_s", stats.cpu_s);
    put_member(out, "interrupted", stats.interrupted);
    put_member(out, "time_limited", stats.time_limited);
    put_member(out, "samples_min", stats.samples_min);
    put_member(out, "samples_max", stats.samples_max);
    put_member(out, "samples_mean", stats.samples_mean);
    if (stats.noise) {
        out.Key("noise");
        out.StartObject();
        put_member(out, "threshold", stats.noise->threshold);
        put_member(out, "tiles", stats.noise->tiles);
        put_member(out, "tiles_above", stats.noise->above);
        put_member(out, "tiles_capped", stats.noise->capped);
        put_member(out, "worst", stats.noise->worst);
        put_member(out, "pilot_paths", stats.noise->pilot_paths);
        out.EndObject();
    }
    put_member(out, "notes", stats.notes);
    put_member(out, "warnings", stats.warnings);
    out.Key("explain");
    out.StartObject();
    for (const auto& [feature, what] : stats.explain) put_member(out, feature.c_str(), what);
    out.EndObject();
    out.EndObject();
    return std::string(buffer.GetString(), buffer.GetSize()) + "\n";
}

void write_stats_json(const std::filesystem::path& path, const RenderStats& stats) {
    const std::string text = stats_to_json(stats);
    if (path == "-") {
        if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0) throw RenderError("stdout: cannot be written");
        return;
    }
    OutputFile file(path);
    std::fwrite(text.data(), 1, text.size(), file.stream());
    file.commit();
}

}  // namespace clume
