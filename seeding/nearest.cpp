#include "pavel/seeding/nearest.h"

#include <tbb/parallel_for.h>

#include "pavel/seeding/kd_tree.h"

namespace pavel {
std::vector<std::vector<size_t>> nearestOf(const std::vector<SurfacePoint>& points, size_t count) {
    const PointCloud cloud{points};
    const KdTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8));
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
