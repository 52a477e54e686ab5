// SPDX-License-Identifier: MIT
// Light tracing: photons leave the point and spot lights, and every scattering of one is seen by an orthographic camera. An
// oracle for lights inside a medium, where a path tracer's plain light sampling (host_tracer.h) has infinite variance: no
// contribution here has a 1/r² in it. Double precision; the medium is the host's own, flights by null collisions.
#pragma once

#include "tests/reference/host_tracer.h"

namespace clume::reference {

/// The light of the scene's point and spot lights after 1 … max_depth scatterings (−1: any number); the camera must be orthographic,
/// with all media before its plane. Variances are from `batches` images of the same size. alpha is not computed.
HostImage trace_from_lights(const Scene& scene, std::uint64_t photons, std::uint64_t seed, int threads = 2, int batches = 32, int cells = 32);

}  // namespace clume::reference
