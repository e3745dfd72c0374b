#pragma once
// Connected pieces of a set of voxels.
#include <array>
#include <utility>
#include <vector>

#include "pavel/vdb/grid.h"

namespace pavel {

/// A leaf-sized block of yes or no: row x * 8 + y, bit z.
using BlockMask = std::array<uint8_t, 64>;
/// Where 512 values are negative.
BlockMask negativeMask(const float* values);
/// Where their magnitude is less than a limit; false where it is nowhere.
bool nearMask(const float* values, float limit, BlockMask& mask);
inline bool testMask(const BlockMask& m, int v) {
    return m[size_t(v >> 3)] >> (v & 7) & 1;
}

/// The same as OpenVDB keeps it, and back.
WorkLeaf::NodeMaskType nodeMask(const BlockMask& m);
BlockMask blockMask(const WorkLeaf::NodeMaskType& m);

struct MaskedBlock {
    Coord origin;
    BlockMask mask;
};

/// What does not belong to the largest piece, six neighbours joined; empty where all is one. Linear, on runs of a row.
std::vector<MaskedBlock> straysOf(const std::vector<MaskedBlock>& blocks);

}  // namespace pavel
