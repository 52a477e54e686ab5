// SPDX-License-Identifier: MIT
// `clume stress` itself: the device holds every limit that the kernels state; a wrong kernel and a wrong limit are found; the
// 256-bit oracle agrees with quadrature and with the tests' own; limits are read from comments; what the report writes.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <fmt/format.h>
#include <fstream>
#include <set>
#include <sstream>

#include "src/stress.h"
#include "src/stress_lines.h"
#include "src/stress_oracle.h"
#include "src/stress_parts.h"
#include "src/stress_report.h"
#include "tests/cli_process.h"
#include "tests/probe_harness.h"
#include "tests/reference/analytic_scenes.h"
#include "tests/reference/high_precision.h"
#include "tests/temp_folder.h"

namespace {

using namespace clume;
using namespace clume::probing;

const StressResult& quick_result() {
    static const StressResult result = run_stress(test_device(), {.quick = true}, [](double) {});
    return result;
}

/// One part of it, such as stress_chords.
template <class Part>
StressResult alone(Part part, const StressOptions& options) {
    StressDevice device(test_device());
    StressResult result;
    part(device, options, result, [](double) {});
    return result;
}

std::size_t exceeded(const StressResult& result, const std::string& function) {
    std::size_t count = 0;
    for (const StressRow& r : result.rows) count += r.function == function && !r.holds();
    return count;
}

std::string read_text(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

}  // namespace

TEST_CASE("Stress.EveryLimitHolds", "[kernels][quick]") {
    std::set<std::string> functions;
    for (const StressRow& r : quick_result().rows) {
        INFO(r.quantity << " (" << r.function << "), " << r.family << ": " << r.trouble() << "; at " << r.worst_at);
        CHECK(r.holds());
        CHECK(r.cases > 0);
        CHECK(r.limit.value > 0);
        functions.insert(r.function);
    }
    for (const char* name : {"FN(rcp)", "FN(divide)", "FN(rsqrt)", "FN(sqrt)", "FN(exp)", "FN(log)", "FN(exponential)", "FN(erfc)", "FN(erfc_inverse)", "FN(epanechnikov_inverse)", "FN(sincos_turns)", "asin_s", "acos_s",
                             "atan2_s", "normalize_s", "FN(uniform)", "erf_between", "intersect", "intersect_quadratic", "density_part", "depth_part", "flight_part", "transmittance_analytic", "FN(phase_value)", "FN(phase_sample)",
                             "light_sample", "envmap_sample", "envmap_texel", "camera_ray"})
        CHECK(functions.count(name) == 1);
}

TEST_CASE("Stress.WrongFormulasAreFound", "[kernels][quick]") {
    // The textbook's formulas judged as if they were the kernels': each must break its limit in several families.
    const StressResult result = alone(stress_chords, {.quick = true, .naive = true});
    CHECK_FALSE(result.holds());
    CHECK(exceeded(result, "intersect") > 3);
    CHECK(exceeded(result, "depth_part") > 3);
    CHECK(exceeded(result, "flight_part") > 3);
    // Where the line lies is not theirs to get wrong: the integral and its inversion are.
    const StressResult given = alone(stress_given, {.quick = true, .naive = true});
    CHECK(exceeded(given, "depth_part") > 3);
    CHECK(exceeded(given, "flight_part") > 3);
}

TEST_CASE("Stress.TooStrictLimitsAreFound", "[kernels][quick]") {
    // No float chord is within a thousandth of an ulp: a check that reads the wrong column would not notice.
    const StressResult result = alone(stress_chords, {.quick = true, .strictness = 4000});
    std::size_t rows = 0;
    for (const StressRow& r : result.rows) rows += r.function == "intersect";
    CHECK(exceeded(result, "intersect") == rows);
    const StressResult images = alone(stress_environment, {.quick = true, .strictness = 4000});
    CHECK(exceeded(images, "envmap_sample") >= 10);
    CHECK(exceeded(images, "light_sample") >= 10);
    const StressResult lights = alone(stress_lights, {.quick = true, .strictness = 4000});
    CHECK(exceeded(lights, "light_sample") > 25);
}

TEST_CASE("Stress.InversionErrorsShowInTheDevicesGeometry", "[quick]") {
    // A small Gaussian from within: a flight off by 1e-5 of its depth is hidden by what a line may move, not by what t may.
    oracle::Ellipsoid256 e;
    e.family = KernelFamily::gaussian, e.sigma = 1000, e.e2 = 9, e.mu = oracle::vector(std::array{0.5, 0.0, 0.0}.data());
    e.w = {1000, 0, 0, 1000, 0, 1000};
    const oracle::Line256 line(e, oracle::vector(std::array{0.4995, 0.0005, 0.0}.data()), oracle::vector(std::array{1.0, 0.0, 0.0}.data()));
    const oracle::Line256 given(e, line.t_perp, line.w, line.distance * line.distance);
    const oracle::Real tau = 0.3;
    const double exact = static_cast<double>(line.invert(0, tau)), limit = stated_limit("ellipsoid.cl", "flight_part", "geometry").value, off = exact * (1 + 1e-5);
    const double moved = stated_limit("ellipsoid.cl", "intersect").value * 0x1p-23, reach = static_cast<double>(abs(given.t_perp) + given.reach());
    double relative = NAN;
    CHECK(flight_error(line, 0, tau, off, moved, relative).error == 0);
    CHECK(relative > 2 * limit);
    CHECK(flight_error(given, 0, tau, off, 0x1p-23 * reach, relative).error > 2 * limit);
    CHECK(flight_error(given, 0, tau, exact, 0x1p-23 * reach, relative).error == 0);
}

TEST_CASE("Stress.LightsTellWhatRoundingTheSceneDoes", "[kernels][quick]") {
    for (const StressRow& r : quick_result().rows) {
        if (!r.quantity.starts_with("light sampling") && !r.quantity.starts_with("environment image")) continue;
        INFO(r.quantity << ", " << r.family << ": " << r.rounding.worst);
        CHECK_FALSE(std::isnan(r.rounding.worst));
        // The scene's numbers are rounded by half an ulp: what is well placed moves by no more than a few, and by something.
        if (r.family == "point" || r.family == "sphere" || r.family == "spot" || r.family == "rectangle") {
            CHECK(r.rounding.worst > 0);
            if (r.quantity.ends_with("end")) CHECK(r.rounding.worst < 3);
        }
    }
}

TEST_CASE("Stress.RowsTellWhatIsWrong", "[quick]") {
    const Limit limit{1e-6, LimitUnit::relative};
    const auto row = [&](const StressError& e) { return stress_row("q", "f", "family", limit, {StressError{}, e}, {}); };
    StressError large, none;
    large.error = 2e-6;
    none.nonfinite = true;
    CHECK(row({}).holds());
    CHECK_FALSE(row(large).holds());
    CHECK_FALSE(row(none).holds());
    for (StressCount StressRow::*count : {&StressRow::lost_beyond, &StressRow::invented_beyond, &StressRow::additivity, &StressRow::monotonicity, &StressRow::round_trip}) {
        StressRow r = row({});
        r.*count = {1, 2, ""};
        CHECK_FALSE(r.holds());
    }
    CHECK(compare_to(NAN, oracle::Real(1), LimitUnit::ulp).nonfinite);
    CHECK(compare_to(1 + 0x1p-23, oracle::Real(1), LimitUnit::ulp).error == Approx(1));
}

TEST_CASE("Stress.LimitsStandInTheComments", "[quick]") {
    const std::string text =
        "\n/// Half of x; error < 0.5 ulp. Ends\n/// of it: ends error < 3 ulp of the radius, sum error < 1e-7\n/// relative.\nstatic float half(float x) {\n\n/// Nothing said.\nstatic float other(float x) {\n";
    CHECK(limit_in(text, "half").value == 0.5);
    CHECK(limit_in(text, "half").unit == LimitUnit::ulp);
    CHECK(limit_in(text, "half", "ends").value == 3);
    CHECK(limit_in(text, "half", "ends").unit == LimitUnit::radius_ulp);
    CHECK(limit_in(text, "half", "sum").value == 1e-7);
    CHECK_THROWS(limit_in(text, "half", "pdf"));
    CHECK_THROWS(limit_in(text, "other"));
    CHECK_THROWS(limit_in(text, "none"));
    CHECK_THROWS(stated_limit("none.cl", "half"));
}

TEST_CASE("Stress.OracleAgreesWithQuadrature", "[quick]") {
    namespace high = reference::high;
    TestRandom random(77);
    for (const KernelFamily kernel : {KernelFamily::gaussian, KernelFamily::epanechnikov, KernelFamily::uniform})
        for (int i = 0; i < 30; ++i) {
            const double ratio = random.spread(1, 1e5);
            double w[6];
            for (double& v : w) v = random.uniform(-1, 1) * random.spread(1, ratio);
            w[0] = random.spread(1, ratio), w[3] = random.spread(1, ratio), w[5] = random.spread(1, ratio);
            const glm::dvec3 o(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)), d = glm::normalize(glm::dvec3(random.uniform(-1, 1), 0.2, 1));
            const glm::dvec3 mu = o + random.uniform(-1, 1) * d + random.spread(1e-6, 1) / ratio * glm::dvec3(0.3, -0.5, 0.1);
            const high::Chord chord(o, d, mu, high::whitening_from_upper(w), high::Real(3), high::Real(3), kernel);
            oracle::Ellipsoid256 e;
            e.family = kernel, e.sigma = 3, e.e2 = 9, e.mu = oracle::vector(&mu.x);
            for (std::size_t k = 0; k < 6; ++k) e.w[k] = w[k];
            const oracle::Line256 line(e, oracle::vector(&o.x), oracle::vector(&d.x));
            REQUIRE(line.hit() == chord.hit());
            if (!line.hit()) continue;
            const double t_in = static_cast<double>(line.t_in()), t_out = static_cast<double>(line.t_out());
            const double t0 = t_in + (t_out - t_in) * random.uniform(-0.2, 0.9), t1 = t0 + (t_out - t_in) * random.uniform(0.1, 1);
            const double whole = static_cast<double>(chord.optical_depth_quadrature(t0, t1)), got = static_cast<double>(line.depth(t0, t1));
            CHECK(got == Approx(whole).epsilon(1e-14));
            const oracle::Line256 given(e, line.t_perp, line.w, line.distance * line.distance);
            CHECK(abs(given.depth(t0, t1) - line.depth(t0, t1)) <= line.depth(t0, t1) * oracle::Real(1e-60));
            const oracle::Real begin = std::max(t0, t_in), end = std::min(t1, t_out);  // as the device gives them
            for (const double along : {-0.9e-9, 0.9e-9}) CHECK(given.depth_near(begin, end, 1e-9).outside(line.depth(begin + along, end + along), line.depth(begin, end)) < 1e-60);
            const auto range = line.depth_near(t0, t1, 1e-9);
            CHECK(range.outside(line.depth(t0, t1), line.depth(t0, t1)) < 1e-60);
            for (int axis = 0; axis < 3; ++axis)
                for (const double sign : {-1.0, 1.0}) {  // a line moved less than the range allows for lies in it
                    glm::dvec3 moved = o;
                    moved[axis] += sign * 0.9e-9;
                    const oracle::Line256 other(e, oracle::vector(&moved.x), oracle::vector(&d.x));
                    CHECK(range.outside(other.depth(t0, t1), line.depth(t0, t1)) < 1e-60);
                }
            if (const auto t = chord.invert(high::Real(t_in), high::Real(whole / 2))) CHECK(static_cast<double>(line.invert(t_in, whole / 2)) == Approx(static_cast<double>(*t)).epsilon(1e-12));
            // A point δ off the surface along its normal is δ away from it.
            const oracle::Vector entry = oracle::along(oracle::vector(&o.x), oracle::vector(&d.x), line.t_in());
            const oracle::Vector a = e.whiten({entry[0] - e.mu[0], entry[1] - e.mu[1], entry[2] - e.mu[2]}), n = oracle::unit(e.unwhiten(a));
            CHECK(static_cast<double>(e.surface_distance(entry, 3)) < 1e-30);
            for (const double delta : {1e-9, -1e-15}) CHECK(static_cast<double>(e.surface_distance(oracle::along(entry, n, delta), 3)) == Approx(std::abs(delta)).epsilon(1e-9));
        }
}

TEST_CASE("Stress.ReportIsWhole", "[quick]") {
    const test::TempFolder folder;
    const StressResult& result = quick_result();
    const std::filesystem::path page = write_stress_report(folder.path() / "out", std::span(&result, 1));
    const std::string html = read_text(page);
    CHECK(page.filename() == "index.html");
    for (const char* part : {"<!DOCTYPE html>", "data:image/svg+xml", "Optical depth", "optical depth", "c − b²/a", "axis ratio 1 to 1e6, gaussian", "</html>"}) CHECK(html.find(part) != std::string::npos);
    CHECK(html.find("src=\"http") == std::string::npos);
    // A page with places for tables is remade, its prose left alone.
    const std::filesystem::path docs = folder.path() / "docs";
    std::filesystem::create_directories(docs);
    std::ofstream(docs / "stability.md") << "# Title\n\n<!-- table conditions -->\n<!-- end -->\nprose\n<!-- table limits -->\nold\n<!-- end -->\n<!-- table families -->\n<!-- end -->\n";
    CHECK(write_stress_report(docs, std::span(&result, 1)).filename() == "stability.md");
    const std::string text = read_text(docs / "stability.md");
    CHECK(text.find("prose\n") != std::string::npos);
    CHECK(text.find("old\n") == std::string::npos);
    CHECK(text.find("`depth_part`") != std::string::npos);
    CHECK(std::filesystem::exists(docs / "images" / "stability" / "depth_distance.svg"));
    const std::filesystem::path json = folder.path() / "all.json";
    write_stress_json(json, std::span(&result, 1));
    CHECK(read_text(json).find("\"made_by\": \"clume stress\"") != std::string::npos);
    CHECK(stress_table(result).find("free flight") != std::string::npos);
}

TEST_CASE("Stress.CommandLine", "[cli]") {
    const test::SceneFolder folder;
    const auto code = [&](const test::Words& words) {
        test::Process process(words, folder.path);
        return process.wait();
    };
    CHECK(code({"stress", "--nonsense"}) == 2);
    CHECK(code({"stress", "--device", "no-such-device"}) == 4);
}
