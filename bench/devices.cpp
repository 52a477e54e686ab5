// SPDX-License-Identifier: MIT
// Devices that share a render: paths per second of each alone and of all together, in turns. Halves of one CPU device; halves of
// the CPU devices of two implementations; and every CPU device beside every GPU. Halves are measured alone on half of the cores:
// Intel's runtime does not keep a sub-device's threads to its own while the others are free.
#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "bench/sections.h"
#include "runtime/device.h"
#include "runtime/dispatcher.h"
#include "src/device_camera.h"
#include "src/device_renderer.h"
#include "src/device_scene.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {
namespace {

struct Shared {
    std::string item;
    std::vector<DeviceInfo> devices;
};

std::vector<Shared> pairs_of(const DeviceInfo& own) {
    std::vector<Shared> out;
    std::vector<DeviceInfo> cpus, gpus;
    for (const DeviceInfo& d : list_devices()) {
        if (d.type == "gpu") gpus.push_back(d);
        else if (d.type == "cpu" && d.compute_units > 1) cpus.push_back(d);
    }
    if (own.type == "cpu" && own.compute_units > 1) out.push_back({"cpu_split_2", split_cpu(own, 2)});
    for (std::size_t a = 0; a < cpus.size(); ++a)
        for (std::size_t b = a + 1; b < cpus.size(); ++b)
            if (cpus[a].platform != cpus[b].platform) out.push_back({"two_implementations", {split_cpu(cpus[a], 2)[0], split_cpu(cpus[b], 2)[1]}});
    for (const DeviceInfo& c : cpus)
        for (const DeviceInfo& g : gpus) out.push_back({"cpu_and_gpu", {c, g}});
    return out;
}

/// Keeps all threads that the process has now to the cores [first, first + count), until it is destroyed.
class Confined {
public:
    Confined(unsigned first, unsigned count) {
        sched_getaffinity(0, sizeof(before_), &before_);
        cpu_set_t some;
        CPU_ZERO(&some);
        unsigned core = 0;
        for (int c = 0; c < CPU_SETSIZE; ++c)
            if (CPU_ISSET(c, &before_) && core++ >= first && core <= first + count) CPU_SET(c, &some);
        if (CPU_COUNT(&some) == static_cast<int>(count)) set(some);
    }
    ~Confined() { set(before_); }
    Confined(const Confined&) = delete;
    Confined& operator=(const Confined&) = delete;

private:
    cpu_set_t before_;
    static void set(const cpu_set_t& cores) {
        for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task"))
            sched_setaffinity(std::stoi(thread.path().filename().string()), sizeof(cores), &cores);
    }
};

void measure(Session& session, const Shared& shared) {
    const Scene scene = reference::ball_scene();
    const auto shared_scene = std::make_shared<const DeviceScene>(make_device_scene(scene, session.render_options()));
    const DeviceScene& device = *shared_scene;
    const auto pixels = active_pixels(scene, device, {0, 0, scene.film.width, scene.film.height});
    std::vector<Tile> tiles;
    for (std::uint32_t first = 0; first < pixels.size(); first += 1024) tiles.push_back({first, std::min<std::uint32_t>(1024, static_cast<std::uint32_t>(pixels.size()) - first)});
    FilmSums film(pixels.size(), 1, static_cast<double>(device.params.film_scale));
    Workers all;
    for (const DeviceInfo& d : shared.devices) {
        all.push_back(std::make_shared<DeviceRenderer>(d, shared_scene, pixels, tiles, session.options().width));
        static_cast<DeviceRenderer&>(*all.back()).aim(film, 1);
    }
    std::uint32_t next = 0;
    const auto speed = [&](const Workers& workers, std::uint32_t samples) {
        DispatchOptions o;
        o.items = static_cast<std::uint32_t>(tiles.size());
        o.begin = next;
        o.end = next += samples;
        const DispatchReport report = dispatch(workers, o);
        return static_cast<double>(pixels.size()) * samples / report.elapsed_s;
    };
    // Of the device k alone, on its share of the cores.
    const bool halves = std::ranges::all_of(shared.devices, [](const DeviceInfo& d) { return d.type == "cpu"; });
    const auto speed_alone = [&](std::size_t k, std::uint32_t count) {
        std::optional<Confined> confined;
        if (halves) confined.emplace(k == 0 ? 0 : shared.devices[0].compute_units, shared.devices[k].compute_units);
        return speed({all[k]}, count);
    };
    // As many samples as make a turn long beside a batch: found step by step, since a GPU's first batches are far too small for it.
    const double turn_s = session.options().quick ? 0.2 : 2.0;
    std::vector<std::uint32_t> samples;
    for (std::size_t k = 0; k < all.size(); ++k) {
        double count = 2, wanted = 0;
        for (;;) {
            wanted = std::clamp(turn_s * speed_alone(k, static_cast<std::uint32_t>(count)) / static_cast<double>(pixels.size()), 2.0, 65536.0);
            if (wanted < 4 * count) break;
            count = std::min(wanted, 16 * count);
        }
        samples.push_back(static_cast<std::uint32_t>(wanted));
    }
    std::vector<double> together, share;
    std::vector<std::vector<double>> alone(all.size());
    for (int round = -1; round < session.rounds(7); ++round) {
        double sum = 0;
        std::uint32_t whole = 0;
        for (std::size_t k = 0; k < all.size(); ++k) {
            const double s = speed_alone(k, samples[k]);
            if (round >= 0) alone[k].push_back(s);
            sum += s;
            whole += samples[k];
        }
        const double s = speed(all, whole);
        if (round < 0) continue;
        together.push_back(s);
        share.push_back(s / sum);
    }
    std::string parts, names;
    for (std::size_t k = 0; k < all.size(); ++k) {
        parts += fmt::format("{}{:.3f}", k ? " + " : "", median(alone[k]) / 1e6);
        names += fmt::format("{}{}", k ? " + " : "", shared.devices[k].label());
    }
    session.record(shared.item, fmt::format("{:20} {:>20} {:>10.3f} {:>8.2f}  {}", shared.item, parts, median(together) / 1e6, median(share), names),
                   {{"devices", names}, {"together_per_s", median(together)}, {"share", median(share)}});
}

}  // namespace

void bench_devices_section(Session& session) {
    session.section("devices", "An item is a path of the ball. Each device alone, then all at once by batches sized to their measured speed.\n" +
                                   fmt::format("{:20} {:>20} {:>10} {:>8}", "", "alone M/s", "together", "share"));
    for (const Shared& shared : pairs_of(session.device()))
        if (session.wants(shared.item)) measure(session, shared);
}

}  // namespace clume::bench
