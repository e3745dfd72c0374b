#pragma once
// Placed level sets, and what has grown on them, at full resolution, there only while somebody needs them.
#include <deque>
#include <functional>
#include <mutex>

#include "pavel/vdb/grown_field.h"
#include "pavel/vdb/measure.h"

namespace pavel {

/// Each shape is made at its first use and dropped after its last: elements that are worked through along an axis keep
/// a slab of shapes in memory, not all. Safe to use from many threads.
class PlacedShapes {
  public:
    struct Shape {
        WorkTree::Ptr tree;
        InsideMeasure measure;
        GrownField grown;
    };
    using Make = std::function<Shape(int)>;
    PlacedShapes(size_t count, Make make) : make_(std::move(make)), shapes_(count), grown_(count), slots_(count) {}

    /// One more call of release(i) to come.
    void expect(int i) { ++slots_[size_t(i)].uses; }
    void acquire(int i) {
        Slot& slot = slots_[size_t(i)];
        const std::lock_guard<std::mutex> lock(slot.mutex);
        if (shapes_[size_t(i)]) return;
        Shape shape = make_(i);
        shapes_[size_t(i)] = std::move(shape.tree);
        grown_[size_t(i)] = std::move(shape.grown);
        slot.measure = shape.measure;
    }
    /// True when nobody will ask for the shape any more.
    bool release(int i) {
        Slot& slot = slots_[size_t(i)];
        const std::lock_guard<std::mutex> lock(slot.mutex);
        if (--slot.uses > 0) return false;
        shapes_[size_t(i)].reset();
        grown_[size_t(i)] = GrownField();
        return true;
    }
    /// To be read between acquire and release.
    const std::vector<WorkTree::Ptr>& shapes() const { return shapes_; }
    const std::vector<GrownField>& grown() const { return grown_; }
    const InsideMeasure& measure(int i) const { return slots_[size_t(i)].measure; }

  private:
    struct Slot {
        std::mutex mutex;
        int uses = 0;
        InsideMeasure measure;
    };
    Make make_;
    std::vector<WorkTree::Ptr> shapes_;
    std::vector<GrownField> grown_;
    std::deque<Slot> slots_;
};

}  // namespace pavel
