// SPDX-License-Identifier: MIT
// The JSON reader: what RFC 8259 allows is read with its positions, everything else is refused at its place.
// The cases of bad input are listed as text and the beginning of the message.
#include <catch2/catch.hpp>
#include <cstdint>
#include <string>

#include "src/error.h"
#include "src/json_reader.h"
#include "src/json_text.h"

using namespace clume;

namespace {

std::string error_of(const std::string& text) {
    try {
        parse_json(text, "f");
    } catch (const SceneError& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("Json.ReadsEveryKindOfValue", "[quick]") {
    const JsonValue v = parse_json(" {\"a\": [1, -2.5e1, true, false, null, \"x\\u00e9\\n\"], \"b\": {}} \n", "f");
    REQUIRE(v.type == JsonType::object);
    REQUIRE(v.members.size() == 2);
    const auto& a = v.find("a")->value.items;
    REQUIRE(a.size() == 6);
    CHECK(a[0].number == 1);
    CHECK(a[0].integer == std::uint64_t{1});
    CHECK(a[1].number == -25);
    CHECK_FALSE(a[1].integer);
    CHECK(a[2].boolean);
    CHECK_FALSE(a[3].boolean);
    CHECK(a[4].type == JsonType::null);
    CHECK(a[5].text == "x\xC3\xA9\n");
    CHECK(v.find("b")->value.members.empty());
    CHECK(v.find("c") == nullptr);
}

TEST_CASE("Json.KnowsLineAndColumn", "[quick]") {
    const JsonValue v = parse_json("{\n  \"a\" : [ 10,\n\t\"\xC3\xA9\", {\"k\":true} ],\r\n \"b\":{ \"c\" :-1 }\n}", "f");
    const auto at = [](const JsonPosition& p) { return std::to_string(p.line) + ":" + std::to_string(p.column); };
    CHECK(at(v.at) == "1:1");
    CHECK(at(v.members[0].at) == "2:3");
    const JsonValue& a = v.members[0].value;
    CHECK(at(a.at) == "2:9");
    CHECK(at(a.items[0].at) == "2:11");
    CHECK(at(a.items[1].at) == "3:2");
    CHECK(at(a.items[2].at) == "3:7");  // columns count characters, not bytes
    CHECK(at(a.items[2].members[0].at) == "3:8");
    CHECK(at(a.items[2].members[0].value.at) == "3:12");
    CHECK(at(v.members[1].at) == "4:2");
    CHECK(at(v.members[1].value.at) == "4:6");
    CHECK(at(v.members[1].value.members[0].value.at) == "4:13");
}

TEST_CASE("Json.NumbersAreExact", "[quick]") {
    CHECK(parse_json("0.1", "f").number == 0.1);
    CHECK(parse_json("2.2250738585072011e-308", "f").number == 2.2250738585072011e-308);
    CHECK(parse_json("1.7976931348623157e308", "f").number == 1.7976931348623157e308);
    CHECK(parse_json("123456789012345678901234567890e-10", "f").number == 123456789012345678901234567890e-10);
    CHECK(parse_json("9223372036854775807", "f").integer == std::uint64_t{9223372036854775807u});
    CHECK(parse_json("18446744073709551615", "f").integer == std::uint64_t{18446744073709551615u});
    CHECK_FALSE(parse_json("18446744073709551616", "f").integer);
    CHECK(parse_json("1e-400", "f").number == 0);
    CHECK(parse_json("-0", "f").number == 0);
}

TEST_CASE("Json.RefusesBadInputAtItsPlace", "[quick]") {
    const auto check = [](const std::string& text, const std::string& begin) {
        INFO(text.substr(0, 60));
        const std::string message = error_of(text);
        CHECK(message.substr(0, begin.size()) == begin);
        CHECK(message.find('\n') == std::string::npos);
    };
    check("", "f:1:1: the file is empty");
    check("{\"a\": 1,\n \"a\": 2}", "f:2:2: duplicate key \"a\", first given at 1:2");
    check("{\"a\": 1} x", "f:1:10: unexpected text after the end");
    check("{\"a\": 1,}", "f:1:9: ");
    check("[1 2]", "f:1:4: missing ',' or ']'");
    check("[1,\n2", "f:2:2: the file ends inside a list");
    check("{\"a\": 1", "f:1:8: the file ends inside a section");
    check("[NaN]", "f:1:2: not a JSON value");
    check("[Infinity]", "f:1:2: not a JSON value");
    check("[-Infinity]", "f:1:");
    check("[1e400]", "f:1:2: number too large");
    check("[01]", "f:1:3: missing ','");
    check("[+1]", "f:1:2: not a JSON value");
    check("[.5]", "f:1:2: not a JSON value");
    check("[1.]", "f:1:");
    check("// note\n1", "f:1:1: not a JSON value");
    check("{a: 1}", "f:1:2: ");
    check("['a']", "f:1:2: ");
    check("\xEF\xBB\xBF{}", "f:1:1: the file begins with a byte-order mark");
    check("[\"\xC3\x28\"]", "f:1:");      // not UTF-8
    check("[\"\xED\xA0\x80\"]", "f:1:");  // a surrogate
    check(R"(["", "\uDC00"])", "f:1:6: half of a surrogate pair in a string");
    check(R"({"a\uDFFFb": 1})", "f:1:2: half of a surrogate pair in a string");
    CHECK(parse_json(R"(["\uD83C\uDF2B\uD7FF"])", "f").items[0].text == "\xF0\x9F\x8C\xAB\xED\x9F\xBF");
    check("[\"\xC0\xAF\"]", "f:1:");      // overlong
    check("[\"\\ud800\"]", "f:1:");       // half a pair
    check("[\"a\nb\"]", "f:1:");          // a raw control character
    check(std::string("[1]\0[2]", 7), "f:1:4: a NUL byte");
    check("[\"open", "f:1:");
}

TEST_CASE("Json.DepthIsLimited", "[quick]") {
    const auto nested = [](int depth, char open, char close) {
        return std::string(static_cast<std::size_t>(depth), open) + std::string(static_cast<std::size_t>(depth), close);
    };
    CHECK(error_of(nested(64, '[', ']')).empty());
    CHECK(error_of(nested(65, '[', ']')) == "f:1:65: brackets nested deeper than 64");
    CHECK(error_of(nested(200000, '[', ']')) == "f:1:65: brackets nested deeper than 64");
    CHECK(error_of(std::string(200000, '[')) == "f:1:65: brackets nested deeper than 64");
    std::string objects;
    for (int i = 0; i < 200000; ++i) objects += "{\"a\":";
    CHECK(error_of(objects) == "f:1:321: brackets nested deeper than 64");
}

TEST_CASE("Json.QuotedTextStaysOneLine", "[quick]") {
    CHECK(in_quotes("a\nb") == "\"a\\x0ab\"");
    CHECK(in_quotes(std::string(500, 'x')).size() < 100);
}

TEST_CASE("JsonText.IsUtf8", "[quick]") {
    for (const char* good : {"", "PoCL 3.1", "caf\xC3\xA9 \xE2\x82\xAC \xF0\x9F\x98\x80"}) CHECK(json_text(good) == good);
    CHECK(json_text("caf\xE9 4") == "caf? 4");
    CHECK(json_text("\xC3\xA9 and \xFF") == "?? and ?");
    CHECK(json_text("cut \xE2\x82") == "cut ??");
    CHECK(json_text(std::string("a\0\xFF", 3)) == std::string("a\0?", 3));
}
