// SPDX-License-Identifier: MIT
// What the reports' pages share: head and style sheet, and text made safe. Pages need no other file, no network and no script,
// and are well-formed as XML, too.
#pragma once

#include <string>

namespace clume {

/// Up to and with <body>.
std::string html_begin(const std::string& title);

/// Text for elements and quoted attributes.
std::string escaped(const std::string& text);

}  // namespace clume
