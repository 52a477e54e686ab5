// SPDX-License-Identifier: MIT
// The exceptions that become exit codes: 1 render, 2 usage, 3 scene or asset, 4 device. The message is the whole line printed.
#pragma once

#include <stdexcept>
#include <string>

namespace clume {

/// Wrong command line; exit code 2.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Wrong scene file or asset; exit code 3. The message is "file:line:column: what is wrong" (line and column where they exist).
struct SceneError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The render can't be done or written; exit code 1.
struct RenderError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

}  // namespace clume
