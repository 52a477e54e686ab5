// SPDX-License-Identifier: MIT
// Lines against ellipsoids behind icosahedra (proxy.cl), for the study and for the kernels' benchmarks.
#pragma once

#include <memory>
#include <vector>

#include "kernels/layout.h"
#include "runtime/device.h"

namespace clume::bench {

enum class ProxyWork : std::uint32_t { analytic, mesh, instanced, check };

class ProxyLines {
public:
    /// Ellipsoids in the unit ball, sized so that about `overlap` supports cover a point of it.
    ProxyLines(const DeviceInfo& device, int width, double overlap, std::size_t copies = 1);
    ~ProxyLines();

    double tests() const;          ///< lines × ellipsoids
    double launch(ProxyWork what); ///< seconds on the device
    /// Of the last launch, per line: x summed lengths of chords; check: ellipsoids, meshes and instances met, ellipsoids met
    /// outside their mesh or instance.
    std::vector<device::float4> out() const;
    double byte_size(ProxyWork what) const;  ///< of what a launch reads over and over

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace clume::bench
