// SPDX-License-Identifier: MIT
// Names of the OpenCL error codes, and the messages made of them.
#include "runtime/error.h"

#include <CL/opencl.hpp>
#include <utility>

namespace clume {

std::string error_code_name(int code) {
#define CLUME_CODE(name) \
    case name:           \
        return #name;
    switch (code) {
        CLUME_CODE(CL_SUCCESS)
        CLUME_CODE(CL_DEVICE_NOT_FOUND)
        CLUME_CODE(CL_DEVICE_NOT_AVAILABLE)
        CLUME_CODE(CL_COMPILER_NOT_AVAILABLE)
        CLUME_CODE(CL_MEM_OBJECT_ALLOCATION_FAILURE)
        CLUME_CODE(CL_OUT_OF_RESOURCES)
        CLUME_CODE(CL_OUT_OF_HOST_MEMORY)
        CLUME_CODE(CL_PROFILING_INFO_NOT_AVAILABLE)
        CLUME_CODE(CL_MEM_COPY_OVERLAP)
        CLUME_CODE(CL_IMAGE_FORMAT_MISMATCH)
        CLUME_CODE(CL_IMAGE_FORMAT_NOT_SUPPORTED)
        CLUME_CODE(CL_BUILD_PROGRAM_FAILURE)
        CLUME_CODE(CL_MAP_FAILURE)
        CLUME_CODE(CL_MISALIGNED_SUB_BUFFER_OFFSET)
        CLUME_CODE(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST)
        CLUME_CODE(CL_COMPILE_PROGRAM_FAILURE)
        CLUME_CODE(CL_LINKER_NOT_AVAILABLE)
        CLUME_CODE(CL_LINK_PROGRAM_FAILURE)
        CLUME_CODE(CL_DEVICE_PARTITION_FAILED)
        CLUME_CODE(CL_KERNEL_ARG_INFO_NOT_AVAILABLE)
        CLUME_CODE(CL_INVALID_VALUE)
        CLUME_CODE(CL_INVALID_DEVICE_TYPE)
        CLUME_CODE(CL_INVALID_PLATFORM)
        CLUME_CODE(CL_INVALID_DEVICE)
        CLUME_CODE(CL_INVALID_CONTEXT)
        CLUME_CODE(CL_INVALID_QUEUE_PROPERTIES)
        CLUME_CODE(CL_INVALID_COMMAND_QUEUE)
        CLUME_CODE(CL_INVALID_HOST_PTR)
        CLUME_CODE(CL_INVALID_MEM_OBJECT)
        CLUME_CODE(CL_INVALID_IMAGE_FORMAT_DESCRIPTOR)
        CLUME_CODE(CL_INVALID_IMAGE_SIZE)
        CLUME_CODE(CL_INVALID_SAMPLER)
        CLUME_CODE(CL_INVALID_BINARY)
        CLUME_CODE(CL_INVALID_BUILD_OPTIONS)
        CLUME_CODE(CL_INVALID_PROGRAM)
        CLUME_CODE(CL_INVALID_PROGRAM_EXECUTABLE)
        CLUME_CODE(CL_INVALID_KERNEL_NAME)
        CLUME_CODE(CL_INVALID_KERNEL_DEFINITION)
        CLUME_CODE(CL_INVALID_KERNEL)
        CLUME_CODE(CL_INVALID_ARG_INDEX)
        CLUME_CODE(CL_INVALID_ARG_VALUE)
        CLUME_CODE(CL_INVALID_ARG_SIZE)
        CLUME_CODE(CL_INVALID_KERNEL_ARGS)
        CLUME_CODE(CL_INVALID_WORK_DIMENSION)
        CLUME_CODE(CL_INVALID_WORK_GROUP_SIZE)
        CLUME_CODE(CL_INVALID_WORK_ITEM_SIZE)
        CLUME_CODE(CL_INVALID_GLOBAL_OFFSET)
        CLUME_CODE(CL_INVALID_EVENT_WAIT_LIST)
        CLUME_CODE(CL_INVALID_EVENT)
        CLUME_CODE(CL_INVALID_OPERATION)
        CLUME_CODE(CL_INVALID_GL_OBJECT)
        CLUME_CODE(CL_INVALID_BUFFER_SIZE)
        CLUME_CODE(CL_INVALID_MIP_LEVEL)
        CLUME_CODE(CL_INVALID_GLOBAL_WORK_SIZE)
        CLUME_CODE(CL_INVALID_PROPERTY)
        CLUME_CODE(CL_INVALID_IMAGE_DESCRIPTOR)
        CLUME_CODE(CL_INVALID_COMPILER_OPTIONS)
        CLUME_CODE(CL_INVALID_LINKER_OPTIONS)
        CLUME_CODE(CL_INVALID_DEVICE_PARTITION_COUNT)
        case -1001:
            return "CL_PLATFORM_NOT_FOUND_KHR";
        default:
            return "OpenCL error " + std::to_string(code);
    }
#undef CLUME_CODE
}

void throw_device_error(const cl::Error& error, const std::string& device, const std::string& detail) {
    std::string message = std::string(error.what()) + ": " + error_code_name(error.err()) + " on " + device;
    if (!detail.empty()) message += " (" + detail + ")";
    if (error.err() == CL_MEM_OBJECT_ALLOCATION_FAILURE || error.err() == CL_OUT_OF_HOST_MEMORY) throw DeviceMemoryError(message);
    throw DeviceError(message);
}

BuildError::BuildError(const std::string& device, std::string options_used, std::string build_log)
    : DeviceError("clBuildProgram: CL_BUILD_PROGRAM_FAILURE on " + device + "\noptions: " + options_used + "\n" + build_log),
      options(std::move(options_used)),
      log(std::move(build_log)) {}

}  // namespace clume
