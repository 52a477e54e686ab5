// SPDX-License-Identifier: MIT
// `clume bench`: kernels and scenes measured with Google Benchmark, beside the plain host tracer.
#pragma once

namespace clume {

/// argv[0] is the program; the rest are Google Benchmark's flags and ours (--help lists them). Returns an exit code.
int run_bench(int argc, char** argv);

}  // namespace clume
