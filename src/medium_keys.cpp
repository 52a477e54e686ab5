// SPDX-License-Identifier: MIT
#include "src/medium_keys.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "src/error.h"

namespace clume {

bool is_singular(const glm::dmat3& m) {
    const double lengths = glm::length(m[0]) * glm::length(m[1]) * glm::length(m[2]);
    const double determinant = std::abs(glm::determinant(m));
    return !std::isfinite(determinant) || !std::isfinite(lengths) || !(determinant > 1e-14 * lengths);
}

Transform read_transform(const SectionReader& medium) {
    Transform out;
    const SectionReader section = medium.section("transform");
    if (const JsonValue* matrix = section.value("matrix")) {
        for (const char* key : {"scale", "rotate", "translate"})
            if (section.given(key)) section.fail(key, fmt::format("\"{}\" and \"matrix\" exclude each other", key));
        if (matrix->items.size() != 4) section.fail("matrix", "\"matrix\" must be four rows of four numbers");
        for (int row = 0; row < 4; ++row) {
            const JsonValue& values = matrix->items[static_cast<std::size_t>(row)];
            if (values.type != JsonType::array || values.items.size() != 4)
                section.source().fail(values.at, "\"matrix\" must be four rows of four numbers");
            for (int column = 0; column < 4; ++column) {
                const JsonValue& value = values.items[static_cast<std::size_t>(column)];
                if (value.type != JsonType::number)
                    section.source().fail(value.at,
                                          fmt::format("\"matrix\" must hold numbers, not {}", json_type_name(value.type)));
                if (row == 3 && value.number != (column == 3 ? 1 : 0))
                    section.source().fail(value.at, "the last row of \"matrix\" must be 0, 0, 0, 1");
                if (row == 3) continue;
                if (column == 3)
                    out.translate[row] = value.number;
                else
                    out.linear[column][row] = value.number;
            }
        }
        if (is_singular(out.linear)) section.fail("matrix", "\"matrix\" is singular");
        return out;
    }
    const glm::dvec3 scale = section.triple("scale");
    if (scale.x == 0 || scale.y == 0 || scale.z == 0) section.fail("scale", "\"scale\" of a transform must not be 0");
    out.linear = glm::dmat3(scale.x, 0, 0, 0, scale.y, 0, 0, 0, scale.z);
    if (section.given("rotate")) {
        const SectionReader rotate = section.section("rotate");
        const glm::dvec3 axis = rotate.triple("axis");
        if (!(glm::length(axis) > 0)) rotate.fail("axis", "\"axis\" must not be zero");
        out.linear = glm::mat3_cast(glm::angleAxis(glm::radians(rotate.number("angle")), glm::normalize(axis))) * out.linear;
    }
    out.translate = section.triple("translate");
    return out;
}

Phase read_phase(const SectionReader& medium) {
    const SectionReader section = medium.section("phase");
    if (section.variant() == "rayleigh") return {PhaseKind::rayleigh, 0};
    if (section.variant() == "henyey-greenstein") return {PhaseKind::henyey_greenstein, section.number("g")};
    return {};
}

std::filesystem::path find_asset(const SectionReader& section, std::string_view key, const std::filesystem::path& folder) {
    const std::string name = section.text(key);
    std::filesystem::path path = folder / name;
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status))
        section.source().fail_asset(section.at(key), fmt::format("no such file: {}", in_quotes(path.string())));
    if (!std::filesystem::is_regular_file(status))
        section.source().fail_asset(section.at(key), fmt::format("not a file: {}", in_quotes(path.string())));
    return path;
}

}  // namespace clume
