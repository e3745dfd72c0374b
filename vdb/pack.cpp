#include "pavel/vdb/pack.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/vdb/fuse.h"
#include "pavel/vdb/measure.h"
#include "pavel/vdb/overlap.h"
#include "pavel/vdb/redistance.h"
#include "pavel/vdb/voxelize.h"

namespace pavel {
namespace {

/// Runs f(i) for all elements in parallel and reports progress and cancellation as it goes.
template <class F>
void forEachElement(size_t n, const RunContext& context, const char* stage, double from, double to, F f) {
    std::atomic<size_t> done{0};
    std::mutex reporting;
    tbb::parallel_for(size_t(0), n, [&](size_t i) {
        f(i);
        const size_t k = ++done;
        if (k % 16 == 0) {
            const std::lock_guard<std::mutex> lock(reporting);
            context.progress(stage, from + (to - from) * double(k) / double(n));
        }
    });
    context.progress(stage, to);
}

std::vector<WorkElement> voxelizeAll(const std::vector<ElementKind>& kinds, const std::vector<PlacedElement>& placed,
                                     double h, const RunContext& context) {
    std::vector<CanonicalField> fields(kinds.size());
    tbb::parallel_for(size_t(0), kinds.size(), [&](size_t k) {
        double lo = 1e300, hi = 0;
        for (const PlacedElement& p : placed)
            if (p.kind == int(k))
                lo = std::min(lo, p.worldFromElement.scale), hi = std::max(hi, p.worldFromElement.scale);
        if (hi > 0) fields[k] = makeCanonicalField(kinds[k].mesh, h, lo, hi);
    });
    std::vector<WorkElement> elements(placed.size());
    forEachElement(placed.size(), context, "voxelize", 0.1, 1, [&](size_t i) {
        WorkElement& e = elements[i];
        const PlacedElement& p = placed[i];
        const CanonicalField& field = fields[size_t(p.kind)];
        e.id = p.id;
        e.kind = p.kind;
        e.indexFromElement = p.worldFromElement;
        e.indexFromElement.origin /= h;
        e.indexFromElement.scale /= h;
        e.centre = e.indexFromElement.apply(field.centroid);
        e.size = field.bounds.diagonal() * e.indexFromElement.scale;
        e.placed = voxelizePlacement(field, e.indexFromElement);
        e.placed->evalLeafBoundingBox(e.box);
        const InsideMeasure m = measureInside(*e.placed);
        e.placedVolume = m.volume;
        e.placedVoxels = m.voxels;
    });
    return elements;
}

void resolveOverlap(std::vector<WorkElement>& elements, const openvdb::FloatTree* base, RunContext& context) {
    findNeighbours(elements);
    forEachElement(elements.size(), context, "overlap", 0, 0.6, [&](size_t i) {
        trimElement(elements[i], elements, base);
        const InsideMeasure m = measureInside(*elements[i].body);
        elements[i].bodyVolume = m.volume;
        elements[i].bodyVoxels = m.voxels;
    });
    forEachElement(elements.size(), context, "overlap", 0.6, 1, [&](size_t i) {
        if (elements[i].bodyVoxels) findContacts(elements[i], elements, base);
    });
}

/// Moves a surface inward, by hundredths of a voxel, until its volume is no more than the target: where an element was
/// squeezed so hard that the stop time could not settle, too little is reported, but nothing is invented.
double shrinkToTarget(WorkTree& tree, double target) {
    constexpr double kClose = 5e-4;
    double volume = measureInside(tree).volume;
    for (int step = 0; step < 4 && volume > target * (1 + kClose); ++step) {
        double area = 0;
        for (auto it = tree.cbeginValueOn(); it; ++it) area += std::abs(*it) < 0.5f;
        const float by = float(std::min(0.5, (volume - target) / std::max(area, 1.0)));
        for (auto leaf = tree.beginLeaf(); leaf; ++leaf)
            for (auto it = leaf->beginValueOn(); it; ++it) it.setValue(std::min(kResultBand, *it + by));
        volume = measureInside(tree).volume;
    }
    return volume;
}

std::string idList(const std::vector<int>& ids) {
    std::string text;
    for (size_t i = 0; i < ids.size() && i < 12; ++i) text += (i ? ", " : "") + std::to_string(ids[i]);
    return ids.size() > 12 ? text + " and " + std::to_string(ids.size() - 12) + " more" : text;
}

}  // namespace

openvdb::FloatGrid::Ptr toFloatGrid(const WorkTree& tree) {
    auto grid = openvdb::FloatGrid::create(kResultBand);
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) grid->tree().addLeaf(new WorkLeaf(*leaf));
    openvdb::tools::signedFloodFill(grid->tree());
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

void checkVoxelSize(const TriangleMesh& base, const std::vector<ElementKind>& kinds, double h, RunContext& context) {
    const Bounds b = meshBounds(base);
    const double reach =
        std::max({std::abs(b.min.max()), std::abs(b.min.min()), std::abs(b.max.max()), std::abs(b.max.min())}) / h;
    // Distances are floats of voxel coordinates: beyond this a voxel is no longer resolved to a thousandth.
    if (reach > 1e6)
        throw InputError("voxel_size is too small: the base reaches " + std::to_string(int64_t(reach)) +
                         " voxels from the origin (at most 1000000)");
    if (b.size().min() / h < 3)
        throw InputError("voxel_size is too large: the base is only " + std::to_string(b.size().min() / h) +
                         " voxels thick");
    for (const ElementKind& k : kinds) {
        const double voxels = meshBounds(k.mesh).size().min() / h;
        if (voxels < 3)
            throw InputError("voxel_size is too large: element \"" + k.name + "\" is only " +
                             std::to_string(voxels).substr(0, 4) + " voxels thick (at least 3; 10 or more look good)");
        if (voxels < 8)
            context.warn("element \"" + k.name + "\" is only " + std::to_string(voxels).substr(0, 4) +
                         " voxels thick: details are lost");
    }
}

Packing pack(const TriangleMesh& baseMesh, const std::vector<ElementKind>& kinds,
             const std::vector<PlacedElement>& placed, const PackOptions& options, RunContext& context) {
    const double h = options.voxelSize, h3 = h * h * h;
    openvdb::initialize();
    Packing result;
    result.voxelSize = h;
    result.grids = std::make_shared<PackedGrids>();
    PackedGrids& grids = *result.grids;

    std::vector<WorkElement> elements;
    {
        const StageTimer timer(context, "voxelize");
        grids.base = voxelizeBase(baseMesh, h)->treePtr();
        elements = voxelizeAll(kinds, placed, h, context);
    }
    {
        const StageTimer timer(context, "overlap");
        resolveOverlap(elements, grids.base.get(), context);
    }
    const size_t n = elements.size();
    grids.elements.resize(n);
    result.elements.resize(n);
    std::vector<int> swallowed, widened, short_;
    {
        const StageTimer timer(context, "growth");
        std::vector<Material> materials(kinds.size(), Material{options.a, options.b});
        for (size_t k = 0; k < options.kindMaterial.size(); ++k)
            materials[k] = {options.kindMaterial[k].first, options.kindMaterial[k].second};
        Growth growth(elements, grids.base.get(), materials);
        growth.march(context);
        std::vector<double> targets(n);
        for (size_t i = 0; i < n; ++i) targets[i] = elements[i].placedVolume;
        growth.solveStopTimes(targets, context);
        // What re-distancing changes in the measure is small and hardly moves with the stop time: solve with it allowed
        // for.
        std::vector<double> corrected = targets;
        forEachElement(n, context, "growth", 0.7, 0.8, [&](size_t i) {
            if (!elements[i].bodyVoxels || !growth.front(int(i))) return;
            const WorkTree::Ptr raw = growth.region(int(i));
            corrected[i] += measureInside(*raw).volume - measureInside(*redistanced(*raw)).volume;
        });
        growth.solveStopTimes(corrected, context);
        forEachElement(n, context, "growth", 0.9, 1, [&](size_t i) {
            const WorkElement& e = elements[i];
            ElementResult& r = result.elements[i];
            r.id = e.id;
            r.initialVolume = r.targetVolume = e.placedVolume * h3;
            r.lostVolume = e.lost() * h3;
            for (int c : e.contacts) r.contacts.push_back(elements[size_t(c)].id);
            if (e.bodyVoxels) {
                grids.elements[i] = redistanced(*growth.region(int(i)));
                r.finalVolume = shrinkToTarget(*grids.elements[i], e.placedVolume) * h3;
            }
            const Front* f = growth.front(int(i));
            if (f && f->b > f->firstB) r.widenedB = f->b;
            // Rounding is no lack of room; what is missing beyond it could not be had back.
            const double missing = r.targetVolume - r.finalVolume;
            if (!e.bodyVoxels || (f && f->exhausted) || missing > 1e-3 * r.targetVolume)
                r.unrecoveredVolume = std::max(0.0, missing);
        });
        for (size_t i = 0; i < n; ++i) {
            if (!elements[i].bodyVoxels)
                swallowed.push_back(elements[i].id);
            else if (result.elements[i].unrecoveredVolume > 0)
                short_.push_back(elements[i].id);
            else if (result.elements[i].widenedB > 0)
                widened.push_back(elements[i].id);
        }
        result.counts.grownVoxels = growth.grownVoxels();
        for (WorkElement& e : elements) e.contact.reset();
        fuse(elements, growth, grids.base, options.solidWithBase, grids);
    }
    for (const WorkElement& e : elements) {
        result.counts.decorationVoxels += e.placedVoxels;
        result.counts.overlapVoxels += e.placedVoxels - e.bodyVoxels;
    }
    grids.ids = elementIds(grids.elements);
    result.counts.baseVoxels = uint64_t(std::llround(meshVolume(baseMesh) / h3));
    result.counts.activeVoxels = grids.surface->activeVoxelCount() + grids.base->activeVoxelCount();
    for (const auto& e : grids.elements)
        if (e) result.counts.activeVoxels += e->activeVoxelCount();
    if (!swallowed.empty()) context.warn("elements swallowed whole by neighbours or the base: " + idList(swallowed));
    if (!widened.empty()) context.warn("elements short of room, grown with a wider b: " + idList(widened));
    if (!short_.empty()) context.warn("elements walled in, part of their volume not recovered: " + idList(short_));
    return result;
}

}  // namespace pavel
