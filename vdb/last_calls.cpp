#include "pavel/vdb/last_calls.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <iterator>

#include "pavel/vdb/region_builder.h"

namespace pavel {

LastCalls::LastCalls(const std::vector<WorkElement>& elements, const std::vector<std::unique_ptr<Front>>& fronts,
                     const RegionBuilder& builder)
    : asking_(elements.size()), watched_(elements.size()), pending_(elements.size()) {
    const auto each = [&](const auto& f) { tbb::parallel_for(size_t(0), elements.size(), f); };
    each([&](size_t i) {
        asking_[i] = builder.rivalsOf(int(i));
        asking_[i].push_back(int(i));
    });
    each([&](size_t k) {
        if (!fronts[k]) return;
        std::vector<int> watched{int(k)}, layer = watched;
        for (int step = 0; step < kSteps; ++step) {
            std::vector<int> next;
            for (int i : layer) {
                const auto &rivals = asking_[size_t(i)], &beside = elements[size_t(i)].neighbours;
                next.insert(next.end(), rivals.begin(), rivals.end());
                next.insert(next.end(), beside.begin(), beside.end());
            }
            std::sort(next.begin(), next.end());
            next.erase(std::unique(next.begin(), next.end()), next.end());
            layer.clear();
            std::set_difference(next.begin(), next.end(), watched.begin(), watched.end(), std::back_inserter(layer));
            const size_t before = watched.size();
            watched.insert(watched.end(), layer.begin(), layer.end());
            std::inplace_merge(watched.begin(), watched.begin() + std::ptrdiff_t(before), watched.end());
        }
        for (int j : watched) ++pending_[size_t(j)];
        watched_[k] = std::move(watched);
    });
    // Regions of elements without fronts are made when all stop times are known.
    for (size_t i = 0; i < elements.size(); ++i) {
        if (fronts[i] || !elements[i].bodyVoxels) continue;
        for (int j : asking_[i]) ++pending_[size_t(j)];
    }
}

bool LastCalls::mayAsk(int element) const {
    const auto& asked = asking_[size_t(element)];
    return std::none_of(asked.begin(), asked.end(), [&](int j) { return pending_[size_t(j)] == 0; });
}

}  // namespace pavel
