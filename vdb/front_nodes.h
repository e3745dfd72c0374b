#pragma once
// What a front holds at the nodes of its own grid, for an interpolation on a finer one.
#include <array>
#include <memory>
#include <vector>

#include "pavel/vdb/front.h"

namespace pavel {

/// Along one axis: how the k-th of the fine blocks in a coarse one lies among the coarse nodes.
struct FineSpan {
    static constexpr int kMostNodes = 7;
    int first = 0, nodes = 0;          ///< the node at or before its first voxel; nodes from the one before that on
    int before[8];                     ///< of a voxel's four nodes the first, from the first of all
    std::array<float, 4> weights[8];   ///< Catmull-Rom
    float spread[kMostNodes][8] = {};  ///< the same by nodes, zero for those that a voxel does not see

    FineSpan(int k, int factor) : first(8 * k / factor) {
        for (int i = 0; i < 8; ++i) {
            before[i] = (8 * k + i) / factor - first;
            const float t = float((8 * k + i) % factor) / float(factor), t2 = t * t, t3 = t2 * t;
            weights[i] = {0.5f * (-t3 + 2 * t2 - t), 0.5f * (3 * t3 - 5 * t2 + 2), 0.5f * (-3 * t3 + 4 * t2 + t),
                          0.5f * (t3 - t2)};
            for (int m = 0; m < 4; ++m) spread[before[i] + m][i] = weights[i][size_t(m)];
        }
        nodes = before[7] + 4;
    }
};

/// A front's nodes in one of its blocks and around it: one layer before the block, two beyond it.
struct FrontNodes {
    // Rows are read eight nodes at a time, so that the last ones go on into the next row, or what lies behind.
    static constexpr int kBefore = 1, kSide = 11, kRow = 12, kSlab = kSide * kRow, kCount = kSide * kSlab + 4;
    static constexpr int index(int x, int y, int z) { return x * kSlab + y * kRow + z; }

    static constexpr uint8_t kTimed = 1, kNearRim = 2;

    float phi[kCount], way[kCount], scale[kCount];
    uint8_t flags[kCount];

    /// The nodes around a fine block, from the one before its first.
    struct Window {
        const float *phi, *way, *scale;  ///< steps kSlab, kRow, 1
        const FineSpan *x, *y, *z;
        // Of the nodes that the block's voxels lie between:
        uint8_t flags = 0;    ///< of any of them
        float least = kBand;  ///< of the front's own values, in coarse voxels
    };
    Window window(const FineSpan& sx, const FineSpan& sy, const FineSpan& sz) const;
};

/// The nodes of all blocks of a stopped front, by their numbers; null where it comes no nearer than `reach`, in its own
/// voxels. Nodes beside those that the front reached have times as if it had gone on, two layers of them.
std::vector<std::unique_ptr<FrontNodes>> nodesOf(const Front& front, float reach);

}  // namespace pavel
