// SPDX-License-Identifier: MIT
// Ellipsoids behind circumscribed icosahedra against the analytic test alone: 512 ellipsoids held in the cache, every line
// against each. No tree, no ray-tracing hardware: what is compared is the test at a leaf.
#include "bench/proxy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/rays.h"
#include "bench/study.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "src/device_scene.h"
#include "tests/reference/analytic_scenes.h"

namespace clume::bench {
namespace {

constexpr std::uint32_t kGroups = 32, kLines = 4096;  // times copies
constexpr std::size_t kVertices = 12, kMeshFloats = kVertices * 3 * CLUME_GROUP_SIZE;

/// A unit sphere's circumscribed icosahedron.
struct Icosahedron {
    std::array<glm::dvec3, kVertices> vertices;
    std::vector<device::uint> faces;        ///< 20 × 3, counter-clockwise from outside
    std::vector<device::float4> normals;    ///< 10, of the pairs of parallel faces
    double reach = 1.0001;                  ///< of the faces: a hair of slack for rounding

    Icosahedron() {
        const double phi = (1 + std::sqrt(5.0)) / 2, inradius = phi * phi / std::sqrt(3.0);  // at edges of 2
        std::size_t n = 0;
        for (int k = 0; k < 3; ++k)
            for (const double a : {-1., 1.})
                for (const double b : {-phi, phi}) {
                    glm::dvec3 v(0);
                    v[(k + 1) % 3] = a;
                    v[(k + 2) % 3] = b;
                    vertices[n++] = v * (reach / inradius);
                }
        const double edge = 2 * reach / inradius;
        const auto near = [&](std::size_t i, std::size_t j) { return std::abs(glm::distance(vertices[i], vertices[j]) - edge) < 1e-6; };
        for (std::size_t i = 0; i < kVertices; ++i)
            for (std::size_t j = i + 1; j < kVertices; ++j)
                for (std::size_t k = j + 1; k < kVertices; ++k) {
                    if (!near(i, j) || !near(j, k) || !near(i, k)) continue;
                    const glm::dvec3 cross = glm::cross(vertices[j] - vertices[i], vertices[k] - vertices[i]), normal = glm::normalize(vertices[i] + vertices[j] + vertices[k]);
                    const bool outward = glm::dot(cross, normal) > 0;
                    for (const std::size_t index : {i, outward ? j : k, outward ? k : j}) faces.push_back(static_cast<device::uint>(index));
                    const double first = std::abs(normal.x) > 1e-6 ? normal.x : std::abs(normal.y) > 1e-6 ? normal.y : normal.z;
                    if (first > 0) normals.push_back({static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z), 0});
                }
    }
};

struct Data {
    std::vector<float> groups, meshes;
    std::vector<device::float4> lines;
    float e2 = 0, reach = 0;
};

/// Ellipsoids in the unit ball sized for `overlap`, lines through it.
Data make_data(const Icosahedron& proxy, double overlap, std::size_t copies) {
    Scene scene = reference::random_mixture(KernelFamily::gaussian, static_cast<int>(kGroups * CLUME_GROUP_SIZE), 3, overlap, 2);
    scene.render.strategy = "decomposition";
    RenderOptions options;
    options.accelerator = "bvh";
    const DeviceScene device = make_device_scene(scene, options);
    const double extent = scene.media[0].extent;
    Data data;
    data.e2 = static_cast<float>(extent * extent);
    data.reach = static_cast<float>(extent * proxy.reach);
    data.groups.resize(kGroups * CLUME_GROUP_FLOATS);
    data.meshes.resize(kGroups * kMeshFloats);
    for (std::size_t i = 0; i < device.ellipsoids.size(); ++i) {
        const Ellipsoid& e = device.ellipsoids[i];
        const std::size_t group = i / CLUME_GROUP_SIZE, lane = i % CLUME_GROUP_SIZE;
        const auto put = [&](std::size_t row, double v) { data.groups[group * CLUME_GROUP_FLOATS + row * CLUME_GROUP_SIZE + lane] = static_cast<float>(v); };
        for (int k = 0; k < 3; ++k) put(CLUME_ROW_MU + static_cast<std::size_t>(k), e.center[k]);
        for (std::size_t k = 0; k < 6; ++k) put(CLUME_ROW_W + k, e.w[k]);
        put(CLUME_ROW_SIGMA, e.sigma);
        // Columns of the whitening, its upper triangle being w, row by row.
        const glm::dmat3 unwhiten = glm::inverse(glm::dmat3(glm::dvec3(e.w[0], 0, 0), glm::dvec3(e.w[1], e.w[3], 0), glm::dvec3(e.w[2], e.w[4], e.w[5])));
        for (std::size_t v = 0; v < kVertices; ++v) {
            const glm::dvec3 at = e.center + unwhiten * (proxy.vertices[v] * extent);
            for (int k = 0; k < 3; ++k) data.meshes[group * kMeshFloats + (3 * v + static_cast<std::size_t>(k)) * CLUME_GROUP_SIZE + lane] = static_cast<float>(at[k]);
        }
    }
    for (const ProbeRay& r : inside_rays(device, copies * kLines, 4)) {
        data.lines.push_back({r.origin[0], r.origin[1], r.origin[2], 0});
        data.lines.push_back({r.direction[0], r.direction[1], r.direction[2], 0});
    }
    return data;
}

}  // namespace

struct ProxyLines::Impl {
    Impl(const DeviceInfo& device, const ProgramOptions& options, const Icosahedron& proxy, const Data& data)
        : queue(device), kernel(make_kernel(queue, build_program(queue, "proxy.cl", options), "proxy_lines")),
          groups(queue, data.groups), meshes(queue, data.meshes), faces(queue, proxy.faces), normals(queue, proxy.normals), lines(queue, data.lines), out(queue, data.lines.size() / 2),
          e2(data.e2), reach(data.reach) {}
    Queue queue;
    cl::Kernel kernel;
    Buffer<float> groups, meshes;
    Buffer<device::uint> faces;
    Buffer<device::float4> normals, lines, out;
    float e2, reach;
};

ProxyLines::ProxyLines(const DeviceInfo& device, int width, double overlap, std::size_t copies) {
    const Icosahedron proxy;
    ProgramOptions options;
    options.define("CLUME_WIDTH", width);
    impl_ = std::make_unique<Impl>(device, options, proxy, make_data(proxy, overlap, copies));
}
ProxyLines::~ProxyLines() = default;

double ProxyLines::tests() const { return static_cast<double>(impl_->out.size()) * kGroups * CLUME_GROUP_SIZE; }

double ProxyLines::launch(ProxyWork what) {
    Impl& s = *impl_;
    set_args(s.queue, s.kernel, 0, s.groups, s.meshes, s.faces, s.normals, s.lines, s.out, s.reach, cl_uint(s.out.size()), cl_uint(kGroups), s.e2, cl_uint(what));
    return s.queue.launch(s.kernel, s.out.size(), s.queue.info().group_size());
}

std::vector<device::float4> ProxyLines::out() const { return impl_->out.download(); }

double ProxyLines::byte_size(ProxyWork what) const {
    return static_cast<double>(impl_->groups.byte_size() + (what == ProxyWork::mesh ? impl_->meshes.byte_size() : 0));
}

void study_proxy(Session& session, const Report& report) {
    if (!session.wants("proxy")) return;
    const char* names[] = {"analytic alone", "mesh of 20 triangles, then analytic", "shared icosahedron (10 slabs), then analytic"};
    const double bytes[] = {40, 40 + 12 * 12, 40};
    Table csv{{"overlap", "test", "mtests_s", "relative_time", "bytes_per_primitive", "share_met", "share_proxy_met", "lost"}},
        table{{"lines that meet an ellipsoid", "test", "million tests/s", "time", "bytes per primitive", "lines that meet the proxy"}};
    for (const double overlap : {1.0, 60.0}) {
        ProxyLines lines(session.device(), session.options().width > 0 ? session.options().width : static_cast<int>(session.device().native_vector_width), overlap);
        const auto launch = [&](std::uint32_t what) { return lines.launch(static_cast<ProxyWork>(what)); };
        const double tests = lines.tests();
        std::array<double, 4> met{};  // ellipsoids, meshes, instances, lost
        lines.launch(ProxyWork::check);
        for (const device::float4& v : lines.out()) {
            met[0] += static_cast<double>(v.x) / tests;
            met[1] += static_cast<double>(v.y) / tests;
            met[2] += static_cast<double>(v.z) / tests;
            met[3] += static_cast<double>(v.w);
        }
        std::array<std::vector<double>, 3> seconds;
        std::array<double, 3> sums{};
        for (int round = -1; round < session.rounds(40); ++round)
            for (std::uint32_t what = 0; what < 3; ++what) {
                const double s = launch(what);
                if (round >= 0) {
                    seconds[what].push_back(s);
                    continue;
                }
                for (const device::float4& v : lines.out()) sums[what] += static_cast<double>(v.x);
            }
        for (std::uint32_t what = 0; what < 3; ++what) {
            // The least disturbed launch counts: they are short, and other programs only make them longer.
            const auto least = [&](std::uint32_t k) { return *std::min_element(seconds[k].begin(), seconds[k].end()); };
            const double s = least(what), share = what == 0 ? met[0] : met[what], relative = s / least(0);
            csv.push_back({figure(overlap), fmt::format("\"{}\"", names[what]), figure(1e-6 * tests / s), figure(relative), figure(bytes[what]), figure(met[0]), figure(share), figure(met[3])});
            table.push_back({fmt::format("{:.1f} %", 100 * met[0]), names[what], fmt::format("{:.0f}", 1e-6 * tests / s), fmt::format("{:.1f}×", relative), figure(bytes[what]),
                             what == 0 ? "–" : fmt::format("{:.1f} %", 100 * share)});
            session.record(fmt::format("proxy/{:g}/{}", overlap, names[what]), fmt::format("proxy {}", fmt::join(table.back(), "  ")), {{"mtests_s", 1e-6 * tests / s}, {"relative", relative}});
        }
        if (met[3] > 0) session.note(fmt::format("proxy: {:.0f} ellipsoids were met outside their proxies", met[3]));
        for (const double sum : sums)
            if (std::abs(sum / sums[0] - 1) > 1e-6) session.note("proxy: the tests do not agree on the chords: do not trust these lines");
    }
    report.csv("proxy", csv);
    report.table("proxy", table);
}

}  // namespace clume::bench
