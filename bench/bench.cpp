// SPDX-License-Identifier: MIT
#include "bench/bench.h"

namespace clume {

int run_bench(int, char**) { return 0; }

}  // namespace clume
