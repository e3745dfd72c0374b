#include "pavel/vdb/pack.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <mutex>
#include <numeric>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/vdb/fine_shapes.h"
#include "pavel/vdb/fuse.h"
#include "pavel/vdb/gap.h"
#include "pavel/vdb/grow.h"
#include "pavel/vdb/measure.h"
#include "pavel/vdb/overlap.h"
#include "pavel/vdb/redistance.h"
#include "pavel/vdb/region_builder.h"
#include "pavel/vdb/sweep.h"
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

/// How far nine of ten fronts will go at most where they are fastest, in terms of the way from a contact to there: what
/// was lost, over what a band along the rims gives back.
double advanceOf(const std::vector<WorkElement>& elements, const std::vector<Material>& materials) {
    std::vector<double> advances;
    for (const WorkElement& e : elements) {
        if (!e.bodyVoxels || std::isinf(e.stiffness) || !e.contact || e.contact->empty()) continue;
        const Material& m = materials[size_t(e.kind)];
        const double band = e.size * (2 * m.a / 3 + (m.b - m.a) / 2);  // the integral of the recovery function
        advances.push_back(e.lost() / (e.contact->length() * band) / (m.a * e.size));
    }
    if (advances.empty()) return 0;
    const auto most = advances.begin() + std::ptrdiff_t(advances.size() * 9 / 10);
    std::nth_element(advances.begin(), most, advances.end());
    return *most;
}

/// The grid for fronts that suits all elements.
int factorFor(const std::vector<ElementKind>& kinds, const std::vector<Material>& materials,
              const std::vector<PlacedElement>& placed, double h, double marchAcross, double advance) {
    std::vector<Vec3> sizes;
    for (const ElementKind& k : kinds) sizes.push_back(meshBounds(k.mesh).size() / h);
    double thinnest = 1e300, rise = 1e300;
    for (const PlacedElement& p : placed) {
        const Vec3 size = sizes[size_t(p.kind)] * p.worldFromElement.scale;
        thinnest = std::min(thinnest, size.min());
        rise = std::min(rise, materials[size_t(p.kind)].a * length(size));
    }
    return marchingFactor(thinnest, rise, marchAcross, advance);
}

/// Canonical fields of all kinds that are placed.
std::vector<CanonicalField> canonicalFields(const std::vector<ElementKind>& kinds,
                                            const std::vector<PlacedElement>& placed, double h, bool deep) {
    std::vector<CanonicalField> fields(kinds.size());
    tbb::parallel_for(size_t(0), kinds.size(), [&](size_t k) {
        double lo = 1e300, hi = 0;
        for (const PlacedElement& p : placed)
            if (p.kind == int(k))
                lo = std::min(lo, p.worldFromElement.scale), hi = std::max(hi, p.worldFromElement.scale);
        // Rigid ones keep every point: nobody asks how deep it lies.
        if (hi > 0) fields[k] = makeCanonicalField(kinds[k].mesh, h, lo, hi, deep && !std::isinf(kinds[k].stiffness));
    });
    return fields;
}

Frame indexFrame(const PlacedElement& p, double h) {
    Frame f = p.worldFromElement;
    f.origin /= h;
    f.scale /= h;
    return f;
}

std::vector<WorkElement> voxelizeAll(const std::vector<CanonicalField>& fields, const std::vector<ElementKind>& kinds,
                                     const std::vector<PlacedElement>& placed, double h, bool deep,
                                     const RunContext& context) {
    std::vector<WorkElement> elements(placed.size());
    forEachElement(placed.size(), context, "voxelize", 0.1, 1, [&](size_t i) {
        WorkElement& e = elements[i];
        const CanonicalField& field = fields[size_t(placed[i].kind)];
        e.id = placed[i].id;
        e.kind = placed[i].kind;
        e.stiffness = kinds[size_t(e.kind)].stiffness;
        e.indexFromElement = indexFrame(placed[i], h);
        e.centre = e.indexFromElement.apply(field.centroid);
        e.size = field.bounds.diagonal() * e.indexFromElement.scale;
        if (deep && !std::isinf(e.stiffness)) e.deep = &field;
        e.placed = voxelizePlacement(field, e.indexFromElement).compact();
        e.box = e.placed.box();
        const InsideMeasure m = BlockLevelSet(e.placed).measure();  // as it is when it is trimmed
        e.placedVolume = m.volume;
        e.placedVoxels = m.voxels;
    });
    return elements;
}

/// Leaves of the base that no element comes near become tiles.
void dropFar(openvdb::FloatTree& base, const RegionBuilder& elements) {
    std::vector<std::pair<Coord, float>> far;
    for (auto leaf = base.cbeginLeaf(); leaf; ++leaf) {
        const Coord& origin = leaf->origin();
        if (!elements.reach(CoordBBox(origin.offsetBy(-8), origin.offsetBy(15))))
            far.emplace_back(origin, leaf->getFirstValue() < 0 ? -base.background() : base.background());
    }
    for (const auto& [origin, value] : far) base.addTile(1, origin, value, false);
}

/// Share of its volume to which a region is solved before it is re-distanced.
constexpr double kCloseEnough = 2e-4;

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

void checkVoxelSize(const TriangleMesh& base, const std::vector<ElementKind>& kinds, double h, double gap,
                    RunContext& context) {
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
    if (gap / h > kMostGap)
        throw InputError("material.gap is " + std::to_string(gap / h).substr(0, 5) + " voxels wide (at most " +
                         std::to_string(kMostGap).substr(0, 1) + "): make it narrower or voxel_size larger");
    for (const ElementKind& k : kinds) {
        if (meshBounds(k.mesh).size().max() > b.size().max())
            context.warn("element \"" + k.name + "\" is larger than the base");
        if (2 * gap > meshBounds(k.mesh).size().min())
            throw InputError("material.gap is more than half as wide as element \"" + k.name + "\" is thick");
        const double voxels = meshBounds(k.mesh).size().min() / h;
        if (voxels < 3)
            throw InputError("voxel_size is too large: element \"" + k.name + "\" is only " +
                             std::to_string(voxels).substr(0, 4) + " voxels thick (at least 3; 10 or more look good)");
        if (voxels < 8)
            context.warn("element \"" + k.name + "\" is only " + std::to_string(voxels).substr(0, 4) +
                         " voxels thick: details are lost");
    }
}

int marchingFactor(double across, double rise, double marchAcross, double advance) {
    // Less leaves holes and ripples where much volume comes back in a narrow band.
    const double leastRise = std::min(3 + 3 * advance * advance, 6.0);
    return int(std::clamp(std::min(across / marchAcross, rise / leastRise), 1.0, 8.0));
}

Packing pack(const TriangleMesh& baseMesh, const std::vector<ElementKind>& kinds,
             const std::vector<PlacedElement>& placed, const PackOptions& options, RunContext& context) {
    const double h = options.voxelSize, h3 = h * h * h;
    const size_t n = placed.size();
    std::vector<Material> materials(kinds.size(), Material{options.a, options.b});
    for (size_t k = 0; k < options.kindMaterial.size(); ++k)
        materials[k] = {options.kindMaterial[k].first, options.kindMaterial[k].second};
    const bool deep = options.contactByDepth;
    openvdb::initialize();
    Packing result;
    result.voxelSize = h;
    result.grids = std::make_shared<PackedGrids>();
    PackedGrids& grids = *result.grids;
    grids.elements.resize(n);
    result.elements.resize(n);
    std::vector<uint64_t> voxels(n);

    // Overlap and growth are settled on the coarse grid, the packed shapes are then made on the fine one.
    std::vector<CanonicalField> fields, coarseFields;
    std::vector<WorkElement> coarse;
    openvdb::FloatTree::Ptr coarseBase;
    const auto factorAt = [&](double advance) {
        return factorFor(kinds, materials, placed, h, options.marchAcross, advance);
    };
    int factor = factorAt(0);
    const auto makeCoarseFields = [&] { coarseFields = canonicalFields(kinds, placed, h * factor, deep); };
    const auto makeCoarseBase = [&] {
        coarseBase = factor > 1 ? narrowBand(baseMesh, h * factor)->treePtr() : grids.base;
    };
    const auto settleOverlap = [&] {
        {
            const StageTimer timer(context, "voxelize");
            coarse = voxelizeAll(coarseFields, kinds, placed, h * factor, deep, context);
            if (factor > 1)
                for (WorkElement& e : coarse) e.fine = &fields[size_t(e.kind)];
        }
        const StageTimer timer(context, "overlap");
        resolveOverlap(coarse, coarseBase.get(), options.recoverBaseLoss, context);
    };
    {
        const StageTimer timer(context, "voxelize");
        const auto makeBase = [&] {
            grids.base = narrowBand(baseMesh, h, float(kBaseBand + options.gap / h))->treePtr();
            if (factor == 1) makeCoarseBase();
        };
        const auto makeFields = [&] { fields = canonicalFields(kinds, placed, h, false); };
        // All at once, as none of them keeps all threads busy.
        if (factor > 1)
            tbb::parallel_invoke(makeCoarseFields, makeFields, makeCoarseBase, makeBase);
        else
            tbb::parallel_invoke(makeCoarseFields, makeBase);
    }
    settleOverlap();
    // How far the fronts have to go is known only now.
    if (const int finer = factorAt(advanceOf(coarse, materials)); finer < factor) {
        factor = finer;
        {
            const StageTimer timer(context, "voxelize");
            tbb::parallel_invoke(makeCoarseFields, makeCoarseBase);
        }
        if (factor == 1) fields.clear();
        settleOverlap();
    }
    const double coarseH = h * factor;
    Growth growth(coarse, coarseBase.get(), materials);
    /// The packed shape of a region whose front stops later by something.
    const auto finish = [&](int element, Region& region, double later, double target) {
        const size_t i = size_t(element);
        const Front* f = growth.front(element);
        if (later != 0) region.advance(later);
        BlockLevelSet packed = redistanced(region, options.gap > 0 ? kWidestBand : kResultBand);
        const bool mayGrow = f ? !f->exhausted : !std::isinf(coarse[i].stiffness);
        result.elements[i].finalVolume = packed.settleVolume(target, mayGrow) * h3;
        grids.elements[i] = packed.compact();
    };
    const auto drop = [&](int element) {
        WorkElement& done = coarse[size_t(element)];
        done.placed = {}, done.body = {}, done.contact.reset();
        growth.drop(element);
    };
    std::vector<Outline> outlines(factor > 1 ? n : 0);
    {
        const StageTimer timer(context, "growth");
        growth.march(context);
        std::vector<double> targets(n);
        for (size_t i = 0; i < n; ++i) targets[i] = coarse[i].targetVolume;
        if (factor > 1) {
            growth.solveStopTimes(targets, 0.2, 1e-3, context, [&](int i, Region& region, double later) {
                outlines[size_t(i)] = Outline(region, later, factor);
            });
            growth.lookBeyond();
        } else {
            growth.solveStopTimes(
                targets, 0.2, kCloseEnough, context,
                [&](int i, Region& region, double later) { finish(i, region, later, targets[size_t(i)]); }, drop);
        }
    }
    {
        const StageTimer timer(context, "growth");
        const auto fieldOf = [&](int i) -> const CanonicalField& { return fields[size_t(placed[size_t(i)].kind)]; };
        FineShapes shapes(n, [&](int i) -> std::unique_ptr<FineShape> {
            if (factor == 1) return nullptr;
            return std::make_unique<FineShape>(coarse[size_t(i)], growth.front(i), fieldOf(i),
                                               indexFrame(placed[size_t(i)], h), factor);
        });
        const auto measurePlaced = [&](int i) -> InsideMeasure {
            const WorkElement& e = coarse[size_t(i)];
            if (factor == 1) return {e.placedVolume, e.placedVoxels};
            const double scale = indexFrame(placed[size_t(i)], h).scale,
                         volume = fieldOf(i).volume * scale * scale * scale;
            return {volume, uint64_t(std::llround(volume))};
        };
        const RegionBuilder onCoarse(coarse, coarseBase.get(), growth.fronts()),
            onFine(coarse, grids.base.get(), growth.fronts(), factor, factor > 1 ? &shapes : nullptr);
        result.counts.grownVoxels = growth.grownVoxels() * uint64_t(factor) * uint64_t(factor) * uint64_t(factor);
        growth.dropClaims();
        if (options.gap == 0) dropFar(*grids.base, onFine);
        const std::vector<int> order = sweepOrder(coarse);
        std::vector<std::vector<int>> rivals(n);
        tbb::parallel_for(size_t(0), n, [&](size_t i) { rivals[i] = onFine.rivalsOf(int(i)); });
        for (size_t i = 0; i < n; ++i) {
            shapes.expect(int(i));
            for (int j : rivals[i]) shapes.expect(j);
        }
        inOrder(order, context, "growth", 0.8, 1, [&](int element) {
            const size_t i = size_t(element);
            ElementResult& r = result.elements[i];
            const Front* f = growth.front(element);
            shapes.acquire(element);
            for (int j : rivals[i]) shapes.acquire(j);
            const InsideMeasure initial = measurePlaced(element);
            const double target = initial.volume * coarse[i].targetVolume / std::max(coarse[i].placedVolume, 1e-9);
            voxels[i] = initial.voxels;
            r.id = coarse[i].id;
            r.initialVolume = initial.volume * h3;
            r.targetVolume = target * h3;
            r.lostVolume = coarse[i].lost() * coarseH * coarseH * coarseH;
            for (int c : coarse[i].contacts) r.contacts.push_back(coarse[size_t(c)].id);
            if (coarse[i].bodyVoxels && factor > 1) {
                if (outlines[i].empty()) outlines[i] = Outline(onCoarse.build(element), 0, factor);
                Region region = onFine.refine(element, outlines[i]);
                outlines[i] = Outline();
                const StopShift s = solveShift(region, target, 0.5, kCloseEnough);
                finish(element, region, f && !(f->exhausted && s.missing > 0) ? s.later : 0, target);
            } else if (coarse[i].bodyVoxels && !f) {
                Region region = onCoarse.build(element);
                finish(element, region, 0, target);
            }
            if (f && f->b > f->firstB) r.widenedB = f->b;
            // Rounding is no lack of room; all that is missing beyond it is said.
            const double missing = r.targetVolume - r.finalVolume;
            if (!coarse[i].bodyVoxels || (f && f->exhausted) || missing > 5e-5 * r.targetVolume)
                r.unrecoveredVolume = std::max(0.0, missing);
            const auto release = [&](int j) {
                if (shapes.release(j)) drop(j);
            };
            release(element);
            for (int j : rivals[i]) release(j);
        });
    }
    if (options.gap > 0) {
        const StageTimer timer(context, "growth");
        std::vector<WorkTree::Ptr> packed = takeTrees(grids.elements);
        const std::vector<double> taken = leaveGap(packed, *grids.base, options.gap / h);
        grids.elements = putAway(std::move(packed));
        for (size_t i = 0; i < n; ++i) {
            result.elements[i].targetVolume -= taken[i] * h3;
            result.elements[i].finalVolume -= taken[i] * h3;
        }
    }
    if (options.surface || options.solidWithBase) {
        const StageTimer timer(context, "extract");
        returnFreedMemory();
        if (options.gap == 0) grids.base = narrowBand(baseMesh, h, kResultBand)->treePtr();
        if (options.surface) {
            double volume = 0;
            for (const ElementResult& e : result.elements) volume += e.finalVolume / h3;
            fuse(volume, options.solidWithBase, options.gap == 0, grids);
        }
        if (options.gap > 0) grids.base = redistanced(*grids.base);  // a band of another width
    }
    constexpr double kWorthAWord = 1e-3;
    std::vector<int> swallowed, widened, short_;
    const double factor3 = double(factor) * factor * factor;
    for (size_t i = 0; i < n; ++i) {
        result.counts.decorationVoxels += voxels[i];
        const WorkElement& e = coarse[i];
        // Whole layers of coarse voxels would be too rough a measure.
        result.counts.overlapVoxels += factor == 1 ? e.placedVoxels - e.bodyVoxels
                                                   : uint64_t(std::max(0.0, e.placedVolume - e.bodyVolume) * factor3);
        if (!coarse[i].bodyVoxels)
            swallowed.push_back(coarse[i].id);
        else if (result.elements[i].unrecoveredVolume > kWorthAWord * result.elements[i].targetVolume)
            short_.push_back(coarse[i].id);
        else if (result.elements[i].widenedB > 0)
            widened.push_back(coarse[i].id);
    }
    result.counts.baseVoxels = uint64_t(std::llround(meshVolume(baseMesh) / h3));
    result.counts.activeVoxels =
        grids.base->activeVoxelCount() + (grids.surface ? grids.surface->activeVoxelCount() : 0);
    for (const CompactLevelSet& e : grids.elements) result.counts.activeVoxels += e.activeVoxels();
    if (!swallowed.empty()) context.warn("elements swallowed whole by neighbours or the base: " + idList(swallowed));
    if (!widened.empty()) context.warn("elements short of room, grown with a wider b: " + idList(widened));
    if (!short_.empty()) context.warn("elements walled in, part of their volume not recovered: " + idList(short_));
    return result;
}

}  // namespace pavel
