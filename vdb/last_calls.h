#pragma once
// Which fronts are done with while stop times are still being solved.
#include <atomic>
#include <memory>
#include <vector>

#include "pavel/vdb/element.h"

namespace pavel {

class Front;          // front.h
class RegionBuilder;  // region_builder.h

/// An element's front and shape are asked for by the regions of its rivals, and these are made anew where one of their
/// neighbours' fronts moved. When all of these have been solved and stand still, nobody asks any more.
class LastCalls {
  public:
    LastCalls(const std::vector<WorkElement>& elements, const std::vector<std::unique_ptr<Front>>& fronts,
              const RegionBuilder& builder);
    /// Told of each front that stands still. Calls done(element) for those that nobody will ask for. Safe from many
    /// threads; who is done in the end does not depend on their order.
    template <class F>
    void standsStill(int element, F done) {
        for (int j : watched_[size_t(element)])
            if (--pending_[size_t(j)] == 0) done(j);
    }

  private:
    std::vector<std::vector<int>> watched_;  // by element, who depends on its standing still
    std::vector<std::atomic<int>> pending_;
};

}  // namespace pavel
