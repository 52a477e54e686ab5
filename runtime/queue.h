// SPDX-License-Identifier: MIT
// One device made ready: its context, shared by the queues of a GPU, and one in-order, profiled queue. One thread uses a
// Queue at a time. Kernels and buffers made on it may outlive it (OpenCL counts references).
#pragma once

#include <CL/opencl.hpp>
#include <cstddef>
#include <memory>
#include <string>

#include "runtime/device.h"

namespace clume {

class Queue {
public:
    explicit Queue(DeviceInfo info);
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    const DeviceInfo& info() const { return info_; }
    const std::string& label() const { return label_; }  ///< what errors call the device
    const cl::Context& context() const { return *context_; }
    const cl::CommandQueue& queue() const { return queue_; }

    /// Enqueues `global` work-items, padded up to a multiple of `local` (kernels check their bounds), and returns at once.
    /// global 0 does nothing. `local` 0 leaves the size to the driver; on PoCL keep it fixed, each size is compiled anew.
    void enqueue(const cl::Kernel& kernel, std::size_t global, std::size_t local);
    /// The same, then waits; returns the seconds the kernel ran on the device.
    double launch(const cl::Kernel& kernel, std::size_t global, std::size_t local);
    void flush();   ///< starts what is enqueued
    void finish();  ///< waits for it; throws DeviceError if a command failed

    /// Device memory, or `host` memory if the flags say so; the DeviceMemoryError of a failure tells bytes asked for and the most the
    /// device gives.
    cl::Buffer allocate(std::size_t byte_size, cl_mem_flags flags, void* host = nullptr) const;

private:
    DeviceInfo info_;
    std::string label_;
    std::shared_ptr<const cl::Context> context_;
    cl::CommandQueue queue_;
};

}  // namespace clume
