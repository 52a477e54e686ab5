// SPDX-License-Identifier: MIT
// What is fuzzed: one function per kind of file, each over the reader's own entry point. It returns whether bytes make sense or
// are refused by SceneError; anything else, a crash, another exception, a hang or memory beyond the bound, is a bug.
// libFuzzer runs them (libfuzzer_main.cpp, ./clume test --fuzz), and the tests over the inputs in regressions/.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "src/memory_bound.h"

namespace clume::fuzz {

struct Target {
    std::string_view name;
    void (*run)(std::string_view bytes);
    MemoryBound memory;  ///< what src/ promises of the reader
};

extern const Target scene, ply, vol, raw, nvdb, vdb, environment;
inline const Target* const targets[] = {&scene, &ply, &vol, &raw, &nvdb, &vdb, &environment};

/// Puts the bytes into a file in memory, the same one each time, and calls `read` with its path; a SceneError is a fine answer.
void read_as_file(std::string_view bytes, const std::function<void(const std::string& path)>& read);

}  // namespace clume::fuzz
