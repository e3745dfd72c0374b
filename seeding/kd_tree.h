#pragma once
// A search tree over surface points (nanoflann). Internal to this folder.
#include <nanoflann.hpp>

#include "pavel/seeding/surface.h"

namespace pavel {

struct PointCloud {
    const std::vector<SurfacePoint>& points;
    size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(size_t i, size_t k) const { return points[i].position[int(k)]; }
    template <class B>
    bool kdtree_get_bbox(B&) const {
        return false;
    }
};
using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointCloud>, PointCloud, 3, size_t>;

}  // namespace pavel
