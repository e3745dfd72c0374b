#include "pavel/vdb/overlap.h"

#include <algorithm>
#include <array>
#include <map>

#include "pavel/vdb/element_index.h"

namespace pavel {
namespace {

constexpr double kHalfBlock = 3.5 * 1.7320508;

/// Sets a whole block to one side.
void fillBlock(WorkTree& tree, const Coord& origin, float value) {
    tree.addTile(1, origin, value, false);
}

void trimByNeighbour(WorkElement& element, const WorkElement& other) {
    WorkTree& body = *element.body;
    const WorkTree& cutter = *other.placed;
    const Bisector g(element, other);
    CoordBBox shared = element.box;
    shared.intersect(other.box);
    if (shared.empty()) return;
    forEachBlock(shared, [&](const Coord& origin) {
        WorkLeaf* leaf = body.probeLeaf(origin);
        if (!leaf && body.getValue(origin) > 0) return;
        const WorkLeaf* cut = cutter.probeConstLeaf(origin);
        if (!cut && cutter.getValue(origin) > 0) return;
        const double middle = g(centreOf(origin) + Vec3(3.5, 3.5, 3.5));
        if (middle < -kBand - kHalfBlock) return;
        if (!cut && middle > kBand + kHalfBlock) {
            fillBlock(body, origin, kBand);
            return;
        }
        if (!leaf) leaf = body.touchLeaf(origin);
        for (openvdb::Index v = 0; v < WorkLeaf::SIZE; ++v) {
            const float inOther = cut ? -cut->getValue(v) : kBand;
            if (inOther <= -kBand) continue;
            const float taken = std::min(
                inOther, float(std::clamp(g(centreOf(leaf->offsetToGlobalCoord(v))), -double(kBand), double(kBand))));
            if (taken > leaf->getValue(v)) leaf->setValueOnly(v, taken);
        }
    });
}

void trimByBase(WorkElement& element, const openvdb::FloatTree& base) {
    WorkTree& body = *element.body;
    const BaseReader reader(base);
    forEachBlock(element.box, [&](const Coord& origin) {
        WorkLeaf* leaf = body.probeLeaf(origin);
        if (!leaf && body.getValue(origin) > 0) return;
        const auto* solid = reader.probeConstLeaf(origin);
        if (!solid) {
            if (reader.getValue(origin) < 0) fillBlock(body, origin, kBand);
            return;
        }
        if (!leaf) leaf = body.touchLeaf(origin);
        for (openvdb::Index v = 0; v < WorkLeaf::SIZE; ++v)
            if (-solid->getValue(v) > leaf->getValue(v)) leaf->setValueOnly(v, -solid->getValue(v));
    });
}

/// Blocks that ended up uniform become tiles.
void tidy(WorkTree& tree) {
    std::vector<std::pair<Coord, float>> uniform;
    for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
        bool in = true, out = true;
        for (openvdb::Index v = 0; v < WorkLeaf::SIZE; ++v) {
            const float x = leaf->getValue(v);
            in &= x <= -kBand;
            out &= x >= kBand;
        }
        if (in || out) uniform.emplace_back(leaf->origin(), in ? -kBand : kBand);
    }
    for (const auto& [origin, value] : uniform) fillBlock(tree, origin, value);
}

/// Labels of the pieces within one block, and the union of labels over blocks.
class Pieces {
  public:
    explicit Pieces(const WorkTree& tree) : tree_(tree) {
        CoordBBox box;
        tree.evalLeafBoundingBox(box);
        if (box.empty()) return;
        forEachBlock(box, [&](const Coord& origin) {
            const WorkLeaf* leaf = tree.probeConstLeaf(origin);
            if (leaf)
                labelLeaf(*leaf);
            else if (tree.getValue(origin) < 0)
                blocks_[origin] = {nullptr, newLabel(WorkLeaf::SIZE)};
        });
        for (const auto& [origin, block] : blocks_)
            for (int axis = 0; axis < 3; ++axis) joinAcross(origin, block, axis);
    }
    /// Root label of the largest piece, or -1.
    int largest() {
        std::vector<uint64_t> sum(parent_.size(), 0);
        for (size_t i = 0; i < parent_.size(); ++i) sum[size_t(find(int(i)))] += size_[i];
        return parent_.empty() ? -1 : int(std::max_element(sum.begin(), sum.end()) - sum.begin());
    }
    bool single() {
        for (size_t i = 1; i < parent_.size(); ++i)
            if (find(int(i)) != find(0)) return false;
        return true;
    }
    template <class F>
    void forEachOutside(int root, F f) {  // f(block origin, voxel or -1 for the whole block)
        for (auto& [origin, block] : blocks_) {
            if (!block.labels) {
                if (find(block.first) != root) f(origin, -1);
                continue;
            }
            for (int v = 0; v < int(WorkLeaf::SIZE); ++v) {
                const int l = (*block.labels)[size_t(v)];
                if (l >= 0 && find(l) != root) f(origin, v);
            }
        }
    }

  private:
    using Labels = std::array<int, WorkLeaf::SIZE>;
    struct Block {
        std::unique_ptr<Labels> labels;  // null: one piece fills the block
        int first = -1;
    };
    int newLabel(uint64_t size) {
        parent_.push_back(int(parent_.size()));
        size_.push_back(size);
        return int(parent_.size()) - 1;
    }
    int find(int i) {
        while (parent_[size_t(i)] != i) i = parent_[size_t(i)] = parent_[size_t(parent_[size_t(i)])];
        return i;
    }
    void join(int a, int b) {
        a = find(a), b = find(b);
        if (a != b) parent_[size_t(std::max(a, b))] = std::min(a, b);
    }
    void labelLeaf(const WorkLeaf& leaf) {
        auto labels = std::make_unique<Labels>();
        labels->fill(-1);
        int first = -1;
        std::vector<int> stack;
        for (int start = 0; start < int(WorkLeaf::SIZE); ++start) {
            if ((*labels)[size_t(start)] >= 0 || !(leaf.getValue(openvdb::Index(start)) < 0)) continue;
            const int label = newLabel(0);
            if (first < 0) first = label;
            stack.assign(1, start);
            (*labels)[size_t(start)] = label;
            while (!stack.empty()) {
                const int v = stack.back();
                stack.pop_back();
                ++size_[size_t(label)];
                const int x[3] = {v >> 6, v >> 3 & 7, v & 7}, step[3] = {64, 8, 1};
                for (int k = 0; k < 3; ++k)
                    for (int s = -1; s <= 1; s += 2) {
                        if (x[k] + s < 0 || x[k] + s > 7) continue;
                        const int n = v + s * step[k];
                        if ((*labels)[size_t(n)] >= 0 || !(leaf.getValue(openvdb::Index(n)) < 0)) continue;
                        (*labels)[size_t(n)] = label;
                        stack.push_back(n);
                    }
            }
        }
        if (first >= 0) blocks_[leaf.origin()] = {std::move(labels), first};
    }
    void joinAcross(const Coord& origin, const Block& block, int axis) {
        Coord next = origin;
        next[axis] += 8;
        const auto found = blocks_.find(next);
        if (found == blocks_.end()) return;
        const Block& other = found->second;
        if (!block.labels && !other.labels) return join(block.first, other.first);
        const int step = axis == 0 ? 64 : axis == 1 ? 8 : 1, u = axis == 0 ? 8 : 64, w = axis == 2 ? 8 : 1;
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j) {
                const int near = 7 * step + i * u + j * w, far = i * u + j * w;
                const int a = block.labels ? (*block.labels)[size_t(near)] : block.first;
                const int b = other.labels ? (*other.labels)[size_t(far)] : other.first;
                if (a >= 0 && b >= 0) join(a, b);
            }
    }

    const WorkTree& tree_;
    std::map<Coord, Block> blocks_;
    std::vector<int> parent_;
    std::vector<uint64_t> size_;
};

}  // namespace

Bisector::Bisector(const WorkElement& own, const WorkElement& other) {
    const WorkElement &lo = own.id < other.id ? own : other, &hi = own.id < other.id ? other : own;
    sign_ = own.id < other.id ? 1 : -1;
    const Vec3 d = hi.centre - lo.centre;
    const double l = length(d);
    if (l < 1e-6) {
        offset_ = 1e6;  // everything lies on the lower id's side
        return;
    }
    normal_ = d / l;
    offset_ = dot(0.5 * (lo.centre + hi.centre), normal_);
}

void findNeighbours(std::vector<WorkElement>& elements) {
    const ElementIndex index(elements);
    for (size_t i = 0; i < elements.size(); ++i) {
        elements[i].neighbours = index.meeting(elements[i].box);
        auto& n = elements[i].neighbours;
        n.erase(std::remove(n.begin(), n.end(), int(i)), n.end());
    }
}

void trimElement(WorkElement& element, const std::vector<WorkElement>& all, const openvdb::FloatTree* base) {
    element.body = std::make_shared<WorkTree>(*element.placed);
    for (int n : element.neighbours) trimByNeighbour(element, all[size_t(n)]);
    if (base) trimByBase(element, *base);
    tidy(*element.body);
    element.islands = dropIslands(*element.body);
}

std::vector<Coord> dropIslands(WorkTree& tree) {
    Pieces pieces(tree);
    std::vector<Coord> dropped;
    if (pieces.single()) return dropped;
    pieces.forEachOutside(pieces.largest(), [&](const Coord& origin, int v) {
        for (int i = v < 0 ? 0 : v; i <= (v < 0 ? int(WorkLeaf::SIZE) - 1 : v); ++i) {
            const Coord c = origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(i));
            dropped.push_back(c);
        }
    });
    for (const Coord& c : dropped) {
        // Flipped, not set far out: the zero set moves away without tearing the values of the main piece beside it.
        const float v = tree.getValue(c);
        tree.setValueOnly(c, std::max(0.5f, -v));
    }
    return dropped;
}

}  // namespace pavel
