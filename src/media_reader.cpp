// SPDX-License-Identifier: MIT
// Ellipsoid media. Mass and opacity become peak extinction from a primitive's own scales, before the transform, which
// then moves centres and axes and leaves the peak as it is (scene.md, *media*; ∫K as in physics.md's table).
#include "src/media_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

#include "src/ellipsoid.h"
#include "src/error.h"
#include "src/medium_keys.h"
#include "src/memory_budget.h"
#include "src/ply_reader.h"

namespace clume {

namespace {

constexpr double pi = std::numbers::pi;

/// What a medium's own keys say about each of its primitives.
struct MediumContext {
    EllipsoidMedium& medium;
    Transform transform;
    bool is_mass = false;
    std::optional<glm::dvec3> albedo, emission;
};

/// Depth through the centre of a primitive of unit scale and peak [physics.md].
double central_depth(KernelFamily kernel, double extent) {
    switch (kernel) {
        case KernelFamily::gaussian:
            return std::sqrt(2 * pi);
        case KernelFamily::epanechnikov:
            return 4 * extent / 3;
        case KernelFamily::uniform:
            return 2 * extent;
    }
    return 0;
}

/// Lower triangular L with Σ = L Lᵀ; empty if Σ is not positive definite.
std::optional<glm::dmat3> cholesky(const std::vector<double>& c) {
    const double xx = c[0], xy = c[1], xz = c[2], yy = c[3], yz = c[4], zz = c[5];
    // Pivots that are rounding of the entries they come from are not positive either.
    constexpr double rounding = 4e-16;
    if (!(xx > 0)) return std::nullopt;
    const double l00 = std::sqrt(xx), l10 = xy / l00, l20 = xz / l00, p1 = yy - l10 * l10;
    if (!(p1 > rounding * yy)) return std::nullopt;
    const double l11 = std::sqrt(p1), l21 = (yz - l20 * l10) / l11, p2 = zz - l20 * l20 - l21 * l21;
    if (!(p2 > rounding * zz)) return std::nullopt;
    return glm::dmat3(l00, l10, l20, 0, l11, l21, 0, 0, std::sqrt(p2));
}

glm::dmat3 scaled_rotation(const glm::dvec4& wxyz, const glm::dvec3& scale) {
    const glm::dmat3 r = glm::mat3_cast(glm::dquat(wxyz.x, wxyz.y, wxyz.z, wxyz.w));
    return {r[0] * scale.x, r[1] * scale.y, r[2] * scale.z};
}

/// Adds a primitive given in the medium's own coordinates; `peak` is extinction there. False if it leaves the range of
/// double precision.
bool add_primitive(MediumContext& context, Primitive primitive, double peak) {
    if (peak == 0) {
        ++context.medium.dropped;
        return true;
    }
    primitive.sigma_t = peak;
    primitive.center = context.transform.linear * primitive.center + context.transform.translate;
    primitive.axes = context.transform.linear * primitive.axes;
    if (context.albedo) primitive.albedo = *context.albedo;
    if (context.emission) primitive.emission = *context.emission;
    const double determinant = glm::determinant(primitive.axes);
    if (!std::isfinite(peak) || !std::isfinite(determinant) || determinant == 0 ||
        !std::isfinite(glm::dot(primitive.center, glm::dvec3(1))))
        return false;
    context.medium.primitives.push_back(primitive);
    return true;
}

/// To float, staying inside (−1, 1).
float own_g(double g) {
    const float most = std::nextafter(1.0f, 0.0f);
    return std::clamp(static_cast<float>(g), -most, most);
}

double peak_of(const MediumContext& context, double density, double scale_product) {
    const EllipsoidMedium& m = context.medium;
    return context.is_mass ? density / (scale_product * kernel_mass(m.kernel, m.extent)) : density;
}

void read_list(MediumContext& context, const SectionReader& medium) {
    const JsonValue& list = *medium.value("primitives");
    if (list.items.size() > most_primitives) medium.fail("primitives", "more primitives than 32-bit numbers can name");
    context.medium.primitives.reserve(list.items.size());
    for (std::size_t i = 0; i < list.items.size(); ++i) {
        const SectionReader section(medium.source(), "primitive", &list.items[i], list.at);
        const auto fail = [&](std::string_view key, const std::string& what) {
            section.fail(key, fmt::format("primitive {}: {}", i, what));
        };
        Primitive p;
        p.center = section.triple("center");
        double scale_product = 0;
        if (section.given("covariance")) {
            for (const char* key : {"scale", "rotation"})
                if (section.given(key)) fail(key, fmt::format("\"{}\" and \"covariance\" exclude each other", key));
            const auto axes = cholesky(section.numbers("covariance"));
            if (!axes) fail("covariance", "the covariance is not positive definite");
            p.axes = *axes;
            scale_product = glm::determinant(p.axes);
        } else {
            if (!section.given("scale")) fail("", "missing key \"scale\" or \"covariance\"");
            const glm::dvec3 scale = section.triple("scale");
            const auto q = section.numbers("rotation");
            glm::dvec4 rotation(q[0], q[1], q[2], q[3]);
            const double largest = std::max(std::max(std::abs(q[0]), std::abs(q[1])), std::max(std::abs(q[2]), std::abs(q[3])));
            if (!(largest > 0)) fail("rotation", "zero quaternion");
            p.axes = scaled_rotation(glm::normalize(rotation / largest), scale);
            scale_product = scale.x * scale.y * scale.z;
        }
        p.albedo = section.triple("albedo");
        p.emission = section.triple("emission");
        if (section.given("g")) {
            if (context.medium.phase.kind == PhaseKind::rayleigh)
                fail("g", "its own \"g\" has no meaning in a Rayleigh medium");
            p.g = own_g(section.number("g"));
            p.has_g = true;
        }
        const double density = section.number("density");
        if (!add_primitive(context, p, density == 0 ? 0 : peak_of(context, density, scale_product)))
            fail("", "scale, position or density is outside double precision");
    }
}

void read_file(MediumContext& context, const SectionReader& medium, const std::filesystem::path& path) {
    PlyOptions options;
    options.scale = medium.text("scale_encoding") == "linear" ? ScaleEncoding::linear : ScaleEncoding::log;
    if (medium.given("density_encoding"))
        options.density = medium.text("density_encoding") == "opacity" ? DensityEncoding::opacity : DensityEncoding::extinction;
    options.read_albedo = !context.albedo;
    options.read_emission = !context.emission;
    const EllipsoidMedium& m = context.medium;
    const double depth_per_peak = central_depth(m.kernel, m.extent);
    read_ply(path, options, [&](const PlyEllipsoid& e, std::size_t index, std::size_t count) {
        if (index == 0) {
            require_memory(path.string(), {{"primitives", count * sizeof(Primitive)}});
            context.medium.primitives.reserve(count);
        }
        if (e.g && m.phase.kind == PhaseKind::rayleigh)
            medium.fail("phase",
                        fmt::format("Rayleigh phase, but the primitives of {} have their own g", in_quotes(path.string())));
        Primitive p;
        p.center = e.center;
        p.axes = scaled_rotation(e.rotation, e.scale);
        p.albedo = e.albedo;
        p.emission = e.emission;
        p.g = own_g(e.g.value_or(0));
        p.has_g = e.g.has_value();
        const double scale_product = e.scale.x * e.scale.y * e.scale.z;
        const double peak = e.density == 0       ? 0
                            : e.density_is_depth ? e.density / (depth_per_peak * std::cbrt(scale_product))
                                                 : peak_of(context, e.density, scale_product);
        if (!add_primitive(context, p, peak))
            throw SceneError(
                fmt::format("{}: primitive {}: scale, position or density is outside double precision", path.string(), index));
    });
}

}  // namespace

EllipsoidMedium read_ellipsoids(const SectionReader& section, const std::filesystem::path& folder) {
    EllipsoidMedium medium;
    const std::string kernel = section.text("kernel");
    medium.kernel = kernel == "gaussian"  ? KernelFamily::gaussian
                    : kernel == "uniform" ? KernelFamily::uniform
                                          : KernelFamily::epanechnikov;
    medium.extent = section.given("extent")                       ? section.number("extent")
                    : medium.kernel == KernelFamily::gaussian     ? 3
                    : medium.kernel == KernelFamily::epanechnikov ? std::sqrt(7.0)
                                                                  : std::sqrt(5.0);
    medium.density_scale = section.number("density_scale");
    medium.phase = read_phase(section);
    MediumContext context{medium, read_transform(section), section.text("normalization") == "mass", {}, {}};
    if (section.given("albedo")) context.albedo = section.triple("albedo");
    if (section.given("emission")) context.emission = section.triple("emission");

    const bool from_file = section.given("file"), from_list = section.given("primitives");
    if (from_file && from_list) section.fail("primitives", "\"file\" and \"primitives\" exclude each other");
    if (!from_file && !from_list) section.source().fail(section.at(), "missing key \"file\" or \"primitives\" in media");
    if (from_list) {
        for (const char* key : {"scale_encoding", "density_encoding"})
            if (section.given(key)) section.fail(key, fmt::format("\"{}\" speaks about a file, and there is none", key));
        medium.source = "scene";
        read_list(context, section);
    } else {
        const std::filesystem::path path = find_asset(section, "file", folder);
        medium.source = path.string();
        read_file(context, section, path);
    }
    return medium;
}

}  // namespace clume
