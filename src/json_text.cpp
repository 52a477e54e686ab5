// SPDX-License-Identifier: MIT
#include "src/json_text.h"

#include <rapidjson/memorystream.h>
#include <rapidjson/stringbuffer.h>

namespace clume {

std::string json_text(std::string text) {
    rapidjson::MemoryStream source(text.data(), text.size());
    rapidjson::StringBuffer unused;
    bool valid = true;
    while (valid && source.Tell() < text.size()) valid = rapidjson::UTF8<>::Validate(source, unused);
    // A sequence cut short by the end reads zeros there, which continue nothing.
    if (valid) return text;
    for (char& c : text)
        if (static_cast<unsigned char>(c) >= 0x80) c = '?';
    return text;
}

}  // namespace clume
