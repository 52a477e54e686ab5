// SPDX-License-Identifier: MIT
// Kernel creation and arguments with errors that say which.
#include "runtime/kernel.h"

namespace clume {

cl::Kernel make_kernel(const Queue& queue, const cl::Program& program, const std::string& name) {
    try {
        return cl::Kernel(program, name.c_str());
    } catch (const cl::Error& error) {
        throw_device_error(error, queue.label(), "kernel " + name);
    }
}

std::size_t max_local_size(const Queue& queue, const cl::Kernel& kernel) {
    return checked(queue.label(),
                   [&] { return kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(queue.info().device); });
}

void set_raw_arg(const Queue& queue, cl::Kernel& kernel, unsigned index, std::size_t byte_size, const void* bytes) {
    try {
        kernel.setArg(index, byte_size, bytes);
    } catch (const cl::Error& error) {
        cl_int status = CL_SUCCESS;
        throw_device_error(error, queue.label(),
                           "argument " + std::to_string(index) + " of kernel " +
                               kernel.getInfo<CL_KERNEL_FUNCTION_NAME>(&status) + ", " + std::to_string(byte_size) + " bytes");
    }
}

}  // namespace clume
