// SPDX-License-Identifier: MIT
// What the tests of runtime/ share: the message of an exception, devices made up or real.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "runtime/device.h"

namespace clume::test {

/// The message of the E that `body` throws; fails the test if it throws nothing.
template <class E, class Body>
std::string message_of(Body&& body) {
    try {
        body();
    } catch (const E& error) {
        return error.what();
    }
    FAIL("nothing was thrown");
    return {};
}

inline bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

inline DeviceInfo made_up(const std::string& id, const std::string& type, const std::string& platform, unsigned units,
                          bool available = true) {
    DeviceInfo info;
    info.id = id;
    info.name = id.substr(id.find('-') + 1);
    info.type = type;
    info.platform = platform;
    info.compute_units = units;
    info.available = available;
    return info;
}

/// The best device of this machine (PoCL in the usual setting).
inline const DeviceInfo& here() {
    static const DeviceInfo device = select_devices({}).front();
    return device;
}

}  // namespace clume::test
