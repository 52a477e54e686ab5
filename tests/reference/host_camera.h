// SPDX-License-Identifier: MIT
// Film point to ray, exactly as scene.md's camera section: x right and y down in pixels, row 0 on top, nothing mirrored.
#pragma once

#include "tests/reference/host_medium.h"

#include <cmath>

namespace clume::reference {

class HostCamera {
public:
    explicit HostCamera(const Scene& scene) : kind_(scene.camera.kind), origin_(scene.camera.origin) {
        const Camera& c = scene.camera;
        const double w = scene.film.width, h = scene.film.height;
        const glm::dvec3 f = unit(c.target - c.origin), r = unit(glm::cross(f, c.up)), u = glm::cross(r, f);
        const double half = kind_ == CameraKind::perspective ? std::tan(c.fov_rad / 2) : c.width / 2;
        forward_ = f;
        corner_ = (kind_ == CameraKind::perspective ? f : c.origin) - r * half + u * (half * h / w);
        dx_ = r * (2 * half / w);
        dy_ = -u * (2 * half / w);
    }

    HostRay ray(double x, double y) const {
        const glm::dvec3 p = corner_ + dx_ * x + dy_ * y;
        return kind_ == CameraKind::perspective ? HostRay{origin_, unit(p)} : HostRay{p, forward_};
    }

private:
    CameraKind kind_;
    glm::dvec3 origin_, forward_, corner_, dx_, dy_;

    static glm::dvec3 unit(const glm::dvec3& v) { return v / std::sqrt(glm::dot(v, v)); }
};

}  // namespace clume::reference
