// SPDX-License-Identifier: MIT
// Makes the files of the shipped scenes: plume.ply, fire.ply, cloud.ply and sky.exr, into the folder given.
// The same bytes everywhere: own random numbers, no std distributions, no two draws in one expression (their order would be
// the compiler's), and every value is rounded to 16 significant bits, so that last-bit differences between maths libraries
// don't show. Sizes are support radii in world units; files hold natural logs of scales (support radius / extent).
#include <ImfArray.h>
#include <ImfRgbaFile.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using glm::dquat;
using glm::dvec3;
using std::numbers::pi;

/// SplitMix64 (Steele et al., doi 10.1145/2660193.2660195).
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    /// In [0, 1).
    double uniform() {
        std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }
    double uniform(double a, double b) { return a + (b - a) * uniform(); }
    /// Mean 0, variance 1, within ±6: the sum of twelve.
    double bell() {
        double sum = -6;
        for (int i = 0; i < 12; ++i) sum += uniform();
        return sum;
    }
    /// Uniform on the sphere.
    dvec3 direction() {
        const double z = uniform(-1, 1), phi = uniform(0, 2 * pi), r = std::sqrt(1 - z * z);
        return {r * std::cos(phi), z, r * std::sin(phi)};
    }

  private:
    std::uint64_t state_;
};

/// A divergence-free velocity field of zero mean and about unit size: a sum of plane shear waves.
class Swirl {
  public:
    Swirl(std::uint64_t seed, double frequency) {
        Random random(seed);
        for (Wave& w : waves_) {
            const double detail = std::exp(random.uniform(-0.7, 0.7));
            w.k = random.direction() * frequency * detail;
            w.a = glm::normalize(glm::cross(w.k, random.direction())) * std::sqrt(2.0 / static_cast<double>(waves_.size()));
            w.phase = random.uniform(0, 2 * pi);
        }
    }
    dvec3 operator()(const dvec3& x) const {
        dvec3 v(0);
        for (const Wave& w : waves_) v += w.a * std::sin(glm::dot(w.k, x) + w.phase);
        return v;
    }

  private:
    struct Wave {
        dvec3 k, a;
        double phase;
    };
    std::array<Wave, 24> waves_;
};

/// One ellipsoid: semi-axes of its support, the first along `rotation` times x.
struct Puff {
    dvec3 center, radii;
    dquat rotation{1, 0, 0, 0};
    double sigma_t = 1;
    dvec3 albedo{0}, emission{0};
    int level = 0;

    double radius() const { return (radii.x + radii.y + radii.z) / 3; }
    /// 1 on the surface, 0 at the centre.
    double level_set(const dvec3& p) const { return glm::length((glm::conjugate(rotation) * (p - center)) / radii); }
};

/// Turns x to `direction` (any length), with `roll` radians about it.
dquat along(const dvec3& direction, double roll) {
    const dvec3 d = glm::normalize(direction);
    const dquat arc = d.x < -0.9999 ? dquat(0, 0, 1, 0) : glm::normalize(dquat(1 + d.x, glm::cross(dvec3(1, 0, 0), d)));
    return arc * dquat(std::cos(roll / 2), std::sin(roll / 2), 0, 0);
}

struct Growth {
    int tries;                 ///< candidates on each parent
    double smallest, largest;  ///< radius of a child over its parent's
    double spacing;            ///< least distance of two children over the sum of their radii
    double gap;                ///< share of the surface left bare, in patches
    double sigma_t;
};

/// Puffs on the visible surface of the puffs that are there (those of the last level bear them): cauliflower.
template <typename Keep>
void grow(std::vector<Puff>& puffs, const Growth& how, const Swirl& swirl, Random& random, const Keep& keep) {
    const std::size_t parents = puffs.size();
    const int level = puffs.back().level;
    for (std::size_t i = 0; i < parents; ++i) {
        const Puff parent = puffs[i];
        if (parent.level != level) continue;
        for (int k = 0; k < how.tries; ++k) {
            const dvec3 on_ball = random.direction();
            const double size = parent.radius() * random.uniform(how.smallest, how.largest);
            const double sink = random.uniform(0.72, 0.92), stretch = std::exp(random.uniform(0.0, 0.35)),
                         roll = random.uniform(0, 2 * pi);
            Puff child;
            child.center = parent.center + parent.rotation * (parent.radii * on_ball * sink);
            if (swirl(child.center * 1.7).y < how.gap) continue;
            const bool buried = std::any_of(
                puffs.begin(), puffs.begin() + static_cast<std::ptrdiff_t>(parents),
                [&](const Puff& p) { return p.level_set(child.center) < 1 - 0.6 * size / p.radius() && p.radius() > size; });
            const bool crowded = std::any_of(
                puffs.begin() + static_cast<std::ptrdiff_t>(parents), puffs.end(),
                [&](const Puff& p) { return glm::distance(p.center, child.center) < how.spacing * (p.radius() + size); });
            if (buried || crowded) continue;
            child.radii = size * dvec3(stretch, 1.0, 1 / stretch);
            child.rotation = along(swirl(child.center) + dvec3(0, 0.6, 0), roll);
            child.sigma_t = how.sigma_t * random.uniform(0.7, 1.3);
            child.level = level + 1;
            if (keep(child)) puffs.push_back(child);
        }
    }
}

/// Thin shreds torn off the surface: carried a way along the swirl, stretched along it.
void shred(std::vector<Puff>& puffs, std::size_t count, double reach, double sigma_t, const Swirl& swirl, Random& random) {
    const std::size_t sources = puffs.size();
    for (std::size_t i = 0; i < count; ++i) {
        Puff p = puffs[std::min(sources - 1, static_cast<std::size_t>(random.uniform() * static_cast<double>(sources)))];
        p.center += random.direction() * p.radius();
        const int steps = 1 + static_cast<int>(random.uniform() * 8);
        for (int s = 0; s < steps; ++s) p.center += swirl(p.center) * (reach / 8);
        const double size = std::clamp(p.radius(), 0.025, 0.05) * random.uniform(0.5, 1.2);
        p.radii = size * dvec3(2.2, 0.8, 0.55);
        p.rotation = along(swirl(p.center), random.uniform(0, 2 * pi));
        p.sigma_t = sigma_t * random.uniform(0.3, 1.0) * (1 - steps / 10.0);
        puffs.push_back(p);
    }
}

double smooth(double a, double b, double x) {
    const double t = std::clamp((x - a) / (b - a), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// An eruption column, base at y = 0, top near 4: stacked vortex rings around a core, ash-brown below, white on top.
std::vector<Puff> make_plume() {
    struct Ring {
        double y, radius, tube;
        int count;
    };
    constexpr std::array<Ring, 11> rings{{{-0.25, 0.26, 0.34, 6},
                                          {0.1, 0.2, 0.28, 6},
                                          {0.5, 0.2, 0.3, 6},
                                          {0.95, 0.27, 0.34, 6},
                                          {1.4, 0.3, 0.36, 7},
                                          {1.85, 0.34, 0.42, 7},
                                          {2.3, 0.42, 0.44, 8},
                                          {2.75, 0.62, 0.52, 9},
                                          {3.15, 0.82, 0.52, 11},
                                          {3.5, 0.62, 0.55, 8},
                                          {3.8, 0.25, 0.5, 4}}};
    Random random(2024);
    const Swirl swirl(7, 3.0);
    const auto axis = [](double y) {
        return dvec3(0.05 * y * y - 0.1 + 0.1 * std::sin(1.9 * y), y, 0.08 * std::sin(1.3 * y + 1));
    };
    std::vector<Puff> puffs;
    const auto lobe = [&](const dvec3& at, double size) {
        Puff p;
        p.center = at;
        const double thin = random.uniform(0.8, 1.0), wide = random.uniform(0.9, 1.25);
        p.radii = size * dvec3(wide, 1.0, thin);
        p.rotation = along(swirl(at) + dvec3(0, 0.8, 0), random.uniform(0, 2 * pi));
        p.sigma_t = 14;
        puffs.push_back(p);
    };
    for (const Ring& ring : rings) {
        const double turn = random.uniform(0, 2 * pi);
        lobe(axis(ring.y), ring.radius + 0.5 * ring.tube);
        for (int i = 0; i < ring.count; ++i) {
            const double phi = turn + 2 * pi * (i + random.uniform(-0.3, 0.3)) / ring.count,
                         out = ring.radius * random.uniform(0.75, 1.25);
            const double y = ring.y + ring.tube * random.uniform(-0.55, 0.55);
            lobe(axis(y) + dvec3(out * std::cos(phi), 0, out * std::sin(phi)), ring.tube * random.uniform(0.65, 1.2));
        }
    }
    const auto all = [](const Puff&) { return true; };
    grow(puffs, {60, 0.38, 0.62, 0.55, -0.9, 20}, swirl, random, all);
    grow(puffs, {34, 0.36, 0.58, 0.6, -0.7, 28}, swirl, random, all);
    grow(puffs, {30, 0.34, 0.52, 0.62, -0.5, 36}, swirl, random, [](const Puff& p) { return p.radius() > 0.018; });
    shred(puffs, 600, 0.5, 6, swirl, random);
    for (Puff& p : puffs) {
        const double age = smooth(0.2, 3.0, p.center.y + 0.25 * swirl(p.center * 0.4).x);
        const double soot = p.level == 0 ? 0.75 : 1.0;  // the unseen inside is dark: short paths
        p.albedo = soot * glm::mix(dvec3(0.84, 0.78, 0.72), dvec3(0.972, 0.968, 0.962), age);
    }
    return puffs;
}

/// The hue of a glowing body, hottest first: white-yellow, orange, deep red.
dvec3 glow(double heat) { return {1.6 * smooth(0.0, 0.6, heat), 1.1 * smooth(0.12, 1.05, heat), 0.5 * smooth(0.5, 1.2, heat)}; }

/// A fire on a bed of about unit width: tongues are streamlines of a rising, narrowing, ever more turbulent flow.
std::vector<Puff> make_fire() {
    Random random(451);
    const Swirl swirl(11, 3.2), fine(12, 8.5);
    std::vector<Puff> puffs;
    struct Flame {
        dvec3 root;
        double height, share;
    };
    constexpr std::array<Flame, 6> flames{{{{0, 0, 0}, 1.45, 0.3},
                                           {{-0.3, 0, 0.08}, 1.0, 0.5},
                                           {{0.32, 0, -0.05}, 1.15, 0.68},
                                           {{0.12, 0, -0.28}, 0.85, 0.8},
                                           {{-0.5, 0, -0.1}, 0.55, 0.9},
                                           {{0.52, 0, 0.05}, 0.6, 1.0}}};
    for (int tongue = 0; tongue < 320; ++tongue) {
        const double pick = (tongue + 0.5) / 320;
        const Flame& flame = *std::find_if(flames.begin(), flames.end(), [&](const Flame& f) { return pick < f.share; });
        const double phi = random.uniform(0, 2 * pi), out = std::sqrt(random.uniform());
        const dvec3 side(std::cos(phi), 0, std::sin(phi));
        dvec3 at = flame.root + side * (0.1 * out) + dvec3(0, 0.1 * flame.root.x * flame.root.x + random.uniform(0.0, 0.16), 0);
        const double life = flame.height * (1.3 - 0.6 * out) * random.uniform(0.6, 1.25), width = random.uniform(0.035, 0.07);
        const int steps = 8 + static_cast<int>(12 * life);
        for (int s = 0; s < steps; ++s) {
            const double t = (s + 0.5) / steps;
            const dvec3 inward = (flame.root - at) * dvec3(1, 0, 1);  // a flame swells, then narrows
            const dvec3 v = dvec3(0, 0.45 + 0.55 * smooth(0, 0.3, t), 0) + side * (out * 0.75 * (1 - smooth(0.05, 0.4, t))) +
                            inward * (1.6 * smooth(0.2, 0.6, t)) + swirl(at) * (0.1 + 0.3 * at.y) +
                            fine(at) * (0.1 + 0.4 * at.y);
            const double step = 1.7 * life / steps, thick = width * 2.2 * std::sqrt((t + 0.05) * (1.02 - t)) + 0.004;
            Puff p;
            p.center = at + v * (step / 2);
            p.radii = {1.5 * step * std::max(0.5, glm::length(v)), 1.6 * thick, 0.8 * thick};
            p.rotation = along(v, phi + 2.5 * t);
            const double heat = std::clamp(
                1.12 - 0.55 * at.y / (0.35 + 0.55 * life) - 0.35 * t * t - 0.3 * out + 0.1 * random.bell(), 0.14, 1.2);
            p.sigma_t = 8 * (0.3 + 0.7 * heat);
            p.albedo = dvec3(0.12);
            p.emission = glow(heat);
            puffs.push_back(p);
            at += v * step;
        }
    }
    for (int i = 0; i < 420; ++i) {  // smoke, darker than the flames it rolls off
        const double z = 0.2 * random.bell(), y = random.uniform(1.1, 1.8), x = 0.2 * random.bell();
        dvec3 at(x, y, z);
        const int steps = static_cast<int>(random.uniform() * 24);
        for (int s = 0; s < steps; ++s) at += (dvec3(0.12, 0.8, 0) + swirl(at * 0.8) * 0.55 + fine(at) * 0.2) * 0.09;
        Puff p;
        p.center = at;
        const double size = (0.07 + 0.09 * (at.y - 1.0)) * random.uniform(0.7, 1.4);
        p.radii = size * dvec3(1.5, 1.0, 0.8);
        p.rotation = along(swirl(at * 0.8) + dvec3(0, 0.7, 0), random.uniform(0, 2 * pi));
        p.sigma_t = 0.45 / size * random.uniform(0.5, 1.3);
        p.albedo = dvec3(0.62, 0.58, 0.55);
        puffs.push_back(p);
    }
    for (int i = 0; i < 150; ++i) {  // sparks
        const double z = 0.3 * random.bell(), y = random.uniform(0.2, 1.2), x = 0.3 * random.bell();
        dvec3 at(x, y, z);
        dvec3 v(0);
        const int steps = static_cast<int>(random.uniform() * 30);
        for (int s = 0; s <= steps; ++s) at += (v = dvec3(0, 0.9, 0) + swirl(at) * 0.7 + fine(at) * 0.5) * 0.06;
        Puff p;
        p.center = at;
        const double stretch = random.uniform(1.0, 3.5), size = random.uniform(0.006, 0.012);
        p.radii = size * dvec3(stretch, 1, 1);
        p.rotation = along(v, 0);
        p.sigma_t = 400;
        p.albedo = dvec3(0.1);
        p.emission = dvec3(2.2, 0.8, 0.15) * random.uniform(0.4, 1.0);
        puffs.push_back(p);
    }
    return puffs;
}

/// A fair-weather cumulus, flat base at y = 0, about 4 wide, hollow around the point (0.1, 0.62, 0) where a light may stand.
std::vector<Puff> make_cloud() {
    Random random(1803);  // Luke Howard named the clouds
    const Swirl swirl(21, 2.6);
    const dvec3 hollow(0.1, 0.62, 0);
    const double hollow_radius = 0.3;
    std::vector<Puff> puffs;
    const auto keep = [&](const Puff& p) {
        return p.center.y - 0.55 * p.radius() > -0.05 && glm::distance(p.center, hollow) > hollow_radius + p.radii.x;
    };
    for (int i = 0; puffs.size() < 90 && i < 4000; ++i) {
        Puff p;
        const double x = 0.8 * random.bell(), z = 0.42 * random.bell();
        const double roof =
            1.35 * std::exp(-0.9 * (x - 0.1) * (x - 0.1) - 1.8 * z * z) * (1 + 0.35 * swirl({x, 0.3, z}).x) + 0.15;
        const double size = random.uniform(0.2, 0.46) * (0.55 + 0.45 * std::min(1.0, roof));
        p.center = {x, random.uniform(0.4 * size, std::max(0.45 * size, roof)), z};
        const double thin = random.uniform(0.8, 1.0), wide = random.uniform(1.0, 1.3);
        p.radii = size * dvec3(wide, 1.0, thin);
        const double roll = random.uniform(0, 2 * pi), rise = 0.2 * random.bell(), turn = random.bell();
        p.rotation = along({1, rise, turn}, roll);
        p.sigma_t = 4;
        if (std::abs(x) < 2 && keep(p)) puffs.push_back(p);
    }
    grow(puffs, {50, 0.36, 0.6, 0.55, -0.9, 8}, swirl, random, keep);
    grow(puffs, {30, 0.36, 0.56, 0.6, -0.6, 13}, swirl, random, keep);
    grow(puffs, {12, 0.36, 0.55, 0.7, -0.1, 18}, swirl, random, [&](const Puff& p) { return keep(p) && p.radius() > 0.018; });
    shred(puffs, 300, 0.3, 4, swirl, random);
    std::erase_if(puffs, [&](const Puff& p) { return glm::distance(p.center, hollow) < hollow_radius + p.radii.x; });
    return puffs;
}

/// To 16 significant bits, to the nearest.
float rounded(double value) {
    int exponent;
    const double fraction = std::frexp(value, &exponent);
    return static_cast<float>(std::ldexp(std::nearbyint(std::ldexp(fraction, 16)), exponent - 16));
}

void write_ply(const std::filesystem::path& path, const std::vector<Puff>& puffs, double extent, bool with_albedo,
               bool with_emission) {
    std::string names = "x y z scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 sigma_t";
    if (with_albedo) names += " albedo_0 albedo_1 albedo_2";
    if (with_emission) names += " emission_0 emission_1 emission_2";
    std::string bytes =
        "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(puffs.size()) + "\nproperty float ";
    for (const char c : names) bytes += c == ' ' ? std::string("\nproperty float ") : std::string(1, c);
    bytes += "\nend_header\n";
    const auto put = [&](double value) {
        const auto word = std::bit_cast<std::uint32_t>(rounded(value));
        for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 255);
    };
    const auto put_all = [&](const dvec3& v) { put(v.x), put(v.y), put(v.z); };
    for (const Puff& p : puffs) {
        put_all(p.center);
        put_all(glm::log(p.radii / extent));
        put(p.rotation.w), put_all({p.rotation.x, p.rotation.y, p.rotation.z});
        put(p.sigma_t);
        if (with_albedo) put_all(p.albedo);
        if (with_emission) put_all(p.emission);
    }
    std::ofstream file(path, std::ios::binary);
    if (!file.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush())
        throw std::runtime_error("cannot write " + path.string());
    std::printf("%s: %zu ellipsoids, %zu bytes\n", path.c_str(), puffs.size(), bytes.size());
}

/// A clear sky that only depends on elevation, so one texel wide: blue above, pale towards the horizon, dim ground below.
void write_sky(const std::filesystem::path& path) {
    constexpr int rows = 2048;
    Imf::Array2D<Imf::Rgba> texels(rows, 1);
    for (int row = 0; row < rows; ++row) {
        const double elevation = (0.5 - (row + 0.5) / rows) * pi, up = std::max(0.0, std::sin(elevation));
        const dvec3 zenith(0.10, 0.21, 0.46), horizon(0.62, 0.60, 0.58), ground(0.10, 0.095, 0.09);
        dvec3 sky = glm::mix(zenith, horizon, std::exp(-3.6 * up));
        sky += dvec3(0.22, 0.10, 0.01) * std::exp(-11 * up);
        sky = glm::mix(ground, sky, smooth(-0.12, 0.0, elevation));
        texels[row][0] = Imf::Rgba(static_cast<float>(sky.x), static_cast<float>(sky.y), static_cast<float>(sky.z), 1.0f);
    }
    Imf::RgbaOutputFile file(path.c_str(), 1, rows, Imf::WRITE_RGB, 1, {0, 0}, 1, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
    file.setFrameBuffer(&texels[0][0], 1, 1);
    file.writePixels(rows);
    std::printf("%s: %d x 1 texels\n", path.c_str(), rows);
}

}  // namespace

int main(int argc, char** argv) try {
    if (argc != 2) throw std::runtime_error("usage: clume_scenes FOLDER");
    const std::filesystem::path folder = argv[1];
    const double epanechnikov = std::sqrt(7.0), gaussian = 3;
    write_ply(folder / "plume.ply", make_plume(), epanechnikov, true, false);
    write_ply(folder / "fire.ply", make_fire(), gaussian, true, true);
    write_ply(folder / "cloud.ply", make_cloud(), epanechnikov, false, false);
    write_sky(folder / "sky.exr");
    return 0;
} catch (const std::exception& error) {
    std::fprintf(stderr, "clume_scenes: %s\n", error.what());
    return 1;
}
