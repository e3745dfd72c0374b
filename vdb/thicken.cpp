#include "pavel/vdb/thicken.h"

#include <openvdb/tools/FastSweeping.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <unordered_set>

namespace pavel {
namespace {

/// Central differences are shorter than this in the middle of a solid, where the nearest surface changes.
constexpr double kRidge = 0.7;
/// Thin places are farther than this from a ball that fits, in radii.
constexpr double kAway = 1.5;

/// Distances all through a shell of the inside that is wide enough.
openvdb::FloatTree::Ptr deepEnough(const openvdb::FloatTree& solid, double depth) {
    if (depth <= kResultBand) return std::make_shared<openvdb::FloatTree>(solid);
    const auto grid = openvdb::FloatGrid::create(std::make_shared<openvdb::FloatTree>(solid));
    const int layers = int(std::ceil(depth - kResultBand)) + 1;
    return openvdb::tools::dilateSdf(*grid, layers, openvdb::tools::NN_FACE, 1)->treePtr();
}

bool isThin(const BaseReader& phi, const Coord& c, double radius) {
    const double value = phi.getValue(c);
    if (value >= -0.25 || value <= -(radius - 0.5)) return false;
    double g2 = 0;
    for (int k = 0; k < 3; ++k) {
        Coord up = c, down = c;
        ++up[k], --down[k];
        const double d = 0.5 * (double(phi.getValue(up)) - double(phi.getValue(down)));
        g2 += d * d;
    }
    if (g2 >= kRidge * kRidge) return false;
    // Does a ball fit near enough?
    const double away = (1 + kAway) * radius;
    const int reach = int(std::ceil(away));
    for (int x = -reach; x <= reach; ++x)
        for (int y = -reach; y <= reach; ++y)
            for (int z = -reach; z <= reach; ++z)
                if (x * x + y * y + z * z <= away * away && phi.getValue(c.offsetBy(x, y, z)) <= -radius) return false;
    return true;
}

}  // namespace

openvdb::FloatTree::Ptr thickened(const openvdb::FloatTree& solid, double radius, size_t& places) {
    places = 0;
    if (radius < 0.75) return nullptr;  // below what the grid can tell
    const openvdb::FloatTree::Ptr deep = deepEnough(solid, radius + 1);
    std::vector<const openvdb::FloatTree::LeafNodeType*> leaves;
    for (auto leaf = deep->cbeginLeaf(); leaf; ++leaf) leaves.push_back(&*leaf);
    std::vector<std::vector<Coord>> found(leaves.size());
    tbb::parallel_for(size_t(0), leaves.size(), [&](size_t k) {
        const BaseReader phi(*deep);
        for (int v = 0; v < 512; ++v) {
            const Coord c = leaves[k]->offsetToGlobalCoord(openvdb::Index(v));
            if (isThin(phi, c, radius)) found[k].push_back(c);
        }
    });
    // A few voxels alone are a tip or noise; a thin place is a sheet or a wire of them.
    std::unordered_set<Coord, CoordHash> all;
    for (const auto& list : found) all.insert(list.begin(), list.end());
    for (auto& list : found) {
        const auto alone = [&](const Coord& c) {
            const int reach = int(std::ceil(radius));
            int near = 0;
            for (int x = -reach; x <= reach; ++x)
                for (int y = -reach; y <= reach; ++y)
                    for (int z = -reach; z <= reach; ++z) near += int(all.count(c.offsetBy(x, y, z)));
            return near < std::max(4, 2 * reach);
        };
        list.erase(std::remove_if(list.begin(), list.end(), alone), list.end());
        places += list.size();
    }
    if (places == 0) return nullptr;
    auto thick = std::make_shared<openvdb::FloatTree>(solid);
    openvdb::tree::ValueAccessor<openvdb::FloatTree> values(*thick);
    const int reach = int(std::ceil(radius + kResultBand));
    for (const auto& list : found)
        for (const Coord& middle : list)
            for (int x = -reach; x <= reach; ++x)
                for (int y = -reach; y <= reach; ++y)
                    for (int z = -reach; z <= reach; ++z) {
                        const Coord c = middle.offsetBy(x, y, z);
                        const float d = float(std::sqrt(double(x * x + y * y + z * z)) - radius);
                        if (d < values.getValue(c)) values.setValue(c, std::max(d, -kResultBand));
                    }
    return thick;
}

}  // namespace pavel
