#include "pavel/vdb/last_calls.h"

#include <tbb/parallel_for.h>

#include <algorithm>

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
        static thread_local std::vector<char> seen;  // all clear but while one is worked on
        seen.resize(elements.size());
        std::vector<int> watched{int(k)};
        seen[k] = 1;
        size_t first = 0;
        for (int step = 0; step < kSteps; ++step)
            for (const size_t end = watched.size(); first < end; ++first) {
                const size_t i = size_t(watched[first]);
                for (const auto* beside :
                     std::initializer_list<const std::vector<int>*>{&asking_[i], &elements[i].neighbours})
                    for (int j : *beside) {
                        if (seen[size_t(j)]) continue;
                        seen[size_t(j)] = 1;
                        watched.push_back(j);
                    }
            }
        for (int j : watched) seen[size_t(j)] = 0;
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
