// SPDX-License-Identifier: MIT
// Line by line; lines may end in LF or CRLF. What isn't understood is an error: a header that is guessed at reads garbage.
#include "src/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "src/error.h"
#include "src/json_reader.h"

namespace clume::ply {

std::size_t size_of(Scalar type) {
    constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[static_cast<int>(type)];
}

std::vector<std::string_view> split_words(std::string_view line) {
    std::vector<std::string_view> out;
    for (std::size_t i = 0; i < line.size();) {
        const std::size_t begin = line.find_first_not_of(" \t\r\v\f", i);
        if (begin == std::string_view::npos) break;
        const std::size_t end = std::min(line.find_first_of(" \t\r\v\f", begin), line.size());
        out.push_back(line.substr(begin, end - begin));
        i = end;
    }
    return out;
}

const Element* Header::find(std::string_view name) const {
    const auto found = std::find_if(elements.begin(), elements.end(), [&](const Element& e) { return e.name == name; });
    return found == elements.end() ? nullptr : &*found;
}

namespace {

std::optional<Scalar> scalar_named(std::string_view name) {
    constexpr std::string_view names[][2] = {{"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
                                             {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
    for (int i = 0; i < 8; ++i)
        if (name == names[i][0] || name == names[i][1]) return static_cast<Scalar>(i);
    return std::nullopt;
}

class HeaderReader {
  public:
    HeaderReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    void run() {
        std::string_view line;
        constexpr std::size_t longest_line = 4096;
        if (!next_line(line) || split_words(line) != std::vector<std::string_view>{"ply"}) {
            header_.lines = 1;
            fail("unknown format: not a PLY file");
        }
        bool has_format = false;
        while (true) {
            if (!next_line(line)) fail("the header has no end_header");
            if (line.size() > longest_line) fail("not a PLY header line");
            const auto words = split_words(line);
            if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
            if (words[0] == "end_header") break;
            if (words[0] == "format" && words.size() == 3) {
                if (words[1] == "ascii")
                    header_.format = Format::ascii;
                else if (words[1] == "binary_little_endian")
                    header_.format = Format::little;
                else if (words[1] == "binary_big_endian")
                    header_.format = Format::big;
                else
                    fail(fmt::format("unknown format {}; known: ascii, binary_little_endian, binary_big_endian",
                                     in_quotes(words[1])));
                if (words[2] != "1.0") fail(fmt::format("unknown PLY version {}; known: 1.0", in_quotes(words[2])));
                has_format = true;
            } else if (words[0] == "element" && words.size() == 3) {
                Element element;
                element.name = words[1];
                const auto end = words[2].data() + words[2].size();
                const auto read = std::from_chars(words[2].data(), end, element.count);
                if (read.ec != std::errc() || read.ptr != end)
                    fail(fmt::format("element count {} is not a number of elements", in_quotes(words[2])));
                // Few enough that comparing each with each takes no time.
                if (header_.elements.size() >= most_names) fail(fmt::format("more than {} elements", most_names));
                for (const Element& other : header_.elements)
                    if (other.name == element.name) fail(fmt::format("element {} stands twice", in_quotes(element.name)));
                header_.elements.push_back(std::move(element));
            } else if (words[0] == "property" && !header_.elements.empty() &&
                       (words.size() == 3 || (words.size() == 5 && words[1] == "list"))) {
                add_property(words);
            } else {
                fail(fmt::format("header line not understood: {}", in_quotes(line)));
            }
        }
        if (!has_format) fail("the header has no format line");
        if (header_.find("vertex") == nullptr) fail("the file has no element \"vertex\"");
    }

    void add_property(const std::vector<std::string_view>& words) {
        Element& element = header_.elements.back();
        Property property;
        property.is_list = words.size() == 5;
        property.name = words.back();
        const auto type = scalar_named(words[property.is_list ? 3 : 1]);
        const auto count_type = property.is_list ? scalar_named(words[2]) : Scalar::u8;
        if (!type || !count_type || *count_type >= Scalar::f32)
            fail(fmt::format("unknown type in property {}", in_quotes(property.name)));
        if (++properties_ > most_names) fail(fmt::format("more than {} properties", most_names));
        for (const Property& other : element.properties)
            if (other.name == property.name) fail(fmt::format("property {} stands twice", in_quotes(property.name)));
        property.type = *type;
        property.count_type = *count_type;
        element.has_lists |= property.is_list;
        element.row_bytes += size_of(property.is_list ? property.count_type : property.type);
        element.properties.push_back(std::move(property));
    }

    Header take() { return std::move(header_); }

  private:
    [[noreturn]] void fail(const std::string& why) const {
        throw SceneError(fmt::format("{}:{}: {}", name_, header_.lines, why));
    }

    bool next_line(std::string_view& line) {
        if (header_.data_offset >= bytes_.size()) return false;
        const std::string_view left = bytes_.substr(header_.data_offset);
        const std::size_t end = std::min(left.find('\n'), left.size());
        line = left.substr(0, end);
        header_.data_offset += std::min(end + 1, left.size());
        ++header_.lines;
        return true;
    }

    static constexpr std::size_t most_names = 4096;

    std::string_view bytes_;
    const std::string& name_;
    Header header_;
    std::size_t properties_ = 0;  ///< of all elements
};

}  // namespace

Header read_header(std::string_view bytes, const std::string& name) {
    HeaderReader reader(bytes, name);
    reader.run();
    return reader.take();
}

}  // namespace clume::ply
