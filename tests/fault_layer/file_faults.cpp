// SPDX-License-Identifier: MIT
// To be preloaded: sends the process signals, or fails, inside chosen calls on files. CLUME_FILE_FAULT has keys with commas:
//   call=fsync|linkat|rename  n=1 (which call)  times=1 (so many from it on)  signal=9 (sent, if not 0)  again=1 (more of them, 0.4 s apart)  code=28 (errno, if not 0)
#include <dlfcn.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string>

namespace {

/// Strikes if this is the call meant; true: fail with errno.
bool strike(const char* call) {
    static std::atomic<int> count{0};
    const char* text = std::getenv("CLUME_FILE_FAULT");
    if (text == nullptr) return false;
    std::istringstream pairs(text);
    std::string meant;
    int n = 1, times = 1, signal_number = 0, again = 0, code = 0;
    for (std::string pair; std::getline(pairs, pair, ',');) {
        const std::string key = pair.substr(0, pair.find('=')), value = pair.substr(pair.find('=') + 1);
        if (key == "call") meant = value;
        if (key == "n") n = std::atoi(value.c_str());
        if (key == "times") times = std::atoi(value.c_str());
        if (key == "signal") signal_number = std::atoi(value.c_str());
        if (key == "again") again = std::atoi(value.c_str());
        if (key == "code") code = std::atoi(value.c_str());
    }
    if (meant != call) return false;
    if (const int now = ++count; now < n || now >= n + times) return false;
    for (int k = 0; signal_number != 0 && k <= again; ++k) {
        if (k > 0) usleep(400000);
        kill(getpid(), signal_number);
    }
    errno = code;
    return code != 0;
}

template <class Function>
Function next(Function, const char* name) {
    return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" int fsync(int descriptor) {
    return strike("fsync") ? -1 : next(&fsync, "fsync")(descriptor);
}

extern "C" int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) noexcept {
    return strike("linkat") ? -1 : next(&linkat, "linkat")(from_folder, from, to_folder, to, flags);
}

extern "C" int rename(const char* from, const char* to) noexcept {
    return strike("rename") ? -1 : next(&rename, "rename")(from, to);
}
