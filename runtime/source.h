// SPDX-License-Identifier: MIT
// One program text out of the embedded kernel files: OpenCL has no search path, so includes are resolved here, and
// #line markers let the compiler's errors name the real file and line.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "runtime/embedded.h"

namespace clume {

/// The text of `root_file` with every `#include "name"` replaced by that file, each taking effect once (generated guards, so
/// an include inside an #if is right too), but "*.inc.cl", bodies over macros, wherever it is named.
/// `#include <...>` stays as it is and `#pragma once` goes.
/// Throws std::runtime_error "file:line: ..." for an unknown file or a circle of includes.
std::string assemble_source(std::string_view root_file);

/// The same over any set of files.
std::string assemble_source(std::string_view root_file, std::span<const EmbeddedFile> files);

}  // namespace clume
