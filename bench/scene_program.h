// SPDX-License-Identifier: MIT
// A program of the benchmarks' own (bench/*.cl) over a scene's buffers.
#pragma once

#include <string>

#include "bench/session.h"
#include "runtime/program.h"
#include "src/scene_buffers.h"

namespace clume::bench {

struct SceneProgram {
    SceneProgram(Session& session, const char* root, const DeviceScene& scene, const ProgramOptions& options)
        : queue(session.device()), program(build_program(queue, root, options)), buffers(queue, scene) {}

    Queue queue;
    cl::Program program;
    SceneBuffers buffers;

    cl::Kernel kernel(const char* name) { return make_kernel(queue, program, name); }
    /// Arguments of a kernel whose first are the scene.
    template <class... Args>
    void set(cl::Kernel& k, const Args&... args) {
        buffers.bind(queue, k);
        set_args(queue, k, SceneBuffers::kArgs, args...);
    }
};

/// The scene's own defines, and the width.
inline ProgramOptions defines_of(const DeviceScene& scene, int width) {
    ProgramOptions options;
    for (const auto& [name, value] : scene.defines) options.define(name, value);
    options.define("CLUME_WIDTH", width);
    return options;
}

}  // namespace clume::bench
