#pragma once
// What a front knows of its voxels, in blocks that are made when it reaches them.
#include "pavel/vdb/claims.h"
#include "pavel/vdb/compact_level_set.h"
#include "pavel/vdb/voxel_mask.h"

namespace pavel {

/// State of a voxel for one front. Ghosts are voxels that another front or body holds: the front marches two layers
/// into them, so that the face between the two is known at sub-voxel precision, but grows no further from there. Once
/// it has stopped, one layer of a body will do. Inner voxels belong to the body, too: the front's way runs on into
/// them, backwards, at their neighbours' mean scale.
enum VoxelState : uint8_t { kFar, kTrial, kReal, kGhost, kDeepGhost, kBody, kInner };

/// 4^3 voxels that the front touched.
struct GrowthCell {
    static constexpr int kCount = 64;
    float time[kCount];     ///< arrival time, negative in the body; the largest float where there is none
    float contact[kCount];  ///< distance to the rims, negative where not asked for yet; of inner voxels: their scale
    uint8_t state[kCount];
};

/// A leaf-sized block of cells.
struct GrowthBlock {
    static constexpr float kNever = std::numeric_limits<float>::max();
    Coord origin;
    ClaimBlock* claims = nullptr;
    const CompactLevelSet* placed = nullptr;
    int placedBlock = CompactLevelSet::kOutside;  ///< the placed shape's here
    float placedAt(int v) const { return placed->value(placedBlock, v); }
    GrowthBlock* next[6] = {};  ///< -x +x -y +y -z +z, null until made
    int number = 0;
    const VoxelMask* body = nullptr;
    GrowthCell* cells[8] = {};  ///< null until the front touches one

    static int voxelOf(int cell, int i) { return kLeafTables.voxel[cell << 6 | i]; }
    const GrowthCell* cellAt(int v) const { return cells[cellOf(v)]; }
    VoxelState untouched(int v) const { return body->isOn(openvdb::Index(v)) ? kBody : kFar; }
    VoxelState state(int v) const {
        const GrowthCell* c = cellAt(v);
        return c ? VoxelState(c->state[inCell(v)]) : untouched(v);
    }
    float time(int v) const {
        const GrowthCell* c = cellAt(v);
        return c ? c->time[inCell(v)] : kNever;
    }
    float contact(int v) const {
        const GrowthCell* c = cellAt(v);
        return c ? c->contact[inCell(v)] : -1;
    }
    bool hasTime(int v) const { return time(v) < kNever; }
    /// Calls f(v, cell, index in the cell) for all voxels of cells that are there.
    template <class F>
    void forEachVoxel(F f) const {
        for (int c = 0; c < 8; ++c)
            if (GrowthCell* cell = cells[c])
                for (int i = 0; i < GrowthCell::kCount; ++i) f(voxelOf(c, i), *cell, i);
    }
};

}  // namespace pavel
