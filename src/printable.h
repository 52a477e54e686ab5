// SPDX-License-Identifier: MIT
// Text from files, made fit for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace clume {

/// `text` as UTF-8 that a terminal only shows: control characters (U+0000 to U+001F, U+007F to U+009F), marks that turn the
/// direction of writing (U+202A to U+202E, U+2066 to U+2069) and bytes that aren't UTF-8 become \xNN. Line feeds stay if `lines`.
std::string printable(std::string_view text, bool lines = false);

}  // namespace clume
