// SPDX-License-Identifier: MIT
// OpenCL calls that may never return. A thread inside one can't be ended, nor can what it uses be released: it is left
// behind, the device is not used again, and the process must leave by _Exit, since static destructors would wait for it.
#pragma once

#include <functional>
#include <string>

namespace clume {

/// Runs `work` on a thread of its own. True once it has ended (what it throws is thrown here); false after `seconds`: then the
/// thread goes on, so `work` must own or share all it uses. `seconds` 0: waits for ever.
bool ends_within(double seconds, std::function<void()> work);

/// To be said of a device (DeviceInfo::label) given up because of a call that did not return.
void note_hang(const std::string& device);
bool known_to_hang(const std::string& device);
/// True if any was noted in this process.
bool anything_hangs();

}  // namespace clume
