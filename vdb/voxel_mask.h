#pragma once
// Voxels of a leaf, one bit each: OpenVDB's node masks.
#include "pavel/vdb/grid.h"

namespace pavel {

using VoxelMask = WorkLeaf::NodeMaskType;

/// The voxels that have a face neighbour in a mask. sides: masks of the leaves at -x +x -y +y -z +z, null for none.
inline VoxelMask besideMask(const VoxelMask& mask, const VoxelMask* const sides[6]) {
    // A word is a slab of a leaf: bit y * 8 + z.
    constexpr uint64_t kFirstZ = 0x0101010101010101, kLastZ = 0x8080808080808080;
    const auto slab = [](const VoxelMask* m, int x) { return m ? m->getWord<uint64_t>(openvdb::Index(x)) : 0; };
    VoxelMask beside;
    for (int x = 0; x < 8; ++x) {
        const uint64_t own = slab(&mask, x);
        beside.getWord<uint64_t>(openvdb::Index(x)) =
            (x > 0 ? slab(&mask, x - 1) : slab(sides[0], 7)) | (x < 7 ? slab(&mask, x + 1) : slab(sides[1], 0)) |  //
            own << 8 | slab(sides[2], x) >> 56 | own >> 8 | slab(sides[3], x) << 56 | (own << 1 & ~kFirstZ) |
            (slab(sides[4], x) >> 7 & kFirstZ) | (own >> 1 & ~kLastZ) | (slab(sides[5], x) << 7 & kLastZ);
    }
    return beside;
}

/// Does a mask hold voxels at the leaf's face -x +x -y +y -z +z?
inline bool touchesFace(const VoxelMask& mask, int side) {
    constexpr uint64_t kFace[6] = {~uint64_t(0),       ~uint64_t(0),       0xff,
                                   0xff00000000000000, 0x0101010101010101, 0x8080808080808080};
    for (int x = side == 1 ? 7 : 0; x < (side == 0 ? 1 : 8); ++x)
        if (mask.getWord<uint64_t>(openvdb::Index(x)) & kFace[side]) return true;
    return false;
}

}  // namespace pavel
