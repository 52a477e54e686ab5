// SPDX-License-Identifier: MIT
// The table of scene keys, and what follows from it: checks, suggestions, documentation. To add a key, add a row here,
// read it in scene_reader.cpp and put the new tables (the test prints them) into docs/scene.md.
#include "src/scene_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>

#include "src/error.h"

namespace clume {

namespace {

using T = KeyType;

// clang-format off
// section, name, variants, type, length, required, default, range, choices, unit, meaning
constexpr KeySpec table[] = {
    {"scene", "camera", "", T::section, 0, true, "", "", "", "", "where the image is seen from"},
    {"scene", "film", "", T::section, 0, false, "", "", "", "", "the image"},
    {"scene", "render", "", T::section, 0, false, "", "", "", "", "how the image is computed"},
    {"scene", "media", "", T::list, 0, false, "[]", "", "", "", "what scatters, absorbs and emits; media overlap freely, their extinctions add"},
    {"scene", "lights", "", T::list, 0, false, "[]", "", "", "", "what shines"},

    {"camera", "type", "", T::choice, 0, false, "\"perspective\"", "", "perspective orthographic", "", "the projection"},
    {"camera", "origin", "", T::vec3, 3, true, "", "", "", "world units", "where the camera stands"},
    {"camera", "target", "", T::vec3, 3, true, "", "", "", "world units", "what it looks at; not the origin"},
    {"camera", "up", "", T::vec3, 3, false, "[0,1,0]", "", "", "", "what is up in the image; not along the view"},
    {"camera", "fov", "perspective", T::number, 0, false, "40", "(0,180)", "", "degrees", "full horizontal angle"},
    {"camera", "width", "orthographic", T::number, 0, true, "", "(0,inf)", "", "world units", "across the image"},

    {"film", "width", "", T::integer, 0, false, "512", "[1,65536]", "", "pixels", "columns"},
    {"film", "height", "", T::integer, 0, false, "512", "[1,65536]", "", "pixels", "rows"},

    {"render", "spp", "", T::integer, 0, false, "64", "[1,4294967295]", "", "", "samples per pixel"},
    {"render", "seed", "", T::integer, 0, false, "0", "[0,18446744073709551615]", "", "", "of the random numbers; every bit counts"},
    {"render", "max_depth", "", T::integer, 0, false, "-1", "[-1,2147483647]", "", "", "most scattering events on a path; 0: emission and unscattered light; 1: single scattering; -1: no limit"},
    {"render", "rr_depth", "", T::integer, 0, false, "16", "[0,2147483647]", "", "", "scattering events before roulette may act"},
    {"render", "strategy", "", T::choice, 0, false, "\"auto\"", "", "auto march march-analytic regular regular-linear decomposition delta progressive", "", "distance sampling; `auto`: the fastest unbiased one, by a pilot"},
    {"render", "transmittance", "", T::choice, 0, false, "\"auto\"", "", "auto analytic march ratio residual-ratio binary", "", "transmittance estimator; `auto`: the fastest unbiased one, by a pilot"},
    {"render", "bound", "", T::choice, 0, false, "\"auto\"", "", "auto scene grid tree", "", "of null collisions: one for the scene, one per cell of a uniform grid, or per node of an octree"},
    {"render", "majorant_grid", "", T::integer, 0, false, "", "[1,1024]", "", "cells", "along the longest axis of the `grid` bound and of `progressive`; default: by a cost model"},
    {"render", "root_finding", "", T::choice, 0, false, "\"newton\"", "", "newton bisection", "", "of `regular` where several primitives overlap; both are exact to rounding"},
    {"render", "sampler", "", T::choice, 0, false, "\"independent\"", "", "independent sobol", "", "random numbers of a pixel's samples: `independent`, or spread evenly (`sobol`), which makes less noise, the most where `spp` is a power of two"},
    {"render", "light_sampling", "", T::choice, 0, false, "\"mis\"", "", "mis nee phase", "", "`mis`: both ways, weighted; `nee`: light sampling alone; `phase`: none, not with point, spot or directional lights"},
    {"render", "step", "", T::number, 0, false, "", "(0,inf)", "", "world units", "of marching only; default: the smallest kernel scale / 4"},

    {"media", "type", "", T::choice, 0, true, "", "", "ellipsoids grid", "", "a mixture of ellipsoids, or voxels"},
    {"media", "kernel", "ellipsoids", T::choice, 0, true, "", "", "gaussian epanechnikov uniform", "", "density over distance from the centre"},
    {"media", "extent", "ellipsoids", T::number, 0, false, "", "[1e-15,1e15]", "", "scales", "support radius; default: 3 gaussian, √7 epanechnikov, √5 uniform"},
    {"media", "normalization", "ellipsoids", T::choice, 0, false, "\"peak\"", "", "peak mass", "", "what a density means: extinction at the centre, or its integral over space"},
    {"media", "file", "ellipsoids", T::string, 0, false, "", "", "", "", "a PLY file; this or `primitives`"},
    {"media", "primitives", "ellipsoids", T::list, 0, false, "", "", "", "", "a list of primitives; this or `file`"},
    {"media", "file", "grid", T::string, 0, true, "", "", "", "", "voxels: OpenVDB `.vdb`, NanoVDB `.nvdb`, Mitsuba `.vol`, or `.raw`: float32, little-endian, x fastest"},
    {"media", "grid", "grid", T::string, 0, false, "", "", "", "", "the density's name in a `.vdb` or `.nvdb` file; default: `density`, else the only float grid"},
    {"media", "resolution", "grid", T::vec3, 3, false, "", "[1,65536]", "", "voxels", "nx, ny, nz of a `.raw` file, where it is required; others know it"},
    {"media", "bounds", "grid", T::list, 0, false, "", "", "", "", "[[min], [max]] in the medium's own coordinates, filled by a dense grid, or by a sparse one's active box grown by half a voxel; default: the file's own placement; required for `.raw`"},
    {"media", "interpolation", "grid", T::choice, 0, false, "\"trilinear\"", "", "trilinear nearest", "", "between samples, which stand at voxel centres"},
    {"media", "emission_grid", "grid", T::string, 0, false, "", "", "", "", "a second grid of a `.vdb` or `.nvdb` file; `emission` times its value is radiance per unit length, wherever the density is"},
    {"media", "scale_encoding", "ellipsoids", T::choice, 0, false, "\"log\"", "", "log linear", "", "of the file's scales: natural logarithms or lengths"},
    {"media", "density_encoding", "ellipsoids", T::choice, 0, false, "", "", "extinction opacity", "", "of the file's densities; default: by the property's name"},
    {"media", "density_scale", "", T::number, 0, false, "1", "[0,inf)", "", "", "multiplies every density"},
    {"media", "albedo", "ellipsoids", T::rgb, 3, false, "", "[0,1]", "", "", "single-scattering albedo; given, it replaces every primitive's own (0.9 where they have none)"},
    {"media", "emission", "ellipsoids", T::rgb, 3, false, "", "[0,inf)", "", "W/m²/sr", "source radiance; given, it replaces every primitive's own (0 where they have none)"},
    {"media", "albedo", "grid", T::rgb, 3, false, "0.9", "[0,1]", "", "", "single-scattering albedo, everywhere"},
    {"media", "emission", "grid", T::rgb, 3, false, "", "[0,inf)", "", "W/m²/sr", "source radiance, everywhere (default 0); with an `emission_grid` what its values are multiplied by (default 1)"},
    {"media", "phase", "", T::section, 0, false, "", "", "", "", "how light scatters"},
    {"media", "transform", "", T::section, 0, false, "", "", "", "", "from the medium's own coordinates to the world's"},

    {"primitive", "center", "", T::vec3, 3, true, "", "", "", "world units", ""},
    {"primitive", "scale", "", T::scale, 3, false, "", "(0,inf)", "", "world units", "along its own axes; this or `covariance` is required"},
    {"primitive", "rotation", "", T::list, 4, false, "[1,0,0,0]", "", "", "", "quaternion w, x, y, z, normalised on reading; not zero; turns its own axes into the medium's"},
    {"primitive", "covariance", "", T::list, 6, false, "", "", "", "world units²", "xx, xy, xz, yy, yz, zz, positive definite; instead of scale and rotation"},
    {"primitive", "density", "", T::number, 0, true, "", "[0,inf)", "", "1/world unit", "peak extinction, or mass by `normalization`; primitives of density 0 are dropped"},
    {"primitive", "albedo", "", T::rgb, 3, false, "0.9", "[0,1]", "", "", "single-scattering albedo"},
    {"primitive", "emission", "", T::rgb, 3, false, "0", "[0,inf)", "", "W/m²/sr", "source radiance"},
    {"primitive", "g", "", T::number, 0, false, "", "(-1,1)", "", "", "makes it Henyey-Greenstein with this mean cosine; not in a Rayleigh medium"},

    {"phase", "type", "", T::choice, 0, false, "\"isotropic\"", "", "isotropic henyey-greenstein rayleigh", "", "the phase function"},
    {"phase", "g", "henyey-greenstein", T::number, 0, true, "", "(-1,1)", "", "", "mean cosine; above 0 scatters forward"},

    {"transform", "scale", "", T::scale, 3, false, "1", "", "", "", "applied first; not 0, negative mirrors"},
    {"transform", "rotate", "", T::section, 0, false, "", "", "", "", "applied second"},
    {"transform", "translate", "", T::vec3, 3, false, "[0,0,0]", "", "", "world units", "applied last"},
    {"transform", "matrix", "", T::list, 0, false, "", "", "", "", "four rows of four numbers, the last 0, 0, 0, 1; not singular; instead of the other keys"},

    {"rotate", "axis", "", T::vec3, 3, true, "", "", "", "", "not zero"},
    {"rotate", "angle", "", T::number, 0, true, "", "", "", "degrees", "right-handed about the axis"},

    {"lights", "type", "", T::choice, 0, true, "", "", "constant envmap point spot directional sphere rectangle", "", "the kind of light"},
    {"lights", "radiance", "constant sphere rectangle", T::rgb, 3, true, "", "[0,inf)", "", "W/m²/sr", "constant: from every direction; sphere: outwards; rectangle: from the side edge_u × edge_v points to"},
    {"lights", "file", "envmap", T::string, 0, true, "", "", "", "", "an EXR or Radiance HDR image, longitude and latitude; its centre is seen along +z, its top along +y"},
    {"lights", "scale", "envmap", T::number, 0, false, "1", "[0,inf)", "", "", "multiplies the image"},
    {"lights", "rotate_y", "envmap", T::number, 0, false, "0", "", "", "degrees", "right-handed about +y: 90 moves what was seen along +z to +x"},
    {"lights", "visible_to_camera", "constant envmap", T::boolean, 0, false, "false", "", "", "", "whether the image's background shows it"},
    {"lights", "position", "point spot", T::vec3, 3, true, "", "", "", "world units", ""},
    {"lights", "intensity", "point spot", T::rgb, 3, true, "", "[0,inf)", "", "W/sr", "irradiance is intensity / distance²"},
    {"lights", "target", "spot", T::vec3, 3, true, "", "", "", "world units", "what it points at; not its position"},
    {"lights", "beam", "spot", T::number, 0, false, "15", "[0,180)", "", "degrees", "half angle of full intensity, at most `cutoff`"},
    {"lights", "cutoff", "spot", T::number, 0, false, "20", "(0,180)", "", "degrees", "half angle where it has fallen, linearly in angle, to zero"},
    {"lights", "direction", "directional", T::vec3, 3, true, "", "", "", "", "the way the light travels; not zero"},
    {"lights", "irradiance", "directional", T::rgb, 3, true, "", "[0,inf)", "", "W/m²", "on a plane that faces it"},
    {"lights", "center", "sphere", T::vec3, 3, true, "", "", "", "world units", ""},
    {"lights", "radius", "sphere", T::number, 0, true, "", "(0,inf)", "", "world units", ""},
    {"lights", "corner", "rectangle", T::vec3, 3, true, "", "", "", "world units", "one corner of a parallelogram"},
    {"lights", "edge_u", "rectangle", T::vec3, 3, true, "", "", "", "world units", "from the corner to the next"},
    {"lights", "edge_v", "rectangle", T::vec3, 3, true, "", "", "", "world units", "from the corner to the other; not parallel to edge_u"},
};
// clang-format on

std::vector<std::string_view> words(std::string_view text) {
    std::vector<std::string_view> out;
    while (!text.empty()) {
        const auto end = std::min(text.find(' '), text.size());
        if (end > 0) out.push_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return out;
}

bool belongs(const KeySpec& spec, std::string_view variant) {
    const auto names = words(spec.variants);
    return names.empty() || std::find(names.begin(), names.end(), variant) != names.end();
}

/// Edit distance with swaps of neighbours, on bytes.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
    for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i)
        for (std::size_t j = 1; j <= b.size(); ++j) {
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
}

/// "; did you mean "X"?", or the names there are if none is near.
std::string suggestion(std::string_view word, std::span<const std::string_view> names) {
    if (const auto near = nearest_name(word, names); !near.empty()) return fmt::format("; did you mean \"{}\"?", near);
    return fmt::format("; known: {}", fmt::join(names, ", "));
}

bool in_range(std::string_view range, double x) {
    if (range.empty()) return std::isfinite(x);
    const auto comma = range.find(',');
    const auto bound = [](std::string_view s) { return std::strtod(std::string(s).c_str(), nullptr); };
    const double low = bound(range.substr(1, comma - 1));
    const double high = bound(range.substr(comma + 1, range.size() - comma - 2));
    return (range.front() == '[' ? x >= low : x > low) && (range.back() == ']' ? x <= high : x < high);
}

std::string type_words(const KeySpec& spec) {
    switch (spec.type) {
        case T::number:
            return "a number";
        case T::integer:
            return "an integer";
        case T::boolean:
            return "true or false";
        case T::string:
        case T::choice:
            return "a string";
        case T::vec3:
            return "a list of 3 numbers";
        case T::rgb:
        case T::scale:
            return "a number or a list of 3 numbers";
        case T::list:
            return spec.length > 0 ? fmt::format("a list of {} numbers", spec.length) : "a list";
        case T::section:
            return "a section";
    }
    return "";
}

std::string type_markdown(const KeySpec& spec) {
    if (spec.type == T::choice) return fmt::format("`{}`", fmt::join(words(spec.choices), "`, `"));
    return type_words(spec).substr(spec.type == T::boolean ? 0 : type_words(spec).find(' ') + 1);
}

bool is_numbers(const JsonValue& value, std::size_t length) {
    return value.type == JsonType::array && value.items.size() == length &&
           std::all_of(value.items.begin(), value.items.end(), [](const JsonValue& v) { return v.type == JsonType::number; });
}

}  // namespace

std::span<const KeySpec> scene_schema() { return table; }

std::string_view nearest_name(std::string_view word, std::span<const std::string_view> names) {
    std::string_view best;
    if (word.size() > 64) return best;
    std::size_t least = std::max<std::size_t>(2, word.size() / 2) + 1;
    for (const auto name : names)
        if (const auto d = edit_distance(word, name); d < least && d < std::max(word.size(), name.size())) {
            least = d;
            best = name;
        }
    return best;
}

std::string schema_markdown() {
    std::string out;
    std::string_view section;
    for (const KeySpec& key : table) {
        if (key.section != section) {
            section = key.section;
            out += fmt::format(
                "{}### {}\n\n| key | for | type | default | range | unit | meaning |\n|---|---|---|---|---|---|---|\n",
                out.empty() ? "" : "\n", section);
        }
        std::string fallback;
        if (key.required) fallback = "required";
        if (!key.default_json.empty()) fallback = fmt::format("`{}`", key.default_json);
        out += fmt::format("| `{}` | {} | {} | {} | {} | {} | {} |\n", key.name, fmt::join(words(key.variants), ", "),
                           type_markdown(key), fallback, key.range, key.unit, key.meaning);
    }
    return out;
}

void SceneSource::fail(const JsonPosition& at, const std::string& what) const {
    if (at.override_index >= 0)
        throw UsageError(fmt::format("-D {}: {}", overrides[static_cast<std::size_t>(at.override_index)], what));
    throw SceneError(fmt::format("{}:{}:{}: {}", file, at.line, at.column, what));
}

void SceneSource::fail_asset(const JsonPosition& at, const std::string& what) const {
    if (at.override_index >= 0)
        throw SceneError(fmt::format("-D {}: {}", overrides[static_cast<std::size_t>(at.override_index)], what));
    throw SceneError(fmt::format("{}:{}:{}: {}", file, at.line, at.column, what));
}

SectionReader::SectionReader(const SceneSource& source, std::string_view section, const JsonValue* value,
                             const JsonPosition& parent)
    : source_(source), section_(section), value_(value), at_(value != nullptr ? value->at : parent) {
    if (value != nullptr && value->type != JsonType::object)
        source_.fail(at_, fmt::format("{} must be a section in braces, not {}", section_, json_type_name(value->type)));
    const auto has_type = std::any_of(std::begin(table), std::end(table),
                                      [&](const KeySpec& k) { return k.section == section_ && k.name == "type"; });
    if (has_type) {
        if (spec("type").required && this->value("type") == nullptr)
            fail("type", fmt::format("missing key \"type\" in {}", section_));
        if (const JsonValue* type = this->value("type")) check_value(spec("type"), *type);
        variant_ = text("type");
    }
    check();
}

const KeySpec& SectionReader::spec(std::string_view key) const {
    const auto found = std::find_if(std::begin(table), std::end(table), [&](const KeySpec& k) {
        return k.section == section_ && k.name == key && (variant_.empty() || belongs(k, variant_));
    });
    assert(found != std::end(table));
    return *found;
}

void SectionReader::check() const {
    std::vector<std::string_view> known;
    for (const KeySpec& key : table) {
        if (key.section != section_ || !belongs(key, variant_)) continue;
        known.push_back(key.name);
        if (const JsonValue* value = this->value(key.name)) check_value(key, *value);
    }
    if (value_ != nullptr)
        for (const JsonMember& member : value_->members) {
            if (std::find(known.begin(), known.end(), member.key) != known.end()) continue;
            const auto other = std::find_if(std::begin(table), std::end(table),
                                            [&](const KeySpec& k) { return k.section == section_ && k.name == member.key; });
            const std::string where =
                variant_.empty() ? std::string(section_) : fmt::format("{} of type \"{}\"", section_, variant_);
            if (other != std::end(table))
                source_.fail(member.at, fmt::format("key {} does not belong to {}{}", in_quotes(member.key), where,
                                                    suggestion(member.key, known)));
            source_.fail(member.at,
                         fmt::format("unknown key {} in {}{}", in_quotes(member.key), where, suggestion(member.key, known)));
        }
    for (const KeySpec& key : table)
        if (key.section == section_ && key.required && belongs(key, variant_) && value(key.name) == nullptr)
            source_.fail(at_, fmt::format("missing key \"{}\" in {}", key.name, section_));
}

void SectionReader::check_value(const KeySpec& key, const JsonValue& value) const {
    bool right = false;
    switch (key.type) {
        case T::number:
            right = value.type == JsonType::number;
            break;
        case T::integer:
            right =
                value.type == JsonType::number &&
                (value.integer || (value.number == std::floor(value.number) && std::abs(value.number) <= 9007199254740992.0));
            break;
        case T::boolean:
            right = value.type == JsonType::boolean;
            break;
        case T::string:
        case T::choice:
            right = value.type == JsonType::string;
            break;
        case T::vec3:
            right = is_numbers(value, 3);
            break;
        case T::rgb:
        case T::scale:
            right = value.type == JsonType::number || is_numbers(value, 3);
            break;
        case T::list:
            right = key.length > 0 ? is_numbers(value, static_cast<std::size_t>(key.length)) : value.type == JsonType::array;
            break;
        case T::section:
            right = value.type == JsonType::object;
            break;
    }
    if (!right) {
        std::string got(json_type_name(value.type));
        if (value.type == JsonType::string) got += " " + in_quotes(value.text);
        if (value.type == JsonType::array) got = fmt::format("a list of {}", value.items.size());
        const bool range_speaks =
            key.type == T::integer && value.type == JsonType::number && !in_range(key.range, value.number);
        if (key.type == T::integer && value.type == JsonType::number) got = fmt::format("{}", value.number);
        if (is_numbers(value, value.items.size()) == false && value.type == JsonType::array)
            got = "a list that holds something else";
        if (!range_speaks) source_.fail(value.at, fmt::format("\"{}\" must be {}, not {}", key.name, type_words(key), got));
    }
    const auto in_bounds = [&](const JsonValue& number) {
        if (!in_range(key.range, number.number))
            source_.fail(number.at, fmt::format("\"{}\" must be in {}, not {}", key.name, key.range, number.number));
    };
    if (value.type == JsonType::number) in_bounds(value);
    if (value.type == JsonType::array && (key.length > 0))
        for (const JsonValue& item : value.items) in_bounds(item);
    if (key.type == T::choice) {
        const auto names = words(key.choices);
        if (std::find(names.begin(), names.end(), value.text) != names.end()) return;
        const auto near = nearest_name(value.text, names);
        source_.fail(value.at,
                     fmt::format("unknown {} {}; known: {}{}", key.name, in_quotes(value.text), fmt::join(names, ", "),
                                 near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
    }
}

const JsonValue* SectionReader::value(std::string_view key) const {
    if (value_ == nullptr) return nullptr;
    const JsonMember* member = value_->find(key);
    return member == nullptr ? nullptr : &member->value;
}

bool SectionReader::given(std::string_view key) const { return value(key) != nullptr; }

JsonPosition SectionReader::at(std::string_view key) const {
    const JsonValue* found = value(key);
    return found != nullptr ? found->at : at_;
}

JsonValue SectionReader::value_or_default(std::string_view key) const {
    const KeySpec& known = spec(key);
    if (const JsonValue* found = value(key)) return *found;
    assert(!known.default_json.empty());
    return parse_json(known.default_json, "default");
}

double SectionReader::number(std::string_view key) const { return value_or_default(key).number; }
bool SectionReader::boolean(std::string_view key) const { return value_or_default(key).boolean; }
std::string SectionReader::text(std::string_view key) const { return value_or_default(key).text; }

std::uint64_t SectionReader::integer(std::string_view key) const {
    const JsonValue found = value_or_default(key);
    return found.integer ? *found.integer : static_cast<std::uint64_t>(static_cast<std::int64_t>(found.number));
}

std::vector<double> SectionReader::numbers(std::string_view key) const {
    std::vector<double> out;
    for (const JsonValue& item : value_or_default(key).items) out.push_back(item.number);
    return out;
}

glm::dvec3 SectionReader::triple(std::string_view key) const {
    const JsonValue found = value_or_default(key);
    if (found.type == JsonType::number) return glm::dvec3(found.number);
    return {found.items[0].number, found.items[1].number, found.items[2].number};
}

SectionReader SectionReader::section(std::string_view key) const { return SectionReader(source_, key, value(key), at_); }

}  // namespace clume
