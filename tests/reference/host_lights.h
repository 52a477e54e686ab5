// SPDX-License-Identifier: MIT
// Lights of the host path tracer: what an escaping path finds (constant, image environment), opaque surfaces that end rays
// (sphere, rectangle), and the lights no path can hit (point, spot, directional), which alone are sampled.
#pragma once

#include "src/scene.h"
#include "tests/reference/host_medium.h"

#include <vector>

namespace clume::reference {

/// Nearest opaque surface along a ray; `radiance` is 0 on a black side.
struct SurfaceHit {
    double t;
    glm::dvec3 radiance;
};

/// One light seen from a point, without occlusion.
struct LightSample {
    glm::dvec3 direction;   ///< towards the light, length 1
    double distance;        ///< [world units], infinite for a directional light
    glm::dvec3 irradiance;  ///< on a plane facing the light
};

class HostLights {
public:
    explicit HostLights(const Scene& scene);

    bool has_surfaces() const { return !surfaces_.empty(); }
    std::size_t sampled_count() const { return sampled_.size(); }
    SurfaceHit nearest_surface(const HostRay& ray) const;  ///< t infinite: none
    LightSample sample(std::size_t light, const glm::dvec3& x) const;
    /// Radiance from beyond everything that travels along −direction; `from_camera`: unscattered, so only what is visible.
    glm::dvec3 background(const glm::dvec3& direction, bool from_camera) const;

private:
    std::vector<Light> surfaces_, sampled_, images_;
    glm::dvec3 constant_{0}, constant_visible_{0};
};

}  // namespace clume::reference
