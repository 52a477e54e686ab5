// SPDX-License-Identifier: MIT
// The kernels' random numbers: Philox bit for bit against Random123's, per-primitive bits by χ² for uniformity and for
// pairs of neighbouring primitives and of related keys. p-values are corrected for the number of tests.
#include <Random123/philox.h>

#include <fmt/format.h>

#include "tests/probe_harness.h"
#include "tests/reference/statistics.h"

namespace {

using namespace clume;
using namespace clume::probing;
using reference::chi_square;

/// p-values of a family of tests of true hypotheses: fails with probability 1e-4 in all.
void check_family(const std::vector<double>& p, const std::string& what) {
    const double threshold = reference::sidak_threshold(1e-4, p.size());
    const double least = *std::min_element(p.begin(), p.end());
    const std::string text = fmt::format("{}: least p {:.3g} of {} tests, threshold {:.3g}", what, least, p.size(), threshold);
    report(text);
    INFO(text);
    CHECK(least > threshold);
}

double uniform_p(const std::vector<double>& counts, double total) { return chi_square(counts, std::vector<double>(counts.size(), total / static_cast<double>(counts.size()))).p; }

/// χ² of pairs (a, b) in 32 × 32 bins of the top bits.
double pair_p(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b, int shift_a = 27, int shift_b = 27) {
    std::vector<double> counts(1024);
    for (std::size_t i = 0; i < a.size(); ++i) counts[(a[i] >> shift_a & 31) * 32 + (b[i] >> shift_b & 31)] += 1;
    return uniform_p(counts, static_cast<double>(a.size()));
}

}  // namespace

TEST_CASE("Random.PhiloxIsRandom123s", "[kernels][quick]") {
    TestRandom random(1);
    std::vector<Probe::Words> counters, keys;
    for (int i = 0; i < 5000; ++i) {
        const bool small = i % 2;
        const auto word = [&] { return small ? static_cast<std::uint32_t>(random.below(3)) : random.word(); };
        counters.push_back({{word(), word(), word(), word()}});
        keys.push_back({{word(), word(), 0, 0}});
    }
    counters.push_back({{~0u, ~0u, ~0u, ~0u}});
    keys.push_back({{~0u, ~0u, 0, 0}});
    for (const int width : kWidths) {
        const auto got = bare_probe(width).philox(counters, keys);
        for (std::size_t i = 0; i < counters.size(); ++i) {
            const auto& c = counters[i].v;
            const r123::Philox4x32_R<7>::ctr_type in{{c[0], c[1], c[2], c[3]}};
            const r123::Philox4x32_R<7>::key_type key{{keys[i].v[0], keys[i].v[1]}};
            const auto out = r123::Philox4x32_R<7>()(in, key);
            INFO("width " << width << ", counter " << i);
            if (!(got[i].v[0] == out[0] && got[i].v[1] == out[1] && got[i].v[2] == out[2] && got[i].v[3] == out[3])) FAIL("differs from Random123");
        }
    }
}

TEST_CASE("Random.PrimitiveBitsAgreeOnEveryWidth", "[kernels][quick]") {
    const auto first = bare_probe(16).primitive_bits(12345, 0x1234567u, 0x89abcdefu, 4096);
    for (const int width : kWidths) CHECK(first_difference(first, bare_probe(width).primitive_bits(12345, 0x1234567u, 0x89abcdefu, 4096)) == first.size());
}

TEST_CASE("Random.PrimitiveBitsAreUniform", "[kernels][quick]") {
    // Over ids under one key, and over keys (as flights have them: Philox's words) for one id: 2^17 values in 256 bins of each byte.
    constexpr std::size_t n = 1 << 17;
    Probe& probe = bare_probe(16);
    TestRandom random(2);
    std::vector<double> p;
    for (int k = 0; k < 8; ++k) {
        const auto x = probe.primitive_bits(k % 2 ? 0 : random.word() >> 8, k < 2 ? 0 : random.word(), k < 2 ? 0 : random.word(), n);
        for (int byte = 0; byte < 4; ++byte) {
            std::vector<double> counts(256);
            for (const auto v : x) counts[v >> (8 * byte) & 255] += 1;
            p.push_back(uniform_p(counts, n));
        }
    }
    check_family(p, "bytes over ids");
}

TEST_CASE("Random.PrimitiveBitsOfNeighboursAreIndependent", "[kernels][quick]") {
    // A flight compares the draws of ids that stand close together, under one key: pairs at distances 1 … 64 over ids, and
    // small sets of ids over many keys, which is what a χ² on free flights sees.
    Probe& probe = bare_probe(16);
    TestRandom random(3);
    std::vector<double> p;
    for (int k = 0; k < 4; ++k) {
        const std::vector<std::uint32_t> x = probe.primitive_bits(0, random.word(), random.word(), (1 << 17) + 64);
        for (const int distance : {1, 2, 3, 4, 8, 16, 32, 64}) {
            const std::vector<std::uint32_t> a(x.begin(), x.begin() + (1 << 17)), b(x.begin() + distance, x.begin() + distance + (1 << 17));
            p.push_back(pair_p(a, b));
            p.push_back(pair_p(a, b, 27, 0));
            p.push_back(pair_p(a, b, 10, 10));
        }
    }
    check_family(p, "neighbouring ids under one key");
}

TEST_CASE("Random.PrimitiveBitsOverKeysAreIndependent", "[kernels]") {
    // 16 ids under 8000 random keys; and under keys whose first word differs by one bit or counts up.
    Probe& probe = bare_probe(16);
    TestRandom random(4);
    std::vector<double> p;
    std::vector<std::vector<std::uint32_t>> columns(16);
    std::vector<std::uint32_t> single, flipped_lo, next;
    for (int k = 0; k < 8000; ++k) {
        const std::uint32_t lo = random.word(), hi = random.word();
        const auto x = probe.primitive_bits(100, lo, hi, 16);
        for (std::size_t i = 0; i < 16; ++i) columns[i].push_back(x[i]);
        const auto l = probe.primitive_bits(100, lo ^ (1u << k % 32), hi, 16);
        const auto up = probe.primitive_bits(100, static_cast<std::uint32_t>(k), 7, 16);
        for (std::size_t i = 0; i < 16; ++i) {
            single.push_back(x[i]);
            flipped_lo.push_back(l[i]);
        }
        next.insert(next.end(), up.begin(), up.end());
    }
    p.push_back(pair_p(single, flipped_lo));
    {
        const std::vector<std::uint32_t> a(next.begin(), next.end() - 16), b(next.begin() + 16, next.end());
        p.push_back(pair_p(a, b));
    }
    for (std::size_t i = 0; i < 16; ++i)
        for (std::size_t j = i + 1; j < 16; ++j) p.push_back(pair_p(columns[i], columns[j]));
    check_family(p, "ids over keys");
}
