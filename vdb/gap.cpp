#include "pavel/vdb/gap.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "pavel/vdb/measure.h"
#include "pavel/vdb/packed_blocks.h"
#include "pavel/vdb/redistance.h"

namespace pavel {
namespace {

WorkTree::Ptr setBack(size_t i, const std::vector<WorkTree::Ptr>& elements, const std::vector<int>& others,
                      const openvdb::FloatTree& base, float gap) {
    const WorkTree& own = *elements[i];
    const float band = own.background();
    auto out = std::make_shared<WorkTree>(band);
    float phi[512], other[512], result[512];
    CoordBBox box;
    own.evalLeafBoundingBox(box);
    if (box.empty()) return out;
    forEachBlock(box, [&](const Coord& origin) {
        bool any = readBlock(own, origin, phi);
        if (!any && phi[0] > 0) return;
        std::copy(phi, phi + 512, result);
        any |= readBlock(base, origin, other);
        for (int v = 0; v < 512; ++v) result[v] = std::max(result[v], gap - other[v]);
        for (int j : others) {
            any |= readBlock(*elements[size_t(j)], origin, other);
            for (int v = 0; v < 512; ++v) result[v] = std::max(result[v], 0.5f * (gap - other[v] + phi[v]));
        }
        if (!any) {
            out->addTile(1, origin, result[0] < 0 ? -band : band, false);
            return;
        }
        WorkLeaf* leaf = out->touchLeaf(origin);
        for (int v = 0; v < 512; ++v) leaf->buffer().data()[v] = std::clamp(result[v], -band, band);
        leaf->setValuesOn();
    });
    return redistanced(*out);
}

}  // namespace

std::vector<double> leaveGap(std::vector<WorkTree::Ptr>& elements, const openvdb::FloatTree& base, double gap) {
    const std::vector<CoordBBox> boxes = leafBoxes(elements);
    const ElementIndex index(boxes);
    std::vector<WorkTree::Ptr> made(elements.size());
    std::vector<double> taken(elements.size(), 0);
    tbb::parallel_for(size_t(0), elements.size(), [&](size_t i) {
        if (!elements[i]) return;
        std::vector<int> others = index.meeting(boxes[i]);
        others.erase(std::remove(others.begin(), others.end(), int(i)), others.end());
        made[i] = setBack(i, elements, others, base, float(gap));
        taken[i] = measureInside(*elements[i]).volume - measureInside(*made[i]).volume;
    });
    elements = std::move(made);
    return taken;
}

}  // namespace pavel
