#pragma once
// Turns a field that is right where it changes sign into a clean narrow-band distance of half width 3.
//
// Every voxel beside the zero set finds its foot point on it along the gradient of the trilinear field; foot points
// travel outward through the band, each voxel keeping the nearest, and the plane at the foot point mends the sampling
// of the surface by points. Bricks of 32^3 with a halo: parallel, no storage beyond a brick, linear in the band.
#include "pavel/vdb/grid.h"

namespace pavel {

template <class Tree>
typename Tree::Ptr redistanced(const Tree& raw);

extern template WorkTree::Ptr redistanced(const WorkTree&);
extern template openvdb::FloatTree::Ptr redistanced(const openvdb::FloatTree&);

}  // namespace pavel
