// SPDX-License-Identifier: MIT
// For results that only have to depend on everything: the lanes of a vector, added in order.
#include "config.cl"

static float lanes_sum(vfloat v) {
    float sum = 0.0f;
    for (int lane = 0; lane < CLUME_WIDTH; ++lane) sum += ((const float*)&v)[lane];
    return sum;
}
