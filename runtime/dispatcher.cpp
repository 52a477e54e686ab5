// SPDX-License-Identifier: MIT
// The threads around BatchPlan: one lock guards plan and report, workers run outside it. A worker without work waits
// until all is done, since another's failure may give it some. A thread that hangs can't be ended: it is left behind, with
// the state it shares, and comes back, if ever, to find that it was given up.
#include "runtime/dispatcher.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "runtime/batch_plan.h"
#include "runtime/error.h"

namespace clume {

Worker::Worker() : sign_of_life_(std::chrono::steady_clock::now()) {}
Worker::~Worker() = default;

double Worker::silent_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - sign_of_life_.load()).count();
}

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPatience = 1;  ///< seconds from its begin that a batch is waited for after `stop`

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Seconds as people write them: "60", "0.5".
std::string plain(double seconds) {
    std::string text = std::to_string(seconds);
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
    return text;
}

class Dispatch {
public:
    Dispatch(const Workers& workers, const DispatchOptions& options)
        : workers_(workers), options_(options), plan_(options, workers.size()), held_(workers.size()), started_(workers.size()), alive_(workers.size()) {
        for (const auto& worker : workers) report_.workers.emplace_back().name = worker->name();
        report_.units_of_item.resize(options.items);
        for (std::uint32_t item = 0; item < options.items; ++item) report_.units_total += options.end_of(item) - options.begin;
    }

    /// `self` keeps this alive for threads left behind.
    DispatchReport run(const std::shared_ptr<Dispatch>& self) {
        std::vector<std::thread> threads;
        try {
            for (std::size_t w = 0; w < workers_.size(); ++w) threads.emplace_back([self, w] { self->serve(w); });
            watch(true);
        } catch (...) {
            end_with(std::current_exception());
            watch(false);
        }
        for (std::size_t w = 0; w < threads.size(); ++w) report_.workers[w].hung ? threads[w].detach() : threads[w].join();
        if (error_) std::rethrow_exception(error_);
        report_.elapsed_s = seconds_since(start_);
        report_.gaps = plan_.unredone();
        report_.stopped = stopping_ && report_.units_done < report_.units_total;
        report_.failed = !stopping_ && report_.units_done < report_.units_total;
        if (options_.progress) options_.progress(progress());
        return report_;
    }

private:
    bool ended() const { return stopping_ || alive_ == 0 || (plan_.exhausted() && under_way_ == 0); }

    void end_with(std::exception_ptr error) {
        const std::lock_guard lock(mutex_);
        if (!error_) error_ = std::move(error);
        stopping_ = true;
        changed_.notify_all();
    }

    /// On the caller's thread until nothing is left to do and every batch has come back: gives up workers that hang, and
    /// calls `progress` if it is to `tell`.
    void watch(bool tell) {
        std::unique_lock lock(mutex_);
        while (!(ended() && under_way_ == 0)) {
            changed_.wait_for(lock, std::chrono::milliseconds(200), [&] { return ended() && under_way_ == 0; });
            give_up_hung();
            abandon_if_asked();
            if (!tell || !options_.progress || seconds_since(reported_) < 0.19) continue;
            reported_ = Clock::now();
            const DispatchProgress state = progress();
            lock.unlock();
            options_.progress(state);
            lock.lock();
        }
    }

    /// A batch may take long where a flight does: nobody who wants to leave waits for it.
    void abandon_if_asked() {
        if (under_way_ == 0 || !options_.stop || !options_.stop()) return;
        stopping_ = true;
        for (std::size_t w = 0; w < workers_.size(); ++w)
            if (held_[w] && seconds_since(started_[w]) > kPatience) workers_[w]->set_unwanted(true);
    }

    void give_up_hung() {
        if (!(options_.hang_seconds > 0)) return;
        for (std::size_t w = 0; w < workers_.size(); ++w) {
            if (!held_[w] || workers_[w]->silent_s() < options_.hang_seconds) continue;
            const Batch batch = *held_[w];
            held_[w].reset();
            --under_way_;
            report_.workers[w].hung = true;
            drop(w, batch, workers_[w]->doing() + " gave no sign of life for " + plain(options_.hang_seconds) + " s: it hangs");
        }
    }

    DispatchProgress progress() const {
        const bool all = report_.units_done == report_.units_total;
        return {report_.units_done, report_.units_total, seconds_since(start_), all ? 0 : plan_.seconds_left()};
    }

    /// A worker's thread.
    void serve(std::size_t w) try {
        std::unique_lock lock(mutex_);
        while (!ended()) {
            if (!plan_.exhausted() && options_.stop && options_.stop()) {
                stopping_ = true;
                break;
            }
            const std::optional<Batch> batch = plan_.next(w);
            if (!batch) {
                changed_.wait(lock);
                continue;
            }
            ++under_way_;
            workers_[w]->alive();
            workers_[w]->set_unwanted(false);
            held_[w] = batch;
            started_[w] = Clock::now();
            lock.unlock();
            std::string failure;
            std::exception_ptr other;
            bool abandoned = false;
            const Clock::time_point start = Clock::now();
            try {
                workers_[w]->run(*batch);
            } catch (const BatchAbandoned&) {
                abandoned = true;
            } catch (const DeviceError& error) {
                failure = error.what();
                if (failure.empty()) failure = "unknown failure";
            } catch (...) {
                other = std::current_exception();
            }
            lock.lock();
            if (!held_[w]) return;  // given up: nobody waits for this thread, nothing it made counts
            held_[w].reset();
            if (failure.empty() && !other && !abandoned) {
                lock.unlock();
                try {
                    workers_[w]->commit(*batch);
                } catch (...) {
                    other = std::current_exception();
                }
                lock.lock();
            }
            const double seconds = seconds_since(start);
            --under_way_;
            WorkerReport& own = report_.workers[w];
            own.busy_s += seconds;
            if (other) {
                if (!error_) error_ = other;
                stopping_ = true;
                break;
            }
            if (abandoned) {
                plan_.failed(w, *batch);
                break;
            }
            if (!failure.empty()) {
                drop(w, *batch, failure);
                return;
            }
            plan_.done(w, *batch, seconds);
            const std::uint32_t units = batch->end - batch->begin;
            own.units += units;
            ++own.batches;
            report_.units_done += units;
            report_.units_of_item[batch->item] += units;
            changed_.notify_all();
        }
        changed_.notify_all();
    } catch (...) {
        end_with(std::current_exception());
    }

    void drop(std::size_t w, const Batch& batch, const std::string& failure) {
        plan_.failed(w, batch);
        --alive_;
        report_.workers[w].dropped = true;
        report_.workers[w].error = failure;
        report_.warnings.push_back("device " + report_.workers[w].name + " failed and was dropped: " + failure);
        changed_.notify_all();
    }

    const Workers workers_;
    const DispatchOptions options_;
    const Clock::time_point start_ = Clock::now();
    Clock::time_point reported_ = start_;
    std::mutex mutex_;
    std::condition_variable changed_;
    BatchPlan plan_;
    DispatchReport report_;
    std::vector<std::optional<Batch>> held_;  ///< per worker: the batch in its run(), by which it can be given up
    std::vector<Clock::time_point> started_;  ///< per worker: when that began
    std::exception_ptr error_;
    std::size_t alive_;
    std::size_t under_way_ = 0;
    bool stopping_ = false;
};

}  // namespace

DispatchReport dispatch(const Workers& workers, const DispatchOptions& options) {
    const auto state = std::make_shared<Dispatch>(workers, options);
    return state->run(state);
}

}  // namespace clume
