// SPDX-License-Identifier: MIT
// Host loops over all cores. Chunks are handed out dynamically: the body must not depend on which thread runs it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

namespace clume {

/// Calls body(begin, end) for consecutive chunks of [0, count) of at most `chunk`; the first exception is rethrown.
template <class Body>
void parallel_chunks(std::size_t count, std::size_t chunk, const Body& body) {
    const std::size_t chunks = (count + chunk - 1) / chunk;
    const std::size_t workers = std::min<std::size_t>(std::max(1u, std::thread::hardware_concurrency()), chunks);
    std::atomic<std::size_t> next{0};
    std::vector<std::exception_ptr> errors(workers);
    const auto work = [&](std::size_t worker) {
        try {
            for (std::size_t c = next++; c < chunks; c = next++) body(c * chunk, std::min(count, (c + 1) * chunk));
        } catch (...) {
            errors[worker] = std::current_exception();
            next = chunks;
        }
    };
    std::vector<std::thread> threads;
    for (std::size_t w = 1; w < workers; ++w) threads.emplace_back(work, w);
    if (workers > 0) work(0);
    for (auto& t : threads) t.join();
    for (const auto& e : errors)
        if (e) std::rethrow_exception(e);
}

}  // namespace clume
