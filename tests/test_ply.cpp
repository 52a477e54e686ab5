// SPDX-License-Identifier: MIT
// The PLY reader: every format, type and encoding gives the same ellipsoids; bad files are refused by name.
// Files are made by `PlyFile`, which writes one table of columns in any format.
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "src/error.h"
#include "src/ply_reader.h"
#include "tests/temp_folder.h"

using namespace clume;
using clume::test::TempFolder;

namespace {

struct Column {
    std::string name, type;
    std::vector<double> values;
};

template <typename T>
std::string raw(double value, bool big) {
    const T v = static_cast<T>(value);
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &v, sizeof(T));
    return big == (std::endian::native == std::endian::big) ? bytes : std::string(bytes.rbegin(), bytes.rend());
}

std::string encode(const std::string& type, double v, bool big) {
    if (type == "char" || type == "int8") return raw<std::int8_t>(v, big);
    if (type == "uchar" || type == "uint8") return raw<std::uint8_t>(v, big);
    if (type == "short" || type == "int16") return raw<std::int16_t>(v, big);
    if (type == "ushort" || type == "uint16") return raw<std::uint16_t>(v, big);
    if (type == "int" || type == "int32") return raw<std::int32_t>(v, big);
    if (type == "uint" || type == "uint32") return raw<std::uint32_t>(v, big);
    if (type == "float" || type == "float32") return raw<float>(v, big);
    return raw<double>(v, big);
}

const char* const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};

std::string number(double v) {
    char text[64];
    std::snprintf(text, sizeof text, "%.17g", v);
    return text;
}

/// `around`: with a list element before and one after, and a list inside the vertices.
std::string ply_file(const std::string& format, const std::vector<Column>& columns, bool around = false,
                     const std::string& eol = "\n") {
    const bool ascii = format == "ascii", big = format == "binary_big_endian";
    const std::size_t count = columns[0].values.size();
    std::string out =
        "ply" + eol + "format " + format + " 1.0" + eol + "comment made by a test" + eol + "obj_info nothing" + eol;
    if (around) out += "element face 2" + eol + "property list uchar int vertex_indices" + eol + "property double area" + eol;
    out += "element vertex " + std::to_string(count) + eol;
    for (const Column& c : columns) out += "property " + c.type + " " + c.name + eol;
    if (around) out += "property list ushort float history" + eol + "element edge 1" + eol + "property int a" + eol;
    out += "end_header" + eol;
    const auto put = [&](const std::string& type, double v) { out += ascii ? number(v) + " " : encode(type, v, big); };
    const auto end = [&] {
        if (ascii) out += eol;
    };
    if (around)
        for (int face = 0; face < 2; ++face) {
            put("uchar", 3 - face);
            for (int i = 0; i < 3 - face; ++i) put("int", i);
            put("double", 0.5);
            end();
        }
    for (std::size_t row = 0; row < count; ++row) {
        for (const Column& c : columns) put(c.type, c.values[row]);
        if (around) {
            put("ushort", static_cast<double>(row));
            for (std::size_t i = 0; i < row; ++i) put("float", 9);
        }
        end();
    }
    if (around) {
        put("int", 7);
        end();
    }
    return out;
}

std::vector<Column> columns(const std::string& type = "float") {
    return {{"rot_3", type, {0, 0, 0}},       {"x", type, {1, -2, 3}},         {"nx", "float", {7, 7, 7}},
            {"sigma_t", type, {0.5, 2, 0}},   {"rot_0", type, {2, 0, 1}},      {"rot_1", type, {0, 3, 0}},
            {"rot_2", type, {0, 4, 0}},       {"y", type, {4, 5, 6}},          {"z", type, {7, 8, 9}},
            {"scale_2", type, {-1, 0, 0.5}},  {"scale_1", type, {0, 0, 0.25}}, {"scale_0", type, {1, 0, 0}},
            {"albedo_0", type, {0, 0.5, 1}},  {"albedo_1", type, {1, 1, 1}},   {"albedo_2", type, {0.25, 0, 0}},
            {"f_rest_0", "double", {1, 2, 3}}};
}

std::vector<Column> with(std::vector<Column> all, const std::string& name, std::size_t row, double value) {
    for (Column& c : all)
        if (c.name == name) {
            c.values[row] = value;
            return all;
        }
    all.push_back({name, "float", std::vector<double>(all[0].values.size(), 0.0)});
    all.back().values[row] = value;
    return all;
}

std::vector<Column> without(std::vector<Column> all, const std::string& name) {
    std::erase_if(all, [&](const Column& c) { return c.name == name; });
    return all;
}

std::vector<PlyEllipsoid> read(const std::string& bytes, const PlyOptions& options = {}) {
    const TempFolder folder;
    std::vector<PlyEllipsoid> out;
    read_ply(folder.write("a.ply", bytes), options, [&](const PlyEllipsoid& e, std::size_t index, std::size_t) {
        REQUIRE(index == out.size());
        out.push_back(e);
    });
    return out;
}

std::string error_of(const std::string& bytes, const PlyOptions& options = {}) {
    try {
        read(bytes, options);
    } catch (const SceneError& error) {
        const std::string message = error.what();
        CHECK(message.find('\n') == std::string::npos);
        const auto at = message.find("a.ply:");
        return at == std::string::npos ? message : message.substr(at);
    }
    return "";
}

bool contains(const std::string& text, const std::string& part) {
    INFO(text);
    INFO(part);
    CHECK(text.find(part) != std::string::npos);
    return text.find(part) != std::string::npos;
}

void check_standard(const std::vector<PlyEllipsoid>& e) {
    REQUIRE(e.size() == 3);
    CHECK(e[0].center == glm::dvec3(1, 4, 7));
    CHECK(e[1].center == glm::dvec3(-2, 5, 8));
    CHECK(e[0].scale.x == Approx(std::exp(1.0)));
    CHECK(e[0].scale.y == 1);
    CHECK(e[0].scale.z == Approx(std::exp(-1.0)));
    CHECK(e[0].rotation == glm::dvec4(1, 0, 0, 0));
    CHECK(glm::distance(e[1].rotation, glm::dvec4(0, 0.6, 0.8, 0)) < 1e-15);
    CHECK(e[0].density == 0.5);
    CHECK(e[2].density == 0);
    CHECK(e[0].albedo == glm::dvec3(0, 1, 0.25));
    CHECK(e[1].emission == glm::dvec3(0));
    CHECK_FALSE(e[0].g);
    CHECK_FALSE(e[0].density_is_depth);
}

}  // namespace

TEST_CASE("Ply.EveryFormatAndTypeReadsTheSame", "[quick]") {
    for (const char* format : formats)
        for (const char* type : {"float", "double", "float32", "float64"})
            for (const bool around : {false, true})
                for (const char* eol : {"\n", "\r\n"}) {
                    INFO(format << " " << type << " " << around);
                    check_standard(read(ply_file(format, columns(type), around, eol)));
                }
}

TEST_CASE("Ply.IntegerTypes", "[quick]") {
    for (const char* format : formats)
        for (const char* type :
             {"char", "int8", "uchar", "uint8", "short", "int16", "ushort", "uint16", "int", "int32", "uint", "uint32"}) {
            auto all = columns();
            for (Column& c : all)
                if (c.name == "x") c = {"x", type, {100, 3, 0}};
            INFO(format << " " << type);
            CHECK(read(ply_file(format, all))[0].center.x == 100);
            for (Column& c : all)
                if (c.name == "x") c.values[0] = -100;
            if (type[0] != 'u') CHECK(read(ply_file(format, all))[0].center.x == -100);
        }
}

TEST_CASE("Ply.Encodings", "[quick]") {
    SECTION("linear scales") {
        const auto all = with(with(with(columns(), "scale_0", 1, 0.5), "scale_0", 2, 1), "scale_2", 0, 2);
        auto linear = with(with(with(all, "scale_1", 0, 3), "scale_1", 1, 3), "scale_2", 1, 1);
        PlyOptions options;
        options.scale = ScaleEncoding::linear;
        CHECK(read(ply_file("ascii", linear), options)[0].scale == glm::dvec3(1, 3, 2));
        CHECK(contains(error_of(ply_file("ascii", with(linear, "scale_1", 2, 0)), options),
                       "primitive 2: scale_1 must be positive"));
        CHECK(contains(error_of(ply_file("ascii", with(linear, "scale_1", 2, -1)), options),
                       "primitive 2: scale_1 must be positive"));
    }
    SECTION("opacity is a depth") {
        auto all = with(with(without(columns(), "sigma_t"), "opacity", 0, 2), "opacity", 1, 800);
        const auto e = read(ply_file("binary_little_endian", with(all, "opacity", 2, -800)));
        CHECK(e[0].density_is_depth);
        CHECK(1 - std::exp(-e[0].density) == Approx(1 / (1 + std::exp(-2.0))));
        CHECK(e[1].density == 800);
        CHECK(e[2].density == 0);
    }
    SECTION("sigma_t_0, and the density encoding given") {
        auto all = with(without(columns(), "sigma_t"), "sigma_t_0", 0, 3);
        CHECK(read(ply_file("ascii", all))[0].density == 3);
        PlyOptions options;
        options.density = DensityEncoding::opacity;
        CHECK(read(ply_file("ascii", all), options)[0].density == Approx(std::log1p(std::exp(3.0))));
        all = with(all, "opacity", 0, 5);
        CHECK(read(ply_file("ascii", all))[0].density == 3);
        CHECK(read(ply_file("ascii", all), options)[0].density == Approx(std::log1p(std::exp(5.0))));
        options.density = DensityEncoding::extinction;
        CHECK(read(ply_file("ascii", without(all, "sigma_t_0")), options)[0].density == 5);
    }
    SECTION("captures' colours") {
        auto all = without(without(without(columns(), "albedo_0"), "albedo_1"), "albedo_2");
        CHECK(read(ply_file("ascii", all))[0].albedo == glm::dvec3(0.9));
        all = with(with(with(all, "f_dc_0", 0, 1), "f_dc_1", 0, 100), "f_dc_2", 0, -100);
        const auto e = read(ply_file("binary_big_endian", all));
        CHECK(e[0].albedo.x == Approx(0.78209479));
        CHECK(e[0].albedo.y == 1);
        CHECK(e[0].albedo.z == 0);
    }
    SECTION("emission and g") {
        auto all = with(with(with(with(columns(), "emission_0", 0, 5), "emission_1", 0, 0), "emission_2", 1, 2), "g", 0, 0.5);
        const auto e = read(ply_file("binary_little_endian", all));
        CHECK(e[0].emission == glm::dvec3(5, 0, 0));
        CHECK(e[1].emission == glm::dvec3(0, 0, 2));
        CHECK(e[0].g == 0.5);
        CHECK(e[1].g == 0.0);
    }
    SECTION("no rotation is none") {
        auto all = columns();
        for (const char* name : {"rot_0", "rot_1", "rot_2", "rot_3"}) all = without(all, name);
        CHECK(read(ply_file("ascii", all))[1].rotation == glm::dvec4(1, 0, 0, 0));
    }
}

TEST_CASE("Ply.BadPrimitivesAreNamed", "[quick]") {
    const double nan = std::nan("");
    for (const char* format : formats) {
        const auto check = [&](const std::string& name, double value, const std::string& words) {
            INFO(format << " " << name);
            auto all = columns();
            if (name.starts_with("emission_"))
                all = with(with(with(all, "emission_0", 0, 0), "emission_1", 0, 0), "emission_2", 0, 0);
            contains(error_of(ply_file(format, with(all, name, 1, value))), "primitive 1: " + words);
        };
        check("x", nan, "x is not finite");
        check("sigma_t", nan, "sigma_t is not finite");
        check("rot_2", INFINITY, "rot_2 is not finite");
        check("scale_1", 1000, "scale_1 must be positive and finite");
        check("scale_1", -1000, "scale_1 must be positive and finite");
        check("sigma_t", -1, "density must not be negative");
        check("albedo_2", 1.5, "albedo_2 must be in [0,1]");
        check("albedo_0", -0.1, "albedo_0 must be in [0,1]");
        check("emission_1", -1, "emission_1 must not be negative");
        check("g", 1, "g must be in (-1,1)");
        contains(error_of(ply_file(format, with(with(columns(), "rot_1", 1, 0), "rot_2", 1, 0))),
                 "primitive 1: zero quaternion");
    }
    // ascii tells the line: 21 lines of header, the second vertex
    CHECK(contains(error_of(ply_file("ascii", with(columns(), "x", 1, nan))), "a.ply:24: "));
    PlyOptions unused;
    unused.read_albedo = false;
    CHECK(error_of(ply_file("ascii", with(columns(), "albedo_0", 1, 7)), unused).empty());
}

TEST_CASE("Ply.MissingPropertiesAreNamed", "[quick]") {
    contains(error_of(ply_file("ascii", without(without(columns(), "y"), "scale_2"))), "missing in element vertex: y, scale_2");
    contains(error_of(ply_file("ascii", without(columns(), "sigma_t"))), "sigma_t (or sigma_t_0, or opacity)");
    contains(error_of(ply_file("ascii", without(columns(), "rot_2"))), "rot_2");
    contains(error_of(ply_file("ascii", without(columns(), "albedo_2"))), "albedo_2");
}

TEST_CASE("Ply.CutShortAtEveryByteIsAnError", "[quick]") {
    for (const char* format : formats)
        for (const bool around : {false, true}) {
            const std::string bytes = ply_file(format, columns(), around);
            // A cut inside the last line of text may leave a good one.
            const std::size_t tail = format != formats[0] ? 0 : around ? 12 : 26;
            for (std::size_t size = 0; size + tail < bytes.size(); size += 3) {
                INFO(format << " " << around << " " << size << " of " << bytes.size());
                CHECK_FALSE(error_of(bytes.substr(0, size)).empty());
            }
        }
    const std::string bytes = ply_file("binary_little_endian", columns());
    contains(error_of(bytes.substr(0, bytes.size() - 1)), "a.ply: needs 204 bytes for 3 vertices, holds 203");
    contains(error_of(bytes + "x"), "a.ply: needs 204 bytes for 3 vertices, holds 205");
}

TEST_CASE("Ply.MoreThanTheHeaderSaysIsAnError", "[quick]") {
    for (const char* format : formats)
        for (const bool around : {false, true}) {
            INFO(format << " " << around);
            const std::string bytes = ply_file(format, columns(), around);
            CHECK(error_of(bytes).empty());
            CHECK_FALSE(error_of(bytes + "1").empty());
            if (format != formats[0]) continue;
            CHECK(error_of(bytes + " \n\n").empty());
            contains(error_of(bytes + "\n1\n"), "the file holds more than its header says");
        }
}

TEST_CASE("Ply.HeaderPromisingMoreIsRefusedWithoutAllocating", "[quick]") {
    for (const char* format : formats)
        for (const bool around : {false, true})
            for (const char* count : {"4000000000", "18446744073709551615", "4611686018427387904"}) {
                std::string bytes = ply_file(format, columns(), around);
                bytes.replace(bytes.find("vertex 3"), 8, std::string("vertex ") + count);
                contains(error_of(bytes), "for " + std::string(count) + " vertices, holds");
                bytes = ply_file(format, columns(), true);
                bytes.replace(bytes.find("face 2"), 6, std::string("face ") + count);
                CHECK_FALSE(error_of(bytes).empty());
            }
}

TEST_CASE("Ply.BadHeadersAreRefused", "[quick]") {
    const std::string good = ply_file("ascii", columns());
    const auto changed = [&](const std::string& from, const std::string& to) {
        std::string bytes = good;
        bytes.replace(bytes.find(from), from.size(), to);
        return error_of(bytes);
    };
    contains(error_of("solid x\n"), "a.ply:1: unknown format: not a PLY file");
    contains(error_of(""), "unknown format: not a PLY file");
    contains(changed("ascii", "binary_middle_endian"), "a.ply:2: unknown format \"binary_middle_endian\"");
    contains(changed("1.0", "2.0"), "unknown PLY version");
    contains(changed("vertex 3", "vertex three"), "is not a number of elements");
    contains(changed("vertex 3", "vertex -3"), "is not a number of elements");
    contains(changed("element vertex", "element point"), "no element \"vertex\"");
    contains(changed("property float rot_3", "property half rot_3"), "unknown type");
    contains(changed("property float rot_3", "property float rot_0"), "stands twice");
    contains(changed("property float rot_3", "list rot_3"), "header line not understood");
    contains(changed("end_header", "comment"), "a.ply:");
    contains(changed("0 1 7 ", "0 x 7 "), "is not a number");
}

TEST_CASE("Ply.ReadsTheBundledVolume", "[quick]") {
    std::size_t count = 0;
    read_ply(std::string(CLUME_SOURCE_DIR) + "/scenes/smoke.ply", {}, [&](const PlyEllipsoid& e, std::size_t, std::size_t) {
        ++count;
        CHECK(e.albedo.x == Approx(0.9));
    });
    CHECK(count == 835);
}
