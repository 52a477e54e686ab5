// SPDX-License-Identifier: MIT
// The one way OpenCL calls are checked: the bindings throw cl::Error naming the call, and every public function of
// runtime/ wraps its calls in `checked`, which turns that into a DeviceError naming the device too.
#pragma once

#include <CL/opencl.hpp>
#include <string>
#include <utility>

#include "runtime/error.h"

namespace clume {

/// Runs `body` and returns what it returns; a cl::Error leaves as DeviceError.
template <class Body>
decltype(auto) checked(const std::string& device, Body&& body) {
    try {
        return std::forward<Body>(body)();
    } catch (const cl::Error& error) {
        throw_device_error(error, device);
    }
}

}  // namespace clume
