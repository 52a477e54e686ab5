// SPDX-License-Identifier: MIT
#include "src/device_scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/format.h>

#include "runtime/hash.h"
#include "src/bvh.h"
#include "src/cell_cache.h"
#include "src/device_camera.h"
#include "src/device_grids.h"
#include "src/device_lamps.h"
#include "src/device_lights.h"
#include "src/device_mixture.h"
#include "src/device_values.h"
#include "src/error.h"
#include "src/memory_budget.h"
#include "src/strategies.h"

namespace clume {
namespace {

std::string hash_of(const auto& array) { return sha256_hex(std::as_bytes(std::span(array))); }

/// Uniform values and tables of what varies by primitive or medium; returns whether all of it is grey.
struct MediaTraits {
    bool grey = true, uniform_albedo = true, uniform_g = true, one_medium = true;
    int emission = 0;  ///< CLUME_EMISSION
    device::uint families = 0, phases = 0;
    double brightest = 0;
};

MediaTraits pack_media(const Scene& scene, DeviceScene& out) {
    MediaTraits t;
    const Primitive* first = nullptr;
    double first_g = 0;
    bool uniform_emission = true;
    std::vector<Primitive> grids(scene.grids.size());
    for (const auto& m : scene.media) {
        const bool own_g = std::any_of(m.primitives.begin(), m.primitives.end(), [](const Primitive& p) { return p.has_g; });
        const bool hg = own_g || (m.phase.kind == PhaseKind::henyey_greenstein && m.phase.g != 0);
        const device::uint phase = m.phase.kind == PhaseKind::rayleigh ? PHASE_RAYLEIGH : hg ? PHASE_HENYEY_GREENSTEIN : PHASE_ISOTROPIC;
        out.media.push_back({family_bit(m.kernel), phase, static_cast<float>(m.extent * m.extent), static_cast<float>(m.phase.g)});
        if (m.primitives.empty()) continue;
        t.families |= family_bit(m.kernel);
        t.phases |= phase;
        for (const auto& p : m.primitives) {
            const double g = p.has_g ? static_cast<double>(p.g) : m.phase.g;
            if (!first) first = &p, first_g = g;
            t.uniform_albedo = t.uniform_albedo && p.albedo == first->albedo;
            uniform_emission = uniform_emission && p.emission == first->emission;
            t.uniform_g = t.uniform_g && g == first_g;
            t.grey = t.grey && is_grey(p.albedo) && is_grey(p.emission);
            const double most = largest(p.emission);
            t.brightest = std::max(t.brightest, most);
            if (most > 0) t.emission = 2;
        }
    }
    // A voxel medium is one more primitive, and a medium without a kernel.
    for (std::size_t i = 0; i < scene.grids.size(); ++i) {
        const GridMedium& m = scene.grids[i];
        const device::uint phase = m.phase.kind == PhaseKind::rayleigh ? PHASE_RAYLEIGH : m.phase.kind == PhaseKind::henyey_greenstein && m.phase.g != 0 ? PHASE_HENYEY_GREENSTEIN : PHASE_ISOTROPIC;
        out.media.push_back({0, phase, 0, static_cast<float>(m.phase.g)});
        t.phases |= phase;
        Primitive& p = grids[i];
        p.albedo = m.albedo;
        if (!m.emission_grid) p.emission = m.emission;
        if (!first) first = &p, first_g = m.phase.g;
        t.uniform_albedo = t.uniform_albedo && p.albedo == first->albedo;
        uniform_emission = uniform_emission && p.emission == first->emission;
        t.uniform_g = t.uniform_g && m.phase.g == first_g;
        t.grey = t.grey && is_grey(m.albedo) && is_grey(m.emission);
        const double most = largest(p.emission);
        t.brightest = std::max(t.brightest, most);
        if (most > 0) t.emission = 2;
    }
    if (t.emission && uniform_emission) t.emission = 1;
    const device::MediumInfo* same = nullptr;
    for (std::size_t i = 0; i < scene.media.size(); ++i) {
        if (scene.media[i].primitives.empty()) continue;
        const auto& info = out.media[i];
        if (same && (same->family != info.family || same->phase != info.phase || same->extent_squared != info.extent_squared)) t.one_medium = false;
        same = &info;
    }
    for (std::size_t g = 0; g < scene.grids.size(); ++g) {
        const auto& info = out.media[scene.media.size() + g];
        if (same && same->phase != info.phase) t.one_medium = false;
        same = same ? same : &info;
    }
    if (first) {
        out.params.albedo = pack(first->albedo, first_g);
        out.params.emission = pack(first->emission);
    }
    const bool per_primitive = !t.uniform_albedo || !t.uniform_g || t.emission == 2 || (!t.one_medium && t.phases != PHASE_ISOTROPIC);
    if (per_primitive) {
        for (std::size_t m = 0; m < scene.media.size(); ++m)
            for (const auto& p : scene.media[m].primitives) {
                out.shading.push_back(pack(p.albedo, p.has_g ? static_cast<double>(p.g) : scene.media[m].phase.g));
                out.shading.push_back(pack(p.emission));
                out.shading.back().w = as_float(static_cast<std::uint32_t>(m));
            }
        for (std::size_t g = 0; g < scene.grids.size(); ++g) {
            out.shading.push_back(pack(grids[g].albedo, scene.grids[g].phase.g));
            out.shading.push_back(pack(grids[g].emission));
            out.shading.back().w = as_float(static_cast<std::uint32_t>(scene.media.size() + g));
        }
    }
    if (!t.families) t.families = FAMILY_UNIFORM;
    if (!t.phases) t.phases = PHASE_ISOTROPIC;
    return t;
}

/// Of the media's bounds as a whole: where `progressive` starts.
float mean_extinction(std::span<const Ellipsoid> ellipsoids) {
    const Box box = bounds_of(ellipsoids);
    const glm::dvec3 size = box.hi - box.lo;
    double mass = 0;
    for (const Ellipsoid& e : ellipsoids) mass += e.sigma * kernel_mass(e.family, e.extent) / std::abs(e.w[0] * e.w[3] * e.w[5]);
    return static_cast<float>(std::max(mass / (size.x * size.y * size.z), 1e-20));
}

/// What the strategies of a program look things up in.
struct Structures {
    bool bvh = false;          ///< chords (decomposition, regular, analytic): groups by node
    bool cell_groups = false;  ///< chords by cell, or densities
    bool references = false;   ///< null collisions under the cells' bounds
    bool scene_bound = false;  ///< null collisions under one bound
    bool chords = false;       ///< something visits chords
};

Structures structures_of(const DeviceScene& out, bool shadow_rays, bool lamps, const RenderOptions& options) {
    const std::string &s = out.strategy, &t = out.transmittance;
    const bool segments = s == "regular" || s == "regular-linear" || s == "march-analytic";
    const bool null_transmittance = shadow_rays && (t == "ratio" || t == "residual-ratio" || (t == "binary" && s == "delta"));
    const bool null_collisions = s == "delta" || null_transmittance;
    const bool chords = segments || s == "decomposition" || (shadow_rays && (t == "analytic" || (t == "binary" && s != "delta")));
    const bool march = s == "march" || (shadow_rays && t == "march");
    Structures w;
    w.chords = chords;
    w.scene_bound = null_collisions && out.bound == "scene";
    w.references = null_collisions && !w.scene_bound;
    // Measured (docs/performance.md): the bvh is ahead for depths everywhere, and for flights where sizes are mixed.
    w.bvh = segments || options.accelerator == "bvh" || (options.accelerator == "auto" && chords && s != "march");
    w.cell_groups = w.scene_bound || s == "progressive" || (!w.bvh && (chords || march || lamps));
    return w;
}

/// Takes what is wanted from `shared`, where it is built first unless it is there; says what it is.
std::string build_structures(const Structures& wanted, const TreeSource& tree, std::optional<int> majorant_grid, bool kept_cells, SharedStructures& shared, DeviceScene& out) {
    std::string text;
    Groups groups;
    if (wanted.references || wanted.cell_groups) {
        const bool densities = wanted.scene_bound || out.strategy == "progressive";
        CellOptions o;
        o.costs.null_share = wanted.references ? 1 : 0;
        o.costs.density_share = densities ? 1 : 0;
        o.costs.chord_share = wanted.cell_groups && !densities ? 1 : 0;
        o.control = wanted.references && out.transmittance == "residual-ratio";
        o.max_references = std::max<std::size_t>(std::size_t{2} << 20, 6 * out.ellipsoids.size());
        if (out.bound == "grid" && (wanted.references || densities)) {
            o.max_levels = 0;
            o.roots = majorant_grid;
        }
        const bool share = !wanted.cell_groups && !o.control;  // one estimator alone needs control
        PackedCells packed;
        if (share && shared.cell_options == o) {
            packed = shared.cells;
        } else {
            if (share) shared.cell_options.reset(), shared.cells = {};  // one at a time in memory
            packed = pack_cells(cached_cells(out.ellipsoids, tree, o, kept_cells ? cells_folder() : std::filesystem::path()), out.ellipsoids, wanted.cell_groups, wanted.references, groups);
            if (share) shared.cell_options = o, shared.cells = packed;
        }
        out.cells = packed.cells;
        out.leaves = packed.leaves;
        out.references = packed.references;
        out.params.cells_origin = packed.origin;
        out.params.cells_x = packed.roots.x;
        out.params.cells_y = packed.roots.y;
        out.params.cells_z = packed.roots.z;
        out.params.cells_levels = packed.levels;
        text = packed.text;
    }
    if (wanted.references) {
        if (shared.primitives.empty()) shared.primitives = pack_primitives(out.ellipsoids);
        out.primitives = shared.primitives;
    }
    if (wanted.scene_bound) out.params.scene_bound = std::nextafter(static_cast<float>(std::max(scene_bound(out.ellipsoids, tree()), 1e-20)), 1e30f);
    if (out.strategy == "progressive") out.learned.assign(out.leaves.size(), mean_extinction(out.ellipsoids));
    if (wanted.bvh) {
        const bool share = groups.medium.empty();
        const PackedBvh packed = share && shared.bvh ? *shared.bvh : pack_bvh(tree(), out.ellipsoids, std::move(groups));
        if (share) shared.bvh = packed;
        out.nodes = packed.nodes;
        out.groups = packed.groups;
        out.group_medium = packed.group_medium;
        out.bvh_stack = packed.stack;
        text += fmt::format("{}8-wide bvh, {} nodes", text.empty() ? "" : "; ", out.nodes.size());
    } else {
        out.groups = std::move(groups.rows);
        out.group_medium = std::move(groups.medium);
    }
    if (!out.group_medium.empty()) text += fmt::format(", {} groups", out.group_medium.size());
    return text;
}

std::string names(device::uint bits, std::initializer_list<const char*> all) {
    std::string s;
    for (const char* name : all) {
        if (bits & 1) s += (s.empty() ? "" : ", ") + std::string(name);
        bits >>= 1;
    }
    return s.empty() ? "none" : s;
}

}  // namespace

Normalization normalize(const Scene& scene) {
    Box box{glm::dvec3(1e300), glm::dvec3(-1e300)};
    const auto add = [&](const glm::dvec3& p, const glm::dvec3& half) {
        box.lo = glm::min(box.lo, p - half);
        box.hi = glm::max(box.hi, p + half);
    };
    for (const auto& m : scene.media)
        for (const auto& p : m.primitives)
            add(p.center, m.extent * glm::sqrt(p.axes[0] * p.axes[0] + p.axes[1] * p.axes[1] + p.axes[2] * p.axes[2]));
    for (const auto& m : scene.grids) {
        for (const glm::dvec3& p : grid_corners(m.density, m.interpolation)) add(p, glm::dvec3(0));
        if (!m.emission_grid) continue;
        for (const glm::dvec3& p : grid_corners(*m.emission_grid, m.interpolation)) add(p, glm::dvec3(0));
    }
    for (const auto& l : scene.lights) {
        if (l.kind == LightKind::sphere) add(l.center, glm::dvec3(l.radius));
        if (l.kind == LightKind::rectangle)
            for (int k = 0; k < 4; ++k) add(l.corner + (k & 1 ? l.edge_u : glm::dvec3(0)) + (k & 2 ? l.edge_v : glm::dvec3(0)), glm::dvec3(0));
    }
    Normalization n;
    if (box.lo.x > box.hi.x) return n;
    n.center = 0.5 * (box.lo + box.hi);
    n.radius = 0.5 * glm::length(box.hi - box.lo);
    if (!std::isfinite(n.radius)) throw SceneError(fmt::format("{}: what is in the scene reaches too far for double precision", scene.path));
    if (!(n.radius > 0)) n.radius = 1;
    n.scale = std::exp2(-std::floor(std::log2(n.radius)));
    return n;
}

std::uint64_t DeviceScene::byte_size() const {
    return sizeof(params) + sizeof(device::CellEntry) * cells.size() + sizeof(device::CellLeaf) * leaves.size() + sizeof(device::Reference) * references.size() + 8 * learned.size() +
           sizeof(device::Primitive) * primitives.size() + sizeof(device::BvhNode) * nodes.size() +
           4 * groups.size() + 4 * group_medium.size() + sizeof(device::MediumInfo) * media.size() + 16 * shading.size() +
           sizeof(device::LightInfo) * lights.size() + 16 * texels.size() + sizeof(device::AliasEntry) * alias.size() +
           sizeof(device::GridInfo) * grids.size() + sizeof(device::CellEntry) * grid_cells.size() + 4 * grid_values.size();
}

std::string DeviceScene::hash() const {
    device::RenderParams seedless = params;
    seedless.seed_lo = seedless.seed_hi = 0;
    std::string all = sha256_hex(std::as_bytes(std::span(&seedless, 1)));
    all += hash_of(cells) + hash_of(leaves) + hash_of(references) + hash_of(primitives) + hash_of(nodes) + hash_of(groups) + hash_of(group_medium) + hash_of(media);
    all += hash_of(shading) + hash_of(lights) + hash_of(texels) + hash_of(alias);
    if (!grids.empty()) all += hash_of(grids) + hash_of(grid_cells) + hash_of(grid_values);
    return sha256_hex(all);
}

/// Without structures, what the scene itself is: every primitive, nothing to find one by.
static DeviceScene pack_scene(const Scene& scene, const RenderOptions& options, bool with_structures) {
    DeviceScene out;
    out.normalization = normalize(scene);
    const MediaTraits traits = pack_media(scene, out);
    const LightMasks lights = add_lights(scene, out, with_structures);
    const RenderSettings& r = scene.render;

    const MethodPair asked = options.pair.value_or(MethodPair{r.strategy, r.transmittance, r.bound});
    out.strategy = asked.strategy != "auto" ? asked.strategy : "delta";
    out.transmittance = asked.estimator != "auto" ? asked.estimator : "analytic";
    out.bound = asked.bound != "auto" ? asked.bound : out.strategy == "progressive" || r.majorant_grid ? "grid" : "tree";
    const auto start = std::chrono::steady_clock::now();
    std::uint64_t primitives = 0;
    for (const auto& m : scene.media) primitives += m.primitives.size();
    SharedStructures own;
    SharedStructures& shared = options.shared ? *options.shared : own;
    if (memory_in_use() > memory_limit() / 2) shared = {};  // better built again than too much
    if (shared.ellipsoids.empty()) {
        require_memory(scene.path, {{"primitives for the device", primitives * (sizeof(Ellipsoid) + sizeof(device::Primitive))}, {"tree over them", primitives * 2 * sizeof(BvhTree::Node)}});
        shared.ellipsoids = make_ellipsoids(scene, out.normalization);
    }
    out.ellipsoids = shared.ellipsoids;
    const auto tree = [&]() -> const BvhTree& { return shared.tree ? *shared.tree : shared.tree.emplace(build_bvh(out.ellipsoids)); };
    const std::size_t lamps = with_structures && (lights.nee & (LIGHT_POINT | LIGHT_SPOT)) ? mark_lamps(scene, tree(), out) : 0;
    const Structures wanted = with_structures ? structures_of(out, lights.nee != 0, lamps > 0, options) : Structures{};
    std::string accelerator;
    if (with_structures) accelerator = build_structures(wanted, tree, r.majorant_grid, options.kept_cells, shared, out);
    else out.primitives = pack_primitives(out.ellipsoids);
    const GridTraits voxels = pack_grids(scene, asked.bound, out);
    Box bounds = bounds_of(out.ellipsoids);
    if (lamps > 0)  // the mixture alone needs no more than its own
        for (const auto& box : out.grid_boxes)
            for (const glm::dvec3& corner : box) {
                const glm::dvec3 p = (corner - out.normalization.center) * out.normalization.scale;
                bounds = {glm::min(bounds.lo, p - 0x1p-18), glm::max(bounds.hi, p + 0x1p-18)};
            }
    out.params.bounds_min = pack(bounds.lo);
    out.params.bounds_max = pack(bounds.hi);
    out.accelerator_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

    const double brightest = std::max({lights.brightest, traits.brightest, voxels.brightest});
    device::RenderParams& p = out.params;
    p.film_scale = static_cast<float>(std::exp2(-std::clamp(std::floor(std::log2(std::max(brightest, 1e-30))), -100.0, 100.0)));
    p.film_width = static_cast<device::uint>(scene.film.width);
    p.seed_lo = static_cast<device::uint>(r.seed);
    p.seed_hi = static_cast<device::uint>(r.seed >> 32);
    p.light_count = static_cast<device::uint>(out.lights.size());
    p.max_depth = r.max_depth;
    p.rr_depth = r.rr_depth;
    if (out.strategy == "march" || out.strategy == "march-analytic" || out.transmittance == "march") {
        double step = r.step.value_or(0);
        if (!r.step) {
            step = out.normalization.radius;
            for (const auto& m : scene.media)
                for (const auto& q : m.primitives)
                    for (int k = 0; k < 3; ++k) step = std::min(step, glm::length(q.axes[k]) / 4);
            step = std::min(step, voxels.voxel_edge / 2);
        }
        const double least = out.normalization.radius * 0x1p-20;
        if (r.step && step < least)
            throw SceneError(fmt::format("{}: render.step {:g} is too small for a scene of radius {:g}: at least {:g}", scene.path, step, out.normalization.radius, least));
        p.march_step = static_cast<float>(std::max(step, least) * out.normalization.scale);
    }
    set_camera(scene, out);

    const bool grey = traits.grey && lights.grey;
    const auto define = [&](const char* name, long long value) { out.defines.emplace_back(name, std::to_string(value)); };
    define("CLUME_FAMILIES", traits.families);
    define("CLUME_ONE_MEDIUM", traits.one_medium);
    if (traits.one_medium) {
        float e2 = 9;
        for (std::size_t i = 0; i < scene.media.size(); ++i)
            if (!scene.media[i].primitives.empty()) e2 = out.media[i].extent_squared;
        out.defines.emplace_back("CLUME_EXTENT_SQUARED", fmt::format("{:.9e}f", e2));
    }
    define("CLUME_PHASES", traits.phases);
    define("CLUME_UNIFORM_G", traits.uniform_g);
    define("CLUME_UNIFORM_ALBEDO", traits.uniform_albedo);
    define("CLUME_EMISSION", traits.emission);
    define("CLUME_LIGHTS", lights.present);
    define("CLUME_NEE", lights.nee);
    define("CLUME_LAMPS", lamps > 0);
    define("CLUME_HITS", lights.hits);
    define("CLUME_VISIBLE_BACKGROUND", lights.visible_background);
    define("CLUME_CHANNELS", grey ? 1 : 3);
    define("CLUME_DEPTH_LIMIT", r.max_depth >= 0);
    define("CLUME_STRATEGY", find_strategy(out.strategy)->program);
    define("CLUME_TRANSMITTANCE", find_estimator(out.transmittance)->program);
    define("CLUME_SCENE_BOUND", out.bound == "scene");
    if (r.root_finding == "bisection") define("CLUME_BISECTION", 1);
    define("CLUME_SOBOL", r.sobol);
    define("CLUME_ACCEL", wanted.bvh ? 2 : 1);
    define("CLUME_COUNT", options.count_work || out.strategy == "progressive");  // its look-ups are reported
    // Null collisions under the cells' bounds look at one primitive at a time: vectors are of rays, not of primitives.
    out.lanes = out.strategy == "delta" && out.bound != "scene" && scene.grids.empty() && lamps == 0 && !options.count_work;
    define("CLUME_LANES", out.lanes);
    if (wanted.bvh) define("CLUME_BVH_STACK", std::max(1u, out.bvh_stack));  // OpenCL C knows no empty arrays
    define("CLUME_MIXTURE", !out.ellipsoids.empty() || scene.grids.empty());
    define_grids(scene, voxels, out);
    if (!out.cells.empty()) define("CLUME_CELL_LEVELS", options.most_pixels > 0 ? 8 : out.params.cells_levels);  // a pilot's bounds share a program

    const auto say = [&](const char* feature, std::string what) { out.explain.emplace_back(feature, std::move(what)); };
    const std::initializer_list<const char*> kinds = {"constant", "envmap", "point", "spot", "directional", "sphere", "rectangle"};
    say("strategy", out.strategy + (asked.strategy == "auto" ? " (auto)" : ""));
    say("transmittance", lights.nee ? out.transmittance + (asked.estimator == "auto" ? " (auto)" : "") : "left out: no light needs it");
    if (wanted.references || wanted.scene_bound || out.strategy == "progressive") say("bound of null collisions", out.bound);
    say("accelerator", accelerator);
    say("kernel families", names(traits.families, {"gaussian", "epanechnikov", "uniform"}));
    say("media", traits.one_medium ? "one kernel and extent, constants of the program" : "looked up per group");
    say("phase functions", names(traits.phases, {"isotropic", "henyey-greenstein", "rayleigh"}));
    say("g per primitive", traits.uniform_g ? "left out: one g for all" : "looked up");
    say("albedo per primitive", traits.uniform_albedo ? "left out: one albedo for all" : "looked up");
    say("emission", traits.emission == 0 ? "left out: nothing emits" : traits.emission == 1 ? "one for all" : "looked up per primitive");
    say("lights", names(lights.present, kinds));
    say("next-event estimation", lights.nee ? names(lights.nee, kinds) : "left out");
    if (lights.nee & (LIGHT_POINT | LIGHT_SPOT)) say("lights amid medium", lamps > 0 ? fmt::format("{}: what scatters near them is sampled on its own", lamps) : "none");
    say("lights found by paths", names(lights.hits, kinds));
    say("opaque surfaces", lights.present & (LIGHT_SPHERE | LIGHT_RECTANGLE) ? "tested on every ray" : "left out");
    say("visible background", lights.visible_background ? "yes" : "left out");
    explain_grids(scene, voxels, out);
    say("colour", grey ? "one channel: everything is grey" : "RGB");
    say("sampler", r.sobol ? "sobol: random numbers spread evenly over a pixel's samples" : "independent");
    say("depth limit", r.max_depth >= 0 ? std::to_string(r.max_depth) : "left out");
    return out;
}

DeviceScene make_device_scene(const Scene& scene, const RenderOptions& options) { return pack_scene(scene, options, true); }

std::string scene_hash(const Scene& scene, const RenderOptions& options) {
    const DeviceScene packed = pack_scene(scene, options, false);
    std::string all = packed.hash();
    for (const auto& [name, value] : packed.defines) all += " " + name + "=" + value;
    return sha256_hex(all);
}

}  // namespace clume
