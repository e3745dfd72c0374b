#pragma once
// What is shared by those that work on the finished level sets, block by block.
#include <algorithm>

#include "pavel/vdb/element_index.h"

namespace pavel {

/// The 512 values of a block, from its leaf or the tile that stands for it; true where there is a leaf. `tree`: a tree,
/// or an accessor to one.
template <class Tree>
bool readBlock(const Tree& tree, const Coord& origin, float* out) {
    const auto* leaf = tree.probeConstLeaf(origin);
    if (leaf)
        std::copy(leaf->buffer().data(), leaf->buffer().data() + 512, out);
    else
        std::fill(out, out + 512, tree.getValue(origin));
    return leaf;
}

/// Boxes of the trees' leaves; empty for null ones.
inline std::vector<CoordBBox> leafBoxes(const std::vector<WorkTree::Ptr>& trees) {
    std::vector<CoordBBox> boxes(trees.size());
    for (size_t i = 0; i < trees.size(); ++i)
        if (trees[i]) trees[i]->evalLeafBoundingBox(boxes[i]);
    return boxes;
}

}  // namespace pavel
