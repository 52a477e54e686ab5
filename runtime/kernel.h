// SPDX-License-Identifier: MIT
// Kernels by name and their arguments by position, with errors that name kernel and argument.
// A cl::Kernel keeps its arguments: set once, then launched often; one thread at a time.
#pragma once

#include <cstddef>
#include <string>
#include <type_traits>

#include "runtime/buffer.h"

namespace clume {

/// The kernel `name` of a built program; DeviceError if there is none.
cl::Kernel make_kernel(const Queue& queue, const cl::Program& program, const std::string& name);

/// The largest work-group this kernel can run with on the device, registers and local memory counted.
std::size_t max_local_size(const Queue& queue, const cl::Kernel& kernel);

/// Sets one argument from memory; `bytes` nullptr asks for local memory of that size.
void set_raw_arg(const Queue& queue, cl::Kernel& kernel, unsigned index, std::size_t byte_size, const void* bytes);

template <class T>
void set_arg(const Queue& queue, cl::Kernel& kernel, unsigned index, const Buffer<T>& buffer) {
    const cl_mem handle = buffer.memory()();
    set_raw_arg(queue, kernel, index, sizeof(cl_mem), &handle);
}

/// A value of exactly the kernel's type: cl_uint, cl_float4, a struct of layout.h.
template <class T>
void set_arg(const Queue& queue, cl::Kernel& kernel, unsigned index, const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    set_raw_arg(queue, kernel, index, sizeof(T), &value);
}

/// All arguments from `first` on: set_args(queue, kernel, 0, nodes, lights, cl_uint(n)).
template <class... Args>
void set_args(const Queue& queue, cl::Kernel& kernel, unsigned first, const Args&... args) {
    unsigned index = first;
    (set_arg(queue, kernel, index++, args), ...);
}

}  // namespace clume
