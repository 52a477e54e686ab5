// SPDX-License-Identifier: MIT
#include "src/device_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/device_values.h"

namespace clume {
namespace {

/// World axes of the camera and its pixel steps: direction f + right · (x − W/2) step, up · (H/2 − y) step.
struct Frame {
    glm::dvec3 forward, right, up;
    double step;  ///< per pixel: of the direction (perspective) or of the origin, world units (orthographic)
    double cx, cy;

    explicit Frame(const Scene& scene) {
        const Camera& c = scene.camera;
        forward = glm::normalize(c.target - c.origin);
        right = glm::normalize(glm::cross(forward, c.up));
        up = glm::cross(right, forward);
        step = (c.kind == CameraKind::perspective ? 2 * std::tan(0.5 * c.fov_rad) : c.width) / scene.film.width;
        cx = 0.5 * scene.film.width;
        cy = 0.5 * scene.film.height;
    }
};

/// Marks rectangles by their corners; the prefix sum tells which pixels lie in any.
class Coverage {
public:
    Coverage(const CropWindow& w) : window_(w), width_(w.x1 - w.x0 + 1), height_(w.y1 - w.y0 + 1), count_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0) {}
    void all() { all_ = true; }
    /// Film coordinates, pixels; a margin of one pixel is added.
    void mark(double x0, double y0, double x1, double y1) {
        const auto clip = [](double v, int lo, int hi) { return static_cast<int>(std::clamp(v, static_cast<double>(lo), static_cast<double>(hi))); };
        const int ax = clip(std::floor(x0) - 1, window_.x0, window_.x1) - window_.x0, bx = clip(std::floor(x1) + 2, window_.x0, window_.x1) - window_.x0;
        const int ay = clip(std::floor(y0) - 1, window_.y0, window_.y1) - window_.y0, by = clip(std::floor(y1) + 2, window_.y0, window_.y1) - window_.y0;
        if (ax >= bx || ay >= by) return;
        at(ax, ay) += 1;
        at(bx, ay) -= 1;
        at(ax, by) -= 1;
        at(bx, by) += 1;
    }
    std::vector<bool> covered() {
        for (int y = 0; y < height_; ++y)
            for (int x = 1; x < width_; ++x) at(x, y) += at(x - 1, y);
        for (int y = 1; y < height_; ++y)
            for (int x = 0; x < width_; ++x) at(x, y) += at(x, y - 1);
        std::vector<bool> out(count_.size());
        for (std::size_t i = 0; i < out.size(); ++i) out[i] = all_ || count_[i] > 0;
        return out;
    }
    int stride() const { return width_; }

private:
    int& at(int x, int y) { return count_[static_cast<std::size_t>(x) + static_cast<std::size_t>(width_) * static_cast<std::size_t>(y)]; }
    CropWindow window_;
    int width_, height_;
    std::vector<int> count_;
    bool all_ = false;
};

/// Marks an ellipsoid of centre c and covariance S (support included), both in camera axes (right, up, forward), by the
/// planes through the eye that touch it.
void mark_ellipsoid(const Scene& scene, const Frame& f, const glm::dvec3& c, const glm::dmat3& s, Coverage& coverage) {
    const double depth = std::sqrt(std::max(s[2][2], 0.0));
    if (c.z + depth < 0) return;
    double lo[2], hi[2];
    if (scene.camera.kind == CameraKind::orthographic) {
        for (int k = 0; k < 2; ++k) {
            const double half = std::sqrt(std::max(s[k][k], 0.0));
            lo[k] = (c[k] - half) / f.step;
            hi[k] = (c[k] + half) / f.step;
        }
    } else {
        if (c.z - depth <= 1e-6 * (std::abs(c.z) + depth)) return coverage.all();
        const double a = c.z * c.z - s[2][2];
        for (int k = 0; k < 2; ++k) {
            const double b = c[k] * c.z - s[2][k], q = c[k] * c[k] - s[k][k];
            const double root = std::sqrt(std::max(b * b - a * q, 0.0));
            lo[k] = (b - root) / a / f.step;
            hi[k] = (b + root) / a / f.step;
        }
    }
    coverage.mark(f.cx + lo[0], f.cy - hi[1], f.cx + hi[0], f.cy - lo[1]);
}

}  // namespace

void set_camera(const Scene& scene, DeviceScene& out) {
    const Frame f(scene);
    const Normalization& n = out.normalization;
    const glm::dvec3 eye = (scene.camera.origin - n.center) * n.scale;
    const double radius = n.radius * n.scale;
    // All that can be seen lies within `radius` (a little over 1) of the origin.
    const double ahead = std::max(0.0, -glm::dot(eye, f.forward) - 1.01 * radius);
    const bool perspective = scene.camera.kind == CameraKind::perspective;
    const double plane_step = perspective ? ahead * f.step : f.step * n.scale;
    // The pixel that looks at the scene's centre, or the nearest on the film.
    const double z = perspective ? std::max(-glm::dot(eye, f.forward), 1e-9) * f.step : f.step * n.scale;
    const double px = std::clamp(std::round(f.cx - glm::dot(eye, f.right) / z), 0.0, static_cast<double>(scene.film.width));
    const double py = std::clamp(std::round(f.cy + glm::dot(eye, f.up) / z), 0.0, static_cast<double>(scene.film.height));
    const glm::dvec3 offset = f.right * (px - f.cx) - f.up * (py - f.cy);
    device::RenderParams& p = out.params;
    p.film_cx = static_cast<float>(px);
    p.film_cy = static_cast<float>(py);
    p.plane_c = pack(eye + ahead * f.forward + offset * plane_step);
    p.plane_x = pack(f.right * plane_step);
    p.plane_y = pack(-f.up * plane_step);
    const double dir_step = perspective ? f.step : 0;
    p.dir_c = pack(f.forward + offset * dir_step);
    p.dir_x = pack(f.right * dir_step);
    p.dir_y = pack(-f.up * dir_step);
}

std::vector<device::uint> active_pixels(const Scene& scene, const DeviceScene& device, const CropWindow& window) {
    const Frame f(scene);
    Coverage coverage(window);
    const glm::dmat3 to_camera = glm::transpose(glm::dmat3(f.right, f.up, f.forward));
    const auto from_eye = [&](const glm::dvec3& x) { return to_camera * (x - scene.camera.origin); };
    std::size_t at = 0;
    for (const auto& medium : scene.media)
        for (const auto& p : medium.primitives) {
            const Ellipsoid& e = device.ellipsoids[at++];
            const glm::dmat3 axes = to_camera * p.axes * (e.extent + e.dilation + 1e-4);
            mark_ellipsoid(scene, f, from_eye(p.center), axes * glm::transpose(axes), coverage);
        }
    for (const auto& box : device.grid_boxes) {
        // The rectangle about the corners; everything if one lies behind the eye.
        double x0 = 1e300, y0 = 1e300, x1 = -1e300, y1 = -1e300;
        bool behind = false;
        for (const glm::dvec3& corner : box) {
            const glm::dvec3 c = from_eye(corner);
            const bool perspective = scene.camera.kind == CameraKind::perspective;
            if (perspective && !(c.z > 1e-6 * glm::length(c))) behind = true;
            const double scale = 1 / (perspective ? c.z * f.step : f.step);
            x0 = std::min(x0, f.cx + c.x * scale), x1 = std::max(x1, f.cx + c.x * scale);
            y0 = std::min(y0, f.cy - c.y * scale), y1 = std::max(y1, f.cy - c.y * scale);
        }
        if (behind) coverage.all();
        else coverage.mark(x0, y0, x1, y1);
    }
    for (const auto& light : scene.lights) {
        if (light.kind == LightKind::sphere) {
            mark_ellipsoid(scene, f, from_eye(light.center), glm::dmat3(light.radius * light.radius * 1.0001), coverage);
        } else if (light.kind == LightKind::rectangle) {
            // As the ellipsoid through its corners (flat: thickness 0).
            const glm::dvec3 u = to_camera * light.edge_u * 0.5, v = to_camera * light.edge_v * 0.5;
            const glm::dmat3 axes(u * 1.4143, v * 1.4143, glm::dvec3(0));
            mark_ellipsoid(scene, f, from_eye(light.corner + 0.5 * (light.edge_u + light.edge_v)), axes * glm::transpose(axes), coverage);
        } else if (light.kind == LightKind::envmap && light.visible_to_camera) {
            coverage.all();
        }
    }
    const std::vector<bool> covered = coverage.covered();
    std::vector<device::uint> pixels;
    for (int ty = window.y0; ty < window.y1; ty += film_tile)
        for (int tx = window.x0; tx < window.x1; tx += film_tile)
            for (int y = ty; y < std::min(ty + film_tile, window.y1); ++y)
                for (int x = tx; x < std::min(tx + film_tile, window.x1); ++x)
                    if (covered[static_cast<std::size_t>(x - window.x0) + static_cast<std::size_t>(coverage.stride()) * static_cast<std::size_t>(y - window.y0)])
                        pixels.push_back(static_cast<device::uint>(x + scene.film.width * y));
    return pixels;
}

}  // namespace clume
