// SPDX-License-Identifier: MIT
// Signal handlers. What runs inside them is async-signal-safe: lock-free atomics, clock_gettime, unlink, write, _exit.
#include "src/interrupt.h"

#include <unistd.h>

#include <array>
#include <climits>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <ctime>

namespace clume {

namespace {

constexpr std::int64_t same_signal_ns = 300'000'000;

enum SlotState : int { slot_free, slot_filling, slot_used };

struct Slot {
    std::atomic<int> state{slot_free};
    char path[PATH_MAX] = {};
};

std::array<Slot, 8> slots;
std::atomic<bool> stop{false};
std::atomic<std::int64_t> last_interrupt_ns{0};
std::atomic<bool> put_off{false}, was_put_off{false};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free &&
              std::atomic<std::int64_t>::is_always_lock_free);

std::int64_t now_ns() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

void say(const char* text) { [[maybe_unused]] const auto written = write(STDERR_FILENO, text, std::strlen(text)); }

void leave_at_once() {
    for (Slot& slot : slots)
        if (slot.state.load() == slot_used) unlink(slot.path);
    say("\nclume: interrupted twice: left at once\n");
    _exit(interrupted_exit_code);
}

void on_signal(int signal_number) {
    stop.store(true);
    if (signal_number != SIGINT) return;
    const std::int64_t now = now_ns();
    std::int64_t last = last_interrupt_ns.load();
    if (last != 0 && now - last < same_signal_ns) return;
    if (!last_interrupt_ns.compare_exchange_strong(last, now) || last == 0) return;
    if (!put_off.load() || was_put_off.exchange(true)) leave_at_once();
    say("\nclume: the image is being written; once more leaves without it\n");
}

}  // namespace

const std::atomic<bool>& stop_requested() { return stop; }

void install_interrupt_handlers() {
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
    struct sigaction before {};
    if (sigaction(SIGHUP, nullptr, &before) == 0 && before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

PutOffLeaving::PutOffLeaving() { put_off.store(true); }
PutOffLeaving::~PutOffLeaving() { put_off.store(false); }

int remember_temp_file(const char* path) {
    const std::size_t length = std::strlen(path);
    if (length >= PATH_MAX) return -1;
    for (std::size_t i = 0; i < slots.size(); ++i) {
        int expected = slot_free;
        if (!slots[i].state.compare_exchange_strong(expected, slot_filling)) continue;
        std::memcpy(slots[i].path, path, length + 1);
        slots[i].state.store(slot_used);
        return static_cast<int>(i);
    }
    return -1;
}

void forget_temp_file(int slot) {
    if (slot >= 0) slots[static_cast<std::size_t>(slot)].state.store(slot_free);
}

}  // namespace clume
