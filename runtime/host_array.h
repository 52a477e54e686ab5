// SPDX-License-Identifier: MIT
// Arrays on the host that CPU devices can use where they are: aligned as OpenCL's largest types are, and on huge pages if large,
// since what kernels look up at random costs a walk through the page tables beside the cache miss otherwise.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace clume {

template <class T>
struct PageAllocator {
    using value_type = T;
    PageAllocator() = default;
    template <class U>
    PageAllocator(const PageAllocator<U>&) {}  // NOLINT(google-explicit-constructor): allocators convert

    T* allocate(std::size_t n) {
        const std::size_t bytes = n * sizeof(T);
        void* memory = ::operator new(bytes, alignment(n));
        if (bytes >= huge_page) madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: without it all is as right, and slower
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, std::size_t n) { ::operator delete(memory, alignment(n)); }

    template <class U>
    bool operator==(const PageAllocator<U>&) const {
        return true;
    }

private:
    static constexpr std::size_t huge_page = std::size_t{1} << 21;
    static std::align_val_t alignment(std::size_t n) { return std::align_val_t(n * sizeof(T) < huge_page ? 128 : huge_page); }
};

template <class T>
using HostArray = std::vector<T, PageAllocator<T>>;

/// A HostArray that stays as it is: copies are the same one.
template <class T>
class SharedArray {
public:
    SharedArray() = default;
    SharedArray(const SharedArray&) = default;
    SharedArray& operator=(const SharedArray&) = default;  // no moves: there is always an array
    ~SharedArray() = default;
    SharedArray(HostArray<T>&& values) : values_(std::make_shared<const HostArray<T>>(std::move(values))) {}  // NOLINT(google-explicit-constructor): it is what becomes of one

    const HostArray<T>& values() const { return *values_; }
    std::size_t size() const { return values_->size(); }
    bool empty() const { return values_->empty(); }
    const T* data() const { return values_->data(); }
    const T* begin() const { return data(); }
    const T* end() const { return data() + size(); }
    const T& operator[](std::size_t i) const { return data()[i]; }
    const T& back() const { return values_->back(); }

private:
    std::shared_ptr<const HostArray<T>> values_ = std::make_shared<const HostArray<T>>();
};

}  // namespace clume
