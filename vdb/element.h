#pragma once
// An element in work, from its placement to its trimmed body. Index space, voxels.
#include <memory>
#include <vector>

#include "pavel/core/placement.h"
#include "pavel/vdb/block_masks.h"
#include "pavel/vdb/compact_level_set.h"
#include "pavel/vdb/pieces.h"

namespace pavel {

class ContactDistance;  // contact_distance.h
struct CanonicalField;  // voxelize.h

struct WorkElement {
    int id = 0;  ///< 1..n; elements lie in a vector at id - 1
    int kind = 0;
    Frame indexFromElement;
    Vec3 centre{0, 0, 0};                  ///< centroid of the placed volume
    double stiffness = 1;                  ///< infinity: rigid
    const CanonicalField* deep = nullptr;  ///< distances all through its inside, where depth tells who keeps a point
    const CanonicalField* fine = nullptr;  ///< distances of the result's grid, where that is the finer one
    double size = 0;                  ///< diagonal of the bounding box in the element's own frame: the unit of a and b
    CoordBBox box;                    ///< of the placed level set, its band included
    CompactLevelSet placed;           ///< level set as placed
    BlockMasks body;                  ///< voxels left after neighbours and base took their share
    std::vector<int> neighbours;      ///< indices of elements whose boxes meet, ascending
    std::vector<int> contacts;        ///< indices of those that it shares a contact surface with
    std::vector<MaskedBlock> strays;  ///< pieces that the trim cut off, erased from `placed`
    double placedVolume = 0, bodyVolume = 0;
    double targetVolume = 0;  ///< placed, less what the base cuts off for good
    uint64_t placedVoxels = 0, bodyVoxels = 0;
    std::shared_ptr<ContactDistance> contact;

    /// Volume to win back by growing.
    double lost() const { return targetVolume - bodyVolume; }
};

/// The boxes of all, in order.
inline std::vector<CoordBBox> boxesOf(const std::vector<WorkElement>& elements) {
    std::vector<CoordBBox> boxes;
    for (const WorkElement& e : elements) boxes.push_back(e.box);
    return boxes;
}

}  // namespace pavel
