// SPDX-License-Identifier: MIT
// The dispatcher over workers that only count: every unit once, fair shares, failures, stopping, exceptions, progress; and its plan
// of batches on a made-up clock. No OpenCL, so that these tests also run under ThreadSanitizer (preset tsan).
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <thread>

#include "runtime/batch_plan.h"
#include "runtime/dispatcher.h"
#include "runtime/error.h"
#include "tests/stub_worker.h"

using namespace clume;
using namespace clume::test;

namespace {

/// BatchPlan on a made-up clock: item costs spread 100-fold, workers of the given speeds. Returns the time all is done
/// over the time a perfect sharing would take.
double simulated_makespan(const std::vector<double>& speeds, const DispatchOptions& options, Ledger& ledger, double& longest_s) {
    BatchPlan plan(options, speeds.size());
    std::vector<double> free_at(speeds.size(), 0);
    std::vector<std::optional<Batch>> held(speeds.size());
    const auto cost = [](std::uint32_t item) { return 1e-3 * std::pow(10.0, (item * 7919 % 101) / 50.0); };
    double work = 0, now = 0, last = 0, speed = std::accumulate(speeds.begin(), speeds.end(), 0.0);
    for (std::uint32_t item = 0; item < options.items; ++item) work += cost(item) * (options.end - options.begin);
    const auto seconds = [&](std::size_t w, const Batch& b) { return 1e-4 + (b.end - b.begin) * cost(b.item) / speeds[w]; };
    for (;;) {
        for (std::size_t w = 0; w < speeds.size(); ++w) {
            if (held[w] || !(held[w] = plan.next(w))) continue;
            free_at[w] = now + seconds(w, *held[w]);
            if (held[w]->begin >= options.begin + 9) longest_s = std::max(longest_s, seconds(w, *held[w]));
        }
        std::size_t first = speeds.size();
        for (std::size_t w = 0; w < speeds.size(); ++w)
            if (held[w] && (first == speeds.size() || free_at[w] < free_at[first])) first = w;
        if (first == speeds.size()) break;
        now = last = free_at[first];
        plan.done(first, *held[first], seconds(first, *held[first]));
        ledger.add(*held[first]);
        held[first].reset();
    }
    return last / (work / speed);
}

}  // namespace

TEST_CASE("Dispatcher.EveryUnitOnce", "[quick]") {
    for (int workers = 1; workers <= 4; ++workers) {
        for (const std::uint32_t chunk : {0u, 1u, 7u, 1000000u}) {
            for (DispatchOptions options : {grid(1, 0, 1), grid(13, 0, 37), grid(5, 3, 104), grid(3, 4294967200u, 4294967295u),
                                            grid(0, 0, 9), grid(4, 9, 9)}) {
                options.fixed_chunk = chunk;
                Ledger ledger;
                const DispatchReport report = dispatch(stubs(ledger, workers), options);
                CAPTURE(workers, chunk, options.items, options.begin, options.end);
                CHECK(ledger.complete_once(options));
                CHECK_FALSE(report.failed);
                CHECK_FALSE(report.stopped);
                CHECK(report.units_done == report.units_total);
                CHECK(report.units_of_item == std::vector<std::uint32_t>(options.items, options.end - options.begin));
                std::uint64_t units = 0;
                for (const WorkerReport& worker : report.workers) units += worker.units;
                CHECK(units == report.units_done);
                if (chunk > 0) CHECK(ledger.longest <= chunk);
                if (chunk == 1000000u && options.items > 0) CHECK(ledger.longest == options.end - options.begin);
            }
        }
    }
}

TEST_CASE("Dispatcher.SharesWellOnUnlikeWorkers", "[quick]") {
    struct Case {
        std::vector<double> speeds;
        double most;
        DispatchOptions options = grid(64, 0, 256);
    };
    const Case cases[] = {{{1}, 1.01},     {{1, 1}, 1.02},  {{1, 1, 1, 1}, 1.03},
                          {{1, 3}, 1.04}, {{50, 1}, 1.03}, {{2, 5}, 1.015, grid(1, 0, 2000)}};
    for (const Case& c : cases) {
        Ledger ledger;
        double longest_s = 0;
        const double ratio = simulated_makespan(c.speeds, c.options, ledger, longest_s);
        CAPTURE(c.speeds, ratio, longest_s);
        CHECK(ledger.complete_once(c.options));
        CHECK(ratio < c.most);
        CHECK(longest_s < 1.5 * c.options.target_seconds);
    }
}

TEST_CASE("Dispatcher.SlowWorkerLeavesTheEndToTheFast", "[quick]") {
    const DispatchOptions options = grid(4, 0, 20);
    BatchPlan plan(options, 2);
    Ledger ledger;
    const auto take = [&](std::size_t worker) {
        const std::optional<Batch> batch = plan.next(worker);
        if (batch) ledger.add(*batch);
        return batch;
    };
    const double unit_s[2] = {1e-3, 1.0};
    // The slow one measures an item first, the fast one the others and then the same.
    for (const std::size_t worker : {1u, 0u, 0u, 0u, 0u, 0u, 0u, 0u}) {
        const std::optional<Batch> batch = take(worker);
        REQUIRE(batch);
        plan.done(worker, *batch, unit_s[worker] * (batch->end - batch->begin));
    }
    const std::optional<Batch> held = take(0);
    REQUIRE(held);
    REQUIRE_FALSE(plan.exhausted());
    CHECK_FALSE(plan.next(1));
    plan.failed(0, *held);
    for (std::uint32_t unit = held->begin; unit < held->end; ++unit) ledger.done.erase({held->item, unit});
    while (const auto batch = take(1)) plan.done(1, *batch, unit_s[1] * (batch->end - batch->begin));
    CHECK(plan.exhausted());
    CHECK(ledger.complete_once(options));
}

TEST_CASE("Dispatcher.ItemsAdvanceTogether", "[quick]") {
    Ledger ledger;
    DispatchOptions options = grid(20, 0, 1000);
    options.target_seconds = 0.005;
    int asked = 0;
    options.stop = [&] { return ++asked > 100; };
    const DispatchReport report = dispatch(stubs(ledger, 1, [](const Batch& b) { pause(2e-4 * (b.end - b.begin)); }), options);
    CHECK(report.stopped);
    CHECK_FALSE(report.failed);
    CHECK(report.units_done == ledger.done.size());
    CHECK(report.units_done < report.units_total);
    const auto [least, most] = std::minmax_element(report.units_of_item.begin(), report.units_of_item.end());
    CHECK(*least >= 1);
    CHECK(*most - *least <= 60);
}

TEST_CASE("Dispatcher.EveryItemToItsOwnEnd", "[quick]") {
    for (int workers = 1; workers <= 3; ++workers)
        for (const std::uint32_t chunk : {0u, 1u, 7u, 1000000u})
            for (const std::vector<std::uint32_t>& ends : {std::vector<std::uint32_t>{5, 9, 4, 100, 5}, {4, 4}, {}, {4294967295u}, {7, 2, 7}}) {
                DispatchOptions options = grid(static_cast<std::uint32_t>(ends.size()), ends.size() == 1 ? 4294967200u : 4, 0);
                options.ends = ends;
                options.fixed_chunk = chunk;
                Ledger ledger;
                const DispatchReport report = dispatch(stubs(ledger, workers), options);
                CAPTURE(workers, chunk, ends);
                CHECK(ledger.complete_once(options));
                CHECK(report.units_done == report.units_total);
                CHECK_FALSE(report.failed);
                for (std::size_t i = 0; i < ends.size(); ++i) CHECK(report.units_of_item[i] == std::max(ends[i], options.begin) - options.begin);
            }
}

TEST_CASE("Dispatcher.ItemsOfUnlikeLengthAdvanceByShares", "[quick]") {
    Ledger ledger;
    DispatchOptions options = grid(20, 0, 0);
    for (std::uint32_t item = 0; item < options.items; ++item) options.ends.push_back(100 * (1 + item));
    options.target_seconds = 0.001;
    std::atomic<std::uint32_t> units = 0;
    options.stop = [&] { return units > 10000; };  // of 21,000
    const DispatchReport report = dispatch(stubs(ledger, 1,
                                                 [&](const Batch& b) {
                                                     units += b.end - b.begin;
                                                     pause(2e-5 * (b.end - b.begin));
                                                 }),
                                           options);
    CHECK(report.stopped);
    for (std::uint32_t item = 0; item < options.items; ++item) {
        CAPTURE(item, report.units_of_item[item]);
        // A pass moves all by a twentieth at most here.
        CHECK(std::abs(report.units_of_item[item] / double(options.ends[item]) - 0.48) < 0.15);
    }
}

TEST_CASE("Dispatcher.StopAtOnceDoesNothing", "[quick]") {
    Ledger ledger;
    DispatchOptions options = grid(4, 0, 10);
    options.stop = [] { return true; };
    const DispatchReport report = dispatch(stubs(ledger, 3), options);
    CHECK(report.stopped);
    CHECK(report.units_done == 0);
    CHECK(ledger.done.empty());
}

TEST_CASE("Dispatcher.NobodyWaitsForABatchThatTakesLong", "[quick]") {
    // Asked to stop, batches under way are waited for for a second; what takes longer is left, if its worker looks.
    Ledger ledger;
    Workers workers = stubs(ledger, 1);
    Worker* self = nullptr;
    std::atomic<bool> stop{false};
    std::atomic<int> brief{0};
    workers.push_back(std::make_shared<StubWorker>(ledger, [&](const Batch&) {
        wait_for(brief, 1);
        stop = true;
        while (!self->unwanted()) pause(1e-3);
        throw BatchAbandoned();
    }));
    self = workers[1].get();
    workers[0] = std::make_shared<StubWorker>(ledger, [&](const Batch&) {
        ++brief;
        while (!stop) pause(1e-4);
    });
    DispatchOptions options = grid(8, 0, 4);
    options.fixed_chunk = 1;
    options.stop = [&] { return stop.load(); };
    const auto start = std::chrono::steady_clock::now();
    const DispatchReport report = dispatch(workers, options);
    CHECK(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < 20);
    CHECK(report.stopped);
    CHECK_FALSE(report.failed);
    CHECK(report.units_done == 1);
    CHECK(ledger.done.size() == 1);
    CHECK(report.gaps.size() == 1);
    CHECK(report.warnings.empty());
}

TEST_CASE("Dispatcher.FailedBatchIsRedoneByAnother", "[quick]") {
    for (const std::uint32_t chunk : {0u, 3u}) {
        Ledger ledger;
        DispatchOptions options = grid(6, 0, 50);
        options.fixed_chunk = chunk;
        std::atomic<int> calls{0};
        auto workers = stubs(ledger, 2, [&](const Batch&) { wait_for(calls, 2); });
        workers.push_back(std::make_shared<StubWorker>(ledger, [&](const Batch&) {
            if (++calls == 2) throw DeviceError("clFinish: CL_OUT_OF_RESOURCES on stub");
        }));
        const DispatchReport report = dispatch(workers, options);
        CHECK(ledger.complete_once(options));
        CHECK_FALSE(report.failed);
        CHECK(report.workers[2].dropped);
        CHECK(report.workers[2].batches == 1);
        REQUIRE(report.warnings.size() == 1);
        CHECK_THAT(report.warnings[0], Catch::Contains("CL_OUT_OF_RESOURCES"));
        CHECK(report.gaps.empty());
    }
}

TEST_CASE("Dispatcher.FailureOfTheLastBatchWakesAnIdleWorker", "[quick]") {
    Ledger ledger;
    std::atomic<int> calls{0};
    const DispatchOptions options = grid(2, 0, 1);
    const DispatchReport report = dispatch(stubs(ledger, 2,
                                                 [&](const Batch& batch) {
                                                     if (batch.item == 1 && calls++ == 0) {
                                                         pause(0.05);
                                                         throw DeviceError("gone");
                                                     }
                                                 }),
                                           options);
    CHECK(ledger.complete_once(options));
    CHECK(report.warnings.size() == 1);
}

TEST_CASE("Dispatcher.AllFailed", "[quick]") {
    Ledger ledger;
    std::atomic<int> left{5};
    const DispatchOptions options = grid(4, 0, 100);
    const DispatchReport report = dispatch(stubs(ledger, 3,
                                                 [&](const Batch&) {
                                                     if (left-- <= 0) throw DeviceError("gone");
                                                 }),
                                           options);
    CHECK(report.failed);
    CHECK_FALSE(report.stopped);
    CHECK(report.warnings.size() == 3);
    CHECK(report.units_done == ledger.done.size());
    CHECK(report.units_done >= 5);
    CHECK_FALSE(report.gaps.empty());
    std::uint64_t held = 0;
    for (const std::uint32_t units : report.units_of_item) held += units;
    CHECK(held == report.units_done);
    for (const Batch& gap : report.gaps)
        for (std::uint32_t unit = gap.begin; unit < gap.end; ++unit) CHECK(ledger.done.count({gap.item, unit}) == 0);
    CHECK(dispatch({}, options).failed);
}

TEST_CASE("Dispatcher.OtherExceptionsReachTheCaller", "[quick]") {
    Ledger ledger;
    const DispatchOptions options = grid(4, 0, 100);
    CHECK_THROWS_AS(dispatch(stubs(ledger, 3,
                                   [](const Batch& batch) {
                                       if (batch.begin > 0) throw std::out_of_range("a bug");
                                   }),
                             options),
                    std::out_of_range);
    DispatchOptions bad = grid(4, 0, 100);
    bad.progress = [](const DispatchProgress&) { throw std::domain_error("a bug"); };
    CHECK_THROWS_AS(dispatch(stubs(ledger, 2), bad), std::domain_error);
    bad.progress = {};
    bad.stop = []() -> bool { throw std::length_error("a bug"); };
    CHECK_THROWS_AS(dispatch(stubs(ledger, 2), bad), std::length_error);
}

TEST_CASE("Dispatcher.ProgressComesFromTheCallersThread", "[quick]") {
    Ledger ledger;
    DispatchOptions options = grid(4, 0, 200);
    std::vector<DispatchProgress> seen;
    const std::thread::id caller = std::this_thread::get_id();
    options.progress = [&](const DispatchProgress& state) {
        CHECK(std::this_thread::get_id() == caller);
        seen.push_back(state);
    };
    dispatch(stubs(ledger, 2, [](const Batch& b) { pause(1e-3 * (b.end - b.begin)); }), options);
    REQUIRE(seen.size() >= 2);
    CHECK(seen.size() <= 10);
    CHECK(seen.front().remaining_s > 0.02);
    CHECK(seen.front().remaining_s < 2);
    CHECK(seen.back().units_done == 800);
    CHECK(seen.back().remaining_s == 0);
    for (std::size_t i = 1; i < seen.size(); ++i) CHECK(seen[i].units_done >= seen[i - 1].units_done);
}
