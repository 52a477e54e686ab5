// SPDX-License-Identifier: MIT
// The dispatcher over workers that only count: sharing, failures, hangs, stops. No OpenCL, so that these tests also run under
// ThreadSanitizer (preset tsan), whose reports would drown in those about an OpenCL library that isn't built for it.
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <random>
#include <stdexcept>
#include <thread>

#include "runtime/batch_plan.h"
#include "runtime/dispatcher.h"
#include "runtime/error.h"
#include "runtime/hang.h"

using namespace clume;

namespace {

/// Counts what is done to every (item, unit); sleeps `seconds` per unit if asked.
struct Ledger {
    std::mutex mutex;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> done;
    std::uint32_t longest = 0;

    void add(const Batch& batch) {
        const std::lock_guard lock(mutex);
        longest = std::max(longest, batch.end - batch.begin);
        for (std::uint32_t unit = batch.begin; unit < batch.end; ++unit) ++done[{batch.item, unit}];
    }
    bool complete_once(const DispatchOptions& options) const {
        if (done.size() != std::size_t(options.items) * (options.end - options.begin)) return false;
        for (const auto& [key, count] : done)
            if (count != 1 || key.first >= options.items || key.second < options.begin || key.second >= options.end) return false;
        return true;
    }
};

class StubWorker : public Worker {
public:
    StubWorker(Ledger& ledger, std::function<void(const Batch&)> before) : ledger_(ledger), before_(std::move(before)) {}
    std::string name() const override { return "stub"; }
    void run(const Batch& batch) override {
        if (batch.begin >= batch.end) throw std::logic_error("empty batch");
        if (before_) before_(batch);
    }
    void commit(const Batch& batch) override { ledger_.add(batch); }

private:
    Ledger& ledger_;
    std::function<void(const Batch&)> before_;
};

void pause(double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

/// However the threads are scheduled: until the worker that counts its calls has begun that many.
void wait_for(const std::atomic<int>& calls, int count) {
    while (calls < count) pause(1e-4);
}

Workers stubs(Ledger& ledger, int count, const std::function<void(const Batch&)>& before = {}) {
    Workers workers;
    for (int i = 0; i < count; ++i) workers.push_back(std::make_shared<StubWorker>(ledger, before));
    return workers;
}

DispatchOptions grid(std::uint32_t items, std::uint32_t begin, std::uint32_t end) {
    DispatchOptions options;
    options.items = items;
    options.begin = begin;
    options.end = end;
    return options;
}

/// BatchPlan on a made-up clock: item costs spread 100-fold, workers of the given speeds. Returns the time all is done
/// over the time a perfect sharing would take.
double simulated_makespan(const std::vector<double>& speeds, DispatchOptions options, Ledger& ledger, double& longest_s) {
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

TEST_CASE("Dispatcher.StopAtOnceDoesNothing", "[quick]") {
    Ledger ledger;
    DispatchOptions options = grid(4, 0, 10);
    options.stop = [] { return true; };
    const DispatchReport report = dispatch(stubs(ledger, 3), options);
    CHECK(report.stopped);
    CHECK(report.units_done == 0);
    CHECK(ledger.done.empty());
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
    std::mt19937 random(7);
    for (int round = 0; round < 40; ++round) {
        Ledger ledger;
        Gate gate;
        DispatchOptions options = grid(1 + random() % 9, 0, 1 + random() % 60);
        options.fixed_chunk = random() % 3 == 0 ? 1 + random() % 5 : 0;
        options.target_seconds = 1e-3;
        const bool with_hang = round % 10 == 0;  // these take long
        if (with_hang) options.hang_seconds = hang_s;
        std::atomic<int> stop_in{random() % 4 == 0 ? static_cast<int>(random() % 40) : 1 << 30};
        options.stop = [&] { return stop_in-- <= 0; };
        std::vector<std::weak_ptr<Worker>> weak;
        {
            Workers workers;
            for (std::size_t w = 0, count = 1 + random() % 5; w < count; ++w) {
                const unsigned fate = random() % 4, when = random() % 12;
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
