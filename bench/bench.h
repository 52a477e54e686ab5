// SPDX-License-Identifier: MIT
// `clume bench`: the whole renderer beside the plain host tracer, its kernels one by one, what specialisation saves, and how
// cost grows with the number of primitives, what a noise threshold saves, what an operation costs, and the study of
// strategies. docs/performance.md and docs/strategies.md say what each section measures.
#pragma once

namespace clume {

/// argv[0] is the subcommand's name; the rest are its flags (--help lists them). Returns an exit code. Throws UsageError for
/// a wrong flag, DeviceError, SceneError, RenderError (the JSON file can't be written).
int run_bench(int argc, char** argv);

}  // namespace clume
