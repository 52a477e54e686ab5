// SPDX-License-Identifier: MIT
// Every elementary function of the kernels against 50-digit arithmetic over its stated domain. The bound that a function
// states in its comment is read from the source and is the limit, so comment and test can't drift apart.
// Also: all vector widths give the same bits.
#include <cmath>
#include <fmt/format.h>
#include <functional>

#include "src/stress_limits.h"
#include "tests/probe_harness.h"
#include "tests/reference/high_precision.h"

namespace {

using namespace clume;
using namespace clume::probing;
namespace high = clume::reference::high;
using high::Real;

struct Worst {
    double error = 0;
    float x = 0, y = 0, got = 0;
};

/// Checks f at (x[i], y[i]) on every width.
void check(const std::string& name, MathFunction f, Limit bound, const std::vector<float>& x, const std::vector<float>& y,
           const std::function<Real(float, float)>& truth) {
    std::vector<float> first;
    for (const int width : kWidths) {
        const std::vector<float> got = bare_probe(width).math(f, x, y);
        if (first.empty()) first = got;
        INFO(name << " on width " << width << " against 16");
        REQUIRE(first_difference(first, got) == x.size());
    }
    Worst worst;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const float b = y.empty() ? 1.0f : y[i];
        const Real exact = truth(x[i], b);
        double error = static_cast<double>(abs(Real(first[i]) - exact));
        const double size = std::abs(static_cast<double>(exact));
        if (error > 0 && bound.unit == LimitUnit::ulp) error /= std::ldexp(1.0, std::ilogb(size) - 23);
        if (error > 0 && bound.unit == LimitUnit::relative) error /= size;
        if (!std::isfinite(first[i])) error = INFINITY;
        if (!(error <= worst.error)) worst = {error, x[i], b, first[i]};
    }
    const std::string text = fmt::format("{}: worst error {:.3g} {} of {:.3g} stated, at ({:.9g}, {:.9g}) = {:.9g}, {} inputs", name, worst.error, name_of(bound.unit), bound.value,
                                         worst.x, worst.y, worst.got, x.size());
    report(text);
    INFO(text);
    CHECK(worst.error < bound.value);
}

Limit body(const char* name) { return stated_limit("math_body.inc.cl", "FN(" + std::string(name) + ")"); }

std::vector<float> with_negatives(std::vector<float> x) {
    const std::size_t n = x.size();
    for (std::size_t i = 0; i < n; ++i) x.push_back(-x[i]);
    return x;
}

/// x reordered, so that pairs are independent.
std::vector<float> shuffled(std::vector<float> x, std::uint64_t seed) {
    std::shuffle(x.begin(), x.end(), std::mt19937_64(seed));
    return x;
}

constexpr float kTiny = 0x1.000002p-100f, kHuge = 0x1.fffffep99f;

}  // namespace

TEST_CASE("Math.ReciprocalAndRoots", "[kernels][quick]") {
    const auto x = log_spaced(kTiny, kHuge, 30000, 1);
    check("rcp", MathFunction::rcp, body("rcp"), with_negatives(x), {}, [](float a, float) { return Real(1) / Real(a); });
    check("rsqrt", MathFunction::rsqrt, body("rsqrt"), x, {}, [](float a, float) { return Real(1 / high::sqrt(Real(a))); });
    auto roots = x;
    for (const float zero : {0.0f, -0.0f, 0x1p-149f, 0x1p-127f, 0x1.fffffep-101f}) roots.push_back(zero);
    check("sqrt", MathFunction::sqrt, body("sqrt"), roots, {}, [](float a, float) { return a < 0x1p-100f ? Real(0) : high::sqrt(Real(a)); });
    const auto half = log_spaced(0x1p-50f, 0x1p50f, 30000, 2);
    check("divide", MathFunction::divide, body("divide"), with_negatives(half), shuffled(with_negatives(half), 3),
          [](float a, float b) { return Real(a) / Real(b); });
    check("normalize", MathFunction::normalize_x, stated_limit("math.cl", "normalize_s"), with_negatives(log_spaced(1e-12f, 5e11f, 20000, 4)),
          shuffled(with_negatives(log_spaced(1e-12f, 5e11f, 20000, 4)), 5),
          [](float a, float b) { return Real(Real(a) / high::sqrt(Real(a) * a + 2 * Real(b) * b)); });
}

TEST_CASE("Math.ReciprocalAndRootsForEveryMantissa", "[kernels]") {
    // Two binades cover all of them: these functions scale with the exponent. Long double has 40 bits more than float.
    std::vector<float> x(1u << 24);
    for (std::uint32_t i = 0; i < x.size(); ++i) x[i] = from_bits(0x3f800000u + i);
    Probe& probe = bare_probe(16);
    const auto worst_ulp = [&](MathFunction f, auto&& truth) {
        const auto got = probe.math(f, x);
        long double worst = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            const long double exact = truth(static_cast<long double>(x[i]));
            worst = std::max(worst, std::abs(static_cast<long double>(got[i]) - exact) / std::ldexp(1.0L, std::ilogb(exact) - 23));
        }
        return static_cast<double>(worst);
    };
    const double rcp = worst_ulp(MathFunction::rcp, [](long double v) { return 1 / v; });
    const double rsqrt = worst_ulp(MathFunction::rsqrt, [](long double v) { return 1 / std::sqrt(v); });
    const double sqrt = worst_ulp(MathFunction::sqrt, [](long double v) { return std::sqrt(v); });
    report(fmt::format("every mantissa: rcp {:.4f} ulp, rsqrt {:.4f} ulp, sqrt {:.4f} ulp", rcp, rsqrt, sqrt));
    CHECK(rcp < body("rcp").value);
    CHECK(rsqrt < body("rsqrt").value);
    CHECK(sqrt < body("sqrt").value);
}

TEST_CASE("Math.ExpAndLog", "[kernels][quick]") {
    auto x = evenly_spaced(-69.0f, 88.0f, 30000, 6);
    for (const float v : with_negatives(log_spaced(1e-30f, 60.0f, 6000, 7))) x.push_back(v);
    check("exp", MathFunction::exp, body("exp"), x, {}, [](float a, float) { return high::exp(Real(a)); });
    check("exp, underflow", MathFunction::exp, {1e-45, LimitUnit::absolute}, {-69.00001f, -70.0f, -87.0f, -88.0f, -89.0f, -104.0f, -1e3f, -1e6f, -1e30f, -3.4e38f}, {},
          [](float, float) { return Real(0); });
    auto y = log_spaced(0x1.000002p-120f, 0x1.fffffep119f, 20000, 8);
    for (const float v : evenly_spaced(0.5f, 2.0f, 20000, 9)) y.push_back(v);
    for (int k = -64; k <= 64; ++k) y.push_back(from_bits(static_cast<std::uint32_t>(0x3f800000 + k)));
    check("log", MathFunction::log, body("log"), y, {}, [](float a, float) { return a == 1.0f ? Real(0) : high::log(Real(a)); });
}

TEST_CASE("Math.ExponentialFromBits", "[kernels][quick]") {
    std::vector<float> x;
    const auto add = [&](std::uint32_t b) { x.push_back(from_bits(b)); };
    for (std::uint32_t k = 0; k < 2000; ++k) {
        add(k);
        add(0xffffffffu - k);
        add(0x80000000u + k);
        add(0x7fffffffu - k);
        add(0xb504f333u + k - 1000);  // u and 1 − u at sqrt(1/2)
        add(0x4afb0cccu + k - 1000);
    }
    for (int e = 1; e < 32; ++e)
        for (std::uint32_t k = 0; k < 5; ++k) add((1u << e) + k - 2), add(~((1u << e) + k - 2));
    TestRandom random(10);
    for (int i = 0; i < 20000; ++i) add(random.word()), add(random.word() >> random.below(32)), add(~(random.word() >> random.below(32)));
    check("exponential", MathFunction::exponential, body("exponential"), x, {},
          [](float a, float) { return Real(-high::log((Real(bits(a)) + Real(0.5)) / Real(4294967296.0))); });
    check("from_uint", MathFunction::from_uint, body("from_uint"), x, {}, [](float a, float) { return Real(bits(a)); });
    for (const float u : bare_probe(16).math(MathFunction::exponential, x)) {
        if (!(u > 1.1e-10f && u < 23.0f)) FAIL("exponential gives " << u);
    }
}

TEST_CASE("Math.ErrorFunctions", "[kernels][quick]") {
    auto x = evenly_spaced(0.0f, 8.0f, 8000, 11);
    for (const float v : log_spaced(1e-30f, 8.0f, 2000, 12)) x.push_back(v);
    check("erfc", MathFunction::erfc, body("erfc"), x, {}, [](float a, float) { return high::erfc(Real(a)); });
    check("erfc beyond 8", MathFunction::erfc, {1.2e-29, LimitUnit::absolute}, {8.0f, 8.1f, 8.3f, 8.31f, 9.0f, 20.0f, 1e3f, 1e9f, 1e18f}, {},
          [](float, float) { return Real(0); });
    auto q = log_spaced(0x1.000002p-90f, 1.0f, 3000, 13);
    for (const float v : evenly_spaced(1e-6f, 1.0f, 3000, 14)) q.push_back(v);
    for (std::uint32_t k = 1; k < 500; ++k) q.push_back(from_bits(0x3f800000u - k));
    check("erfc_inverse", MathFunction::erfc_inverse, body("erfc_inverse"), q, {}, [](float a, float) { return a == 1.0f ? Real(0) : high::erfc_inv(Real(a)); });

    // Both tails, straddling, short and long intervals, and nearly equal ends.
    std::vector<float> x0, x1;
    TestRandom random(15);
    for (int i = 0; i < 8000; ++i) {
        const double middle = random.below(2) ? random.uniform(-6, 6) : random.spread(1e-6, 6) * (random.below(2) ? 1 : -1);
        const double half = random.below(2) ? random.spread(1e-6, 6) : random.uniform(0, 0.6);
        const auto a = static_cast<float>(std::clamp(middle - half, -6.0, 6.0)), b = static_cast<float>(std::clamp(middle + half, -6.0, 6.0));
        if (!(a < b)) continue;
        x0.push_back(a);
        x1.push_back(b);
    }
    check("erf_between", MathFunction::erf_between, stated_limit("ellipsoid.cl", "erf_between"), x0, x1,
          [](float a, float b) { return high::erf_difference(Real(a), Real(b)); });
    check("erf_between, empty", MathFunction::erf_between, {1e-45, LimitUnit::absolute}, x0, x0, [](float, float) { return Real(0); });
}

TEST_CASE("Math.EpanechnikovInverse", "[kernels][quick]") {
    auto y = log_spaced(0x1.000002p-100f, 2.0f / 3.0f, 20000, 16);
    for (const float v : evenly_spaced(0.0f, 2.0f / 3.0f, 20000, 17)) y.push_back(v);
    check("epanechnikov_inverse", MathFunction::epanechnikov_inverse, body("epanechnikov_inverse"), y, {}, [](float a, float) {
        if (a < 0x1p-100f) return Real(0);
        // Newton's method from above on s² (1 − s/3), increasing in [0, 1].
        Real s = std::min(1.0, std::sqrt(static_cast<double>(a)) * 1.05);
        for (int k = 0; k < 60; ++k) {
            const Real step = (s * s * (1 - s / 3) - Real(a)) / (2 * s - s * s);
            s -= step;
            if (abs(step) < abs(s) * Real(1e-40)) break;
        }
        return s;
    });
}

TEST_CASE("Math.Trigonometry", "[kernels][quick]") {
    auto turns = evenly_spaced(0.0f, 1.0f, 20000, 18);
    for (const float v : log_spaced(1e-30f, 1.0f, 4000, 19)) turns.push_back(v);
    for (int k = 0; k <= 8; ++k) turns.push_back(static_cast<float>(k) / 8);
    const Limit sincos = stated_limit("math_body.inc.cl", "FN(sincos_turns)");
    check("sin of turns", MathFunction::sin_turns, sincos, turns, {}, [](float a, float) { return high::sin(2 * high::pi() * Real(a)); });
    check("cos of turns", MathFunction::cos_turns, sincos, turns, {}, [](float a, float) { return high::cos(2 * high::pi() * Real(a)); });
    auto x = evenly_spaced(-1.0f, 1.0f, 20000, 20);
    for (const float v : with_negatives(log_spaced(1e-30f, 1.0f, 4000, 21))) x.push_back(v);
    for (std::uint32_t k = 0; k < 1000; ++k) x.push_back(from_bits(0x3f800000u - k)), x.push_back(-from_bits(0x3f800000u - k)), x.push_back(from_bits(0x3f000000u + k - 500));
    check("asin", MathFunction::asin, stated_limit("math.cl", "asin_s"), x, {}, [](float a, float) { return high::asin(Real(a)); });
    check("acos", MathFunction::acos, stated_limit("math.cl", "acos_s"), x, {}, [](float a, float) { return Real(high::pi() / 2 - high::asin(Real(a))); });
    auto py = with_negatives(log_spaced(1e-12f, 1e12f, 10000, 22)), px = shuffled(py, 23);
    for (const float v : evenly_spaced(-1.0f, 1.0f, 10000, 24)) py.push_back(v), px.push_back(1 - std::abs(v));
    for (const float v : {0.0f, 1.0f, -1.0f, 3.0f}) py.push_back(v), px.push_back(0.0f), py.push_back(0.0f), px.push_back(v);
    check("atan2", MathFunction::atan2, stated_limit("math.cl", "atan2_s"), py, px,
          [](float a, float b) { return a == 0 && b == 0 ? Real(0) : Real(boost::multiprecision::atan2(Real(a), Real(b))); });
}

TEST_CASE("Math.UniformIsOpen", "[kernels][quick]") {
    std::vector<float> x;
    for (const std::uint32_t b : {0u, 1u, 2u, 0x7fffffffu, 0x80000000u, 0xffffff7fu, 0xffffff80u, 0xfffffffeu, 0xffffffffu}) x.push_back(from_bits(b));
    TestRandom random(25);
    for (int i = 0; i < 20000; ++i) x.push_back(from_bits(random.word()));
    const auto u = bare_probe(16).math(MathFunction::uniform, x);
    const double limit = stated_limit("rng_body.inc.cl", "FN(uniform)").value;
    for (std::size_t i = 0; i < x.size(); ++i) {
        INFO("bits " << bits(x[i]) << " give " << u[i]);
        const double exact = (static_cast<double>(bits(x[i])) + 0.5) * 0x1p-32;
        REQUIRE(u[i] > 0.0f);
        REQUIRE(u[i] < 1.0f);
        REQUIRE(std::abs(static_cast<double>(u[i]) - exact) <= exact * limit);
    }
}
