// SPDX-License-Identifier: MIT
#include "src/stress_limits.h"

#include <regex>
#include <stdexcept>

#include "runtime/embedded.h"

namespace clume {

namespace {

/// The comment right above a function's definition, on one line.
std::string comment_of(const std::string& text, const std::string& function) {
    const std::size_t at = text.find(" " + function + "(");
    if (at == std::string::npos) throw std::logic_error("no kernel function " + function);
    const std::size_t line = text.rfind('\n', at);
    std::size_t begin = line;
    while (begin != std::string::npos && begin > 0 && text.compare(text.rfind('\n', begin - 1) + 1, 3, "///") == 0) begin = text.rfind('\n', begin - 1);
    return std::regex_replace(text.substr(begin, line - begin), std::regex("\\s+(///)?\\s*"), " ");
}

std::string text_of(const std::string& file) {
    for (const auto& f : embedded_kernels())
        if (f.name == file) return std::string(f.text);
    throw std::logic_error("no kernel file " + file);
}

}  // namespace

Limit limit_in(const std::string& text, const std::string& function, const std::string& name) {
    const std::string comment = comment_of(text, function);
    std::smatch m;
    if (!std::regex_search(comment, m, std::regex((name.empty() ? "" : "\\b" + name + " ") + "error < ([0-9][0-9.e-]*) (ulp of the radius|ulp|relative|absolute)")))
        throw std::logic_error("the comment of kernel function " + function + " states no " + name + " error");
    const std::string unit = m[2];
    return {std::stod(m[1]), unit == "ulp" ? LimitUnit::ulp : unit == "relative" ? LimitUnit::relative : unit == "absolute" ? LimitUnit::absolute : LimitUnit::radius_ulp};
}

Limit stated_limit(const std::string& file, const std::string& function, const std::string& name) { return limit_in(text_of(file), function, name); }

double stated_number(const std::string& file, const std::string& function, const std::string& before) {
    const std::string comment = comment_of(text_of(file), function);
    std::smatch m;
    if (!std::regex_search(comment, m, std::regex(before + " ([0-9][0-9.e-]*)"))) throw std::logic_error("the comment of kernel function " + function + " has no number after '" + before + "'");
    return std::stod(m[1]);
}

const char* name_of(LimitUnit unit) {
    switch (unit) {
        case LimitUnit::relative: return "relative";
        case LimitUnit::absolute: return "absolute";
        case LimitUnit::ulp: return "ulp";
        case LimitUnit::radius_ulp: break;
    }
    return "ulp of radius";
}

}  // namespace clume
