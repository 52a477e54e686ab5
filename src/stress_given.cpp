// SPDX-License-Identifier: MIT
// Optical depth and free flight in the geometry that the device found: the oracle is given the very t⊥, w and d² that they are
// made from, so that nothing is forgiven for where the line lies but the rounding of t itself. What an error of the geometry does is
// judged in stress_chords; here the integral and its inversion stand alone, the textbook's beside them.
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "src/device_mixture.h"
#include "src/parallel.h"
#include "src/stress_families.h"
#include "src/stress_lines.h"
#include "src/stress_parts.h"

namespace clume {
namespace {

using oracle::Real;

Real real(float v) { return Real(static_cast<double>(v)); }

struct Limits {
    Limit depth = stated_limit("ellipsoid.cl", "depth_part", "geometry"), flight = stated_limit("ellipsoid.cl", "flight_part", "geometry");
    double depth_ulp = stated_number("ellipsoid.cl", "depth_part", "t being known to"), flight_ulp = stated_number("ellipsoid.cl", "flight_part", "t being known to");
};

StressError depth_error(const oracle::Line256& line, double density, const StressDevice::Given& got, double shift) {
    const Real start = real(got.start), stop = real(got.stop);
    // A brief chord's ends are floats next to each other: each is known to an ulp by itself, else they lie as far apart as they say.
    const oracle::Range range = line.depth_near(start, stop, shift, line.brief() ? shift : 0);
    const double floor = kStressFloor * std::max(1.0, 8 * density);
    StressError e = compare_to(static_cast<double>(got.depth), line.depth(start, stop), LimitUnit::relative);
    if (!e.nonfinite) e.error = beyond_range(range, static_cast<double>(got.depth), floor);
    e.naive = std::isfinite(got.naive_depth) ? beyond_range(range, static_cast<double>(got.naive_depth), floor) : INFINITY;
    return e;
}

}  // namespace

void stress_given(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress) {
    const Limits limits;
    const std::size_t count = options.quick ? 100 : 2000;
    std::uint64_t seed = 20000;
    double done = 0;
    for (const ChordFamily& family : chord_families())
        for (const KernelFamily kernel : {KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform}) {
            const std::vector<ChordCase> cases = chord_cases(family, kernel, count, seed++);
            std::vector<std::vector<float>> lanes;
            std::vector<ProbeGroupRay> rays;
            for (const ChordCase& c : cases) lanes.push_back(c.lane), rays.push_back(c.ray);
            const auto got = device.given(rays, pack_groups(lanes), family_bit(kernel), static_cast<float>(static_cast<double>(cases.front().device.e2)));
            std::vector<StressError> depths(cases.size()), flights(cases.size());
            parallel_chunks(cases.size(), 16, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    const StressDevice::Given& g = got[i];
                    if (!(g.has > 0)) continue;
                    const oracle::Line256 line(cases[i].device, real(g.t_perp), real(g.w), real(g.d2));
                    const double reach = std::abs(static_cast<double>(g.t_perp)) + static_cast<double>(line.reach() + 1 / line.w), depth_shift = limits.depth_ulp * 0x1p-23 * reach, flight_shift = limits.flight_ulp * 0x1p-23 * reach, flight_blur = line.brief() ? flight_shift : 0;
                    const Real start = real(g.start), tau = real(rays[i].tau);
                    double relative = NAN, ignored = NAN;
                    depths[i] = depth_error(line, cases[i].density, g, depth_shift);
                    flights[i] = flight_error(line, start, tau, static_cast<double>(g.flight), flight_shift, relative, flight_blur);
                    flights[i].relative = relative;
                    flights[i].naive = flight_error(line, start, tau, static_cast<double>(g.naive_flight), flight_shift, ignored, flight_blur).error;
                    depths[i].at = flights[i].at = fmt::format("t_perp {:.9g}, w {:.9g}, d2 {:.9g} of {:.9g}, sigma {:.9g}, t {:.9g} to {:.9g}, tau {:.9g}: depth {:.9g}, flight {:.9g}", g.t_perp, g.w, g.d2, static_cast<double>(cases[i].device.e2),
                                                               cases[i].lane[CLUME_ROW_SIGMA], g.start, g.stop, rays[i].tau, g.depth, g.flight);
                }
            });
            const auto none = [](const StressError& e) { return e.at.empty(); };  // nothing of the chord in the interval
            std::erase_if(depths, none);
            std::erase_if(flights, none);
            const std::string name = std::string(family.name) + ", " + kernel_name(kernel);
            result.rows.push_back(stress_row("optical depth in the device's geometry", "depth_part", name, limits.depth, depths, options));
            result.rows.push_back(stress_row("free flight in the device's geometry", "flight_part", name, limits.flight, flights, options));
            progress((done += 1) / (3.0 * static_cast<double>(chord_families().size())));
        }
}

}  // namespace clume
