// SPDX-License-Identifier: MIT
// An OpenCL layer (ICD loader, OPENCL_LAYERS) that makes real calls fail on demand, for the tests. CLUME_FAULT holds faults
// with blanks between them, each keys with commas: kind=enqueue,n=5,device=1. Devices are numbered as contexts are made on
// them; counting from 1 is per device, and of one kernel's launches (kernel=render) where it is launches that are counted.
//   buffer   the n-th clCreateBuffer and later ones (times=1: only it) fail with `code` (default −4, allocation failure)
//   size     every buffer above `bytes` fails so
//   build    clBuildProgram fails
//   enqueue  the n-th launch fails with `code` (default −5, out of resources), as do later ones
//   lost     from the n-th launch on every call on the device fails, even releases
//   wrong    the lowest bit of what is read back is wrong from the n-th read on
//   hang     the n-th launch is of a kernel that never ends
//   block    the n-th launch is a call that never returns
#include <CL/cl.h>
#include <CL/cl_layer.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

namespace {

struct Fault {
    std::string kind, kernel = "render";
    long n = 1, times = 1L << 40, device = -1, code = 0;
    std::size_t bytes = 0;
};

struct Device {
    long index = 0, buffers = 0, reads = 0;
    std::map<std::string, long> launches;
    bool lost = false;
};

const cl_icd_dispatch* real = nullptr;
cl_icd_dispatch layer;
std::vector<Fault> faults;
std::mutex mutex;
std::map<cl_device_id, Device> devices;
std::map<const void*, cl_device_id> owner;  // of contexts, queues, buffers, programs, kernels

void parse(const char* text) {
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        Fault f;
        std::istringstream pairs(word);
        for (std::string pair; std::getline(pairs, pair, ',');) {
            const std::string key = pair.substr(0, pair.find('=')), value = pair.substr(pair.find('=') + 1);
            if (key == "kind") f.kind = value;
            if (key == "kernel") f.kernel = value;
            if (key == "n") f.n = std::atol(value.c_str());
            if (key == "times") f.times = std::atol(value.c_str());
            if (key == "device") f.device = std::atol(value.c_str());
            if (key == "code") f.code = std::atol(value.c_str());
            if (key == "bytes") f.bytes = static_cast<std::size_t>(std::atol(value.c_str()));
        }
        faults.push_back(f);
    }
}

/// The device that an object belongs to; none if it isn't known.
Device* device_of(const void* object) {
    const auto it = owner.find(object);
    return it == owner.end() ? nullptr : &devices[it->second];
}

template <class Handle>
Handle adopt(Handle made, const void* parent) {
    const std::lock_guard lock(mutex);
    const auto it = owner.find(parent);
    if (made != nullptr && it != owner.end()) owner[made] = it->second;
    return made;
}

bool is_lost(const void* object) {
    const std::lock_guard lock(mutex);
    const Device* d = device_of(object);
    return d != nullptr && d->lost;
}

/// The fault of this kind that strikes at the device's `count`-th time.
const Fault* strikes(const char* kind, const Device& d, long count) {
    for (const Fault& f : faults)
        if (f.kind == kind && (f.device < 0 || f.device == d.index) && count >= f.n && count < f.n + f.times) return &f;
    return nullptr;
}

cl_int code_of(const Fault& f, cl_int otherwise) { return f.code != 0 ? static_cast<cl_int>(f.code) : otherwise; }

constexpr cl_int lost_code = CL_DEVICE_NOT_AVAILABLE;

cl_context CL_API_CALL create_context(const cl_context_properties* p, cl_uint count, const cl_device_id* ids,
                                      void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* user, cl_int* error) {
    if (count > 0) {
        const std::lock_guard lock(mutex);
        const auto [it, fresh] = devices.try_emplace(ids[0]);
        if (fresh) it->second.index = static_cast<long>(devices.size()) - 1;
        if (it->second.lost) {
            if (error != nullptr) *error = lost_code;
            return nullptr;
        }
    }
    cl_context made = real->clCreateContext(p, count, ids, notify, user, error);
    const std::lock_guard lock(mutex);
    if (made != nullptr && count > 0) owner[made] = ids[0];
    return made;
}

cl_command_queue CL_API_CALL create_queue(cl_context context, cl_device_id id, cl_command_queue_properties p, cl_int* error) {
    return adopt(real->clCreateCommandQueue(context, id, p, error), context);
}

cl_mem CL_API_CALL create_buffer(cl_context context, cl_mem_flags flags, size_t size, void* host, cl_int* error) {
    {
        const std::lock_guard lock(mutex);
        if (Device* d = device_of(context)) {
            const Fault* f = strikes("buffer", *d, ++d->buffers);
            for (const Fault& s : faults)
                if (s.kind == "size" && (s.device < 0 || s.device == d->index) && size > s.bytes) f = &s;
            if (f != nullptr || d->lost) {
                if (error != nullptr) *error = d->lost ? lost_code : code_of(*f, CL_MEM_OBJECT_ALLOCATION_FAILURE);
                return nullptr;
            }
        }
    }
    return adopt(real->clCreateBuffer(context, flags, size, host, error), context);
}

cl_program CL_API_CALL create_program(cl_context context, cl_uint count, const char** texts, const size_t* lengths, cl_int* error) {
    return adopt(real->clCreateProgramWithSource(context, count, texts, lengths, error), context);
}

cl_int CL_API_CALL build_program(cl_program program, cl_uint count, const cl_device_id* ids, const char* options,
                                 void(CL_CALLBACK* notify)(cl_program, void*), void* user) {
    {
        const std::lock_guard lock(mutex);
        if (const Device* d = device_of(program))
            if (const Fault* f = strikes("build", *d, 1L << 39)) return code_of(*f, CL_BUILD_PROGRAM_FAILURE);
    }
    return real->clBuildProgram(program, count, ids, options, notify, user);
}

cl_kernel CL_API_CALL create_kernel(cl_program program, const char* name, cl_int* error) {
    return adopt(real->clCreateKernel(program, name, error), program);
}

/// Takes the kernel's place on the queue and never ends.
cl_int launch_endless(cl_command_queue queue, cl_event* event) {
    cl_context context = nullptr;
    cl_device_id id = nullptr;
    real->clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof(cl_context), &context, nullptr);
    real->clGetCommandQueueInfo(queue, CL_QUEUE_DEVICE, sizeof(cl_device_id), &id, nullptr);
    const char* text = "__kernel void endless(volatile __global uint* p) { while (p[0] == 0) p[1] += 1; }";
    cl_program program = real->clCreateProgramWithSource(context, 1, &text, nullptr, nullptr);
    real->clBuildProgram(program, 1, &id, "", nullptr, nullptr);
    cl_kernel kernel = real->clCreateKernel(program, "endless", nullptr);
    cl_uint zeros[2] = {0, 0};
    cl_mem memory = real->clCreateBuffer(context, CL_MEM_COPY_HOST_PTR, sizeof zeros, zeros, nullptr);
    real->clSetKernelArg(kernel, 0, sizeof(cl_mem), &memory);
    const size_t one = 1;
    return real->clEnqueueNDRangeKernel(queue, kernel, 1, nullptr, &one, &one, 0, nullptr, event);
}

cl_int CL_API_CALL enqueue_kernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t* offset, const size_t* global,
                                  const size_t* local, cl_uint waits, const cl_event* wait_list, cl_event* event) {
    bool endless = false, blocked = false;
    {
        const std::lock_guard lock(mutex);
        if (Device* d = device_of(queue)) {
            char name[128] = "";
            real->clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof name, name, nullptr);
            const long count = ++d->launches[name];
            for (const Fault& f : faults) {
                if (f.kernel != name || (f.device >= 0 && f.device != d->index) || count < f.n || count >= f.n + f.times) continue;
                if (f.kind == "enqueue") return code_of(f, CL_OUT_OF_RESOURCES);
                if (f.kind == "lost") d->lost = true;
                endless = endless || f.kind == "hang";
                blocked = blocked || f.kind == "block";
            }
            if (d->lost) return lost_code;
        }
    }
    while (blocked) pause();  // NOLINT(bugprone-infinite-loop): that is the fault
    if (endless) return launch_endless(queue, event);
    return real->clEnqueueNDRangeKernel(queue, kernel, dimensions, offset, global, local, waits, wait_list, event);
}

cl_int CL_API_CALL enqueue_read(cl_command_queue queue, cl_mem memory, cl_bool blocking, size_t offset, size_t size, void* to, cl_uint waits,
                                const cl_event* wait_list, cl_event* event) {
    bool lie = false;
    {
        const std::lock_guard lock(mutex);
        if (Device* d = device_of(queue)) {
            if (d->lost) return lost_code;
            lie = strikes("wrong", *d, ++d->reads) != nullptr;
        }
    }
    const cl_int code = real->clEnqueueReadBuffer(queue, memory, blocking, offset, size, to, waits, wait_list, event);
    if (lie && blocking && size > 0) static_cast<unsigned char*>(to)[0] ^= 1;
    return code;
}

cl_int CL_API_CALL enqueue_write(cl_command_queue queue, cl_mem memory, cl_bool blocking, size_t offset, size_t size, const void* from, cl_uint waits,
                                 const cl_event* wait_list, cl_event* event) {
    if (is_lost(queue)) return lost_code;
    return real->clEnqueueWriteBuffer(queue, memory, blocking, offset, size, from, waits, wait_list, event);
}

cl_int CL_API_CALL finish(cl_command_queue queue) { return is_lost(queue) ? lost_code : real->clFinish(queue); }

/// What a lost device's objects answer to releases: they are gone.
template <auto member, class Handle>
cl_int CL_API_CALL release(Handle handle) {
    return is_lost(handle) ? lost_code : (real->*member)(handle);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) cl_int CL_API_CALL clGetLayerInfo(cl_layer_info what, size_t size, void* value, size_t* size_ret) {
    if (what != CL_LAYER_API_VERSION) return CL_INVALID_VALUE;
    const cl_layer_api_version version = CL_LAYER_API_VERSION_100;
    if (value != nullptr && size >= sizeof version) std::memcpy(value, &version, sizeof version);
    if (size_ret != nullptr) *size_ret = sizeof version;
    return CL_SUCCESS;
}

extern "C" __attribute__((visibility("default"))) cl_int CL_API_CALL clInitLayer(cl_uint entries, const cl_icd_dispatch* target, cl_uint* entries_ret,
                                                                                const cl_icd_dispatch** layer_ret) {
    if (target == nullptr || layer_ret == nullptr || entries_ret == nullptr || entries < sizeof layer / sizeof(void*)) return CL_INVALID_VALUE;
    if (const char* text = std::getenv("CLUME_FAULT")) parse(text);
    real = target;
    layer = *target;
    layer.clCreateContext = create_context;
    layer.clCreateCommandQueue = create_queue;
    layer.clCreateBuffer = create_buffer;
    layer.clCreateProgramWithSource = create_program;
    layer.clBuildProgram = build_program;
    layer.clCreateKernel = create_kernel;
    layer.clEnqueueNDRangeKernel = enqueue_kernel;
    layer.clEnqueueReadBuffer = enqueue_read;
    layer.clEnqueueWriteBuffer = enqueue_write;
    layer.clFinish = finish;
    layer.clReleaseMemObject = release<&cl_icd_dispatch::clReleaseMemObject, cl_mem>;
    layer.clReleaseKernel = release<&cl_icd_dispatch::clReleaseKernel, cl_kernel>;
    layer.clReleaseCommandQueue = release<&cl_icd_dispatch::clReleaseCommandQueue, cl_command_queue>;
    layer.clReleaseContext = release<&cl_icd_dispatch::clReleaseContext, cl_context>;
    *entries_ret = sizeof layer / sizeof(void*);
    *layer_ret = &layer;
    return CL_SUCCESS;
}
