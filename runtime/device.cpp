// SPDX-License-Identifier: MIT
// Queries and partitions devices. Listing swallows every OpenCL error (no implementation, a broken one: nothing to list).
#include "runtime/device.h"

#include <algorithm>
#include <utility>

#include "runtime/check.h"

namespace clume {

namespace {

/// Driver strings come with trailing zeros and stray blanks.
std::string trimmed(std::string text) {
    text.resize(std::min(text.size(), text.find('\0')));
    const auto first = text.find_first_not_of(" \t\n");
    if (first == std::string::npos) return {};
    return text.substr(first, text.find_last_not_of(" \t\n") - first + 1);
}

/// "Intel(R) Xeon(R) Processor" → "intel-xeon-processor".
std::string slug_of(const std::string& name) {
    std::string slug;
    for (std::size_t i = 0; i < name.size(); ++i) {
        if (name.compare(i, 3, "(R)") == 0) i += 2;
        const char c = name[i];
        if ((c >= '0' && c <= '9') || (c >= 'a' && c <= 'z'))
            slug += c;
        else if (c >= 'A' && c <= 'Z')
            slug += static_cast<char>(c - 'A' + 'a');
        else if (!slug.empty() && slug.back() != '-')
            slug += '-';
    }
    while (!slug.empty() && slug.back() == '-') slug.pop_back();
    return slug;
}

unsigned clamped_width(unsigned native) {
    return native >= 16 ? 16 : native >= 8 ? 8 : native >= 4 ? 4 : 1;
}

DeviceInfo describe(const cl::Device& device, const cl::Platform& platform, const std::string& index) {
    DeviceInfo info;
    info.device = device;
    info.platform = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
    info.platform_version = trimmed(platform.getInfo<CL_PLATFORM_VERSION>());
    info.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
    info.id = index + "-" + slug_of(info.name);
    const cl_device_type type = device.getInfo<CL_DEVICE_TYPE>();
    info.type = (type & CL_DEVICE_TYPE_CPU) ? "cpu" : (type & CL_DEVICE_TYPE_GPU) ? "gpu" : "accelerator";  // a simulator says it is all of them
    info.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
    info.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
    info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
    const unsigned native = device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>();
    info.native_vector_width = info.type == "gpu" ? 1 : clamped_width(native);
    info.global_memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    info.max_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
    info.max_work_group = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
    info.available = device.getInfo<CL_DEVICE_AVAILABLE>() && device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>();
    return info;
}

}  // namespace

std::string DeviceInfo::label() const {
    return name + " (" + id.substr(0, id.find('-')) + ")";
}

bool DeviceInfo::is_pocl() const {
    return platform.find("Portable Computing Language") != std::string::npos ||
           platform_version.find("PoCL") != std::string::npos;
}

std::vector<DeviceInfo> list_devices() {
    std::vector<DeviceInfo> found;
    std::vector<cl::Platform> platforms;
    try {
        cl::Platform::get(&platforms);
    } catch (const cl::Error&) {
        return found;
    }
    for (std::size_t p = 0; p < platforms.size(); ++p) {
        std::vector<cl::Device> devices;
        try {
            platforms[p].getDevices(CL_DEVICE_TYPE_CPU | CL_DEVICE_TYPE_GPU | CL_DEVICE_TYPE_ACCELERATOR, &devices);
        } catch (const cl::Error&) {
            continue;
        }
        for (std::size_t d = 0; d < devices.size(); ++d) {
            try {
                found.push_back(describe(devices[d], platforms[p], "p" + std::to_string(p) + "d" + std::to_string(d)));
            } catch (const cl::Error&) {
                continue;
            }
        }
    }
    return found;
}

std::vector<DeviceInfo> select_devices(const std::vector<std::string>& selectors) {
    return select_from(list_devices(), selectors);
}

std::vector<DeviceInfo> split_cpu(const DeviceInfo& info, int parts) {
    if (parts < 1) throw DeviceError("a device can't be split into " + std::to_string(parts) + " parts");
    if (parts == 1) return {info};
    return checked(info.label(), [&] {
        const auto kinds = info.device.getInfo<CL_DEVICE_PARTITION_PROPERTIES>();
        const auto has = [&](cl_device_partition_property kind) {
            return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
        };
        const bool by_counts = has(CL_DEVICE_PARTITION_BY_COUNTS), equally = has(CL_DEVICE_PARTITION_EQUALLY);
        if (!by_counts && !equally) throw DeviceError(info.label() + " can't be split into sub-devices");
        const unsigned n = static_cast<unsigned>(parts);
        const unsigned limit = std::min<unsigned>(info.compute_units, info.device.getInfo<CL_DEVICE_PARTITION_MAX_SUB_DEVICES>());
        if (n > limit)
            throw DeviceError(info.label() + " can be split into at most " + std::to_string(limit) + " sub-devices, not " +
                              std::to_string(n));
        std::vector<cl_device_partition_property> request;
        const unsigned share = info.compute_units / n, extra = info.compute_units % n;
        if (by_counts) {
            request.push_back(CL_DEVICE_PARTITION_BY_COUNTS);
            for (unsigned i = 0; i < n; ++i) request.push_back(share + (i < extra ? 1 : 0));
            request.push_back(CL_DEVICE_PARTITION_BY_COUNTS_LIST_END);
        } else {
            request = {CL_DEVICE_PARTITION_EQUALLY, static_cast<cl_device_partition_property>(share)};
        }
        request.push_back(0);
        std::vector<cl::Device> made;
        cl::Device parent = info.device;  // createSubDevices isn't const
        parent.createSubDevices(request.data(), &made);
        if (made.size() < n)
            throw DeviceError(info.label() + " was split into " + std::to_string(made.size()) + " sub-devices, not " +
                              std::to_string(n));
        std::vector<DeviceInfo> subs;
        for (unsigned i = 0; i < n; ++i) {
            DeviceInfo sub = info;
            sub.device = made[i];
            // Kept for the process's life: PoCL's threads look at a sub-device after its last command was waited for.
            if (info.is_pocl()) clRetainDevice(made[i]());
            sub.id.insert(std::min(sub.id.size(), sub.id.find('-')), "." + std::to_string(i));
            sub.compute_units = made[i].getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
            subs.push_back(std::move(sub));
        }
        return subs;
    });
}

}  // namespace clume
