// SPDX-License-Identifier: MIT
// Programs built for one device from assembled source, with the build log when it fails and a disk cache where the
// platform has none. Options are defines only, plus -cl-std=CL1.2: never a fast-math flag.
#pragma once

#include <CL/opencl.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/queue.h"
#include "runtime/source.h"

namespace clume {

struct ProgramOptions {
    /// (name, value) in the order given; an empty value is "-DNAME=" (defined, empty). No blanks or quotes in either.
    std::vector<std::pair<std::string, std::string>> defines;
    bool optimised = true;  ///< false: sooner built, slower to run, the same results

    ProgramOptions& define(std::string name, std::string value);
    ProgramOptions& define(std::string name, long long value);
    /// "-cl-std=CL1.2 -DNAME=VALUE ..."; std::invalid_argument for a character that compilers' command lines disagree on.
    std::string text() const;
};

/// Assembles `root_file` and builds it. Throws BuildError with log and options.
cl::Program build_program(const Queue& queue, std::string_view root_file, const ProgramOptions& options = {});

/// The same from a text.
cl::Program build_source(const Queue& queue, const std::string& source, const ProgramOptions& options = {});

/// What the compiler said, warnings too; empty for a program that came from the cache.
std::string build_log(const Queue& queue, const cl::Program& program);

/// The cache key: SHA-256 over source, options, device name, driver and platform version.
std::string program_key(const DeviceInfo& info, const std::string& source, const std::string& options);

}  // namespace clume
