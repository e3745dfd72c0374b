#pragma once
// A block of voxels that hand on their nearest foot points to each other. Internal to re-distancing.
#include <cstdint>

namespace pavel {

/// The way to each voxel from the nearest foot known so far, in voxels, and which foot that is.
struct alignas(64) FootBlock {
    static constexpr float kNowhere = 1e18f;  ///< x where no foot is known yet
    // Rows are read one voxel beyond their ends, and what lies there is not used: it may be another field's.
    float before[16], x[512], y[512], z[512];
    int32_t foot[512];  ///< negative where none is known yet
    int32_t after[16];

    void clear();
    /// Offers the voxels' feet to their face neighbours in the block, and those of the blocks beside it to the voxels
    /// there: along x and y from end to end, along z by one voxel from the blocks beside and by `twosAlong` times two.
    /// True where that changed anything.
    /// @param beside at the faces -x +x -y +y -z +z, null for none
    bool spread(const FootBlock* const beside[6], int twosAlong);
    /// Would any voxel beyond a face have a foot of this block nearer than that?
    bool reaches(int side, float distance2) const;
};

}  // namespace pavel
