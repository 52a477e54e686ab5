// SPDX-License-Identifier: MIT
// What a device does wrong, as exceptions whose message is the whole line printed: the OpenCL call, the code's name, the
// device. Light on purpose (no OpenCL header), so that callers that only catch can include it; check.h does the turning.
#pragma once

#include <stdexcept>
#include <string>

namespace cl {
class Error;
}

namespace clume {

/// No device, an unknown one, or one that failed; exit code 4.
struct DeviceError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The device had no room for a buffer: less at a time may go.
struct DeviceMemoryError : DeviceError {
    using DeviceError::DeviceError;
};

/// A program that didn't build. The message holds the log and the options.
struct BuildError : DeviceError {
    BuildError(const std::string& device, std::string options_used, std::string build_log);
    std::string options;
    std::string log;
};

/// "CL_OUT_OF_RESOURCES" for −5; "OpenCL error −123" for a code without a name.
std::string error_code_name(int code);

/// Throws DeviceError: "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES on DEVICE", `detail` added in brackets if not empty; a
/// DeviceMemoryError if the code says that memory was short (drivers may notice only when a command first uses a buffer).
[[noreturn]] void throw_device_error(const cl::Error& error, const std::string& device, const std::string& detail = {});

}  // namespace clume
