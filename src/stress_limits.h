// SPDX-License-Identifier: MIT
// The error that a kernel function states, read from its own comment: the one place where that number stands. `clume stress`,
// the tests and the reports take it from here.
// A comment (lines of /// right above the definition) states an error as  [NAME] error < NUMBER UNIT,  where UNIT is
// relative, absolute, ulp (of the exact result) or "ulp of the radius" (2^-23, positions being normalised to a radius in [1, 2)).
#pragma once

#include <string>

namespace clume {

enum class LimitUnit { relative, absolute, ulp, radius_ulp };

struct Limit {
    double value = 0;
    LimitUnit unit = LimitUnit::absolute;
};

/// What `function` of kernels/`file` states; `name` is the word before "error" where a comment states several, else the
/// first stands. Functions of math_body.inc.cl are called "FN(exp)". Throws std::logic_error if nothing is stated.
Limit stated_limit(const std::string& file, const std::string& function, const std::string& name = "");

/// The number that follows `before` in the function's comment, such as the end of a domain.
double stated_number(const std::string& file, const std::string& function, const std::string& before);

/// A limit in the text of one file.
Limit limit_in(const std::string& text, const std::string& function, const std::string& name = "");

/// "relative", "absolute", "ulp", "ulp of radius"
const char* name_of(LimitUnit unit);

}  // namespace clume
