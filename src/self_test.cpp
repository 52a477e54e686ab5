// SPDX-License-Identifier: MIT
#include "src/self_test.h"

#include <array>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <functional>
#include <vector>

#include "runtime/buffer.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "runtime/queue.h"

namespace clume {
namespace {

std::uint32_t bits(float f) {
    std::uint32_t u;
    std::memcpy(&u, &f, sizeof u);
    return u;
}

/// A function of the kernels beside the host's, over inputs that span its domain.
struct Check {
    const char* name;
    cl_uint function;  ///< PROBE_* of probe.cl
    float lo, hi;
    double tolerance;  ///< relative
    std::function<double(double)> host;
};

const Check kChecks[] = {
    {"reciprocal", 0, 1e-3f, 1e3f, 3e-7, [](double x) { return 1 / x; }},
    {"square root", 3, 1e-6f, 1e6f, 3e-7, [](double x) { return std::sqrt(x); }},
    {"exp", 4, -60, 20, 1e-6, [](double x) { return std::exp(x); }},
    {"log", 5, 1.5f, 1e6f, 1e-6, [](double x) { return std::log(x); }},
    {"erfc", 7, 0, 5, 3e-6, [](double x) { return std::erfc(x); }},
    {"sine", 12, 0.01f, 0.45f, 1e-6, [](double x) { return std::sin(2 * 3.141592653589793 * x); }},
};

/// The host's philox (kernels/rng.cl) of (i, 0, 0, 0) under (seed, 0).
std::array<cl_uint, 4> words_of(cl_uint i, cl_uint seed) {
    std::array<cl_uint, 4> w{i, 0, 0, 0};
    cl_uint a = seed, b = 0;
    for (int round = 0; round < 7; ++round) {
        const std::uint64_t p = std::uint64_t{w[0]} * 0xD2511F53u, q = std::uint64_t{w[2]} * 0xCD9E8D57u;
        w = {static_cast<cl_uint>(q >> 32) ^ w[1] ^ a, static_cast<cl_uint>(q), static_cast<cl_uint>(p >> 32) ^ w[3] ^ b, static_cast<cl_uint>(p)};
        a += 0x9E3779B9u;
        b += 0xBB67AE85u;
    }
    return w;
}

/// What is wrong with thousands of words computed by all units of the device and read back; empty if nothing is.
std::string wrong_words(Queue& queue, const cl::Program& program, cl_uint seed) {
    constexpr cl_uint n = 4096;
    cl::Kernel kernel = make_kernel(queue, program, "probe_words");
    Buffer<cl_uint> out(queue, 4 * n);
    set_args(queue, kernel, 0, out, n, seed);
    queue.launch(kernel, n, queue.info().group_size());
    const std::vector<cl_uint> got = out.download();
    for (cl_uint i = 0; i < n; ++i) {
        const auto expected = words_of(i, seed);
        for (std::size_t k = 0; k < 4; ++k)
            if (got[4 * i + k] != expected[k]) return fmt::format("integer word {} of {} is {:#x}, not {:#x}", 4 * i + k, 4 * n, got[4 * i + k], expected[k]);
    }
    return {};
}

}  // namespace

SelfTestResult self_test(const DeviceInfo& info, int vector_width) {
    SelfTestResult result;
    Queue queue(info);
    ProgramOptions options;
    options.define("CLUME_WIDTH", vector_width > 0 ? vector_width : static_cast<int>(info.native_vector_width));
    const cl::Program program = build_program(queue, "self_test.cl", options);

    // First and last: floats are compared with a tolerance, these are not, and a device may fail once it is warm.
    result.error = wrong_words(queue, program, 1);
    if (!result.error.empty()) return result;

    cl::Kernel arithmetic = make_kernel(queue, program, "probe_arithmetic");
    const float a = 1 + 0x1p-12f;
    std::vector<float> in = {a, a, -(1 + 0x1p-11f), 0x1p-126f, 0, 123456.7f, 2.5f};
    const std::uint32_t wide = 0x12345679u;
    std::memcpy(&in[4], &wide, sizeof wide);
    Buffer<float> input(queue, in);
    Buffer<cl_uint> output(queue, 8);
    set_args(queue, arithmetic, 0, input, output);
    queue.launch(arithmetic, 1, 1);
    const std::vector<cl_uint> got = output.download();
    const auto differs = [&](std::size_t k, std::uint32_t expected, const char* what) {
        if (got[k] != expected) result.outside_exact_set += (result.outside_exact_set.empty() ? "" : ", ") + std::string(what);
    };
    differs(0, bits(0.0f), "contracts a*b+c");
    differs(1, bits(0x1p-24f), "fma is not fused");
    differs(2, bits(0.0f), "contracts a*b+c in vectors");
    differs(3, bits(0x1p-24f), "fma is not fused in vectors");
    differs(4, bits(static_cast<float>(static_cast<std::uint64_t>(wide) << 20)), "integer to float rounding");
    differs(5, 123456u, "float to integer rounding");
    differs(6, bits(2.0f), "rint");

    cl::Kernel math = make_kernel(queue, program, "probe_math");
    constexpr std::size_t n = 256;
    for (const Check& check : kChecks) {
        std::vector<float> x(n);
        for (std::size_t i = 0; i < n; ++i) x[i] = check.lo + (check.hi - check.lo) * static_cast<float>(i) / static_cast<float>(n - 1);
        Buffer<float> bx(queue, x), out(queue, n);
        set_args(queue, math, 0, bx, bx, out, cl_uint(n), check.function);
        queue.launch(math, n, info.group_size());
        const std::vector<float> y = out.download();
        for (std::size_t i = 0; i < n; ++i) {
            const double expected = check.host(static_cast<double>(x[i]));
            if (!(std::abs(static_cast<double>(y[i]) - expected) <= check.tolerance * std::abs(expected))) {
                result.error = fmt::format("{}({}) gives {}, not {}", check.name, x[i], y[i], expected);
                return result;
            }
        }
    }
    result.error = wrong_words(queue, program, 2);
    return result;
}

}  // namespace clume
