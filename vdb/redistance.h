#pragma once
// Turns a field that is right where it changes sign into a clean narrow-band distance, of half width 3 as a rule.
//
// Every voxel beside the zero set finds its foot point on it along the gradient of the trilinear field; foot points
// travel outward through the band, each voxel keeping the nearest, and the plane at the foot point mends the sampling
// of the surface by points. A region's two fields are followed one by one, and where they meet the foot point is the
// nearest point of the crease: corners are cut off neither in nor out. Windows of some blocks: parallel, no storage
// beyond a window, linear in the band.
#include <functional>

#include "pavel/vdb/block_level_set.h"
#include "pavel/vdb/region.h"

namespace pavel {

/// How wide bands can be made.
constexpr float kWidestBand = 4.5f;
BlockLevelSet redistanced(const Region& raw, float band = kResultBand);
openvdb::FloatTree::Ptr redistanced(const openvdb::FloatTree& raw);
WorkTree::Ptr redistanced(const WorkTree& raw);
/// Writes the 512 raw values of a block, and true; or false, and the value that stands for all. Called from many
/// threads, twice or more for blocks at the edges of windows.
using RawBlock = std::function<bool(const Coord& origin, float* values, float& tile)>;
/// The same of values that lie in no tree. @param blocks all through which the surface may pass
openvdb::FloatTree::Ptr redistanced(const std::vector<Coord>& blocks, const RawBlock& raw);
/// A narrow band of half width 3 or more, made as wide as asked for on each side; all voxels of its leaves are active.
/// One window: memory follows the band. O(band) a pass, on one thread; a few passes, more where it bends much.
openvdb::FloatTree::Ptr widened(const openvdb::FloatTree& narrow, float outside, float inside);

}  // namespace pavel
