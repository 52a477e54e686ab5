// SPDX-License-Identifier: MIT
#include "runtime/hang.h"

#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <set>
#include <thread>

namespace clume {

namespace {

std::mutex mutex;
std::set<std::string>& devices() {
    static auto* names = new std::set<std::string>;  // for ever: threads left behind may outlive static objects
    return *names;
}

}  // namespace

bool ends_within(double seconds, std::function<void()> work) {
    const auto task = std::make_shared<std::packaged_task<void()>>(std::move(work));
    std::future<void> end = task->get_future();
    std::thread thread([task] { (*task)(); });
    if (seconds > 0 && end.wait_for(std::chrono::duration<double>(seconds)) != std::future_status::ready) {
        thread.detach();
        return false;
    }
    thread.join();
    end.get();
    return true;
}

void note_hang(const std::string& device) {
    const std::lock_guard lock(mutex);
    devices().insert(device);
}

bool known_to_hang(const std::string& device) {
    const std::lock_guard lock(mutex);
    return devices().count(device) > 0;
}

bool anything_hangs() {
    const std::lock_guard lock(mutex);
    return !devices().empty();
}

}  // namespace clume
