// SPDX-License-Identifier: MIT
// The tree of an OpenVDB file: root, nodes of 32³ and 16³ children, leaves of 8³ samples, as file versions 222 to 224 have it:
// first the topology of all nodes, then the samples of all leaves, in the same order.
#pragma once

#include <cstdint>

#include "src/byte_reader.h"
#include "src/scene.h"

namespace clume {

struct VdbTreeFormat {
    std::uint32_t compression = 0;  ///< flags of `VdbCompression`
    bool is_double = false;         ///< else float
    bool saved_as_half = false;     ///< samples of nodes are 16-bit floats in the file
};

enum VdbCompression : std::uint32_t { vdb_zip = 1, vdb_active_mask = 2, vdb_blosc = 4 };

/// The tree that begins where `in` stands, placed at the lattice itself. Throws SceneError "name: why".
VoxelGrid read_vdb_tree(ByteReader in, const VdbTreeFormat& format);

}  // namespace clume
