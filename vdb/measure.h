#pragma once
// Sub-voxel volume of a level set: each voxel counts by the share of it that lies under the plane given by the value
// and its gradient. `tools::levelSetVolume` is off by an amount that follows the curved area; this is not.
#include "pavel/vdb/grid.h"

namespace pavel {

/// Share of the unit cube around the origin with n.x + distance < 0, for unit n (R. Scardovelli and S. Zaleski 2000).
double cubeShareUnderPlane(double distance, Vec3 n);

/// Share of the voxel at c that lies inside.
template <class Reader>
double insideShare(const Reader& reader, const Coord& c, float value) {
    if (value <= -1.8f) return 1;
    if (value >= 1.8f) return 0;
    const Vec3 g(0.5 * (reader.getValue(c.offsetBy(1, 0, 0)) - reader.getValue(c.offsetBy(-1, 0, 0))),
                 0.5 * (reader.getValue(c.offsetBy(0, 1, 0)) - reader.getValue(c.offsetBy(0, -1, 0))),
                 0.5 * (reader.getValue(c.offsetBy(0, 0, 1)) - reader.getValue(c.offsetBy(0, 0, -1))));
    const double l = length(g);
    if (l < 0.1) return value < 0 ? 1 : 0;
    return cubeShareUnderPlane(value / l, g / l);
}

struct InsideMeasure {
    double volume = 0;    ///< sub-voxel, in voxels
    uint64_t voxels = 0;  ///< voxel centres inside
};

InsideMeasure measureInside(const WorkTree& tree);
/// The share of the volume that lies in one leaf's voxels.
double leafVolume(const WorkReader& reader, const WorkLeaf& leaf);

}  // namespace pavel
