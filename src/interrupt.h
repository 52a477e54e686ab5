// SPDX-License-Identifier: MIT
// Ctrl-C and its kin: the first one asks the renderer to stop and keep what is done, a second Ctrl-C leaves at once; while
// the image is being written, a third.
// Temporary files are known here so that leaving at once leaves none behind. One set of handlers per process.
#pragma once

#include <atomic>

namespace clume {

inline constexpr int interrupted_exit_code = 130;

/// True once SIGINT, SIGTERM or SIGHUP has arrived after install_interrupt_handlers().
const std::atomic<bool>& stop_requested();

/// SIGHUP stays ignored where it was (nohup). A second SIGINT within 0.3 s of the first is taken for the same one, because
/// `timeout` and some shells send it both to the process and to its group. SIGPIPE and SIGXFSZ are ignored: a
/// reader of the progress that goes away must not end the render, and a file that may not grow is an error like any other.
void install_interrupt_handlers();

/// While one exists, a second Ctrl-C only says that the image is being written: a third leaves without it.
class PutOffLeaving {
  public:
    PutOffLeaving();
    ~PutOffLeaving();
    PutOffLeaving(const PutOffLeaving&) = delete;
    PutOffLeaving& operator=(const PutOffLeaving&) = delete;
};

/// Makes `path` go away if the process leaves by a second Ctrl-C; returns a slot for forget_temp_file, −1 if none is free.
int remember_temp_file(const char* path);
void forget_temp_file(int slot);

}  // namespace clume
