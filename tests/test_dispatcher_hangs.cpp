// SPDX-License-Identifier: MIT
// The dispatcher over workers that hang, alone and mixed with failures and stops, and calls that never return. No OpenCL, so that
// these tests also run under ThreadSanitizer (preset tsan).
#include <atomic>
#include <catch2/catch.hpp>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <random>
#include <vector>

#include "runtime/error.h"
#include "runtime/hang.h"
#include "tests/stub_worker.h"

using namespace clume;
using namespace clume::test;

namespace {

/// What calls hang in, until it is opened; then they return.
class Gate {
public:
    void pass() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return open_; });
    }
    void open() {
        const std::lock_guard lock(mutex_);
        open_ = true;
        changed_.notify_all();
    }

private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool open_ = false;
};

constexpr double hang_s = 2;  // far above what a busy machine makes a thread wait

/// Until the thread that was left behind, which shares the worker, has ended.
void wait_for_end(const std::weak_ptr<Worker>& worker) {
    while (!worker.expired()) pause(0.01);
}

}  // namespace

TEST_CASE("Dispatcher.HungWorkerIsGivenUpAndItsBatchRedone", "[quick]") {
    Ledger ledger;
    Gate gate;
    DispatchOptions options = grid(6, 0, 50);
    options.hang_seconds = hang_s;
    std::weak_ptr<Worker> hung;
    {
        const auto calls = std::make_shared<std::atomic<int>>(0);
        Workers workers = stubs(ledger, 2, [calls](const Batch&) { wait_for(*calls, 2); });
        workers.push_back(std::make_shared<StubWorker>(ledger, [&gate, calls](const Batch&) {
            if (++*calls == 2) gate.pass();
        }));
        hung = workers[2];
        const DispatchReport report = dispatch(workers, options);
        CHECK(ledger.complete_once(options));
        CHECK_FALSE(report.failed);
        CHECK(report.workers[2].dropped);
        CHECK(report.workers[2].hung);
        REQUIRE(report.warnings.size() == 1);
        CHECK_THAT(report.warnings[0], Catch::Contains("no sign of life for 2 s") && Catch::Contains("hangs"));
    }
    // What comes back late is not counted a second time.
    gate.open();
    wait_for_end(hung);
    CHECK(ledger.complete_once(options));
}

TEST_CASE("Dispatcher.AllHung", "[quick]") {
    Ledger ledger;
    Gate gate;
    DispatchOptions options = grid(3, 0, 10);
    options.fixed_chunk = 1;
    options.hang_seconds = hang_s;
    std::atomic<int> left{7};
    std::vector<std::weak_ptr<Worker>> hung;
    {
        const Workers workers = stubs(ledger, 2, [&](const Batch&) {
            if (left-- <= 0) gate.pass();
        });
        for (const auto& worker : workers) hung.push_back(worker);
        const DispatchReport report = dispatch(workers, options);
        CHECK(report.failed);
        CHECK(report.units_done == 7);
        CHECK(report.warnings.size() == 2);
        CHECK(report.gaps.size() == 2);
    }
    gate.open();
    for (const auto& worker : hung) wait_for_end(worker);
    CHECK(ledger.done.size() == 7);
}

TEST_CASE("Dispatcher.SlowIsNotHung", "[quick]") {
    Ledger ledger;
    DispatchOptions options = grid(1, 0, 1);
    options.hang_seconds = 0.5;
    Worker* worker = nullptr;
    const Workers workers = stubs(ledger, 1, [&](const Batch&) {
        for (int i = 0; i < 30; ++i) pause(0.05), worker->alive();
    });
    worker = workers[0].get();
    const DispatchReport report = dispatch(workers, options);
    CHECK(report.warnings.empty());
    CHECK(ledger.complete_once(options));
}

TEST_CASE("Dispatcher.StopWhileOneHangs", "[quick]") {
    Ledger ledger;
    Gate gate;
    DispatchOptions options = grid(4, 0, 1000000);
    options.fixed_chunk = 1;
    options.hang_seconds = hang_s;
    std::atomic<bool> stop{false};
    options.stop = [&] { return stop.load(); };
    std::weak_ptr<Worker> hung;
    {
        Workers workers = stubs(ledger, 1, [](const Batch&) { pause(1e-3); });
        workers.push_back(std::make_shared<StubWorker>(ledger, [&](const Batch&) {
            stop = true;
            gate.pass();
        }));
        hung = workers[1];
        const DispatchReport report = dispatch(workers, options);
        CHECK(report.stopped);
        CHECK_FALSE(report.failed);
        CHECK(report.units_done == ledger.done.size());
        CHECK(report.workers[1].hung);
    }
    gate.open();
    wait_for_end(hung);
}

TEST_CASE("Dispatcher.AnyMixtureOfFaultsCountsNothingTwice") {
    std::mt19937 generator(7);
    const auto random = [&](unsigned n) { return static_cast<unsigned>(generator() % n); };
    for (int round = 0; round < 40; ++round) {
        Ledger ledger;
        Gate gate;
        DispatchOptions options = grid(1 + random(9), 0, 1 + random(60));
        options.fixed_chunk = random(3) == 0 ? 1 + random(5) : 0;
        options.target_seconds = 1e-3;
        const bool with_hang = round % 10 == 0;  // these take long
        if (with_hang) options.hang_seconds = hang_s;
        std::atomic<int> stop_in{random(4) == 0 ? static_cast<int>(random(40)) : 1 << 30};
        options.stop = [&] { return stop_in-- <= 0; };
        std::vector<std::weak_ptr<Worker>> weak;
        {
            Workers workers;
            for (std::size_t w = 0, count = 1 + random(5); w < count; ++w) {
                const unsigned fate = random(4), when = random(12);
                workers.push_back(std::make_shared<StubWorker>(ledger, [&gate, fate, when, with_hang, calls = 0u](const Batch&) mutable {
                    if (calls++ < when) return;
                    if (fate == 0) throw DeviceError("gone");
                    if (fate == 1 && with_hang) gate.pass();
                }));
                weak.push_back(workers.back());
            }
            const DispatchReport report = dispatch(workers, options);
            CAPTURE(round);
            CHECK(report.units_done == ledger.done.size());
            for (const auto& [unit, times] : ledger.done) REQUIRE(times == 1);
            if (!report.failed && !report.stopped) CHECK(ledger.complete_once(options));
            std::size_t dropped = 0;
            for (const WorkerReport& worker : report.workers) dropped += worker.dropped ? 1 : 0;
            CHECK(report.warnings.size() == dropped);
            if (report.failed) CHECK(dropped == workers.size());
        }
        gate.open();
        for (const auto& worker : weak) wait_for_end(worker);
        for (const auto& [unit, times] : ledger.done) REQUIRE(times == 1);
    }
}

TEST_CASE("Hang.CallsThatDoNotReturnAreLeftBehind", "[quick]") {
    bool done = false;
    CHECK(ends_within(30, [&] { done = true; }));
    CHECK(done);
    CHECK_THROWS_AS(ends_within(30, [] { throw DeviceError("gone"); }), DeviceError);
    const auto gate = std::make_shared<Gate>();
    const auto left = std::make_shared<std::atomic<bool>>(false);
    CHECK_FALSE(ends_within(0.05, [gate, left] {
        gate->pass();
        *left = true;
    }));
    gate->open();
    while (!*left) pause(0.01);
    CHECK_FALSE(known_to_hang("a stub"));
    note_hang("a stub");
    CHECK(known_to_hang("a stub"));
    CHECK(anything_hangs());
}
