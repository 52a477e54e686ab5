// SPDX-License-Identifier: MIT
// Devices of runtime/: choosing them by text, splitting them, buffers on them, and launches.
#include <algorithm>
#include <numeric>
#include <vector>

#include "runtime/buffer.h"
#include "runtime/error.h"
#include "runtime/kernel.h"
#include "runtime/program.h"
#include "runtime/queue.h"
#include "tests/runtime_harness.h"

using namespace clume;
using namespace clume::test;

namespace {

std::string ids_of(const std::vector<DeviceInfo>& devices) {
    std::string ids;
    for (const DeviceInfo& device : devices) ids += device.id.substr(0, device.id.find('-')) + " ";
    return ids;
}

}  // namespace

TEST_CASE("Device.SelectionByText", "[quick]") {
    const std::vector<DeviceInfo> devices = {
        made_up("p0d0-xeon-gold", "cpu", "Portable Computing Language", 8),
        made_up("p0d10-xeon-silver", "cpu", "Portable Computing Language", 16),
        made_up("p1d0-geforce", "gpu", "CUDA", 4),
        made_up("p1d1-broken", "gpu", "CUDA", 400, false),
    };
    CHECK(ids_of(select_from(devices, {})) == "p1d0 ");
    CHECK(ids_of(select_from(devices, {""})) == "p1d0 ");
    CHECK(ids_of(select_from({devices[0], devices[1]}, {})) == "p0d10 ");
    CHECK(ids_of(select_from(devices, {"cpu"})) == "p0d0 p0d10 ");
    CHECK(ids_of(select_from(devices, {"GPU"})) == "p1d0 ");
    CHECK(ids_of(select_from(devices, {"all"})) == "p0d0 p0d10 p1d0 ");
    CHECK(ids_of(select_from(devices, {"XEON"})) == "p0d0 p0d10 ");
    CHECK(ids_of(select_from(devices, {"cuda, p0d0", "p0d10-xeon-silver", "cpu"})) == "p1d0 p0d0 p0d10 ");
    CHECK_THROWS_AS(select_from(devices, {"p0d1"}), DeviceError);  // not p0d10
}

TEST_CASE("Device.ErrorsListWhatIsThere", "[quick]") {
    const std::vector<DeviceInfo> devices = {made_up("p0d0-xeon", "cpu", "PoCL", 8),
                                             made_up("p0d1-old", "gpu", "PoCL", 1, false)};
    CHECK(contains(message_of<DeviceError>([&] { select_from(devices, {"voodoo"}); }), "voodoo"));
    CHECK(contains(message_of<DeviceError>([&] { select_from(devices, {"voodoo"}); }), "p0d0-xeon"));
    CHECK(contains(message_of<DeviceError>([&] { select_from(devices, {"gpu"}); }), "not available"));
    CHECK(contains(message_of<DeviceError>([&] { select_from({}, {"cpu"}); }), "pocl-opencl-icd"));
}

TEST_CASE("Device.TheOneHere", "[quick]") {
    const DeviceInfo& device = here();
    CHECK(device.available);
    CHECK(device.compute_units >= 1);
    CHECK((device.native_vector_width == 1 || device.native_vector_width == 4 || device.native_vector_width == 8 ||
           device.native_vector_width == 16));
    CHECK(device.max_allocation > 0);
    CHECK(device.max_allocation <= device.global_memory);
    for (const std::string& selector : {device.id, device.name, device.platform, device.type})
        CHECK(select_devices({selector}).front().id.substr(0, 1) == "p");
    CHECK(select_devices({device.id}).front().id == device.id);
}

TEST_CASE("Device.SplitsOrSaysTheLimit", "[quick]") {
    const DeviceInfo& device = here();
    CHECK(split_cpu(device, 1).front().id == device.id);
    CHECK_THROWS_AS(split_cpu(device, 0), DeviceError);
    CHECK_THROWS_AS(split_cpu(device, 1 << 20), DeviceError);
    if (device.type != "cpu" || device.compute_units < 2) return;
    const std::vector<DeviceInfo> halves = split_cpu(device, 2);
    REQUIRE(halves.size() == 2);
    CHECK(halves[0].compute_units + halves[1].compute_units == device.compute_units);
    CHECK(halves[0].id != halves[1].id);
    Queue queue(halves[1]);
    Buffer<float> buffer(queue, std::vector<float>{1, 2, 3});
    CHECK(buffer.download() == std::vector<float>{1, 2, 3});
}

TEST_CASE("Buffer.RoundTrip", "[quick]") {
    Queue queue(here());
    std::vector<std::uint32_t> data(1000);
    std::iota(data.begin(), data.end(), 7u);
    Buffer<std::uint32_t> buffer(queue, data, CL_MEM_READ_WRITE);
    CHECK(buffer.size() == 1000);
    CHECK(buffer.byte_size() == 4000);
    CHECK(buffer.download() == data);
    const std::vector<std::uint32_t> patch = {1, 2, 3};
    buffer.upload(patch, 997);
    std::copy(patch.begin(), patch.end(), data.begin() + 997);
    CHECK(buffer.download() == data);
    buffer.fill(5);
    CHECK(buffer.download() == std::vector<std::uint32_t>(1000, 5));
    buffer.zero();
    CHECK(buffer.download() == std::vector<std::uint32_t>(1000, 0));

    Buffer<float> empty(queue, std::vector<float>{});
    CHECK(empty.size() == 0);
    empty.upload({});
    empty.zero();
    CHECK(empty.download().empty());
    CHECK(empty.memory()() != nullptr);
}

TEST_CASE("Buffer.TooLargeSaysHowMuch", "[quick]") {
    Queue queue(here());
    const std::string message = message_of<DeviceError>([&] { Buffer<char> b(queue, std::size_t(1) << 60); });
    CHECK(contains(message, "clCreateBuffer: CL_"));
    CHECK(contains(message, "1152921504606846976"));
    CHECK(contains(message, here().name));
}

TEST_CASE("Queue.LaunchPadsAndTimes", "[quick]") {
    Queue queue(here());
    const cl::Program program = build_source(
        queue, "__kernel void twice(__global uint* x, uint n) { uint i = get_global_id(0); if (i < n) x[i] *= 2; }\n");
    cl::Kernel kernel = make_kernel(queue, program, "twice");
    std::vector<cl_uint> data(1001);
    std::iota(data.begin(), data.end(), 0u);
    Buffer<cl_uint> buffer(queue, data, CL_MEM_READ_WRITE);
    set_args(queue, kernel, 0, buffer, cl_uint(data.size()));
    CHECK(queue.launch(kernel, data.size(), 16) >= 0);
    queue.enqueue(kernel, data.size(), 16);
    queue.enqueue(kernel, 0, 16);
    queue.finish();
    for (cl_uint& x : data) x *= 4;
    CHECK(buffer.download() == data);
    CHECK(max_local_size(queue, kernel) >= 16);
    CHECK(contains(message_of<DeviceError>([&] { make_kernel(queue, program, "thrice"); }), "CL_INVALID_KERNEL_NAME"));
    const std::string message = message_of<DeviceError>([&] { set_args(queue, kernel, 1, 1.0); });
    CHECK(contains(message, "clSetKernelArg: CL_INVALID_ARG_SIZE"));
    CHECK(contains(message, "argument 1 of kernel twice"));
}
