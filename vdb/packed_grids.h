#pragma once
// What packing leaves: internal, as it pulls in OpenVDB.
#include "pavel/vdb/compact_level_set.h"

namespace pavel {

/// The packed level sets, in voxels, half width kResultBand.
struct PackedGrids {
    std::vector<CompactLevelSet> elements;  ///< at id - 1; empty where an element was swallowed
    openvdb::FloatTree::Ptr surface;        ///< fused union of the elements, outside the base: a true distance
    openvdb::FloatTree::Ptr base;           ///< the base's band
    openvdb::FloatTree::Ptr solid;          ///< elements and base as one solid; null unless asked for
    openvdb::Int32Tree::Ptr ids;            ///< 1..n inside elements, 0 elsewhere
};

/// A standard grid around a copy of the tree's leaves and tiles.
openvdb::FloatGrid::Ptr toFloatGrid(const WorkTree& tree);

}  // namespace pavel
