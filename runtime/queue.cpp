// SPDX-License-Identifier: MIT
// Context, queue and launches of one device; cl::Error leaves as DeviceError.
#include "runtime/queue.h"

#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "runtime/check.h"

namespace clume {

namespace {

/// A failed launch names its kernel; the padded size is reported since it's what the device saw.
cl::Event start(const cl::CommandQueue& queue, const std::string& label, const cl::Kernel& kernel, std::size_t global,
                std::size_t local) {
    const std::size_t padded = local ? (global + local - 1) / local * local : global;
    try {
        cl::Event event;
        queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(padded), local ? cl::NDRange(local) : cl::NullRange,
                                   nullptr, &event);
        return event;
    } catch (const cl::Error& error) {
        cl_int status = CL_SUCCESS;
        const std::string name = kernel() ? kernel.getInfo<CL_KERNEL_FUNCTION_NAME>(&status) : std::string("no kernel");
        throw_device_error(error, label,
                           "kernel " + name + ", " + std::to_string(padded) + " work-items by " + std::to_string(local));
    }
}

/// The context for a queue. A GPU takes long to make one, and much memory: its queues share the one that the first has made and the
/// last takes along. A CPU's are their own: Oclgrind 21.10 mixes up what the programs of one context have initialised.
std::shared_ptr<const cl::Context> context_for(const DeviceInfo& info) {
    const auto make = [&] { return std::make_shared<const cl::Context>(info.device); };
    if (info.type != "gpu") return make();
    static std::mutex mutex;
    static std::map<cl_device_id, std::weak_ptr<const cl::Context>> contexts;
    const std::lock_guard lock(mutex);
    std::weak_ptr<const cl::Context>& known = contexts[info.device()];
    std::shared_ptr<const cl::Context> context = known.lock();
    if (!context) known = context = make();
    return context;
}

}  // namespace

Queue::Queue(DeviceInfo info) : info_(std::move(info)), label_(info_.label()) {
    checked(label_, [&] {
        context_ = context_for(info_);
        queue_ = cl::CommandQueue(*context_, info_.device, CL_QUEUE_PROFILING_ENABLE);
    });
}

void Queue::enqueue(const cl::Kernel& kernel, std::size_t global, std::size_t local) {
    if (global > 0) start(queue_, label_, kernel, global, local);
}

double Queue::launch(const cl::Kernel& kernel, std::size_t global, std::size_t local) {
    if (global == 0) return 0;
    const cl::Event event = start(queue_, label_, kernel, global, local);
    return checked(label_, [&] {
        event.wait();
        const cl_ulong begin = event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
        const cl_ulong end = event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
        return end > begin ? static_cast<double>(end - begin) * 1e-9 : 0.0;
    });
}

void Queue::flush() {
    checked(label_, [&] { queue_.flush(); });
}

void Queue::finish() {
    checked(label_, [&] { queue_.finish(); });
}

cl::Buffer Queue::allocate(std::size_t byte_size, cl_mem_flags flags, void* host) const {
    const std::string detail = std::to_string(byte_size) + " bytes asked for, the device gives at most " + std::to_string(info_.max_allocation) +
                               " at once of " + std::to_string(info_.global_memory);
    const auto short_of_memory = [&](const char* call, cl_int code) { return DeviceMemoryError(std::string(call) + ": " + error_code_name(code) + " on " + label_ + " (" + detail + ")"); };
    // Drivers that allocate at the first use take any size.
    if (byte_size > info_.global_memory) throw short_of_memory("clCreateBuffer", CL_INVALID_BUFFER_SIZE);
    try {
        return cl::Buffer(*context_, flags, byte_size, host);
    } catch (const cl::Error& error) {
        // Of an allocation, these mean memory.
        if (error.err() == CL_OUT_OF_RESOURCES || error.err() == CL_INVALID_BUFFER_SIZE) throw short_of_memory(error.what(), error.err());
        throw_device_error(error, label_, detail);
    }
}

}  // namespace clume
