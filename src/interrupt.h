// SPDX-License-Identifier: MIT
// Ctrl-C and its kin: the first one asks the renderer to stop and keep what is done, a second Ctrl-C leaves at once.
// Temporary files are known here so that leaving at once leaves none behind. One set of handlers per process.
#pragma once

#include <atomic>

namespace clume {

inline constexpr int interrupted_exit_code = 130;

/// True once SIGINT, SIGTERM or SIGHUP has arrived after install_interrupt_handlers().
const std::atomic<bool>& stop_requested();

/// SIGHUP stays ignored where it was (nohup). A second SIGINT within 0.3 s of the first is taken for the same one, because
/// `timeout` and some shells send it both to the process and to its group.
void install_interrupt_handlers();

/// Makes `path` go away if the process leaves by a second Ctrl-C; returns a slot for forget_temp_file, −1 if none is free.
int remember_temp_file(const char* path);
void forget_temp_file(int slot);

}  // namespace clume
