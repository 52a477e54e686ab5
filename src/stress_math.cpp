// SPDX-License-Identifier: MIT
// Elementary functions and random numbers over their stated domains: logarithmic and even spacing, ends of the domain, powers
// of two and their neighbours, denormals where the domain has them, tails, and the counters' outputs 0 and 2³² − 1.
#include <bit>
#include <cmath>
#include <fmt/format.h>

#include "src/parallel.h"
#include "src/stress_families.h"
#include "src/stress_parts.h"

namespace clume {
namespace {

using oracle::Real;

float from_bits(std::uint32_t b) { return std::bit_cast<float>(b); }
std::uint32_t bits(float f) { return std::bit_cast<std::uint32_t>(f); }

struct Inputs {
    const char* family;
    std::vector<float> x, y;
};

struct Domain {
    double lo, hi;
    bool negative = false;  ///< its mirror image as well
};

/// Inputs of a function of one argument (or of two, the second shuffled).
std::vector<Inputs> inputs_of(const Domain& d, std::size_t count, StressRandom& random, bool tiny) {
    std::vector<Inputs> all;
    const auto sign = [&] { return d.negative ? random.sign() : 1.0; };
    const auto lo = static_cast<float>(d.lo), hi = static_cast<float>(d.hi), least = static_cast<float>(d.lo > 0 ? d.lo : 0x1p-100);
    Inputs spread{"log-spaced", {}, {}}, even{"evenly spaced", {}, {}}, ends{"ends, powers of two", {}, {}}, denormal{"0 and denormals", {}, {}};
    for (std::size_t i = 0; i < count; ++i) {
        if (d.hi > 0) spread.x.push_back(std::clamp(static_cast<float>(random.spread(static_cast<double>(least), d.hi)), least, hi) * static_cast<float>(sign()));
        even.x.push_back(std::clamp(static_cast<float>(random.uniform(d.lo, d.hi)), lo, hi) * static_cast<float>(sign()));
    }
    const auto add = [&](float v) {
        if (v >= lo && v <= hi) ends.x.push_back(v), ends.x.push_back(d.negative ? -v : v);
    };
    for (std::uint32_t k = 0; k < 20; ++k)
        for (const float v : {lo, hi}) add(from_bits(bits(v) + k)), add(from_bits(bits(v) - std::min(bits(v), k)));
    for (int e = -126; e < 127; ++e)
        for (int k = -2; k <= 2; ++k) add(from_bits(static_cast<std::uint32_t>(static_cast<int>(bits(std::ldexp(1.0f, e))) + k)));
    all.push_back(spread);
    all.push_back(even);
    all.push_back(ends);
    if (tiny) {
        for (const std::uint32_t b : {0u, 1u, 2u, 3u, 0x7fffffu, 0x800000u, 0x400000u}) denormal.x.push_back(from_bits(b)), denormal.x.push_back(d.negative ? -from_bits(b) : from_bits(b));
        for (std::size_t i = 0; i < count / 4; ++i) denormal.x.push_back(from_bits(random.word() >> (9 + random.below(20))));
        all.push_back(denormal);
    }
    return all;
}

/// Words of a counter's output, as bits of floats.
std::vector<Inputs> counters(std::size_t count, StressRandom& random) {
    Inputs ends{"outputs next to 0 and 2^32", {}, {}}, some{"any output", {}, {}};
    for (std::uint32_t k = 0; k < 300; ++k)
        for (const std::uint32_t b : {k, ~k, 0x80000000u + k, 0x7fffffffu - k, 0xb504f333u + k - 150, 0x4afb0cccu + k - 150}) ends.x.push_back(from_bits(b));
    for (std::uint32_t e = 1; e < 32; ++e)
        for (std::uint32_t k = 0; k < 5; ++k) ends.x.push_back(from_bits((1u << e) + k - 2)), ends.x.push_back(from_bits(~((1u << e) + k - 2)));
    for (std::size_t i = 0; i < count; ++i) some.x.push_back(from_bits(random.below(2) ? random.word() : random.word() >> random.below(32)));
    return {ends, some};
}

struct Checker {
    StressDevice& device;
    const StressOptions& options;
    StressResult& result;
    const PartProgress& progress;
    int done = 0;
    static constexpr int total = 20;

    template <class Truth>
    void check(const char* name, MathFunction function, const char* file, const char* stated, const std::vector<Inputs>& inputs, const Truth& truth) {
        const Limit limit = stated_limit(file, stated);
        for (const Inputs& in : inputs) {
            const std::vector<float> got = device.probe().math(function, in.x, in.y);
            std::vector<StressError> errors(in.x.size());
            parallel_chunks(errors.size(), 64, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    const float y = in.y.empty() ? 1.0f : in.y[i];
                    errors[i] = compare_to(static_cast<double>(got[i]), Real(truth(in.x[i], y)), limit.unit);
                    errors[i].at = fmt::format("({:.9g} [{:08x}], {:.9g}) = {:.9g}", in.x[i], bits(in.x[i]), y, got[i]);
                }
            });
            result.rows.push_back(stress_row(name, stated, in.family, limit, errors, options));
        }
        progress(static_cast<double>(++done) / total);
    }
};

Real real(float v) { return Real(static_cast<double>(v)); }
Real u_of(float word) { return (Real(bits(word)) + Real(0.5)) / Real(4294967296.0); }

Real epanechnikov_inverse(const Real& y) {
    if (y < Real(0x1p-100)) return 0;
    Real s = std::min(1.0, std::sqrt(static_cast<double>(y)) * 1.05);
    for (int k = 0; k < 80; ++k) {
        const Real step = (s * s * (1 - s / 3) - y) / (2 * s - s * s);
        s -= step;
        if (abs(step) < s * Real(1e-60)) break;
    }
    return s;
}

/// Both tails, straddling, short and long.
std::vector<Inputs> intervals(std::size_t count, StressRandom& random) {
    std::vector<Inputs> all{{"short intervals", {}, {}}, {"long intervals", {}, {}}, {"tails", {}, {}}, {"nearly equal ends", {}, {}}};
    for (std::size_t i = 0; i < 4 * count; ++i) {
        Inputs& in = all[i % 4];
        double middle = random.uniform(-6, 6), half = 0;
        switch (i % 4) {
            case 0: half = random.spread(1e-7, 0.3); break;
            case 1: half = random.uniform(0.2, 6); break;
            case 2: middle = random.sign() * random.uniform(4, 6), half = random.spread(1e-6, 2); break;
            default: half = std::abs(middle) * random.spread(6e-8, 1e-6); break;
        }
        const auto a = static_cast<float>(std::clamp(middle - half, -6.0, 6.0)), b = static_cast<float>(std::clamp(middle + half, -6.0, 6.0));
        if (!(a < b)) continue;
        in.x.push_back(a);
        in.y.push_back(b);
    }
    return all;
}

std::vector<Inputs> with_second(std::vector<Inputs> inputs, const std::vector<Inputs>& second, StressRandom& random) {
    for (std::size_t k = 0; k < inputs.size(); ++k)
        for (std::size_t i = 0; i < inputs[k].x.size(); ++i) {
            const auto& from = second[k].x;
            inputs[k].y.push_back(from[static_cast<std::size_t>(random.below(static_cast<int>(from.size())))]);
        }
    return inputs;
}

}  // namespace

void stress_math(StressDevice& device, const StressOptions& options, StressResult& result, const PartProgress& progress) {
    const std::size_t n = options.quick ? 400 : 20000;
    StressRandom random(1);
    Checker c{device, options, result, progress};
    const auto in = [&](Domain d, bool tiny = false) { return inputs_of(d, n, random, tiny); };
    const char *body = "math_body.inc.cl", *math = "math.cl";
    const Domain wide{0x1.000002p-100, 0x1.fffffep99, true}, half{0x1p-50, 0x1p50, true}, positive{0x1.000002p-100, 0x1.fffffep99};
    c.check("1 / x", MathFunction::rcp, body, "FN(rcp)", in(wide), [](float a, float) { return 1 / real(a); });
    c.check("a / b", MathFunction::divide, body, "FN(divide)", with_second(in(half), in(half), random), [](float a, float b) { return real(a) / real(b); });
    c.check("1 / √x", MathFunction::rsqrt, body, "FN(rsqrt)", in(positive), [](float a, float) { return 1 / sqrt(real(a)); });
    c.check("√x", MathFunction::sqrt, body, "FN(sqrt)", in({0, 0x1.fffffep99}, true), [](float a, float) { return a < 0x1p-100f ? Real(0) : Real(sqrt(real(a))); });
    c.check("exp", MathFunction::exp, body, "FN(exp)", in({-69, 88}, true), [](float a, float) { return exp(real(a)); });
    Inputs under{"underflow", {-69.00001f, -70, -87, -88, -104, -1e3f, -1e30f, -3.4e38f}, {}};
    c.check("exp", MathFunction::exp, body, "FN(exp)", {under}, [](float, float) { return Real(0); });
    c.check("log", MathFunction::log, body, "FN(log)", in({0x1.000002p-120, 0x1.fffffep119}), [](float a, float) { return a == 1.0f ? Real(0) : Real(log(real(a))); });
    c.check("−log(u) of bits", MathFunction::exponential, body, "FN(exponential)", counters(n, random), [](float a, float) { return -log(u_of(a)); });
    auto complemented = counters(n, random);
    for (Inputs& i : complemented)
        for (float& v : i.x) v = from_bits(~bits(v));
    c.check("−log(1 − u) of bits", MathFunction::exponential, body, "FN(exponential)", complemented, [](float a, float) { return -log(1 - u_of(from_bits(~bits(a)))); });
    c.check("bits to (0, 1)", MathFunction::uniform, "rng_body.inc.cl", "FN(uniform)", counters(n, random), [](float a, float) { return u_of(a); });
    c.check("bits to float", MathFunction::from_uint, body, "FN(from_uint)", counters(n, random), [](float a, float) { return Real(bits(a)); });
    c.check("erfc", MathFunction::erfc, body, "FN(erfc)", in({0, 8}, true), [](float a, float) { return oracle::erfc(real(a)); });
    c.check("erfc⁻¹", MathFunction::erfc_inverse, body, "FN(erfc_inverse)", in({0x1.000002p-90, 1}), [](float a, float) { return oracle::erfc_inverse(real(a)); });
    c.check("erf(b) − erf(a)", MathFunction::erf_between, "ellipsoid.cl", "erf_between", intervals(n, random), [](float a, float b) { return oracle::erf_between(real(a), real(b)); });
    c.check("Epanechnikov depth⁻¹", MathFunction::epanechnikov_inverse, body, "FN(epanechnikov_inverse)", in({0, 2.0 / 3.0}, true), [](float a, float) { return epanechnikov_inverse(real(a)); });
    c.check("sin 2πx", MathFunction::sin_turns, body, "FN(sincos_turns)", in({0, 1}, true), [](float a, float) { return sin(2 * oracle::pi() * real(a)); });
    c.check("cos 2πx", MathFunction::cos_turns, body, "FN(sincos_turns)", in({0, 1}, true), [](float a, float) { return cos(2 * oracle::pi() * real(a)); });
    c.check("asin", MathFunction::asin, math, "asin_s", in({0, 1, true}, true), [](float a, float) { return asin(real(a)); });
    c.check("acos", MathFunction::acos, math, "acos_s", in({0, 1, true}, true), [](float a, float) { return acos(real(a)); });
    const Domain plane{1e-12, 1e12, true};
    c.check("atan2", MathFunction::atan2, math, "atan2_s", with_second(in(plane), in(plane), random), [](float a, float b) { return boost::multiprecision::atan2(real(a), real(b)); });
    const Domain lengths{1e-12, 5e11, true};
    c.check("v / |v|", MathFunction::normalize_x, math, "normalize_s", with_second(in(lengths), in(lengths), random),
            [](float a, float b) { return real(a) / sqrt(real(a) * real(a) + 2 * real(b) * real(b)); });
}

}  // namespace clume
