// SPDX-License-Identifier: MIT
#include "src/html_page.h"

namespace clume {
namespace {

constexpr const char* head = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
)";

constexpr const char* sheet = R"(<style>
body { font: 16px/1.5 sans-serif; color: #1a1a1a; background: #fff; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em; margin-bottom: 0.2em; }
h2 { font-size: 1.25em; margin-top: 2em; border-bottom: 1px solid #ccc; }
h3 { font-size: 1em; margin: 1.5em 0 0.4em; }
.verdict { background: #f2f6fa; border-left: 4px solid #0072b2; padding: 0.6em 1em; }
.verdict p { margin: 0.4em 0; }
.warning { background: #fdf3e7; border-left: 4px solid #d55e00; padding: 0.6em 1em; white-space: pre-wrap; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.85em; }
th, td { padding: 0.3em 0.7em; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap; }
th { text-align: right; background: #f7f7f7; }
th:first-child, td:first-child, td.text { text-align: left; }
td.text { white-space: normal; }
img { max-width: 100%; height: auto; }
.trio { display: flex; flex-wrap: wrap; gap: 0.8em; }
.trio figure { margin: 0; flex: 1 1 280px; max-width: 480px; }
.trio img { width: 100%; image-rendering: auto; }
figcaption, .small { font-size: 0.85em; color: #444; }
.bar { display: inline-block; width: 12em; height: 0.9em; vertical-align: middle; border: 1px solid #888; }
</style>
)";

}  // namespace

std::string html_begin(const std::string& title) { return head + ("<title>" + escaped(title)) + "</title>\n" + sheet + "</head>\n<body>\n"; }

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&': out += "&amp;"; break;
            case '<': out += "&lt;"; break;
            case '>': out += "&gt;"; break;
            case '"': out += "&quot;"; break;
            default: out += static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' ? ' ' : c;
        }
    }
    return out;
}

}  // namespace clume
