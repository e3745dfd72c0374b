#pragma once
// Elements in index space, made the way packing makes them.
#include "pavel/vdb/contact.h"
#include "pavel/vdb/measure.h"
#include "pavel/vdb/overlap.h"
#include "pavel/vdb/voxelize.h"
#include "support/meshes.h"

namespace pavel::test {

/// Voxelises an element whose frame is known.
inline void place(WorkElement& e, const CanonicalField& field) {
    e.placed = voxelizePlacement(field, e.indexFromElement).compact();
    e.box = e.placed.box();
    const InsideMeasure m = BlockLevelSet(e.placed).measure();
    e.placedVolume = m.volume, e.placedVoxels = m.voxels;
}

/// One element of `mesh` (lengths in voxels) with its origin at each place.
inline std::vector<WorkElement> elementsAt(const TriangleMesh& mesh, const std::vector<Vec3>& places) {
    openvdb::initialize();
    const CanonicalField field = makeCanonicalField(mesh, 1, 1, 1);
    std::vector<WorkElement> elements(places.size());
    for (size_t i = 0; i < places.size(); ++i) {
        WorkElement& e = elements[i];
        e.id = int(i) + 1;
        e.indexFromElement.origin = places[i];
        e.centre = e.indexFromElement.apply(field.centroid);
        e.size = field.bounds.diagonal();
        place(e, field);
    }
    return elements;
}

/// Neighbours, bodies and contacts of all.
inline void resolve(std::vector<WorkElement>& elements, const openvdb::FloatTree* base = nullptr) {
    const RunContext context;
    resolveOverlap(elements, base, true, context);
}

inline double ballVolume(double r) {
    return 4 * kPi * r * r * r / 3;
}
/// Volume of a ball's cap of height h.
inline double capVolume(double r, double h) {
    return kPi * h * h * (3 * r - h) / 3;
}

/// Mean of | |grad| - 1 | over the voxels within 1.5 of the surface.
template <class Tree>
double gradientError(const Tree& tree) {
    openvdb::tree::ValueAccessor<const Tree, false> reader(tree);
    double sum = 0;
    size_t n = 0;
    for (auto it = tree.cbeginValueOn(); it; ++it) {
        if (!it.isVoxelValue() || std::abs(*it) > 1.5) continue;
        const Coord c = it.getCoord();
        const Vec3 g(reader.getValue(c.offsetBy(1, 0, 0)) - reader.getValue(c.offsetBy(-1, 0, 0)),
                     reader.getValue(c.offsetBy(0, 1, 0)) - reader.getValue(c.offsetBy(0, -1, 0)),
                     reader.getValue(c.offsetBy(0, 0, 1)) - reader.getValue(c.offsetBy(0, 0, -1)));
        sum += std::abs(length(g) / 2 - 1);
        ++n;
    }
    return n ? sum / double(n) : 1;
}

}  // namespace pavel::test
