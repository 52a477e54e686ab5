// SPDX-License-Identifier: MIT
// Line-wise include resolution. Comments aren't parsed: a line that starts with #include counts even inside /* */.
#include "runtime/source.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <stdexcept>
#include <vector>

namespace clume {

namespace {

class Assembler {
public:
    explicit Assembler(std::span<const EmbeddedFile> files) : files_(files) {}

    /// `conditional`: inside some #if, where the file may be skipped by the compiler and so doesn't count as included.
    void add(std::string_view name, const std::string& from, bool conditional) {
        const auto file = std::find_if(files_.begin(), files_.end(), [&](const EmbeddedFile& f) { return f.name == name; });
        if (file == files_.end()) throw std::runtime_error(from + "no kernel file '" + std::string(name) + "'");
        if (std::find(open_.begin(), open_.end(), name) != open_.end())
            throw std::runtime_error(from + "'" + std::string(name) + "' includes itself");
        if (done_.count(name)) return;
        const bool once = !name.ends_with(".inc.cl");
        if (once && !conditional) done_.insert(file->name);
        open_.push_back(file->name);
        const std::string guard = guard_name(name);
        if (once) text_ += "#ifndef " + guard + "\n#define " + guard + "\n";
        add_lines(*file, conditional);
        if (once) text_ += "#endif\n";
        open_.pop_back();
    }

    std::string take() { return std::move(text_); }

private:
    static std::string guard_name(std::string_view name) {
        std::string guard = "CLUME_FILE_";
        for (const char c : name) guard += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
        return guard;
    }

    void mark(std::size_t line, std::string_view name) {
        text_ += "#line " + std::to_string(line) + " \"" + std::string(name) + "\"\n";
    }

    /// The word after '#', or nothing: "include", "if", "endif" ...
    static std::string_view directive(std::string_view line, std::string_view& rest) {
        const auto skip = [&](std::size_t at) { return std::min(line.find_first_not_of(" \t", at), line.size()); };
        const std::size_t hash = skip(0);
        if (hash == line.size() || line[hash] != '#') return {};
        const std::size_t word = skip(hash + 1);
        std::size_t end = word;
        while (end < line.size() && std::isalpha(static_cast<unsigned char>(line[end]))) ++end;
        rest = line.substr(skip(end));
        return line.substr(word, end - word);
    }

    void add_lines(const EmbeddedFile& file, bool conditional) {
        mark(1, file.name);
        int depth = 0;
        std::size_t number = 0;
        for (std::size_t at = 0; at < file.text.size();) {
            const std::size_t end = std::min(file.text.find('\n', at), file.text.size());
            const std::string_view line = file.text.substr(at, end - at);
            at = end + 1;
            ++number;
            std::string_view rest;
            const std::string_view word = directive(line, rest);
            if (word == "if" || word == "ifdef" || word == "ifndef") ++depth;
            if (word == "endif") --depth;
            if (word == "include" && rest.starts_with('"')) {
                const std::string from = std::string(file.name) + ":" + std::to_string(number) + ": ";
                const std::size_t quote = rest.find('"', 1);
                if (quote == std::string_view::npos) throw std::runtime_error(from + "#include without closing quote");
                add(rest.substr(1, quote - 1), from, conditional || depth > 0);
                mark(number + 1, file.name);
            } else if (word == "pragma" && rest.starts_with("once")) {
                text_ += '\n';
            } else {
                text_.append(line);
                text_ += '\n';
            }
        }
    }

    std::span<const EmbeddedFile> files_;
    std::vector<std::string_view> open_;
    std::set<std::string_view> done_;
    std::string text_;
};

}  // namespace

std::string assemble_source(std::string_view root_file) {
    return assemble_source(root_file, embedded_kernels());
}

std::string assemble_source(std::string_view root_file, std::span<const EmbeddedFile> files) {
    Assembler assembler(files);
    assembler.add(root_file, {}, false);
    return assembler.take();
}

}  // namespace clume
