#pragma once
// Elements at full resolution, there only while somebody needs them.
#include <deque>
#include <functional>
#include <mutex>

#include "pavel/vdb/fine_shape.h"

namespace pavel {

/// Each shape is made at its first use and dropped after its last: elements that are worked through along an axis keep
/// a slab of shapes in memory, not all. Safe to use from many threads.
class FineShapes {
  public:
    using Make = std::function<std::unique_ptr<FineShape>(int)>;
    FineShapes(size_t count, Make make) : make_(std::move(make)), slots_(count) {}

    /// One more call of release(i) to come.
    void expect(int i) { ++slots_[size_t(i)].uses; }
    void acquire(int i) {
        Slot& slot = slots_[size_t(i)];
        const std::lock_guard<std::mutex> lock(slot.mutex);
        if (!slot.shape) slot.shape = make_(i);
    }
    /// True when nobody will ask for the shape any more.
    bool release(int i) {
        Slot& slot = slots_[size_t(i)];
        const std::lock_guard<std::mutex> lock(slot.mutex);
        if (--slot.uses > 0) return false;
        slot.shape.reset();
        return true;
    }
    /// To be used between acquire and release.
    const FineShape& shape(int i) const { return *slots_[size_t(i)].shape; }

  private:
    struct Slot {
        std::mutex mutex;
        int uses = 0;
        std::unique_ptr<FineShape> shape;
    };
    Make make_;
    std::deque<Slot> slots_;
};

}  // namespace pavel
