// SPDX-License-Identifier: MIT
// A typed array on one device, released with its owner. Transfers are blocking and in order with the queue's kernels.
// An empty buffer is allowed (a scene without lights still passes a lights buffer): it holds one unused element.
#pragma once

#include <cassert>
#include <cstddef>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "runtime/check.h"
#include "runtime/host_array.h"
#include "runtime/queue.h"

namespace clume {

template <class T>
class Buffer {
    static_assert(std::is_trivially_copyable_v<T>);

public:
    /// Holds nothing; only assignment and destruction are allowed.
    Buffer() = default;
    /// `count` elements of undefined content.
    Buffer(const Queue& queue, std::size_t count, cl_mem_flags flags = CL_MEM_READ_WRITE)
        : queue_(queue.queue()),
          label_(queue.label()),
          size_(count),
          memory_(queue.allocate((count ? count : 1) * sizeof(T), flags)) {}
    /// A copy of `data`, read-only to kernels unless said otherwise.
    Buffer(const Queue& queue, std::span<const T> data, cl_mem_flags flags = CL_MEM_READ_ONLY)
        : Buffer(queue, data.size(), flags) {
        upload(data);
    }
    Buffer(const Queue& queue, const std::vector<T>& data, cl_mem_flags flags = CL_MEM_READ_ONLY)
        : Buffer(queue, std::span<const T>(data), flags) {}
    /// `data` to be read by kernels: on a CPU where it lies, so that it must outlive the buffer; elsewhere a copy.
    Buffer(const Queue& queue, const HostArray<T>& data) : queue_(queue.queue()), label_(queue.label()), size_(data.size()) {
        if (data.empty() || queue.info().type != "cpu") {
            *this = Buffer(queue, std::span<const T>(data));
        } else {
            memory_ = queue.allocate(byte_size(), CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, const_cast<T*>(data.data()));  // NOLINT(cppcoreguidelines-pro-type-const-cast): OpenCL has no other way
        }
    }
    Buffer(const Queue& queue, const SharedArray<T>& data) : Buffer(queue, data.values()) {}
    Buffer(Buffer&&) noexcept = default;
    /// By exchange: what was held is released by a destructor, which a device that fails even then cannot make throw.
    Buffer& operator=(Buffer&& other) noexcept {  // NOLINT(bugprone-exception-escape): only nothing is released amid a swap
        Buffer old(std::move(other));
        std::swap(queue_, old.queue_);
        std::swap(label_, old.label_);
        std::swap(size_, old.size_);
        std::swap(memory_, old.memory_);
        return *this;
    }

    std::size_t size() const { return size_; }                   ///< elements
    std::size_t byte_size() const { return size_ * sizeof(T); }  ///< 0 for an empty buffer
    const cl::Buffer& memory() const { return memory_; }

    /// Elements [first, first + data.size()) become `data`, which may be reused on return.
    void upload(std::span<const T> data, std::size_t first = 0) {
        assert(first + data.size() <= size_);
        if (data.empty()) return;
        checked(label_, [&] {
            queue_.enqueueWriteBuffer(memory_, CL_TRUE, first * sizeof(T), data.size_bytes(), data.data());
        });
    }

    /// `out` becomes elements [first, first + out.size()); waits for what was enqueued before.
    void download(std::span<T> out, std::size_t first = 0) const {
        assert(first + out.size() <= size_);
        if (out.empty()) return;
        checked(label_, [&] {
            queue_.enqueueReadBuffer(memory_, CL_TRUE, first * sizeof(T), out.size_bytes(), out.data());
        });
    }

    std::vector<T> download() const {
        std::vector<T> out(size_);
        download(std::span<T>(out));
        return out;
    }

    /// Every element becomes `value`; enqueued, returns at once.
    void fill(const T& value) {
        static_assert(sizeof(T) <= 128 && (sizeof(T) & (sizeof(T) - 1)) == 0, "OpenCL fills powers of two up to 128 bytes");
        if (size_ > 0) checked(label_, [&] { queue_.enqueueFillBuffer(memory_, value, 0, byte_size()); });
    }

    /// Every byte becomes 0; enqueued, returns at once.
    void zero() {
        using Word = std::conditional_t<sizeof(T) % 16 == 0, cl_uint4, std::conditional_t<sizeof(T) % 4 == 0, cl_uint, cl_uchar>>;
        const Word nothing{};
        if (size_ > 0) checked(label_, [&] { queue_.enqueueFillBuffer(memory_, nothing, 0, byte_size()); });
    }

private:
    cl::CommandQueue queue_;
    std::string label_;
    std::size_t size_ = 0;
    cl::Buffer memory_;
};

}  // namespace clume
