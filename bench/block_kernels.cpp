// SPDX-License-Identifier: MIT
// What a path is made of beside primitives and accelerators: elementary functions, the kernels' own beside those of the
// implementation, random numbers, phase functions, light samples, environments, the film; and how fast data gets to the
// device and back. An item is one value (of one lane), block of random words, direction, sample, byte.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "bench/kernels.h"
#include "bench/operations.h"
#include "bench/rays.h"
#include "bench/scene_program.h"
#include "tests/cases.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {
namespace {

constexpr std::size_t kInputs = 512;  // floats of every array that is gone through: in the first-level cache
constexpr float kG = 0.7f;            // of phase functions that have one

std::vector<device::float4> directions(std::size_t count) {
    std::vector<device::float4> d;
    // Golden-angle spiral.
    for (std::size_t i = 0; i < count; ++i) {
        const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count), r = std::sqrt(1 - z * z), phi = 2.399963229728653 * static_cast<double>(i);
        d.push_back({static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)), static_cast<float>(z), 0});
    }
    return d;
}

/// One kernel, made ready when it is first launched.
struct Ready {
    SceneProgram& program;
    cl::Kernel kernel;
    std::unique_ptr<Buffer<float>> floats;
    std::unique_ptr<Buffer<device::float4>> vectors;
    std::unique_ptr<SizedLaunch> launch;
    Ready(SceneProgram& p, const std::string& name) : program(p), kernel(p.kernel(name.c_str())) {}
};

/// The program with everything in it, of one width and sampler; never destroyed: the implementation may be gone by then.
SceneProgram& general_program(Session& session, int width, bool sobol = false) {
    static auto& all = *new std::map<std::pair<int, bool>, SceneProgram>;
    ProgramOptions options;
    options.define("CLUME_WIDTH", width).define("CLUME_SOBOL", sobol);
    return all.try_emplace({width, sobol}, session, "roofline.cl", DeviceScene{}, options).first->second;
}

using Make = std::function<std::unique_ptr<Ready>()>;

/// `make` leaves `launch` set; a work-item does `items`.
void add(Session& session, const std::string& name, const Make& make, double items, Cost cost) {
    add_kernel_benchmark(session, name, [=, ready = std::shared_ptr<Ready>()](std::uint32_t) mutable {
        if (!ready) ready = make();
        return Launch{items * static_cast<double>(ready->launch->items()), (*ready->launch)(), cost};
    });
}

/// A kernel over the vectors given, without a scene.
Make over_vectors(Session& session, const std::string& kernel, bool with_g) {
    return [=, &session] {
        auto r = std::make_unique<Ready>(general_program(session, 1), kernel);
        r->vectors = std::make_unique<Buffer<device::float4>>(r->program.queue, directions(kInputs));
        r->launch = std::make_unique<SizedLaunch>(session, r->program.queue, r->kernel, [&r = *r, with_g](std::size_t count, Buffer<float>& out) {
            set_args(r.program.queue, r.kernel, 0, *r.vectors, out, cl_uint(count), cl_uint(kInputs));
            if (with_g) set_arg(r.program.queue, r.kernel, 4, kG);
        });
        return r;
    };
}

void add_math(Session& session) {
    static const std::set<std::string> of_one = {"asin", "acos", "atan2", "normalize"};
    static const std::set<std::string> without_built_in = {"erfc_inverse", "epanechnikov_inverse"};
    for (const cases::MathCase& f : cases::math_functions)
        for (const char* whose : {"own", "built_in"})
            for (const int width : kernel_widths(session)) {
                const bool built_in = std::string(whose) == "built_in", scalar = of_one.count(f.name) > 0;
                if (built_in && without_built_in.count(f.name) > 0) continue;
                if (scalar && width != kernel_widths(session).back()) continue;
                const std::string name = fmt::format("math/{}/{}", f.name, whose);
                const Make make = [=, &session] {
                    auto r = std::make_unique<Ready>(general_program(session, width), fmt::format("{}_{}", whose, f.name));
                    // Pairs of a vector x and a vector y, y being between x and x + 2.
                    std::vector<float> in(2 * kInputs);
                    for (std::size_t i = 0; i < kInputs; ++i) {
                        const double u = (static_cast<double>(i * 197 % kInputs) + 0.5) / static_cast<double>(kInputs), lo = static_cast<double>(f.lo), hi = static_cast<double>(f.hi);
                        const double x = f.log_spaced ? lo * std::pow(hi / lo, u) : lo + u * (hi - lo);
                        const std::size_t lanes = scalar ? 1 : static_cast<std::size_t>(width), at = i / lanes * 2 * lanes + i % lanes;
                        in[at] = static_cast<float>(x);
                        in[at + lanes] = static_cast<float>(x + 2 * u);
                    }
                    r->floats = std::make_unique<Buffer<float>>(r->program.queue, in);
                    r->launch = std::make_unique<SizedLaunch>(session, r->program.queue, r->kernel, [&r = *r, lanes = scalar ? 1 : width](std::size_t count, Buffer<float>& out) {
                        set_args(r.program.queue, r.kernel, 0, *r.floats, out, cl_uint(count), cl_uint(kInputs / static_cast<std::size_t>(lanes)));
                    });
                    return r;
                };
                // What the implementation's functions are made of is not known.
                const Cost cost = built_in ? Cost{} : Cost{operations(f.name), 8, 0, 8.0 * kInputs};
                add(session, scalar ? name : with_width(name, width), make, static_cast<double>(kInputs), cost);
            }
}

void add_random(Session& session) {
    const auto make = [&session](const char* kernel, int width, bool sobol = false) {
        return [=, &session] {
            auto r = std::make_unique<Ready>(general_program(session, width, sobol), kernel);
            r->launch = std::make_unique<SizedLaunch>(session, r->program.queue, r->kernel, [&r = *r](std::size_t count, Buffer<float>& out) {
                set_args(r.program.queue, r.kernel, 0, out, cl_uint(count), cl_uint(kInputs));
            });
            return r;
        };
    };
    for (const int width : kernel_widths(session)) {
        const double n = static_cast<double>(kInputs) * width;
        add(session, with_width("random/philox", width), make("random_draw", width), n, {operations("philox")});
        add(session, with_width("random/sobol", width), make("random_draw", width, true), n, {operations("philox") + operations("sobol")});
        add(session, with_width("random/primitive_bits", width), make("random_primitive_bits", width), n, {operations("primitive_bits")});
    }
}

/// A kernel over the vectors given, whose first arguments are a scene lit by one light of the kind: under the program that knows
/// all kinds.
Make under_light(Session& session, const char* kernel, LightKind kind) {
    return [=, &session] {
        Scene scene = reference::random_mixture(KernelFamily::gaussian, 64, 3);
        scene.render.strategy = "decomposition";
        scene.lights = {cases::light(kind)};
        ProgramOptions options;
        options.define("CLUME_WIDTH", 1);
        auto& program = *new SceneProgram(session, "roofline.cl", make_device_scene(scene, {}), options);  // never destroyed, as above
        auto r = std::make_unique<Ready>(program, kernel);
        r->vectors = std::make_unique<Buffer<device::float4>>(program.queue, directions(kInputs));
        r->launch = std::make_unique<SizedLaunch>(session, program.queue, r->kernel, [&r = *r](std::size_t count, Buffer<float>& out) {
            r.program.set(r.kernel, *r.vectors, out, cl_uint(count), cl_uint(kInputs));
        });
        return r;
    };
}

/// 64 MB to the device and back, by the clock on the wall.
void add_transfers(Session& session) {
    for (const bool up : {true, false})
        add_kernel_benchmark(session, up ? "transfer/to_device" : "transfer/from_device", [up, &session](std::uint32_t) {
            constexpr std::size_t count = std::size_t{16} << 20;
            static auto& queue = *new Queue(session.device());
            static auto& buffer = *new Buffer<float>(queue, count);
            static std::vector<float> host(count, 1.0f);
            const auto begin = std::chrono::steady_clock::now();
            if (up) buffer.upload(host);
            else buffer.download(std::span<float>(host));
            const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
            const auto bytes = static_cast<double>(buffer.byte_size());
            return Launch{bytes, s, {0, 2, 0, 2 * bytes}};  // read here, written there
        });
}

}  // namespace

void add_block_benchmarks(Session& session) {
    constexpr auto n = static_cast<double>(kInputs);
    add_math(session);
    add_random(session);
    for (const cases::PhaseCase& phase : cases::phases) {
        const std::string name = phase.name;
        add(session, "phase/sample/" + name, over_vectors(session, "phase_sample_" + name, true), n, {operations("phase_sample/" + name), 16, 0, 16 * n});
        // The isotropic one is a constant.
        if (phase.kind != PHASE_ISOTROPIC) add(session, "phase/value/" + name, over_vectors(session, "phase_value_" + name, true), n, {operations("phase_value/" + name), 4, 0, 16 * n});
    }
    for (const cases::LightCase& light : cases::lights) {
        if (light.kind == LightKind::constant) continue;  // never sampled: escaping paths find it
        const bool image = light.kind == LightKind::envmap;
        // The light itself is the same for all.
        add(session, fmt::format("light/{}", light.name), under_light(session, "light_samples", light.kind), n,
            {operations(fmt::format("light/{}", light.name)), 16 + (image ? 48.0 : 0), image ? 2.0 : 0, 16 * n + sizeof(device::LightInfo)});
    }
    for (const LightKind kind : {LightKind::constant, LightKind::envmap}) {
        const bool image = kind == LightKind::envmap;
        const char* name = image ? "envmap" : "constant";
        add(session, fmt::format("environment/{}", name), under_light(session, "environment_lookups", kind), n, {operations(fmt::format("environment/{}", name)), 16 + (image ? 32.0 : 0), image ? 1.0 : 0, 16 * n});
    }
    add(session, "film/sample", over_vectors(session, "film_samples", false), n, {operations("film"), 16, 0, 16 * n});
    add_transfers(session);
}

}  // namespace clume::bench
