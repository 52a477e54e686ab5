// SPDX-License-Identifier: MIT
// Shares out work over workers, one thread each. Each item has a half-open range of units; a batch is some units of one
// item. Items advance together, pass by pass, so that whenever it stops all hold about the same share of their units.
// Nothing is said about order: what a batch yields must add up the same in any.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace clume {

/// Units [begin, end) of one item, begin < end.
struct Batch {
    std::uint32_t item = 0;
    std::uint32_t begin = 0, end = 0;
};

/// Thrown by Worker::run: the batch is left undone, since nobody waits for it any more.
struct BatchAbandoned {};

/// What does batches, called from its own thread only, one batch at a time.
class Worker {
public:
    Worker();
    virtual ~Worker();
    virtual std::string name() const = 0;
    /// Blocks until done, keeping the results to itself. Throws DeviceError if the device failed: then the batch is given to
    /// another worker and this one gets no more. Any other exception ends the dispatch. Warm up (compile) before
    /// dispatching, since batches are sized by how long they take. Calls alive() with every step that came to its end, and may
    /// throw BatchAbandoned after it if the batch is unwanted().
    virtual void run(const Batch& batch) = 0;
    /// Adds what run() has made to the whole; host work only. Not called for a worker that was given up meanwhile.
    virtual void commit(const Batch&) {}
    /// What it does just now, such as "kernel render"; asked from another thread when it gives no sign of life.
    virtual std::string doing() const { return "a batch"; }

    /// A sign of life.
    void alive() { sign_of_life_.store(std::chrono::steady_clock::now()); }
    double silent_s() const;  ///< since the last one

    /// Of the batch under way: set by dispatch once it has been asked to stop and has waited for the batch for a second.
    void set_unwanted(bool unwanted) { unwanted_.store(unwanted); }
    bool unwanted() const { return unwanted_.load(); }

private:
    std::atomic<std::chrono::steady_clock::time_point> sign_of_life_;
    std::atomic<bool> unwanted_{false};
};

/// Shared, because a worker that hangs outlives its dispatch together with its thread.
using Workers = std::vector<std::shared_ptr<Worker>>;

struct DispatchProgress {
    std::uint64_t units_done = 0, units_total = 0;  ///< over all items
    double elapsed_s = 0;
    double remaining_s = -1;  ///< expected from measured costs; −1: not known yet
};

struct DispatchOptions {
    std::uint32_t items = 0;
    std::uint32_t begin = 0, end = 0;      ///< units of every item
    std::vector<std::uint32_t> ends;       ///< instead of `end`, one per item; empty: `end` for all
    std::uint32_t fixed_chunk = 0;         ///< units per batch; 0: by measurement
    double target_seconds = 0.15;          ///< per batch; well under a display driver's watchdog
    double hang_seconds = 0;               ///< a worker silent for so long is given up; 0: none ever is
    std::function<bool()> stop;            ///< asked before each batch and every 0.2 s, one thread at a time; true: start no more
    std::function<void(const DispatchProgress&)> progress;  ///< called by dispatch's caller's thread, every 0.2 s and at the end

    std::uint32_t end_of(std::uint32_t item) const { return std::max(begin, ends.empty() ? end : ends[item]); }
};

struct WorkerReport {
    std::string name;
    std::uint64_t units = 0;
    std::uint64_t batches = 0;
    double busy_s = 0;     ///< inside run(), failed batches included
    bool dropped = false;
    bool hung = false;     ///< dropped because it gave no sign of life; its thread is left behind
    std::string error;     ///< why it was dropped
};

struct DispatchReport {
    bool failed = false;   ///< no worker was left and work was
    bool stopped = false;  ///< by `stop`, before the end
    std::uint64_t units_done = 0, units_total = 0;
    double elapsed_s = 0;
    std::vector<WorkerReport> workers;         ///< in the order given
    std::vector<std::uint32_t> units_of_item;  ///< done: the first units of the range, the item's `gaps` left out
    std::vector<Batch> gaps;                   ///< abandoned, or held by a dropped worker, and not redone
    std::vector<std::string> warnings;         ///< one per dropped worker
};

/// Runs until all is done, `stop` says so, or no worker is left. What isn't a DeviceError (from a worker, `stop` or
/// `progress`) is thrown again here once every thread has ended its batch or was given up.
DispatchReport dispatch(const Workers& workers, const DispatchOptions& options);

}  // namespace clume
