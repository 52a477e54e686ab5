// SPDX-License-Identifier: MIT
// The house has floors: kernels/ and runtime/ at the bottom, src/ on both, bench/ and tests/ on top. A file includes only what
// stands on its own floor or lower, and never in a circle. This reads the #include "..." lines and says where that's broken.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace {

/// File → files it includes, paths from the root of the source tree.
using Includes = std::map<std::string, std::set<std::string>>;

std::string floor_of(const std::string& file) { return file.substr(0, file.find('/')); }

bool is_allowed(const std::string& from, const std::string& to) {
    const std::string lower = floor_of(to);
    const std::set<std::string> above_all{"bench", "tests"};
    if (floor_of(from) == "kernels") return lower == "kernels";
    if (from.ends_with(".cl") && above_all.count(floor_of(from)) == 1) return lower == "kernels" || (lower == floor_of(from) && to.ends_with(".cl"));
    if (floor_of(from) == "runtime") return lower == "runtime";
    if (above_all.count(floor_of(from)) == 1 && above_all.count(lower) == 1) return true;
    if (from == "src/main.cpp" && to == "bench/bench.h") return true;
    return lower == "src" || lower == "runtime" || to == "kernels/layout.h";
}

/// Everything wrong with a set of includes, one line each.
std::vector<std::string> broken_arrows(const Includes& includes) {
    std::vector<std::string> broken;
    for (const auto& [from, targets] : includes)
        for (const std::string& to : targets) {
            if (includes.count(to) == 0)
                broken.push_back(from + " includes " + to + ", which is no file here");
            else if (!is_allowed(from, to))
                broken.push_back(from + " includes " + to + ", which stands above it");
        }
    std::map<std::string, int> state;  // 1: on the way down, 2: done
    std::vector<std::string> way;
    const std::function<void(const std::string&)> visit = [&](const std::string& file) {
        if (state[file] == 2 || includes.count(file) == 0) return;
        way.push_back(file);
        if (state[file] == 1) {
            std::string circle;
            for (auto at = std::find(way.begin(), way.end(), file); at != way.end(); ++at) circle += " " + *at;
            broken.push_back("a circle:" + circle);
        } else {
            state[file] = 1;
            for (const std::string& to : includes.at(file)) visit(to);
            state[file] = 2;
        }
        way.pop_back();
    };
    for (const auto& [file, targets] : includes) visit(file);
    return broken;
}

Includes read_includes(const fs::path& root) {
    static const std::regex pattern(R"re(^\s*#\s*include\s*"([^"]+)")re");
    Includes includes;
    for (const char* folder : {"kernels", "runtime", "src", "bench", "tests"}) {
        if (!fs::is_directory(root / folder)) continue;
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            const std::string extension = entry.path().extension().string();
            if (extension != ".h" && extension != ".cpp" && extension != ".cl") continue;
            std::set<std::string>& targets = includes[entry.path().lexically_relative(root).generic_string()];
            std::ifstream file(entry.path());
            std::smatch match;
            for (std::string line; std::getline(file, line);) {
                if (!std::regex_search(line, match, pattern)) continue;
                const fs::path beside = entry.path().parent_path() / match[1].str();
                // Programs are assembled from one set of files, wherever they stand.
                const fs::path elsewhere = extension == ".cl" ? fs::path("kernels") / match[1].str() : fs::path(match[1].str());
                const fs::path found = fs::exists(beside) ? beside.lexically_normal().lexically_relative(root) : elsewhere;
                targets.insert(found.generic_string());
            }
        }
    }
    return includes;
}

}  // namespace

TEST_CASE("Includes.NoArrowRunsBackUp", "[quick]") {
    const Includes includes = read_includes(CLUME_SOURCE_DIR);
    REQUIRE(includes.count("src/renderer.h") == 1);
    REQUIRE(includes.at("src/renderer.h").count("src/scene.h") == 1);
    for (const std::string& line : broken_arrows(includes)) FAIL_CHECK(line);
}

TEST_CASE("Includes.EveryKindOfBrokenArrowIsFound", "[quick]") {
    const Includes sound{{"kernels/layout.h", {}},
                         {"kernels/math.cl", {"kernels/layout.h"}},
                         {"runtime/device.h", {}},
                         {"src/scene.h", {}},
                         {"src/film.h", {"src/scene.h", "runtime/device.h", "kernels/layout.h"}},
                         {"src/main.cpp", {"bench/bench.h", "src/film.h"}},
                         {"bench/bench.h", {"src/film.h", "tests/reference/tracer.h"}},
                         {"tests/reference/tracer.h", {"src/scene.h"}}};
    CHECK(broken_arrows(sound).empty());
    const std::pair<const char*, const char*> planted[] = {{"kernels/math.cl", "src/scene.h"},
                                                           {"kernels/layout.h", "runtime/device.h"},
                                                           {"runtime/device.h", "src/scene.h"},
                                                           {"runtime/device.h", "kernels/layout.h"},
                                                           {"src/film.h", "kernels/math.cl"},
                                                           {"src/film.h", "bench/bench.h"},
                                                           {"src/film.h", "tests/reference/tracer.h"},
                                                           {"src/main.cpp", "tests/reference/tracer.h"},
                                                           {"src/scene.h", "src/film.h"},
                                                           {"src/scene.h", "src/scene.h"},
                                                           {"src/scene.h", "src/none.h"}};
    for (const auto& [from, to] : planted) {
        Includes includes = sound;
        includes[from].insert(to);
        INFO(from << " includes " << to);
        CHECK_FALSE(broken_arrows(includes).empty());
    }
}
