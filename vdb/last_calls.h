#pragma once
// Which fronts are done with while stop times are still being solved.
#include <atomic>
#include <memory>
#include <vector>

#include "pavel/vdb/element.h"

namespace pavel {

class Front;          // front.h
class RegionBuilder;  // region_builder.h

/// An element's front and shape are asked for by the regions of its rivals. These are made anew where one of their
/// neighbours' fronts moved, which may make them move in turn, and so on from neighbour to neighbour. When all within
/// some steps have been solved and stand still, nobody asks any more.
class LastCalls {
  public:
    /// From one that moves to the last one that is kept for it; moves that are handed on fall off fast.
    static constexpr int kSteps = 5;

    LastCalls(const std::vector<WorkElement>& elements, const std::vector<std::unique_ptr<Front>>& fronts,
              const RegionBuilder& builder);
    /// Told of each front that stands still. Calls done(element) for those that nobody will ask for. Safe from many
    /// threads; who is done in the end does not depend on their order.
    template <class F>
    void standsStill(int element, F done) {
        for (int j : watched_[size_t(element)])
            if (--pending_[size_t(j)] == 0) done(j);
    }

    /// Is nobody gone whom an element's region asks for, itself included?
    bool mayAsk(int element) const;

  private:
    std::vector<std::vector<int>> asking_;   // by element, who asks for it, and whom it asks for
    std::vector<std::vector<int>> watched_;  // by element, who depends on its standing still
    std::vector<std::atomic<int>> pending_;
};

}  // namespace pavel
