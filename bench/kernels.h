// SPDX-License-Identifier: MIT
// What the kernel benchmarks share: they are Google Benchmarks, timed by the device's own clock, and wait here to be
// registered until the section runs them all.
#pragma once

#include <functional>

#include "bench/peaks.h"
#include "bench/session.h"
#include "runtime/buffer.h"
#include "runtime/kernel.h"
#include "runtime/queue.h"

namespace clume::bench {

/// One launch: items done, seconds on the device, and what an item takes.
struct Launch {
    double items = 0, device_s = 0;
    Cost cost = {};
};

/// Registers an item of the section: `launch` is called again and again with 0, 1, 2, … Nothing is done before the first call.
void add_kernel_benchmark(Session& session, const std::string& item, const std::function<Launch(std::uint32_t)>& launch);

void add_ray_benchmarks(Session& session);    ///< ray_kernels.cpp: free flights and transmittances through whole scenes
void add_group_benchmarks(Session& session);  ///< group_kernels.cpp: one ray against vectors of primitives
void add_accelerator_benchmarks(Session& session);  ///< accelerator_kernels.cpp: nodes, leaves, walks
void add_block_benchmarks(Session& session);  ///< block_kernels.cpp: what a path is made of beside those
void add_sort_benchmarks(Session& session);   ///< sort_kernels.cpp: orders of events, segments

/// Work-items of a launch for each that fills a CPU's cores: a GPU has room for far more.
std::size_t copies_to_fill(Session& session);
/// Widths asked for, or all.
std::vector<int> kernel_widths(const Session& session);
/// "exp/w16"
std::string with_width(const std::string& name, int width);

/// A kernel over as many work-items as take so many seconds at least, each of which leaves a float in `out`.
class SizedLaunch {
public:
    using SetArguments = std::function<void(std::size_t items, Buffer<float>& out)>;
    /// The kernel has run when this returns: no launch after it holds code generation.
    SizedLaunch(Session& session, Queue& queue, cl::Kernel& kernel, const SetArguments& set_arguments, double seconds = 3e-3, std::size_t most_items = std::size_t{1} << 22);
    std::size_t items() const { return out_.size(); }
    double operator()() const;  ///< seconds on the device
    /// The same, on a CPU by processor time of the busiest thread, which other programs do not lengthen.
    double undisturbed() const;

private:
    Queue& queue_;
    cl::Kernel& kernel_;
    std::size_t local_;
    bool cpu_;
    Buffer<float> out_;
};

}  // namespace clume::bench
