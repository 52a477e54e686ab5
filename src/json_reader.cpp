// SPDX-License-Identifier: MIT
// RapidJSON's iterative SAX parser, with a handler that builds the tree and a cursor that follows it through the text to
// tell line and column. Between the end of one token and the start of the next stand only spaces, commas and colons, so
// the cursor finds a token's start by skipping those.
#include "src/json_reader.h"

#include <fmt/format.h>
#include <rapidjson/error/en.h>
#include <rapidjson/memorystream.h>
#include <rapidjson/reader.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "src/error.h"
#include "src/printable.h"

namespace clume {

const JsonMember* JsonValue::find(std::string_view key) const {
    const auto found = std::find_if(members.begin(), members.end(), [&](const JsonMember& m) { return m.key == key; });
    return found == members.end() ? nullptr : &*found;
}

JsonMember* JsonValue::find(std::string_view key) {
    return const_cast<JsonMember*>(static_cast<const JsonValue*>(this)->find(key));
}

std::string_view json_type_name(JsonType type) {
    switch (type) {
        case JsonType::null:
            return "null";
        case JsonType::boolean:
            return "true or false";
        case JsonType::number:
            return "a number";
        case JsonType::string:
            return "a string";
        case JsonType::array:
            return "a list";
        case JsonType::object:
            return "a section";
    }
    return "";
}

std::string json_string(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        if (static_cast<unsigned char>(c) < 0x20)
            out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
        else
            out += c;
    }
    return out + '"';
}

std::string in_quotes(std::string_view text) {
    constexpr std::size_t most = 80;
    std::size_t end = std::min(most, text.size());
    // Cut between characters, never inside one.
    while (end < text.size() && end < most + 3 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) ++end;
    return '"' + printable(text.substr(0, end)) + (end < text.size() ? "..." : "") + '"';
}

namespace {

/// Goes forward through the text and keeps line and column.
class Cursor {
  public:
    explicit Cursor(std::string_view text) : text_(text) {}

    void move_to(std::size_t offset) {
        for (offset = std::min(offset, text_.size()); offset_ < offset; ++offset_) {
            const unsigned char c = static_cast<unsigned char>(text_[offset_]);
            if (c == '\n') {
                ++at_.line;
                at_.column = 1;
            } else if ((c & 0xC0) != 0x80) {
                ++at_.column;
            }
        }
    }

    void skip_separators() {
        std::size_t end = offset_;
        while (end < text_.size() && std::string_view(" \t\r\n,:").find(text_[end]) != std::string_view::npos) ++end;
        move_to(end);
    }

    std::size_t offset() const { return offset_; }
    JsonPosition position() const { return at_; }

  private:
    std::string_view text_;
    std::size_t offset_ = 0;
    JsonPosition at_;
};

struct Failure {
    JsonPosition at;
    std::string what;
};

class TreeBuilder : public rapidjson::BaseReaderHandler<rapidjson::UTF8<>, TreeBuilder> {
  public:
    TreeBuilder(std::string_view text, const rapidjson::MemoryStream& stream) : text_(text), stream_(stream), cursor_(text) {}

    JsonValue root;
    std::optional<Failure> failure;

    bool Null() { return scalar(JsonType::null) != nullptr; }
    bool Bool(bool value) {
        scalar(JsonType::boolean)->boolean = value;
        return true;
    }
    bool String(const char* text, rapidjson::SizeType length, bool) {
        JsonValue& value = *scalar(JsonType::string);
        value.text.assign(text, length);
        return no_surrogate(value.text, value.at);
    }
    bool RawNumber(const char*, rapidjson::SizeType, bool) {
        cursor_.skip_separators();
        const std::size_t begin = cursor_.offset();
        JsonValue& value = *scalar(JsonType::number);
        const std::string token(text_.substr(begin, cursor_.offset() - begin));
        std::uint64_t integer = 0;
        const auto whole = std::from_chars(token.data(), token.data() + token.size(), integer);
        if (whole.ec == std::errc() && whole.ptr == token.data() + token.size()) value.integer = integer;
        const auto read = std::from_chars(token.data(), token.data() + token.size(), value.number);
        // Out of range is either too large, an error, or too small, which rounds to zero.
        if (read.ec == std::errc::result_out_of_range) value.number = std::strtod(token.c_str(), nullptr);
        if (std::isfinite(value.number)) return true;
        failure = Failure{value.at, "number too large for double precision"};
        return false;
    }
    bool Key(const char* text, rapidjson::SizeType length, bool) {
        cursor_.skip_separators();
        const JsonMember& member = open_.back()->members.emplace_back(JsonMember{std::string(text, length), cursor_.position(), {}});
        cursor_.move_to(stream_.Tell());
        return no_surrogate(member.key, member.at);
    }
    bool StartObject() { return open(JsonType::object); }
    bool StartArray() { return open(JsonType::array); }
    bool EndObject(rapidjson::SizeType) { return close() && keys_unique(*closed_); }
    bool EndArray(rapidjson::SizeType) { return close(); }

  private:
    /// The place the next value belongs to, its position set.
    JsonValue* place(JsonType type) {
        cursor_.skip_separators();
        JsonValue* value = &root;
        if (!open_.empty() && open_.back()->type == JsonType::array)
            value = &open_.back()->items.emplace_back();
        else if (!open_.empty())
            value = &open_.back()->members.back().value;
        value->type = type;
        value->at = cursor_.position();
        return value;
    }
    JsonValue* scalar(JsonType type) {
        JsonValue* value = place(type);
        cursor_.move_to(stream_.Tell());
        return value;
    }
    bool open(JsonType type) {
        JsonValue* value = place(type);
        cursor_.move_to(cursor_.offset() + 1);
        if (static_cast<int>(open_.size()) >= json_depth_limit) {
            failure = Failure{value->at, fmt::format("brackets nested deeper than {}", json_depth_limit)};
            return false;
        }
        open_.push_back(value);
        return true;
    }
    bool close() {
        cursor_.skip_separators();
        cursor_.move_to(cursor_.offset() + 1);
        closed_ = open_.back();
        open_.pop_back();
        return true;
    }
    /// The parser lets an escaped trailing surrogate without its leading one through, as three bytes that no UTF-8 has.
    bool no_surrogate(std::string_view text, JsonPosition at) {
        for (std::size_t i = 0; i + 1 < text.size(); ++i)
            if (text[i] == '\xed' && static_cast<unsigned char>(text[i + 1]) >= 0xa0) failure = Failure{at, "half of a surrogate pair in a string"};
        return !failure;
    }
    bool keys_unique(const JsonValue& object) {
        std::vector<std::size_t> order(object.members.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t a, std::size_t b) { return object.members[a].key < object.members[b].key; });
        for (std::size_t i = 1; i < order.size(); ++i) {
            const JsonMember &first = object.members[order[i - 1]], &second = object.members[order[i]];
            if (first.key != second.key) continue;
            failure = Failure{second.at, fmt::format("duplicate key {}, first given at {}:{}", in_quotes(second.key),
                                                     first.at.line, first.at.column)};
            return false;
        }
        return true;
    }

    std::string_view text_;
    const rapidjson::MemoryStream& stream_;
    Cursor cursor_;
    // Pointers stay valid while open: only the innermost container grows, and its ancestors' vectors don't.
    std::vector<JsonValue*> open_;
    JsonValue* closed_ = nullptr;
};

/// The parser's error code in words that a scene's author can use.
std::string describe(const rapidjson::ParseResult& result, std::string_view text) {
    const std::size_t at = result.Offset();
    const bool ended = at >= text.size();
    switch (result.Code()) {
        case rapidjson::kParseErrorDocumentEmpty:
            return "the file is empty";
        case rapidjson::kParseErrorDocumentRootNotSingular:
            return "unexpected text after the end of the scene";
        case rapidjson::kParseErrorNumberTooBig:
            return "number too large for double precision";
        case rapidjson::kParseErrorStringInvalidEncoding:
            return "invalid text in a string: not UTF-8, or a control character";
        case rapidjson::kParseErrorObjectMissCommaOrCurlyBracket:
            return ended ? "the file ends inside a section: missing '}'" : "missing ',' or '}'";
        case rapidjson::kParseErrorArrayMissCommaOrSquareBracket:
            return ended ? "the file ends inside a list: missing ']'" : "missing ',' or ']'";
        case rapidjson::kParseErrorValueInvalid:
            return ended ? "the file ends where a value is expected"
                         : "not a JSON value (comments, NaN, Infinity and trailing commas are not allowed)";
        case rapidjson::kParseErrorObjectMissName:
            return ended ? "the file ends inside a section: missing '}'"
                         : "expected a key in double quotes (trailing commas and comments are not allowed)";
        default:
            break;
    }
    std::string words = rapidjson::GetParseError_En(result.Code());
    if (!words.empty() && words.back() == '.') words.pop_back();
    return words;
}

}  // namespace

JsonValue parse_json(std::string_view text, const std::string& file) {
    const auto fail = [&](const JsonPosition& at, const std::string& what) {
        throw SceneError(fmt::format("{}:{}:{}: {}", file, at.line, at.column, what));
    };
    const auto position_of = [&](std::size_t offset) {
        Cursor cursor(text);
        cursor.move_to(offset);
        return cursor.position();
    };
    if (text.starts_with("\xEF\xBB\xBF") || text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
        fail({}, "the file begins with a byte-order mark; save it as UTF-8 without one");
    if (const auto nul = text.find('\0'); nul != std::string_view::npos) fail(position_of(nul), "a NUL byte in the file");

    rapidjson::MemoryStream stream(text.data(), text.size());
    TreeBuilder builder(text, stream);
    rapidjson::Reader reader;
    constexpr unsigned flags =
        rapidjson::kParseIterativeFlag | rapidjson::kParseValidateEncodingFlag | rapidjson::kParseNumbersAsStringsFlag;
    const rapidjson::ParseResult result = reader.Parse<flags>(stream, builder);
    if (builder.failure) fail(builder.failure->at, builder.failure->what);
    if (result.IsError()) fail(position_of(result.Offset()), describe(result, text));
    return std::move(builder.root);
}

}  // namespace clume
