// SPDX-License-Identifier: MIT
// The scene file as a whole: overrides, camera, film, render settings, lights, and what holds between sections.
// Keys and their ranges are in scene_schema.cpp; here stands only what a range can't say.
#include "src/scene_reader.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <new>

#include "src/environment_reader.h"
#include "src/error.h"
#include "src/grid_reader.h"
#include "src/input_file.h"
#include "src/media_reader.h"
#include "src/medium_keys.h"
#include "src/memory_budget.h"
#include "src/scene_schema.h"
#include "src/voxel_grid.h"

namespace clume {

namespace {

using Path = std::filesystem::path;

/// Below this sine two directions count as parallel.
constexpr double parallel_sine = 1e-9;

bool parallel(const glm::dvec3& a, const glm::dvec3& b) {
    return !(glm::length(glm::cross(a, b)) > parallel_sine * glm::length(a) * glm::length(b));
}

// --- overrides

void mark(JsonValue& value, int index) {
    value.at.override_index = index;
    for (JsonValue& item : value.items) mark(item, index);
    for (JsonMember& member : value.members) {
        member.at.override_index = index;
        mark(member.value, index);
    }
}

JsonValue override_value(const SceneSource& source, const Override& given, int index) {
    JsonValue value;
    try {
        value = parse_json(given.value, "value");
    } catch (const SceneError& error) {
        const JsonPosition at{1, 1, index};
        // What looks like JSON was meant to be; anything else is a word.
        if (given.value.empty() || std::string_view("[{\"").find(given.value.front()) != std::string_view::npos)
            source.fail(at, fmt::format("broken JSON: {}", error.what()));
        value.type = JsonType::string;
        value.text = given.value;
    }
    mark(value, index);
    return value;
}

JsonValue empty_section(int index) {
    JsonValue section;
    section.type = JsonType::object;
    section.at.override_index = index;
    return section;
}

void apply_override(JsonValue& root, const SceneSource& source, const Override& given, int index) {
    const JsonPosition at{1, 1, index};
    JsonValue value = override_value(source, given, index);
    JsonValue* place = &root;
    std::string_view left = given.key, done;
    while (true) {
        const auto end = std::min(left.find('.'), left.size());
        const std::string_view key = left.substr(0, end);
        if (key.empty()) source.fail(at, fmt::format("{} is not a dotted path of keys", in_quotes(given.key)));
        if (place->type == JsonType::array) {
            std::size_t item = 0;
            const auto read = std::from_chars(key.data(), key.data() + key.size(), item);
            if (read.ec != std::errc() || read.ptr != key.data() + key.size())
                source.fail(at, fmt::format("{} is a list: expected an index, not {}", in_quotes(done), in_quotes(key)));
            if (item > place->items.size())
                source.fail(at, fmt::format("{} has {} items, no item {}", in_quotes(done), place->items.size(), item));
            if (item == place->items.size()) place->items.push_back(empty_section(index));
            place = &place->items[item];
        } else if (place->type == JsonType::object) {
            JsonMember* member = place->find(key);
            if (member == nullptr) {
                JsonValue made = empty_section(index);
                if (place == &root && (key == "media" || key == "lights")) made.type = JsonType::array;
                place->members.push_back({std::string(key), at, std::move(made)});
                member = &place->members.back();
            }
            place = &member->value;
        } else {
            source.fail(at,
                        fmt::format("{} is {}, it has no {}", in_quotes(done), json_type_name(place->type), in_quotes(key)));
        }
        done = std::string_view(given.key).substr(0, done.size() + (done.empty() ? 0 : 1) + end);
        if (end == left.size()) break;
        left.remove_prefix(end + 1);
    }
    *place = std::move(value);
}

// --- sections

Camera read_camera(const SectionReader& section) {
    Camera camera;
    camera.origin = section.triple("origin");
    camera.target = section.triple("target");
    camera.up = section.triple("up");
    if (section.variant() == "orthographic") {
        camera.kind = CameraKind::orthographic;
        camera.width = section.number("width");
    } else {
        camera.fov_rad = glm::radians(section.number("fov"));
    }
    const glm::dvec3 view = camera.target - camera.origin;
    if (!(glm::length(view) > 0)) section.fail("target", "the camera's target must not be its origin");
    if (!std::isfinite(glm::length(view))) section.fail("target", "the camera's target is too far from its origin for double precision");
    if (!(glm::length(camera.up) > 0)) section.fail("up", "\"up\" must not be zero");
    if (parallel(view, camera.up))
        section.fail(section.given("up") ? "up" : "target", "\"up\" is parallel to the view direction");
    return camera;
}

Film read_film(const SectionReader& section) {
    Film film;
    film.width = static_cast<int>(section.integer("width"));
    film.height = static_cast<int>(section.integer("height"));
    constexpr double bytes_per_pixel = 256;  // sums, squares and the images made of them
    const double needed = bytes_per_pixel * film.width * film.height, held = static_cast<double>(machine_memory());
    if (needed > held)
        section.fail(film.width >= film.height ? "width" : "height",
                     fmt::format("a film of {} x {} needs {:.1f} GB of memory; this machine has {:.1f}", film.width,
                                 film.height, needed * 1e-9, held * 1e-9));
    return film;
}

RenderSettings read_render(const SectionReader& section) {
    RenderSettings out;
    out.spp = static_cast<std::uint32_t>(section.integer("spp"));
    out.seed = section.integer("seed");
    out.max_depth = static_cast<int>(static_cast<std::int64_t>(section.integer("max_depth")));
    out.rr_depth = static_cast<int>(section.integer("rr_depth"));
    out.strategy = section.text("strategy");
    out.transmittance = section.text("transmittance");
    out.bound = section.text("bound");
    if (section.given("majorant_grid")) out.majorant_grid = static_cast<int>(section.integer("majorant_grid"));
    out.root_finding = section.text("root_finding");
    out.sobol = section.text("sampler") == "sobol";
    const std::string sampling = section.text("light_sampling");
    out.light_sampling = sampling == "nee"     ? LightSampling::nee
                         : sampling == "phase" ? LightSampling::phase
                                               : LightSampling::mis;
    if (section.given("step")) out.step = section.number("step");
    return out;
}

Light read_light(const SectionReader& section, const Path& folder) {
    Light light;
    const std::string& kind = section.variant();
    if (kind == "constant") {
        light.kind = LightKind::constant;
        light.radiance = section.triple("radiance");
        light.visible_to_camera = section.boolean("visible_to_camera");
    } else if (kind == "envmap") {
        light.kind = LightKind::envmap;
        light.scale = section.number("scale");
        light.rotate_y_rad = glm::radians(section.number("rotate_y"));
        light.visible_to_camera = section.boolean("visible_to_camera");
        light.image = read_environment(find_asset(section, "file", folder));
    } else if (kind == "point") {
        light.kind = LightKind::point;
        light.position = section.triple("position");
        light.intensity = section.triple("intensity");
    } else if (kind == "spot") {
        light.kind = LightKind::spot;
        light.position = section.triple("position");
        light.target = section.triple("target");
        light.intensity = section.triple("intensity");
        const double beam = section.number("beam"), cutoff = section.number("cutoff");
        light.beam_rad = glm::radians(beam);
        light.cutoff_rad = glm::radians(cutoff);
        if (beam > cutoff)
            section.fail(section.given("beam") ? "beam" : "cutoff",
                         fmt::format("\"beam\" {} must be at most \"cutoff\" {}", beam, cutoff));
        if (!(glm::length(light.target - light.position) > 0))
            section.fail("target", "the spot's target must not be its position");
    } else if (kind == "directional") {
        light.kind = LightKind::directional;
        light.direction = section.triple("direction");
        light.irradiance = section.triple("irradiance");
        if (!(glm::length(light.direction) > 0) || !std::isfinite(glm::length(light.direction)))
            section.fail("direction", "\"direction\" must not be zero");
    } else if (kind == "sphere") {
        light.kind = LightKind::sphere;
        light.center = section.triple("center");
        light.radius = section.number("radius");
        light.radiance = section.triple("radiance");
    } else {
        light.kind = LightKind::rectangle;
        light.corner = section.triple("corner");
        light.edge_u = section.triple("edge_u");
        light.edge_v = section.triple("edge_v");
        light.radiance = section.triple("radiance");
        for (const char* key : {"edge_u", "edge_v"})
            if (!(glm::length(section.triple(key)) > 0)) section.fail(key, fmt::format("\"{}\" must not be zero", key));
        if (parallel(light.edge_u, light.edge_v)) section.fail("edge_v", "\"edge_u\" and \"edge_v\" are parallel");
    }
    return light;
}

/// What the files that a scene names hold in memory together; a scene can name one file a thousand times.
class AssetMemory {
  public:
    explicit AssetMemory(const SceneSource& source) : source_(source) {}
    void add(const JsonPosition& at, std::uint64_t byte_size) {
        held_ += byte_size;
        if (held_ > physical_memory_bytes() / 2)
            source_.fail_asset(at, fmt::format("the files up to here hold {:.1f} GB, and half of this machine's memory is {:.1f}",
                                               static_cast<double>(held_) * 1e-9, static_cast<double>(physical_memory_bytes()) * 0.5e-9));
    }

  private:
    const SceneSource& source_;
    std::uint64_t held_ = 0;
};

/// Whether any (1 − albedo) L_e is above zero.
bool emits(const EllipsoidMedium& medium) {
    if (medium.density_scale == 0) return false;
    for (const Primitive& p : medium.primitives)
        for (int c = 0; c < 3; ++c)
            if ((1 - p.albedo[c]) * p.emission[c] > 0) return true;
    return false;
}

/// Whether there is density that emits, or any value in the emission grid, times something.
bool emits(const GridMedium& medium) {
    const bool any_colour = glm::any(glm::greaterThan(medium.emission, glm::dvec3(0)));
    if (medium.emission_grid) return any_colour && sample_range(*medium.emission_grid).second > 0;
    return medium.density_scale > 0 && glm::any(glm::greaterThan((1.0 - medium.albedo) * medium.emission, glm::dvec3(0))) &&
           sample_range(medium.density).second > 0;
}

Scene build_scene(const JsonValue& root, const SceneSource& source, const Path& name) {
    const SectionReader top(source, "scene", &root, root.at);
    const Path folder = name.parent_path();
    Scene scene;
    scene.path = name.string();
    scene.camera = read_camera(top.section("camera"));
    scene.film = read_film(top.section("film"));
    const SectionReader render = top.section("render");
    scene.render = read_render(render);

    AssetMemory memory(source);
    // Lights first: they are cheap to read, and so their mistakes are told before a large file is loaded.
    if (const JsonValue* lights = top.value("lights"))
        for (const JsonValue& item : lights->items) {
            const SectionReader section(source, "lights", &item, lights->at);
            scene.lights.push_back(read_light(section, folder));
            memory.add(item.at, scene.lights.back().image.rgb.size() * sizeof(float));
            const LightKind kind = scene.lights.back().kind;
            if (scene.render.light_sampling == LightSampling::phase &&
                (kind == LightKind::point || kind == LightKind::spot || kind == LightKind::directional))
                render.fail("light_sampling",
                            fmt::format("\"light_sampling\" phase cannot find a {} light; use mis or nee", section.variant()));
        }
    std::size_t primitives = 0;
    bool emission = false;
    if (const JsonValue* media = top.value("media"))
        for (const JsonValue& item : media->items) {
            const SectionReader section(source, "media", &item, item.at);
            if (section.variant() == "grid") {
                scene.grids.push_back(read_grid(section, folder));
                const GridMedium& grid = scene.grids.back();
                memory.add(item.at, byte_size(grid.density) + (grid.emission_grid ? byte_size(*grid.emission_grid) : 0));
                emission = emission || emits(scene.grids.back());
                continue;
            }
            scene.media.push_back(read_ellipsoids(section, folder));
            emission = emission || emits(scene.media.back());
            primitives += scene.media.back().primitives.size();
            memory.add(item.at, scene.media.back().primitives.size() * sizeof(Primitive));
            if (primitives > most_primitives) source.fail(item.at, "more primitives than 32-bit numbers can name");
        }
    if (scene.lights.empty() && !emission)
        source.fail(top.at("lights"), "no light, no emission and no opaque surface: nothing to see");
    return scene;
}

}  // namespace

Scene parse_scene(std::string_view text, const Path& name, std::span<const Override> overrides) {
    SceneSource source{name.string(), {}};
    for (const Override& given : overrides) {
        std::string label = given.key + "=" + given.value;
        for (char& c : label)
            if (static_cast<unsigned char>(c) < 0x20) c = ' ';  // a message is one line
        source.overrides.push_back(std::move(label));
    }
    try {
        JsonValue root = parse_json(text, source.file);
        for (std::size_t i = 0; i < overrides.size(); ++i) apply_override(root, source, overrides[i], static_cast<int>(i));
        return build_scene(root, source, name);
    } catch (const std::bad_alloc&) {
        throw SceneError(fmt::format("{}: the scene does not fit in memory", source.file));
    }
}

Scene read_scene(const Path& file, std::span<const Override> overrides) {
    return parse_scene(read_file_bytes(file), file, overrides);
}

}  // namespace clume
