// SPDX-License-Identifier: MIT
// Strict JSON (RFC 8259) into a small tree whose values and keys know their line and column.
// Nothing beyond the standard is accepted: no comments, trailing commas, NaN, Infinity or byte-order marks; text must be
// valid UTF-8, keys must be unique, numbers are read to the nearest double, integers up to 2^64 − 1 exactly.
// Nesting is limited to `json_depth_limit`; the parser is iterative, so deeper input is an error and never a crash.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace clume {

constexpr int json_depth_limit = 64;

/// Where something stands: line and column from 1, columns in characters. Values that came from the command line carry
/// the index of their override instead.
struct JsonPosition {
    int line = 1, column = 1;
    int override_index = -1;
};

enum class JsonType { null, boolean, number, string, array, object };

struct JsonMember;

struct JsonValue {
    JsonType type = JsonType::null;
    bool boolean = false;
    JsonPosition at;
    double number = 0;
    std::optional<std::uint64_t> integer;  ///< the exact value, where the number was written as a non-negative integer
    std::string text;
    std::vector<JsonValue> items;
    std::vector<JsonMember> members;  ///< in file order

    /// The member of that name, or null.
    const JsonMember* find(std::string_view key) const;
    JsonMember* find(std::string_view key);
};

struct JsonMember {
    std::string key;
    JsonPosition at;
    JsonValue value;
};

/// "a list", "a number", ... for messages.
std::string_view json_type_name(JsonType type);

/// `text` in double quotes, control characters escaped and long text cut, so that a message stays one line.
std::string in_quotes(std::string_view text);

/// The text as a JSON string, quotes included.
std::string json_string(std::string_view text);

/// Reads one JSON document. Throws SceneError "file:line:column: what is wrong".
JsonValue parse_json(std::string_view text, const std::string& file);

}  // namespace clume
