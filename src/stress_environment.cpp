// SPDX-License-Identifier: MIT
// Environment images: how often the alias table draws each texel, the directions and densities sampled, and the texel that a
// direction is looked up in, against 256 bits over the texels that the device has. A sample must lie in the texel that the
// look-up finds, and a black texel must never be drawn.
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>

#include "src/device_scene.h"
#include "src/device_values.h"
#include "src/parallel.h"
#include "src/stress_parts.h"
#include "src/stress_sampling.h"

namespace clume {
namespace {

using oracle::Real;
using oracle::Vector;

double num(const Real& r) { return static_cast<double>(r); }

struct ImageFamily {
    const char* name;
    int width, height;
    std::function<double(int column, int row, StressRandom&)> texel;
};

const std::vector<ImageFamily>& images() {
    const auto one = [](int, int, StressRandom&) { return 1.0; };
    const auto any = [](int, int, StressRandom& random) { return random.below(2) ? 0 : random.spread(1e-12, 1e12); };
    const auto some = [](int, int, StressRandom& random) { return random.spread(0.1, 10); };
    static const std::vector<ImageFamily> all{
        {"constant", 64, 32, one},
        {"one texel of 1e12, others 1e-12", 37, 19, [](int column, int row, StressRandom&) { return column == 36 && row == 7 ? 1e12 : 1e-12; }},
        {"rows at the poles alone", 61, 33, [](int, int row, StressRandom&) { return row == 0 || row == 32 ? 1.0 : 0.0; }},
        {"black rows and columns", 101, 57, [](int column, int row, StressRandom& random) { return row % 2 || column % 3 == 0 ? 0 : random.spread(1e-12, 1e12); }},
        {"half black, others 1e-12 to 1e12", 401, 257, any},
        {"1 × 1", 1, 1, one},
        {"1 × 1000", 1, 1000, some},
        {"1000 × 1", 1000, 1, some},
        {"65536 × 2", 65536, 2, some},
        {"2 × 65536, poles and equator alone", 2, 65536, [](int, int row, StressRandom&) { return row < 3 || row >= 65533 ? 1.0 : std::abs(row - 32768) < 3 ? 1e-3 : 0.0; }}};
    return all;
}

/// The image in exact arithmetic: shares of the texels and their solid angles.
struct Image256 {
    std::size_t width, height;
    std::vector<Real> share, radiance;  ///< per texel; radiance: first channel
    std::vector<Real> solid_angle;      ///< of a texel, per row
    Real sine, cosine;                  ///< of rotate_y

    Real density(std::size_t texel) const { return share[texel] / solid_angle[texel / width]; }
    /// From the pole above, rad.
    Real row_angle(std::size_t row) const { return oracle::pi() * row / height; }
    Real column_longitude(std::size_t column) const { return oracle::pi() * (1 - Real(2) * column / width); }
};

template <class Texel>
Image256 image_of(std::size_t width, std::size_t height, const Real& sine, const Real& cosine, const Texel& texel) {
    Image256 image{width, height, {}, {}, {}, sine, cosine};
    for (std::size_t row = 0; row < height; ++row) image.solid_angle.push_back(2 * oracle::pi() / width * (cos(image.row_angle(row)) - cos(image.row_angle(row + 1))));
    Real total = 0;
    for (std::size_t i = 0; i < width * height; ++i) {
        const Vector rgb = texel(i);
        image.radiance.push_back(rgb[0]);
        image.share.push_back(std::max(rgb[0], std::max(rgb[1], rgb[2])) * image.solid_angle[i / width]);
        total += image.share.back();
    }
    for (Real& s : image.share) s /= total;
    return image;
}

/// How often each texel is drawn: slot i by the whole numbers x below 2^64 with floor(x n / 2^64) = i.
std::vector<Real> drawn_shares(std::span<const device::AliasEntry> table) {
    const std::size_t n = table.size();
    const Real words = Real(0x1p64);
    std::vector<Real> share(n, Real(0));
    Real begin = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const Real end = ceil(words * (i + 1) / n), slot = (end - begin) / words, kept = table[i].other == i ? Real(1) : Real(Real(table[i].threshold) / Real(0x1p32));
        begin = end;
        share[i] += slot * kept;
        share[table[i].other] += slot * (1 - kept);
    }
    return share;
}

/// The texel that the bits draw.
std::size_t drawn_texel(std::span<const device::AliasEntry> table, const StressBits& bits) {
    const Real x = Real(bits.v[1]) * Real(0x1p32) + Real(bits.v[3]);
    const auto slot = static_cast<std::size_t>(num(floor(x * table.size() / Real(0x1p64))));
    return bits.v[2] < table[slot].threshold ? slot : table[slot].other;
}

/// From the image's own axes into the scene's.
Vector turned(const Image256& e, const Real& longitude, const Real& angle) {
    const Real r = sin(angle), x = r * sin(longitude), z = r * cos(longitude);
    return {e.cosine * x + e.sine * z, cos(angle), e.cosine * z - e.sine * x};
}

Vector sampled_direction(const Image256& e, std::size_t texel, const StressBits& more) {
    const std::size_t row = texel / e.width, column = texel % e.width;
    const Real u = stress_uniform(more.v[0]), v = stress_uniform(more.v[1]), top = cos(e.row_angle(row)), bottom = cos(e.row_angle(row + 1));
    return turned(e, oracle::pi() * (1 - 2 * (column + u) / e.width), acos(top + v * (bottom - top)));
}

/// How far d lies outside the texel, rad.
Real outside(const Image256& e, std::size_t texel, const Vector& d) {
    const std::size_t row = texel / e.width, column = texel % e.width;
    const Real x = e.cosine * d[0] - e.sine * d[2], z = e.sine * d[0] + e.cosine * d[2], r = sqrt(x * x + z * z);
    const Real angle = boost::multiprecision::atan2(r, d[1]), longitude = boost::multiprecision::atan2(x, z);
    const Real middle = (e.column_longitude(column) + e.column_longitude(column + 1)) / 2;
    Real aside = abs(longitude - middle);
    if (aside > oracle::pi()) aside = 2 * oracle::pi() - aside;
    const Real across = (aside - oracle::pi() / e.width) * sin(angle);
    return std::max(Real(0), std::max(across, std::max(Real(e.row_angle(row) - angle), Real(angle - e.row_angle(row + 1)))));
}

/// Poles, corners and edges of texels, next to the axes; else any.
device::float4 direction_to_find(const Image256& e, StressRandom& random) {
    if (random.below(3) == 0) return pack(some_direction(random));
    if (random.below(8) == 0) return pack({random.below(2) ? 0.0 : random.sign() * random.spread(1e-45, 1e-6), random.sign(), random.below(2) ? -0.0 : random.sign() * random.spread(1e-45, 1e-6)});
    const auto column = static_cast<std::size_t>(random.below(static_cast<int>(e.width + 1))), row = static_cast<std::size_t>(random.below(static_cast<int>(e.height + 1)));
    const Real off = random.below(2) ? 0 : random.sign() * random.spread(1e-9, 1e-5), along = random.uniform();
    const bool corner = random.below(2) == 0;
    const Vector d = turned(e, corner ? e.column_longitude(column) + off : Real(2 * oracle::pi() * along), e.row_angle(row) + off);
    return pack({num(d[0]), num(d[1]), num(d[2])});
}

Light make_image(const ImageFamily& f, StressRandom& random) {
    Light light;
    light.kind = LightKind::envmap;
    light.scale = random.spread(0.1, 10);
    light.rotate_y_rad = random.below(4) ? random.uniform(-7, 7) : 0;
    light.image.width = f.width, light.image.height = f.height;
    for (int row = 0; row < f.height; ++row)
        for (int column = 0; column < f.width; ++column) {
            const double value = f.texel(column, row, random);
            for (int c = 0; c < 3; ++c) light.image.rgb.push_back(static_cast<float>(value * (c == 0 ? 1 : random.uniform(0.5, 1.5))));
        }
    return light;
}

struct Errors {
    std::vector<StressError> shares, directions, pdfs, values, lookups;
    StressCount round_trip;
};

/// Every texel's share.
void judge_shares(std::span<const device::AliasEntry> table, const Image256& exact_image, const Image256& scene_image, Errors& errors) {
    const std::vector<Real> drawn = drawn_shares(table);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
        const Real share = exact_image.share[i], size = std::max(share, Real(Real(1) / drawn.size()));
        StressError e;
        e.error = share > 0 || drawn[i] == 0 ? num(abs(drawn[i] - share) / size) : INFINITY;  // of a black texel nothing may be drawn
        e.rounding = num(abs(share - scene_image.share[i]) / size);
        e.at = fmt::format("texel {}: drawn {:.9g} of {:.9g}", i, num(drawn[i]), num(share));
        errors.shares.push_back(e);
    }
}

}  // namespace

void stress_environment(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress) {
    const Limit share_limit = stated_limit("light.cl", "envmap_sample", "share"), direction_limit = stated_limit("light.cl", "envmap_sample", "direction"), lookup_limit = stated_limit("light.cl", "envmap_texel"),
                pdf_limit = stated_limit("light.cl", "light_sample", "pdf"), value_limit = stated_limit("light.cl", "light_sample", "value");
    const std::size_t n = options.quick ? 200 : 5000, scenes = options.quick ? 1 : 3;
    StressRandom random(61);
    double done = 0;
    for (const ImageFamily& f : images()) {
        Errors errors;
        for (std::size_t part = 0; part < scenes; ++part) {
            Scene scene;
            scene.camera.origin = {0, 0, 5};
            scene.render.light_sampling = LightSampling::nee;
            scene.render.strategy = "decomposition";
            Primitive ball;
            ball.axes = glm::dmat3(0.4), ball.sigma_t = 1;
            scene.media.emplace_back().primitives.push_back(ball);
            scene.lights.push_back(make_image(f, random));
            const Light& light = scene.lights[0];
            const DeviceScene packed = make_device_scene(scene, {});
            const device::LightInfo& info = packed.lights[0];
            const Real select = static_cast<double>(info.select_pdf), s = static_cast<double>(info.axis.x), c = static_cast<double>(info.axis.y), length = sqrt(s * s + c * c), turn = light.rotate_y_rad;
            const Image256 image = image_of(info.width, info.height, s / length, c / length, [&](std::size_t i) { return exact(packed.texels[i]); });
            const Image256 meant = image_of(info.width, info.height, sin(turn), cos(turn), [&](std::size_t i) {
                const Vector rgb = oracle::vector(&light.image.rgb[3 * i]);
                return Vector{rgb[0] * Real(light.scale), rgb[1] * Real(light.scale), rgb[2] * Real(light.scale)};
            });
            judge_shares(packed.alias, image, meant, errors);
            std::vector<StressBits> bits(2 * n);
            std::vector<device::float4> directions(n);
            for (std::size_t i = 0; i < n; ++i) bits[2 * i] = some_bits(random), bits[2 * i + 1] = some_bits(random), directions[i] = direction_to_find(image, random);
            const StressDevice::EnvironmentSample got = device.environment(packed, bits, directions);
            std::vector<StressError> sampled(n), pdfs(n), values(n), lookups(n);
            parallel_chunks(n, 64, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    const std::size_t texel = drawn_texel(packed.alias, bits[2 * i]);
                    const device::float4 &d = got.directions[i], &to = directions[i];
                    const auto [own, found, looked_up, unused] = got.texels[i].v;
                    const std::string at = fmt::format("turned by {:.9g}, bits {:08x} {:08x} {:08x}, more {:08x} {:08x}, texel {}: sampled {} at ({:.9g}, {:.9g}, {:.9g}), found {}, pdf {:.9g}, value {:.9g}", light.rotate_y_rad, bits[2 * i].v[1],
                                                       bits[2 * i].v[2], bits[2 * i].v[3], bits[2 * i + 1].v[0], bits[2 * i + 1].v[1], texel, own, d.x, d.y, d.z, found, d.w, got.values[i]);
                    const bool ok = all_finite({d.x, d.y, d.z, d.w, got.values[i]}) && own == texel;
                    sampled[i] = error_of(ok ? oracle::distance(exact(d), sampled_direction(image, texel, bits[2 * i + 1])) : Real(0), ok, at);
                    sampled[i].rounding = num(oracle::distance(sampled_direction(image, texel, bits[2 * i + 1]), sampled_direction(meant, texel, bits[2 * i + 1])));
                    pdfs[i] = compare_to(static_cast<double>(d.w), Real(select * image.density(texel)), pdf_limit.unit);
                    pdfs[i].rounding = num(abs(meant.density(texel) / image.density(texel) - 1));
                    values[i] = compare_to(static_cast<double>(got.values[i]), Real(image.radiance[texel] / (select * image.density(texel))), value_limit.unit);
                    values[i].rounding = num(abs(meant.radiance[texel] / image.radiance[texel] * image.density(texel) / meant.density(texel) - 1));
                    pdfs[i].at = values[i].at = at;
                    lookups[i] = error_of(outside(image, looked_up, exact(to)), looked_up < packed.texels.size(), fmt::format("turned by {:.9g}, ({:.9g}, {:.9g}, {:.9g}) in texel {}", light.rotate_y_rad, to.x, to.y, to.z, looked_up));
                    lookups[i].rounding = num(abs(image.sine * meant.cosine - image.cosine * meant.sine));
                }
            });
            for (std::size_t i = 0; i < n; ++i) errors.round_trip.add(got.texels[i].v[1] != got.texels[i].v[0], sampled[i].at);
            const auto append = [](std::vector<StressError>& to, const std::vector<StressError>& from) { to.insert(to.end(), from.begin(), from.end()); };
            append(errors.directions, sampled), append(errors.pdfs, pdfs), append(errors.values, values), append(errors.lookups, lookups);
        }
        result.rows.push_back(stress_row("environment image: share of a texel", "envmap_sample", f.name, share_limit, errors.shares, options));
        StressRow directions = stress_row("environment image: direction", "envmap_sample", f.name, direction_limit, errors.directions, options);
        directions.round_trip = errors.round_trip;
        result.rows.push_back(directions);
        result.rows.push_back(stress_row("environment image: density", "light_sample", f.name, pdf_limit, errors.pdfs, options));
        result.rows.push_back(stress_row("environment image: value", "light_sample", f.name, value_limit, errors.values, options));
        result.rows.push_back(stress_row("environment image: look-up", "envmap_texel", f.name, lookup_limit, errors.lookups, options));
        progress((done += 1) / static_cast<double>(images().size()));
    }
}

}  // namespace clume
