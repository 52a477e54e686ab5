// SPDX-License-Identifier: MIT
// The renderer beside the plain host tracer (tests/reference/host_tracer.h), on as many threads as the device has units and
// the better of its two grids, interleaved round by round in one run, so that both meet the same machine. Speeds are medians
// over the rounds; variances, which rare bright paths dominate, are means over all rounds. An inverse efficiency is
// variance of a sample × seconds per path; the ratio printed is the host's over ours.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <ctime>
#include <limits>
#include <thread>

#include "bench/rays.h"
#include "bench/scenes.h"
#include "bench/sections.h"
#include "src/pilot.h"
#include "src/renderer.h"
#include "tests/reference/host_tracer.h"

namespace clume::bench {
namespace {

/// Mean over pixels and channels of the variance of one sample.
template <class T>
double sample_variance(const std::vector<T>& variance_of_mean, double spp) {
    double sum = 0;
    for (const T v : variance_of_mean) sum += static_cast<double>(v);
    return sum / static_cast<double>(variance_of_mean.size()) * spp;
}

template <class T>
double mean_value(const std::vector<T>& rgb) {
    double sum = 0;
    for (const T v : rgb) sum += static_cast<double>(v);
    return sum / static_cast<double>(rgb.size());
}

/// Of one side, per round: wall and processor seconds per item (path or flight), variance of a sample.
struct Side {
    std::vector<double> wall_s, cpu_s, variance, mean;
    void add(double items, double wall, double cpu, double v = 0, double m = 0) {
        wall_s.push_back(wall / items);
        cpu_s.push_back(cpu / items);
        variance.push_back(v);
        mean.push_back(m);
    }
    double mega_per_s() const { return 1e-6 / median(wall_s); }
    double cpu_us() const { return 1e6 * median(cpu_s); }
};

/// Median over the rounds of a ratio of neighbours in time.
double ratio(const std::vector<double>& theirs, const std::vector<double>& ours) {
    std::vector<double> r;
    for (std::size_t i = 0; i < theirs.size(); ++i) r.push_back(theirs[i] / ours[i]);
    return median(r);
}

double cpu_now() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// 48 or 96, whichever costs `work` less processor time: three goes each, in turn, the least disturbed counts. (Wall clock
/// on a shared machine picks the wrong one now and then, and a weak yardstick flatters.)
template <class Work>
int best_cells(const Scene& scene, const Work& work) {
    const int cells[] = {48, 96};
    const reference::HostTracer tracers[] = {reference::HostTracer(scene, cells[0]), reference::HostTracer(scene, cells[1])};
    double least[] = {1e300, 1e300};
    for (std::uint64_t go = 0; go < 3; ++go)
        for (int k = 0; k < 2; ++k) {
            const double before = cpu_now();
            work(tracers[k], go);
            least[k] = std::min(least[k], cpu_now() - before);
        }
    return cells[least[1] < least[0]];
}

double round_seconds(const Session& session) { return session.options().quick ? 0.1 : 0.5; }

/// Samples per pixel that take about `seconds`, at least `least`.
std::uint32_t samples_for(double seconds, double seconds_per_sample, std::uint32_t least) {
    return static_cast<std::uint32_t>(std::clamp(std::ceil(seconds / seconds_per_sample), static_cast<double>(least), 65536.0));
}

void compare_paths(Session& session, const std::string& name, Scene scene, int threads) {
    const Options& options = session.options();
    if (!options.strategy.empty()) scene.render.strategy = options.strategy;
    const int cells = best_cells(scene, [&](const reference::HostTracer& t, std::uint64_t seed) { t.trace(1, seed, threads); });
    const reference::HostTracer host(scene, cells);
    RenderOptions render_options = session.render_options();
    const std::atomic<bool> stop{false};
    // The method is the one that `clume render` takes.
    if (const auto pilot = run_pilot(scene, render_options, pilot_folder(), stop)) render_options.pair = pilot->pair();
    const double target = round_seconds(session), pixels = static_cast<double>(scene.film.width) * scene.film.height;
    std::uint32_t host_spp = 2, spp = 8;
    Side theirs, ours;
    std::string method;
    // The first two rounds warm up and find out how many samples fill a round.
    for (int round = -2; round < session.rounds(7); ++round) {
        const auto seed = static_cast<std::uint64_t>(round) + 2;
        const double before = cpu_now();
        const auto image = host.trace(host_spp, seed, threads);
        const double host_cpu = cpu_now() - before;
        scene.render.seed = seed + 1000;
        scene.render.spp = spp;
        const RenderResult r = render(scene, render_options, {}, stop);
        if (round < 0) {
            host_spp = samples_for(target, image.seconds / host_spp, 2);
            spp = samples_for(target, r.stats.render_s / spp, 4);
            method = r.stats.strategy + "/" + r.stats.transmittance;
            continue;
        }
        theirs.add(pixels * host_spp, image.seconds, host_cpu, sample_variance(image.variance, host_spp), mean_value(image.rgb));
        ours.add(static_cast<double>(r.stats.paths), r.stats.render_s, r.stats.cpu_s, sample_variance(r.image.variance, spp), mean_value(r.image.rgb));
    }
    // Both must have rendered the same picture, or the comparison is void.
    const double rounds = session.rounds(7), deviation = std::sqrt((mean(theirs.variance) / host_spp + mean(ours.variance) / spp) / (pixels * rounds));
    const double sigmas = (mean(ours.mean) - mean(theirs.mean)) / deviation;
    const double paths = ratio(theirs.wall_s, ours.wall_s), variance = mean(theirs.variance) / mean(ours.variance), cpu = ratio(theirs.cpu_s, ours.cpu_s);
    session.record(name,
                   fmt::format("{:14} {:9.3f} {:9.3f} {:7.2f} {:11.4g} {:11.4g} {:10.2f} {:9.3f} {:9.3f} {:7.2f}  {}", name, theirs.mega_per_s(), ours.mega_per_s(), paths,
                               mean(theirs.variance), mean(ours.variance), paths * variance, theirs.cpu_us(), ours.cpu_us(), cpu * variance, method),
                   {{"method", method}, {"host_cells", static_cast<double>(cells)}, {"host_spp", static_cast<double>(host_spp)}, {"spp", static_cast<double>(spp)},
                    {"host_mpaths_s", theirs.mega_per_s()}, {"mpaths_s", ours.mega_per_s()}, {"ratio_paths", paths}, {"host_variance", mean(theirs.variance)},
                    {"variance", mean(ours.variance)}, {"ratio_inverse_efficiency", paths * variance}, {"host_cpu_us_per_path", theirs.cpu_us()},
                    {"cpu_us_per_path", ours.cpu_us()}, {"ratio_inverse_efficiency_cpu", cpu * variance},
                    {"mean_difference_sigmas", sigmas}});
    if (std::abs(sigmas) > 5) session.note(fmt::format("{}: the two mean images differ by {:.1f} standard errors: do not trust this line", name, sigmas));
}

/// Free flights alone; the device's seconds are those of the kernel, reading the rays and writing the hits included.
void compare_flights(Session& session, const std::string& name, const Scene& base, bool inside, int threads) {
    Scene scene = base;
    if (!session.options().strategy.empty()) scene.render.strategy = session.options().strategy;
    const DeviceScene device = make_device_scene(scene, session.render_options());
    Probe probe(session.device(), device, session.options().width);
    const auto rays = inside ? inside_rays(device, std::size_t{1} << 16, 1) : camera_rays(probe, scene.film.width, scene.film.height, 1, 0);
    const int cells = best_cells(scene, [&](const reference::HostTracer& t, std::uint64_t seed) { t.free_flights(100000, inside, seed, threads); });
    const reference::HostTracer host(scene, cells);
    const double target = round_seconds(session);
    std::uint64_t host_count = 100000;
    std::uint32_t launches = 1, sample = 0;
    Side theirs, ours;
    double host_collided = 0, collided = 0, host_flights = 0, flights = 0;
    for (int round = -2; round < session.rounds(7); ++round) {
        const double before = cpu_now();
        const auto rate = host.free_flights(host_count, inside, static_cast<std::uint64_t>(round) + 2, threads);
        const double host_cpu = cpu_now() - before, host_s = static_cast<double>(rate.flights) / rate.flights_per_s;
        double device_s = 0, cpu_s = 0;
        for (std::uint32_t i = 0; i < launches; ++i, ++sample) {
            const double start = cpu_now();
            const auto run = probe.flights(rays, sample);
            cpu_s += cpu_now() - start;
            device_s += run.device_s;
            collided += static_cast<double>(std::count_if(run.values.begin(), run.values.end(), [](const ProbeHit& h) { return h.collided(); }));
        }
        const double count = static_cast<double>(rays.size()) * launches;
        flights += count;
        host_collided += static_cast<double>(rate.collided);
        host_flights += static_cast<double>(rate.flights);
        if (round < 0) {
            host_count = static_cast<std::uint64_t>(std::max(1e4, static_cast<double>(host_count) * target / host_s));
            launches = samples_for(target, device_s / launches, 1);
            continue;
        }
        theirs.add(static_cast<double>(rate.flights), host_s, host_cpu);
        ours.add(count, device_s, cpu_s);
    }
    const double r = ratio(theirs.wall_s, ours.wall_s);
    session.record(name,
                   fmt::format("{:14} {:9.3f} {:9.3f} {:7.2f} {:10.1f}% {:10.1f}% {:10} {:9.3f} {:9.3f}", name, theirs.mega_per_s(), ours.mega_per_s(), r,
                               100 * host_collided / host_flights, 100 * collided / flights, "", theirs.cpu_us(), ours.cpu_us()),
                   {{"strategy", device.strategy}, {"host_cells", static_cast<double>(cells)}, {"host_mflights_s", theirs.mega_per_s()}, {"mflights_s", ours.mega_per_s()},
                    {"ratio_flights", r}, {"host_collided", host_collided / host_flights}, {"collided", collided / flights}});
}

}  // namespace

void bench_scenes_section(Session& session) {
    session.section("scenes",
                    "An item is a path; ball_long: ball without roulette, as the host; ball_inside, ball_camera: a free flight, from inside the\n"
                    "ball or from the camera over the whole film.\n"
                    "host: plain double-precision delta tracker, cell lists. ratio: paths/s. efficiency: ratio of inverse efficiencies\n"
                    "(variance of a sample x wall seconds per path); the last three numbers are processor microseconds per item and\n"
                    "the same ratio by processor time. For flights, the share that collides stands where variances stand. method: what `clume render` chooses.\n" +
                        fmt::format("{:14} {:>9} {:>9} {:>7} {:>11} {:>11} {:>10} {:>9} {:>9} {:>7}  {}", "", "host M/s", "clume M/s", "ratio", "host var", "clume var", "efficiency",
                                    "host cpu", "clume cpu", "eff cpu", "method"));
    const auto threads = [&] { return static_cast<int>(session.device().type == "cpu" ? session.device().compute_units : std::thread::hardware_concurrency()); };
    for (const std::string& name : scene_names())
        if (session.wants(name)) compare_paths(session, name, bench_scene(name), threads());
    if (session.wants("ball_long")) {
        Scene scene = bench_scene("ball");
        scene.render.rr_depth = std::numeric_limits<int>::max();
        compare_paths(session, "ball_long", scene, threads());
    }
    for (const bool inside : {true, false})
        if (const std::string name = inside ? "ball_inside" : "ball_camera"; session.wants(name)) compare_flights(session, name, bench_scene("ball"), inside, threads());
}

}  // namespace clume::bench
