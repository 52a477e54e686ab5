// SPDX-License-Identifier: MIT
// The OpenCL devices of this machine: listing, choosing by what a user types, splitting a CPU into sub-devices.
// Devices are told apart by platform name and type, never by vendor.
#pragma once

#include <CL/opencl.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace clume {

/// One device as found. `id` is "p0d1-slug-of-the-name": platform and device index in the loader's order, stable as long
/// as the installed OpenCL implementations stay the same. Sub-devices add ".0", ".1", … ("p0d1.0-slug").
struct DeviceInfo {  // NOLINT(bugprone-exception-escape): cl::Device says noexcept and may throw
    std::string id;
    std::string platform;
    std::string name;
    std::string type;              ///< "cpu", "gpu" or "accelerator"
    std::string driver;
    std::string version;           ///< of the device ("OpenCL 3.0 PoCL ...")
    std::string platform_version;
    unsigned compute_units = 0;
    unsigned native_vector_width = 1;   ///< floats per vector: 16, 8, 4 or 1; always 1 on GPUs
    std::uint64_t global_memory = 0;    ///< bytes
    std::uint64_t max_allocation = 0;   ///< bytes in one buffer
    std::size_t max_work_group = 1;
    bool available = false;             ///< the device and its compiler are there
    cl::Device device;

    /// "name (p0d1)": what messages call it; sub-devices stay distinct.
    std::string label() const;
    /// Work-items of a work-group that suit its kernels: a CPU's cores take groups as they come free, a GPU's need full warps.
    std::size_t group_size() const { return type == "gpu" ? 64 : 8; }
    /// PoCL has its own program cache and mustn't be asked for binaries.
    bool is_pocl() const;
};

/// Every CPU, GPU and accelerator; empty without any OpenCL implementation. Never throws cl::Error; a device that can't be
/// queried is left out.
std::vector<DeviceInfo> list_devices();

/// The devices meant by `selectors`, each a comma list of: an id or its "p0d1" part; cpu, gpu, accelerator, all; or part of
/// a device or platform name (case doesn't matter; every match counts). No selector: the best one, a GPU before a CPU
/// before an accelerator, then by compute units. Each device once, in the order asked for.
/// Throws DeviceError: no device at all (says how to get one), an unknown selector or an unavailable device (lists those
/// there are).
std::vector<DeviceInfo> select_devices(const std::vector<std::string>& selectors);

/// The same over a given list, so that choosing can be tested without the devices.
std::vector<DeviceInfo> select_from(const std::vector<DeviceInfo>& devices, const std::vector<std::string>& selectors);

/// `parts` ≥ 1 sub-devices with compute units as equal as they come; 1 returns the device itself. Throws DeviceError
/// saying the limit if the device can't be split that often, or not at all.
std::vector<DeviceInfo> split_cpu(const DeviceInfo& info, int parts);

}  // namespace clume
