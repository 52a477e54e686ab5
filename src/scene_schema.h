// SPDX-License-Identifier: MIT
// What a scene file may say: one table of every key with its section, type, default, range, unit and meaning. It drives
// reading, checking, the suggestions in error messages and the tables of docs/scene.md.
// A section may come in variants named by its `type` key; a key with `variants` belongs to those only.
#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "src/json_reader.h"

namespace clume {

/// `rgb` and `scale` are a number or a list of three; a `choice` is one of the names in `choices`.
enum class KeyType { number, integer, boolean, string, choice, vec3, rgb, scale, list, section };

struct KeySpec {
    std::string_view section;
    std::string_view name;
    std::string_view variants;  ///< space-separated; empty: every variant
    KeyType type;
    int length;  ///< of a list; 0: any. Lists of a fixed length hold numbers
    bool required;
    std::string_view default_json;  ///< JSON; empty: none, or what the meaning says
    std::string_view range;         ///< interval as in "[0,1]" or "(0,180)", `inf` allowed; empty: any finite number
    std::string_view choices;       ///< space-separated names
    std::string_view unit;
    std::string_view meaning;
};

/// The whole table, sections together, in the order in which they are documented.
std::span<const KeySpec> scene_schema();

/// The name nearest to `word` by edit distance, empty if none is near.
std::string_view nearest_name(std::string_view word, std::span<const std::string_view> names);

/// The tables of docs/scene.md, in Markdown, one per section.
std::string schema_markdown();

/// Turns a position and words into the exception: SceneError "file:line:column: ..." for what stands in the file,
/// UsageError "-D key=value: ..." for what came from an override.
struct SceneSource {
    std::string file;
    std::vector<std::string> overrides;  ///< "key=value" as given

    [[noreturn]] void fail(const JsonPosition& at, const std::string& what) const;
    /// The same, always a SceneError: for what lies in the files a scene names.
    [[noreturn]] void fail_asset(const JsonPosition& at, const std::string& what) const;
};

/// One section of a scene, checked against the table when made: unknown keys, types, ranges, missing keys.
/// Getters give the value or the table's default; asking for a key that isn't in the table is a bug.
class SectionReader {
  public:
    /// `value` may be null: a section that isn't there, all defaults (required keys are then missing at `parent`).
    SectionReader(const SceneSource& source, std::string_view section, const JsonValue* value, const JsonPosition& parent);

    const std::string& variant() const { return variant_; }
    bool given(std::string_view key) const;
    /// The value's position, the section's if it isn't given.
    JsonPosition at(std::string_view key) const;
    JsonPosition at() const { return at_; }

    double number(std::string_view key) const;
    std::uint64_t integer(std::string_view key) const;
    bool boolean(std::string_view key) const;
    std::string text(std::string_view key) const;
    /// vec3, or a number standing for three.
    glm::dvec3 triple(std::string_view key) const;
    std::vector<double> numbers(std::string_view key) const;
    /// The value as it stands, or null.
    const JsonValue* value(std::string_view key) const;
    SectionReader section(std::string_view key) const;

    [[noreturn]] void fail(std::string_view key, const std::string& what) const { source_.fail(at(key), what); }
    const SceneSource& source() const { return source_; }

  private:
    const KeySpec& spec(std::string_view key) const;
    JsonValue value_or_default(std::string_view key) const;
    void check() const;
    void check_value(const KeySpec& spec, const JsonValue& value) const;

    const SceneSource& source_;
    std::string_view section_;
    const JsonValue* value_;
    JsonPosition at_;
    std::string variant_;
};

}  // namespace clume
