// SPDX-License-Identifier: MIT
// The header of a PLY file: elements, their properties and where the data begins. Checks what a header alone can tell;
// counts are as the file says and may be more than it holds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace clume::ply {

enum class Scalar { i8, u8, i16, u16, i32, u32, f32, f64 };
enum class Format { ascii, little, big };

/// A column. For a list, `type` is of its items.
struct Property {
    std::string name;
    Scalar type = Scalar::f32;
    bool is_list = false;
    Scalar count_type = Scalar::u8;
};

struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;
    bool has_lists = false;
    std::size_t row_bytes = 0;  ///< fixed part: scalars and list counts
};

struct Header {
    Format format = Format::ascii;
    std::vector<Element> elements;
    std::size_t data_offset = 0;
    int lines = 0;  ///< of the header, end_header among them

    /// The element of that name, or null.
    const Element* find(std::string_view name) const;
};

std::size_t size_of(Scalar type);

/// The words of a line, which are what spaces, tabs and a carriage return separate.
std::vector<std::string_view> split_words(std::string_view line);

/// Throws SceneError "name:line: why".
Header read_header(std::string_view bytes, const std::string& name);

}  // namespace clume::ply
