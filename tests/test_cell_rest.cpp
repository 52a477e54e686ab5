// SPDX-License-Identifier: MIT
// Null collisions that leave the rest of a cell to decomposition (kernels/cell_rest.cl): with the least patience that is done all the
// time, and images stay what they are; at every width the same bits; and what null collisions alone would never leave ends soon.
#include "src/strategies.h"
#include "tests/device_image.h"
#include "tests/image_test.h"
#include "tests/pairs.h"
#include "tests/probe_harness.h"

using namespace clume;
using namespace clume::test;

namespace {

DeviceScene impatient(const Scene& scene) {
    DeviceScene device = make_device_scene(scene, {});
    set_define(device, "CLUME_PATIENCE", "1");
    return device;
}

/// One disc, a ten-thousandth as thick as wide and tilted: the cells that hold it are nearly empty, their bounds are not.
Scene disc(double depth) {
    Scene scene = reference::homogeneous_sphere(1, 0);
    Primitive& p = scene.media[0].primitives[0];
    const double thick = 1e-4;
    const glm::dvec3 x = glm::normalize(glm::dvec3(1, 0.3, 0.2)), y = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), x)), z = glm::cross(x, y);
    p.axes = glm::dmat3(x, y, z * thick);
    p.sigma_t = depth / (2 * thick * scene.media[0].extent);
    scene.film = {16, 16};
    scene.camera.origin = glm::dvec3(0, 0, -4);
    scene.camera.target = glm::dvec3(0);
    return scene;
}

}  // namespace

TEST_CASE("CellRest.ImagesStayWhatTheyAre") {
    Scene lit = grey_mixture();
    lit.lights = {cases::light(LightKind::rectangle), cases::light(LightKind::directional)};
    const std::vector<Scene> scenes{lit, mixed_scene(), mixed_grid_scene()};
    for (const MethodPair& pair : {MethodPair{"delta", "analytic", "tree"}, {"delta", "binary", "tree"}, {"delta", "ratio", "grid"}, {"delta", "residual-ratio", "tree"}, {"regular", "ratio", "tree"}})
        for (const Scene& scene : scenes) {
            const Scene s = with_pair(scene, pair);
            check_same("cell_rest " + pair.label(), colour_of(render_device(s, impatient(s), 512), s.film), colour_of(render_pair({"decomposition"}, scene, 1024, 7).image));
        }
}

TEST_CASE("CellRest.SameBitsAtEveryWidth") {
    Scene lit = grey_mixture();
    lit.lights = {cases::light(LightKind::rectangle)};
    for (const char* estimator : {"binary", "ratio"}) {
        const Scene scene = with_pair(lit, {"delta", estimator, "tree"});
        const DeviceScene device = impatient(scene);
        const DeviceImage first = render_device(scene, device, 8, probing::test_device(), 16);
        for (const int width : {8, 4, 1}) CHECK(first.same_bits(render_device(scene, device, 8, probing::test_device(), width)));
    }
}

TEST_CASE("CellRest.ThinDiscsTakeFewCollisions") {
    // Under its bound a ray through the cells draws ten thousand tentative collisions; with patience some hundreds, for the same light.
    for (const double depth : {0.7, 30.0}) {
        Scene scene = with_pair(disc(depth), {"delta", "analytic", "tree"});
        const RenderOptions counted = [] {
            RenderOptions o;
            o.count_work = true;
            return o;
        }();
        scene.render.spp = 256;
        const RenderResult r = render_now(scene, counted);
        check_clean(r);
        CHECK(r.stats.work[WORK_DRAWS] < 2000 * r.stats.paths);
        check_same("disc", alpha_of(r.image), alpha_of(render_pair({"decomposition"}, scene, 256, 3).image));
    }
}
