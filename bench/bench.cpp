// SPDX-License-Identifier: MIT
#include "bench/bench.h"

#include <cstdlib>
#include <string>

#include "bench/compare_host.h"

namespace clume {

int run_bench(int argc, char** argv) {
    HostComparison o;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string a = argv[i];
        if (a == "--filter") o.filter = argv[i + 1];
        if (a == "--rounds") o.rounds = std::atoi(argv[i + 1]);
        if (a == "--strategy") o.strategy = argv[i + 1];
        if (a == "--width") o.vector_width = std::atoi(argv[i + 1]);
        if (a == "--accelerator") o.accelerator = argv[i + 1];
    }
    compare_with_host(o);
    return 0;
}

}  // namespace clume
