// SPDX-License-Identifier: MIT
// Workers that only count, for tests of the dispatcher without OpenCL.
#pragma once

#include <atomic>
#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include "runtime/dispatcher.h"

namespace clume::test {

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
        std::size_t all = 0;
        for (std::uint32_t item = 0; item < options.items; ++item) all += options.end_of(item) - options.begin;
        if (done.size() != all) return false;
        for (const auto& [key, count] : done)
            if (count != 1 || key.first >= options.items || key.second < options.begin || key.second >= options.end_of(key.first)) return false;
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

inline void pause(double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

/// However the threads are scheduled: until the worker that counts its calls has begun that many.
inline void wait_for(const std::atomic<int>& calls, int count) {
    while (calls < count) pause(1e-4);
}

inline Workers stubs(Ledger& ledger, int count, const std::function<void(const Batch&)>& before = {}) {
    Workers workers;
    for (int i = 0; i < count; ++i) workers.push_back(std::make_shared<StubWorker>(ledger, before));
    return workers;
}

inline DispatchOptions grid(std::uint32_t items, std::uint32_t begin, std::uint32_t end) {
    DispatchOptions options;
    options.items = items;
    options.begin = begin;
    options.end = end;
    return options;
}

}  // namespace clume::test
