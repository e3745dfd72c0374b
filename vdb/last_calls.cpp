#include "pavel/vdb/last_calls.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "pavel/vdb/region_builder.h"

namespace pavel {

LastCalls::LastCalls(const std::vector<WorkElement>& elements, const std::vector<std::unique_ptr<Front>>& fronts,
                     const RegionBuilder& builder)
    : watched_(elements.size()), pending_(elements.size()) {
    const auto each = [&](const auto& f) { tbb::parallel_for(size_t(0), elements.size(), f); };
    // Who asks for an element: itself and its rivals.
    std::vector<std::vector<int>> asking(elements.size());
    each([&](size_t i) {
        asking[i] = builder.rivalsOf(int(i));
        asking[i].push_back(int(i));
    });
    each([&](size_t k) {
        if (!fronts[k]) return;
        std::vector<int> watched = asking[k];
        for (int i : elements[k].neighbours)
            watched.insert(watched.end(), asking[size_t(i)].begin(), asking[size_t(i)].end());
        std::sort(watched.begin(), watched.end());
        watched.erase(std::unique(watched.begin(), watched.end()), watched.end());
        for (int j : watched) ++pending_[size_t(j)];
        watched_[k] = std::move(watched);
    });
    // Regions of elements without fronts are made when all stop times are known.
    for (size_t i = 0; i < elements.size(); ++i) {
        if (fronts[i] || !elements[i].bodyVoxels) continue;
        for (int j : asking[i]) ++pending_[size_t(j)];
    }
}

}  // namespace pavel
