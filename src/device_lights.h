// SPDX-License-Identifier: MIT
// Lights as the device gets them: normalised, with selection probabilities for next-event estimation and alias tables for
// environment images.
#pragma once

#include "src/device_scene.h"

namespace clume {

/// What the light sampling mode makes of the kinds present: LIGHT_* bits.
struct LightMasks {
    device::uint present = 0, nee = 0, hits = 0;
    bool visible_background = false, grey = true;
    double brightest = 0;  ///< largest radiance or intensity a sample may meet, normalised units
};

/// Without tables, environments have their texels alone: all that their alias tables follow from.
LightMasks add_lights(const Scene& scene, DeviceScene& out, bool with_tables = true);

/// Whether any light is sampled directly (next-event estimation): else no transmittance is ever estimated.
bool samples_lights(const Scene& scene);

}  // namespace clume
