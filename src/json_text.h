// SPDX-License-Identifier: MIT
// Text on its way into a JSON file. A driver may call its device anything, and a path may be any bytes; JSON is UTF-8.
#pragma once

#include <string>

namespace clume {

/// `text` if it is UTF-8; otherwise with '?' for every byte of it beyond ASCII. Not escaped: the writer does that.
std::string json_text(std::string text);

}  // namespace clume
