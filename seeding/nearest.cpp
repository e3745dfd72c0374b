#include "pavel/seeding/nearest.h"

#include <tbb/parallel_for.h>

#include <nanoflann.hpp>

namespace pavel {
namespace {

struct Cloud {
    const std::vector<SurfacePoint>& points;
    size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(size_t i, size_t k) const { return points[i].position[int(k)]; }
    template <class B>
    bool kdtree_get_bbox(B&) const {
        return false;
    }
};

}  // namespace

std::vector<std::vector<size_t>> nearestOf(const std::vector<SurfacePoint>& points, size_t count) {
    using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3, size_t>;
    const Cloud cloud{points};
    const Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8));
    std::vector<std::vector<size_t>> nearest(points.size());
    tbb::parallel_for(size_t(0), points.size(), [&](size_t i) {
        std::vector<size_t> found(count + 1);
        std::vector<double> distance2(count + 1);
        found.resize(tree.knnSearch(points[i].position.data(), count + 1, found.data(), distance2.data()));
        for (size_t n : found)
            if (n != i && nearest[i].size() < count) nearest[i].push_back(n);
    });
    return nearest;
}

}  // namespace pavel
