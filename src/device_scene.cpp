// SPDX-License-Identifier: MIT
#include "src/device_scene.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <fmt/format.h>

#include "runtime/hash.h"
#include "src/alias_table.h"
#include "src/bvh.h"
#include "src/cells.h"
#include "src/device_camera.h"
#include "src/device_grids.h"
#include "src/device_lights.h"
#include "src/error.h"
#include "src/parallel.h"

namespace clume {
namespace {

device::float4 pack(const glm::dvec3& v, double w = 0) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), static_cast<float>(w)};
}

bool is_grey(const glm::dvec3& v) { return v.x == v.y && v.y == v.z; }

float as_float(std::uint32_t bits) { return std::bit_cast<float>(bits); }

device::uint family_bit(KernelFamily k) {
    return k == KernelFamily::gaussian ? FAMILY_GAUSSIAN : k == KernelFamily::epanechnikov ? FAMILY_EPANECHNIKOV : FAMILY_UNIFORM;
}

/// Device groups out of lists of primitives: each list is cut by medium, then into sixteens.
class GroupWriter {
public:
    GroupWriter(const std::vector<Ellipsoid>& ellipsoids, DeviceScene& out) : ellipsoids_(ellipsoids), out_(out) {}

    /// Number of groups that a list (ascending, so by medium) takes.
    std::size_t count(const std::vector<std::uint32_t>& list) const {
        std::size_t groups = 0;
        for (std::size_t i = 0; i < list.size(); i += length(list, i)) ++groups;
        return groups;
    }

    void resize(std::size_t groups) {
        out_.groups.resize(groups * CLUME_GROUP_FLOATS);
        out_.group_medium.resize(groups);
    }

    void write(std::size_t group, const std::vector<std::uint32_t>& list) {
        for (std::size_t i = 0; i < list.size(); ++group) {
            const std::size_t n = length(list, i);
            float* row = out_.groups.data() + group * CLUME_GROUP_FLOATS;
            out_.group_medium[group] = ellipsoids_[list[i]].medium;
            for (std::size_t lane = 0; lane < CLUME_GROUP_SIZE; ++lane) {
                const auto put = [&](int r, float v) { row[static_cast<std::size_t>(r) * CLUME_GROUP_SIZE + lane] = v; };
                if (lane >= n) {
                    // Nothing there: far away, unlike in each axis, without extinction.
                    const float pad[] = {1e6f, 2.7e6f, -3.1e6f, 1, 0, 0, 1, 0, 1, 0, as_float(CLUME_NO_PRIMITIVE)};
                    for (int r = 0; r < CLUME_GROUP_ROWS; ++r) put(r, pad[r]);
                    continue;
                }
                const Ellipsoid& e = ellipsoids_[list[i + lane]];
                for (int k = 0; k < 3; ++k) put(CLUME_ROW_MU + k, static_cast<float>(e.center[k]));
                for (int k = 0; k < 6; ++k) put(CLUME_ROW_W + k, static_cast<float>(e.w[k]));
                put(CLUME_ROW_SIGMA, static_cast<float>(e.sigma));
                put(CLUME_ROW_ID, as_float(list[i + lane]));
            }
            i += n;
        }
    }

private:
    std::size_t length(const std::vector<std::uint32_t>& list, std::size_t i) const {
        std::size_t n = 1;
        while (n < CLUME_GROUP_SIZE && i + n < list.size() && ellipsoids_[list[i + n]].medium == ellipsoids_[list[i]].medium) ++n;
        return n;
    }
    const std::vector<Ellipsoid>& ellipsoids_;
    DeviceScene& out_;
};

/// Alias table over the bounds of a cell, into references[first, first + n).
void pack_references(const Cells::Leaf& leaf, const std::vector<Ellipsoid>& ellipsoids, device::Reference* out) {
    const std::size_t n = leaf.primitives.size();
    // Upper half of peak / bound: exact but for the rounding of the quotient, since the bound was chosen for it.
    const auto scale = [&](std::size_t i) {
        const auto quotient = static_cast<float>(ellipsoids[leaf.primitives[i]].sigma / static_cast<double>(leaf.bounds[i]));
        return (std::bit_cast<std::uint32_t>(quotient) + 0x8000u) >> 16;
    };
    std::vector<double> weight(n);
    for (std::size_t i = 0; i < n; ++i) weight[i] = static_cast<double>(leaf.bounds[i]) * static_cast<double>(n) / leaf.majorant;
    const std::vector<AliasSlot> slots = alias_table(std::move(weight));
    for (std::size_t i = 0; i < n; ++i)
        out[i] = {slots[i].threshold, leaf.primitives[i], leaf.primitives[slots[i].other], scale(i) | scale(slots[i].other) << 16};
}

/// `with_groups`: for strategies that visit every chord; `with_references`: for null collisions.
void pack_cells(const Cells& cells, bool with_groups, bool with_references, DeviceScene& out) {
    out.leaves.resize(cells.leaves.size());
    GroupWriter writer(out.ellipsoids, out);
    std::size_t groups = 0, references = 0;
    std::vector<device::uint> first_reference(with_references ? cells.leaves.size() : 0);
    for (std::size_t i = 0; i < cells.leaves.size(); ++i) {
        const Cells::Leaf& leaf = cells.leaves[i];
        device::CellLeaf& l = out.leaves[i];
        l = {};
        if (with_groups) {
            l.first_group = static_cast<device::uint>(groups);
            l.group_count = static_cast<device::uint>(writer.count(leaf.primitives));
            groups += l.group_count;
        }
        if (with_references) {
            first_reference[i] = static_cast<device::uint>(references);
            references += leaf.primitives.size();
        }
    }
    out.cells.resize(cells.table.size());
    for (std::size_t i = 0; i < cells.table.size(); ++i) {
        const device::uint link = cells.table[i];
        out.cells[i] = {link, 0, 0, 0};
        if ((link & CELL_INNER) || link < CELL_EMPTY_MAX || !with_references) continue;
        const std::size_t leaf = link - CELL_EMPTY_MAX;
        out.cells[i] = {link, static_cast<float>(cells.leaves[leaf].majorant), first_reference[leaf], static_cast<device::uint>(cells.leaves[leaf].primitives.size())};
    }
    if (std::max(groups, references) > 0x7fffffffu) throw RenderError("the cells need more than 2^31 references");
    writer.resize(groups);
    out.references.resize(references);
    parallel_chunks(cells.leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (with_groups) writer.write(out.leaves[i].first_group, cells.leaves[i].primitives);
            if (with_references) pack_references(cells.leaves[i], out.ellipsoids, out.references.data() + first_reference[i]);
        }
    });
    if (with_references) {
        out.primitives.resize(out.ellipsoids.size());
        parallel_chunks(out.ellipsoids.size(), 4096, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const Ellipsoid& e = out.ellipsoids[i];
                device::Primitive& p = out.primitives[i];
                p = {};
                for (int k = 0; k < 3; ++k) p.mu[k] = static_cast<float>(e.center[k]);
                for (int k = 0; k < 6; ++k) p.w[k] = static_cast<float>(e.w[k]);
                p.sigma = static_cast<float>(e.sigma);
                p.extent_squared = static_cast<float>(e.extent * e.extent);
                p.family = family_bit(e.family);
                p.medium = e.medium;
            }
        });
    }
    device::RenderParams& p = out.params;
    p.cells_origin = pack(cells.origin, 1.0 / cells.root_size);
    p.cells_x = cells.roots.x;
    p.cells_y = cells.roots.y;
    p.cells_z = cells.roots.z;
    p.cells_levels = cells.levels;
}

void pack_bvh(const BvhTree& tree, DeviceScene& out, std::uint32_t& stack) {
    WideBvh wide = widen(tree, out.ellipsoids);
    out.nodes = std::move(wide.nodes);
    stack = wide.stack_entries;
    GroupWriter writer(out.ellipsoids, out);
    writer.resize(wide.groups.size());
    for (std::size_t g = 0; g < wide.groups.size(); ++g) writer.write(g, wide.groups[g]);
    if (out.nodes.empty()) {
        device::BvhNode none{};
        for (auto& c : none.child) c = BVH_NONE;
        out.nodes.push_back(none);
    }
}

template <class T>
std::string hash_of(const std::vector<T>& v) {
    return sha256_hex(std::as_bytes(std::span(v)));
}

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
            const double most = std::max({p.emission.x, p.emission.y, p.emission.z});
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
        const double most = std::max({p.emission.x, p.emission.y, p.emission.z});
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
    if (!(n.radius > 0)) n.radius = 1;
    n.scale = std::exp2(-std::floor(std::log2(n.radius)));
    return n;
}

std::uint64_t DeviceScene::byte_size() const {
    return sizeof(params) + sizeof(device::CellEntry) * cells.size() + sizeof(device::CellLeaf) * leaves.size() + sizeof(device::Reference) * references.size() +
           sizeof(device::Primitive) * primitives.size() + sizeof(device::BvhNode) * nodes.size() +
           4 * groups.size() + 4 * group_medium.size() + sizeof(device::MediumInfo) * media.size() + 16 * shading.size() +
           sizeof(device::LightInfo) * lights.size() + 16 * texels.size() + sizeof(device::AliasEntry) * alias.size() +
           sizeof(device::GridInfo) * grids.size() + sizeof(device::CellEntry) * grid_cells.size() + 4 * grid_values.size();
}

std::string DeviceScene::hash() const {
    std::string all = sha256_hex(std::as_bytes(std::span(&params, 1)));
    all += hash_of(cells) + hash_of(leaves) + hash_of(references) + hash_of(primitives) + hash_of(nodes) + hash_of(groups) + hash_of(group_medium) + hash_of(media);
    all += hash_of(shading) + hash_of(lights) + hash_of(texels) + hash_of(alias);
    if (!grids.empty()) all += hash_of(grids) + hash_of(grid_cells) + hash_of(grid_values);
    return sha256_hex(all);
}

DeviceScene make_device_scene(const Scene& scene, const RenderOptions& options) {
    DeviceScene out;
    out.normalization = normalize(scene);
    const MediaTraits traits = pack_media(scene, out);
    const LightMasks lights = add_lights(scene, out);
    const RenderSettings& r = scene.render;

    // Measured (docs/design.md): null collisions under the cells' bounds are the fastest unbiased choice on every benchmark scene.
    out.strategy = r.strategy != "auto" ? r.strategy : "delta";
    out.transmittance = r.transmittance != "auto" ? r.transmittance : "analytic";
    if (out.strategy != "delta" && out.strategy != "decomposition" && out.strategy != "march")
        throw RenderError(fmt::format("{}: strategy {} is not there yet", scene.path, out.strategy));
    if (out.transmittance != "analytic" && !scene.media.empty()) throw RenderError(fmt::format("{}: transmittance {} is not there yet", scene.path, out.transmittance));

    const auto start = std::chrono::steady_clock::now();
    out.ellipsoids = make_ellipsoids(scene, out.normalization);
    const Box bounds = bounds_of(out.ellipsoids);
    out.params.bounds_min = pack(bounds.lo);
    out.params.bounds_max = pack(bounds.hi);
    const BvhTree tree = build_bvh(out.ellipsoids);
    // Null collisions fly through cells with bounds; everything that sums or inverts chords visits groups, kept by the cells
    // or by the bvh.
    const bool delta = out.strategy == "delta", chords = !delta || lights.nee;
    // Measured (docs/performance.md): the bvh is ahead for depths everywhere, and for flights where sizes are mixed.
    const bool bvh = options.accelerator == "bvh" || (options.accelerator == "auto" && chords && out.strategy != "march");
    std::uint32_t stack = 0;
    std::string accelerator;
    if (delta || !bvh) {
        CellCosts costs;
        costs.null_share = delta ? 1 : 0;
        costs.chord_share = bvh || !chords ? 0 : 1;
        const std::size_t n = out.ellipsoids.size();
        const Cells cells = build_cells(out.ellipsoids, tree, costs, std::max<std::size_t>(std::size_t{2} << 20, 8 * n));
        pack_cells(cells, chords && !bvh, delta, out);
        accelerator = fmt::format("{}x{}x{} cells, {} octree levels, {} leaves, {:.1f} references per primitive", cells.roots.x, cells.roots.y,
                                  cells.roots.z, cells.levels, cells.leaves.size(), n ? static_cast<double>(cells.references) / static_cast<double>(n) : 0.0);
    }
    if (bvh) {
        pack_bvh(tree, out, stack);
        accelerator += fmt::format("{}8-wide bvh, {} nodes, {} groups", accelerator.empty() ? "" : "; ", out.nodes.size(), out.group_medium.size());
    }
    const GridTraits voxels = pack_grids(scene, out);
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
    if (out.strategy == "march" || out.transmittance == "march") {
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
    define("CLUME_HITS", lights.hits);
    define("CLUME_VISIBLE_BACKGROUND", lights.visible_background);
    define("CLUME_CHANNELS", grey ? 1 : 3);
    define("CLUME_DEPTH_LIMIT", r.max_depth >= 0);
    define("CLUME_STRATEGY", out.strategy == "delta" ? 2 : out.strategy == "march" ? 3 : 1);
    define("CLUME_ACCEL", bvh ? 2 : 1);
    define("CLUME_COUNT", options.count_work);
    define("CLUME_MIXTURE", !out.ellipsoids.empty() || scene.grids.empty());
    define_grids(scene, voxels, out);
    if (bvh) define("CLUME_BVH_STACK", stack);
    if (!out.cells.empty()) define("CLUME_CELL_LEVELS", out.params.cells_levels);

    const auto say = [&](const char* feature, std::string what) { out.explain.emplace_back(feature, std::move(what)); };
    const std::initializer_list<const char*> kinds = {"constant", "envmap", "point", "spot", "directional", "sphere", "rectangle"};
    say("strategy", out.strategy + (r.strategy == "auto" ? " (auto)" : ""));
    say("transmittance", lights.nee ? out.transmittance + (r.transmittance == "auto" ? " (auto)" : "") : "left out: no light needs it");
    say("accelerator", accelerator);
    say("kernel families", names(traits.families, {"gaussian", "epanechnikov", "uniform"}));
    say("media", traits.one_medium ? "one kernel and extent, constants of the program" : "looked up per group");
    say("phase functions", names(traits.phases, {"isotropic", "henyey-greenstein", "rayleigh"}));
    say("g per primitive", traits.uniform_g ? "left out: one g for all" : "looked up");
    say("albedo per primitive", traits.uniform_albedo ? "left out: one albedo for all" : "looked up");
    say("emission", traits.emission == 0 ? "left out: nothing emits" : traits.emission == 1 ? "one for all" : "looked up per primitive");
    say("lights", names(lights.present, kinds));
    say("next-event estimation", lights.nee ? names(lights.nee, kinds) : "left out");
    say("lights found by paths", names(lights.hits, kinds));
    say("opaque surfaces", lights.present & (LIGHT_SPHERE | LIGHT_RECTANGLE) ? "tested on every ray" : "left out");
    say("visible background", lights.visible_background ? "yes" : "left out");
    explain_grids(scene, voxels, out);
    say("colour", grey ? "one channel: everything is grey" : "RGB");
    say("depth limit", r.max_depth >= 0 ? std::to_string(r.max_depth) : "left out");
    return out;
}

}  // namespace clume
