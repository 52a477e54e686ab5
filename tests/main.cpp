// SPDX-License-Identifier: MIT
// Runs the tests and prints, as the very last line, how many test cases passed and failed: "12 passed, 0 failed".
// Running none at all (a misspelt filter) is a failure.
#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>
#include <cstdio>
#include <iostream>

namespace {

Catch::Counts test_cases;
bool has_run = false;

struct TotalsListener : Catch::TestEventListenerBase {
    using TestEventListenerBase::TestEventListenerBase;
    void testRunEnded(const Catch::TestRunStats& stats) override {
        test_cases = stats.totals.testCases;
        has_run = true;
        TestEventListenerBase::testRunEnded(stats);
    }
};
CATCH_REGISTER_LISTENER(TotalsListener)

}  // namespace

int main(int argc, char** argv) {
    const int result = Catch::Session().run(argc, argv);
    if (!has_run) return result;  // --help, --list-tests, a wrong option
    const std::size_t passed = test_cases.passed + test_cases.failedButOk;
    std::cerr.flush();
    std::cout.flush();
    std::printf("%zu passed, %zu failed\n", passed, test_cases.failed);
    std::fflush(stdout);
    return result != 0 || passed + test_cases.failed == 0 ? 1 : 0;
}
