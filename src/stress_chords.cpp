// SPDX-License-Identifier: MIT
// Intersections, densities, optical depths and free flights of one primitive, for all families and kernels.
// Chord ends are judged by how far the point lies from the exact surface. What depends on where a line lies (depth, flight,
// density) is right if it is exact for some line moved by no more than the intersection's own limit, to within the limit of
// its function: float knows no better where things are. The relative error with nothing forgiven stands beside it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/device_mixture.h"
#include "src/parallel.h"
#include "src/stress_families.h"
#include "src/stress_lines.h"
#include "src/stress_parts.h"

namespace clume {
namespace {

using oracle::Real;
using oracle::Vector;

constexpr double kUlp = 0x1p-23;  ///< of positions

double num(const Real& r) { return static_cast<double>(r); }
Real real(float v) { return Real(static_cast<double>(v)); }

struct Limits {
    Limit ends = stated_limit("ellipsoid.cl", "intersect"), quadratic = stated_limit("ellipsoid.cl", "intersect_quadratic"), density = stated_limit("ellipsoid.cl", "density_part"),
          depth = stated_limit("ellipsoid.cl", "depth_part"), additivity = stated_limit("ellipsoid.cl", "depth_part", "additivity"),
          monotonicity = stated_limit("ellipsoid.cl", "depth_part", "monotonicity"), flight = stated_limit("ellipsoid.cl", "flight_part");
    double quadratic_ratio = stated_number("ellipsoid.cl", "intersect_quadratic", "axis ratios up to");
};

/// All that the device says about one family's cases, lane 0 of every group.
struct Answers {
    std::vector<ProbeChord> used, quadratic, naive, naive_flights, density, first, second, flights, early, late;
    std::vector<ProbeChord> rising[3];
};

struct Ends {
    double t_in, t_out;
    bool hit() const { return t_in < static_cast<double>(kStressNever); }
};

/// What one case gave.
struct Findings {
    StressError ends, quadratic, density, depth, flight;
    bool lost[2]{}, invented[2]{}, judged = true, hit = false, collides = false;
    bool lost_flight = false, invented_flight = false, not_additive = false, not_monotone = false, no_round_trip = false;
    double naive_depth = NAN, naive_flight = NAN;  ///< relative, nothing forgiven
};

struct Work {
    const ChordFamily& family;
    KernelFamily kernel;
    std::vector<ChordCase> cases;
    std::vector<ProbeGroupRay> rays, density_rays;
    std::vector<float> middles;
    Answers answers;
};

StressError ends_error(const oracle::Ellipsoid256& e, const oracle::Line256& line, const ChordCase& c, const Ends& got, bool& lost, bool& invented) {
    StressError out;
    const Vector o = oracle::vector(c.ray.origin), d = oracle::vector(c.ray.direction);
    if (!std::isfinite(got.t_in) || !std::isfinite(got.t_out)) {
        out.nonfinite = true;
        out.error = INFINITY;
        return out;
    }
    lost = line.hit() && !got.hit();
    invented = !line.hit() && got.hit();
    if (lost || invented) out.error = num(line.tangency()) / kUlp;
    if (line.hit() && got.hit()) {
        const Real r = sqrt(e.e2);
        out.error = num(std::max(e.surface_distance(oracle::along(o, d, Real(got.t_in)), r), e.surface_distance(oracle::along(o, d, Real(got.t_out)), r))) / kUlp;
        const double off = std::max(std::abs(num(Real(got.t_in) - line.t_in())), std::abs(num(Real(got.t_out) - line.t_out())));
        out.relative = off / std::max(std::abs(num(line.t_in())), std::abs(num(line.t_out())));
        out.ulp = off / kUlp;
    }
    return out;
}

/// Rows of Σ⁻¹ in place of W, and the ellipsoid that those floats are; false if they are none.
bool quadratic_of(const ChordCase& c, std::vector<float>& lane, oracle::Ellipsoid256& e) {
    const auto& w = c.scene.w;
    const Real s[6] = {w[0] * w[0], w[0] * w[1], w[0] * w[2], w[1] * w[1] + w[3] * w[3], w[1] * w[2] + w[3] * w[4], w[2] * w[2] + w[4] * w[4] + w[5] * w[5]};
    lane = c.lane;
    Real f[6];
    for (std::size_t k = 0; k < 6; ++k) {
        lane[CLUME_ROW_W + k] = static_cast<float>(s[k]);
        f[k] = Real(static_cast<double>(lane[CLUME_ROW_W + k]));
    }
    e = c.device;
    const Real d0 = f[0];
    if (!(d0 > 0)) return false;
    e.w[0] = sqrt(d0), e.w[1] = f[1] / e.w[0], e.w[2] = f[2] / e.w[0];
    const Real d1 = f[3] - e.w[1] * e.w[1];
    if (!(d1 > 0)) return false;
    e.w[3] = sqrt(d1), e.w[4] = (f[4] - e.w[1] * e.w[2]) / e.w[3];
    const Real d2 = f[5] - e.w[2] * e.w[2] - e.w[4] * e.w[4];
    if (!(d2 > 0)) return false;
    e.w[5] = sqrt(d2);
    return true;
}

Findings judge(const Work& work, std::size_t i, const Limits& limits) {
    const ChordCase& c = work.cases[i];
    const Answers& a = work.answers;
    const ProbeGroupRay& ray = c.ray;
    const double shift = limits.ends.value * kUlp;
    const Vector o = oracle::vector(ray.origin), d = oracle::vector(ray.direction);
    const oracle::Line256 line(c.device, o, d), scene_line(c.scene, o, d);
    Findings f;
    f.hit = line.hit();

    f.ends = ends_error(c.device, line, c, {static_cast<double>(a.used[i].t_in[0]), static_cast<double>(a.used[i].t_out[0])}, f.lost[0], f.invented[0]);
    if (scene_line.hit() && line.hit()) f.ends.rounding = num(c.device.surface_distance(oracle::along(o, d, scene_line.t_in()), sqrt(c.device.e2))) / kUlp;
    bool ignored[2];
    f.ends.naive = ends_error(c.device, line, c, {static_cast<double>(a.naive[i].t_in[0]), static_cast<double>(a.naive[i].t_out[0])}, ignored[0], ignored[1]).error;
    std::vector<float> lane;
    oracle::Ellipsoid256 q;
    const bool ellipsoid = quadratic_of(c, lane, q);
    f.judged = ellipsoid && c.ratio <= limits.quadratic_ratio;
    if (!ellipsoid) f.quadratic.error = NAN;
    if (ellipsoid) {
        const oracle::Line256 q_line(q, o, d);
        f.quadratic = ends_error(q, q_line, c, {static_cast<double>(a.quadratic[i].t_in[0]), static_cast<double>(a.quadratic[i].t_out[0])}, f.lost[1], f.invented[1]);
        if (q_line.hit() && scene_line.hit()) f.quadratic.rounding = num(q.surface_distance(oracle::along(o, d, scene_line.t_in()), sqrt(q.e2))) / kUlp;
    }

    {
        const ProbeGroupRay& r = work.density_rays[i];
        float p[3];
        for (int k = 0; k < 3; ++k) p[k] = std::fma(r.t0, r.direction[k], r.origin[k]);
        const Vector point = oracle::vector(p);
        const Real exact = c.device.density_at(point);
        const double got = static_cast<double>(a.density[i].density[0]);
        f.density = compare_to(got, exact, LimitUnit::relative);
        if (!f.density.nonfinite) f.density.error = beyond_range(c.device.density_near(point, shift), got, kStressFloor * std::max(1.0, num(c.device.sigma)));
        const Real rounded = c.scene.density_at(point);
        f.density.rounding = rounded > 0 ? num(abs(exact - rounded) / rounded) : NAN;
    }

    const Real t0 = real(ray.t0), t1 = real(ray.t1), exact = line.depth(t0, t1);
    const double got = static_cast<double>(a.used[i].depth[0]);
    f.depth = compare_to(got, exact, LimitUnit::relative);
    const oracle::Range range = line.depth_near(t0, t1, shift, line.brief() ? kUlp * std::abs(num(line.t_perp)) : 0);
    if (!f.depth.nonfinite) f.depth.error = beyond_range(range, got, kStressFloor);
    const Real rounded = scene_line.depth(t0, t1);
    if (rounded > 0) f.depth.rounding = num(abs(exact - rounded) / rounded);
    const double naive = static_cast<double>(a.naive[i].depth[0]);
    f.depth.naive = std::isfinite(naive) ? beyond_range(range, naive, kStressFloor) : INFINITY;
    if (exact > Real(kStressFloor)) f.naive_depth = std::isfinite(naive) ? num(abs(Real(naive) - exact) / exact) : INFINITY;
    f.not_additive = std::abs(static_cast<double>(a.first[i].depth[0]) + static_cast<double>(a.second[i].depth[0]) - got) > limits.additivity.value * got + kStressFloor * std::max(1.0, 8 * c.density);
    float before = a.first[i].depth[0];
    for (const auto& rise : a.rising) {
        f.not_monotone = f.not_monotone || static_cast<double>(rise[i].depth[0]) < static_cast<double>(before) * (1 - limits.monotonicity.value);
        before = rise[i].depth[0];
    }

    const Real t = line.invert(t0, real(ray.tau));
    f.collides = t >= 0 || a.flights[i].flight[0] < kStressNever;
    double relative = NAN, naive_relative = NAN;
    f.flight = flight_error(line, t0, real(ray.tau), static_cast<double>(a.flights[i].flight[0]), shift, relative);
    f.flight.relative = relative;
    if (f.flight.nonfinite) return f;
    f.flight.naive = flight_error(line, t0, real(ray.tau), static_cast<double>(a.naive_flights[i].flight[0]), shift, naive_relative).error;
    f.naive_flight = t >= 0 && a.naive_flights[i].flight[0] >= kStressNever ? 1 : naive_relative;
    f.lost_flight = t >= 0 && a.flights[i].flight[0] >= kStressNever;
    f.invented_flight = t < 0 && a.flights[i].flight[0] < kStressNever;
    if (t >= 0 && a.flights[i].flight[0] < kStressNever) f.flight.ulp = std::abs(num(Real(static_cast<double>(a.flights[i].flight[0])) - t)) / kUlp;
    const Real scene_t = scene_line.invert(t0, real(ray.tau));
    if (t >= 0 && scene_t >= 0) f.flight.rounding = num(abs(line.depth(t0, scene_t) - real(ray.tau)) / real(ray.tau));
    if (a.flights[i].flight[0] < kStressNever) {
        const double tau = static_cast<double>(ray.tau), blur = line.brief() ? num(2 * kUlp * abs(line.t_perp) / line.reach()) : 0, e = limits.flight.value + limits.depth.value + blur;
        // A flight that ends as near the exit as the exit is known has been judged by the lines beside it.
        const bool at_exit = a.flights[i].flight[0] + static_cast<float>(shift) >= a.flights[i].t_out[0];
        f.no_round_trip = static_cast<double>(a.early[i].depth[0]) > tau * (1 + e) + kStressFloor || (!at_exit && static_cast<double>(a.late[i].depth[0]) < tau * (1 - e));
    }
    return f;
}

void ask_device(StressDevice& device, Work& w, StressRandom& random, double shift) {
    Probe& probe = device.probe();
    std::vector<std::vector<float>> lanes, squares(w.cases.size());
    for (std::size_t i = 0; i < w.cases.size(); ++i) {
        lanes.push_back(w.cases[i].lane);
        oracle::Ellipsoid256 e;
        if (!quadratic_of(w.cases[i], squares[i], e)) squares[i][CLUME_ROW_W] = squares[i][CLUME_ROW_W + 3] = squares[i][CLUME_ROW_W + 5] = 1;
    }
    const std::vector<float> groups = pack_groups(lanes);
    const device::uint bit = family_bit(w.kernel);
    const auto e2 = static_cast<float>(num(w.cases.front().device.e2));
    const auto ask = [&](const std::vector<ProbeGroupRay>& rays) { return probe.groups(rays, groups, bit, e2); };
    for (const ChordCase& c : w.cases) w.rays.push_back(c.ray);
    Answers& a = w.answers;
    a.used = ask(w.rays);
    a.quadratic = probe.groups(w.rays, pack_groups(squares), bit, e2, true);
    a.naive = device.naive(w.rays, groups, bit, e2);
    std::vector<ProbeGroupRay> open = w.rays;  // flights end where the chord does
    for (ProbeGroupRay& r : open) r.t1 = kStressNever;
    a.flights = ask(open);
    a.naive_flights = device.naive(open, groups, bit, e2);

    // Splits and density points inside the chord, as the device sees it.
    std::vector<ProbeGroupRay> first = w.rays, second = w.rays, early = w.rays, late = w.rays, rising[3] = {w.rays, w.rays, w.rays};
    w.density_rays = w.rays;
    for (std::size_t i = 0; i < w.rays.size(); ++i) {
        const ProbeChord& c = a.used[i];
        const ProbeGroupRay& r = w.rays[i];
        float begin = r.t0, end = std::min(r.t1, 4.0f);
        if (c.t_in[0] < kStressNever) begin = std::max(begin, c.t_in[0]), end = std::min(end, c.t_out[0]);
        const double part = random.below(2) ? random.uniform() : random.spread(1e-4, 1);
        float middle = static_cast<float>(static_cast<double>(begin) + part * (static_cast<double>(end) - static_cast<double>(begin)));
        middle = std::clamp(middle, r.t0, std::max(r.t0, r.t1));
        w.middles.push_back(middle);
        first[i].t1 = second[i].t0 = middle;
        rising[0][i].t1 = std::nextafter(middle, kStressNever);
        rising[1][i].t1 = std::nextafter(rising[0][i].t1, kStressNever);
        rising[2][i].t1 = std::max(rising[1][i].t1, static_cast<float>(static_cast<double>(middle) * (1 + 1e-6)));
        w.density_rays[i].t0 = c.t_in[0] < kStressNever ? static_cast<float>(static_cast<double>(c.t_in[0]) + random.uniform() * (static_cast<double>(c.t_out[0]) - static_cast<double>(c.t_in[0]))) : middle;
        const double flight = static_cast<double>(a.flights[i].flight[0]);
        early[i].t1 = static_cast<float>(flight - shift);
        late[i].t1 = static_cast<float>(flight + shift);
    }
    a.first = ask(first), a.second = ask(second), a.early = ask(early), a.late = ask(late), a.density = ask(w.density_rays);
    for (int k = 0; k < 3; ++k) a.rising[k] = ask(rising[k]);
}

std::string describe(const ChordCase& c) {
    return fmt::format("ratio {:.3g}, distance {:.3g} scales, density {:.3g}, t0 {:.9g}, t1 {:.9g}, tau {:.6g}, o ({:.9g}, {:.9g}, {:.9g}), d ({:.9g}, {:.9g}, {:.9g}), mu, W, sigma {:.9g}", c.ratio, c.distance, c.density,
                       c.ray.t0, c.ray.t1, c.ray.tau, c.ray.origin[0], c.ray.origin[1], c.ray.origin[2], c.ray.direction[0], c.ray.direction[1], c.ray.direction[2],
                       fmt::join(c.lane.begin(), c.lane.begin() + CLUME_ROW_ID, " "));
}

void add_rows(const Work& w, std::vector<Findings>& found, const Limits& limits, const StressOptions& options, StressResult& result) {
    const std::string family = w.family.name, kernel = kernel_name(w.kernel);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Answers& a = w.answers;
        const std::string at = describe(w.cases[i]) + fmt::format(": t {:.9g} to {:.9g}, depth {:.9g}, flight {:.9g}; depths to {:.9g} and from there {:.9g} {:.9g}, to the flight -+ {:.9g} {:.9g}", a.used[i].t_in[0],
                                                                  a.used[i].t_out[0], a.used[i].depth[0], a.flights[i].flight[0], w.middles[i], a.first[i].depth[0], a.second[i].depth[0], a.early[i].depth[0], a.late[i].depth[0]);
        for (StressError* e : {&found[i].ends, &found[i].quadratic, &found[i].density, &found[i].depth, &found[i].flight}) e->at = at;
    }
    const auto collect = [&](auto member, auto wanted) {
        std::vector<StressError> errors;
        for (const Findings& f : found)
            if (wanted(f)) errors.push_back(f.*member);
        return errors;
    };
    const auto all = [](const Findings&) { return true; };
    const auto chord_row = [&](const char* quantity, const char* function, const Limit& limit, StressError Findings::*member, int k) {
        StressRow row = stress_row(quantity, function, family + ", " + kernel, limit, collect(member, [&](const Findings& f) { return k == 0 || f.judged; }), options);
        for (const Findings& f : found) {
            if (k == 1 && !f.judged) continue;
            const bool far = (f.*member).error > row.limit.value;
            row.lost.of += f.hit, row.lost.count += f.lost[k];
            row.invented.of += !f.hit, row.invented.count += f.invented[k];
            row.lost_beyond.of += f.hit, row.lost_beyond.count += f.lost[k] && far;
            row.invented_beyond.of += !f.hit, row.invented_beyond.count += f.invented[k] && far;
        }
        result.rows.push_back(row);
    };
    chord_row("entry and exit", "intersect", limits.ends, &Findings::ends, 0);
    chord_row("entry and exit by the quadratic", "intersect_quadratic", limits.quadratic, &Findings::quadratic, 1);
    result.rows.push_back(stress_row("density", "density_part", family + ", " + kernel, limits.density, collect(&Findings::density, all), options));
    StressRow depth = stress_row("optical depth", "depth_part", family + ", " + kernel, limits.depth, collect(&Findings::depth, all), options);
    StressRow flight = stress_row("free flight", "flight_part", family + ", " + kernel, limits.flight, collect(&Findings::flight, all), options);
    for (const Findings& f : found) {
        depth.additivity.add(f.not_additive, f.depth.at);
        depth.monotonicity.add(f.not_monotone, f.depth.at);
        if (f.collides) flight.round_trip.add(f.no_round_trip, f.flight.at);
        const bool far = f.flight.error > flight.limit.value;
        flight.lost.of += f.collides, flight.lost.count += f.lost_flight;
        flight.invented.of += f.collides, flight.invented.count += f.invented_flight;
        flight.lost_beyond.of += f.collides, flight.lost_beyond.count += f.lost_flight && far;
        flight.invented_beyond.of += f.collides, flight.invented_beyond.count += f.invented_flight && far;
    }
    result.rows.push_back(depth);
    result.rows.push_back(flight);
}

struct Axis {
    const char *name, *label;
    double ChordCase::*value;
    const char* family;  ///< begins with this
};
constexpr Axis kAxes[] = {{"ratio", "longest axis over the shortest", &ChordCase::ratio, "axis ratio"},
                          {"distance", "distance of the centre in scales", &ChordCase::distance, "centres up to"},
                          {"density", "peak extinction × scale along the ray", &ChordCase::density, "density"}};

void add_points(const Work& w, const std::vector<Findings>& found, std::vector<StressPlot>& plots) {
    if (w.kernel != KernelFamily::gaussian) return;
    for (std::size_t k = 0; k < std::size(kAxes); ++k) {
        if (!std::string(w.family.name).starts_with(kAxes[k].family)) continue;
        for (std::size_t i = 0; i < found.size(); ++i) {
            const Findings& f = found[i];
            const double x = w.cases[i].*(kAxes[k].value);
            plots[3 * k].points.push_back({x, f.ends.error, f.ends.naive, f.quadratic.error});
            plots[3 * k + 1].points.push_back({x, f.depth.relative, f.naive_depth});
            plots[3 * k + 2].points.push_back({x, f.flight.relative, f.naive_flight});
        }
    }
}

std::vector<StressPlot> empty_plots() {
    std::vector<StressPlot> plots;
    for (const Axis& axis : kAxes) {
        plots.push_back({std::string("ends_") + axis.name, "Entry and exit: distance to the surface, worst", "c − b²/a", "quadratic in Σ⁻¹", axis.label, "ulp of the scene’s radius", {}});
        plots.push_back({std::string("depth_") + axis.name, "Optical depth, Gaussian: 90 % of the cases are below", "erf(b) − erf(a)", "", axis.label, "relative error", {}});
        plots.push_back({std::string("flight_") + axis.name, "Free flight, Gaussian, by depth: 90 % of the cases are below", "inversion from t = 0", "", axis.label, "relative error", {}});
    }
    return plots;
}

}  // namespace

void stress_chords(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress) {
    const Limits limits;
    std::vector<StressPlot> plots = empty_plots();
    const std::size_t count = options.quick ? 100 : 2000;
    std::uint64_t seed = 1;
    const double total = 3.0 * static_cast<double>(chord_families().size());
    for (const ChordFamily& family : chord_families())
        for (const KernelFamily kernel : {KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform}) {
            Work work{family, kernel, chord_cases(family, kernel, count, seed), {}, {}, {}, {}};
            StressRandom random(1000 + seed);
            ask_device(device, work, random, limits.ends.value * kUlp);
            std::vector<Findings> found(work.cases.size());
            parallel_chunks(found.size(), 16, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) found[i] = judge(work, i, limits);
            });
            add_rows(work, found, limits, options, result);
            add_points(work, found, plots);
            progress(static_cast<double>(seed++) / total);
        }
    for (StressPlot& plot : plots) {
        bin_plot(plot, plot.name.starts_with("ends") ? 1 : 0.9);
        result.plots.push_back(std::move(plot));
    }
}

}  // namespace clume
