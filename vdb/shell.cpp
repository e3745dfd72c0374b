#include "pavel/vdb/shell.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/union_find.h"
#include "pavel/vdb/fuse.h"
#include "pavel/vdb/level_set_mesh.h"
#include "pavel/vdb/measure.h"
#include "pavel/vdb/packed_blocks.h"
#include "pavel/vdb/packed_grids.h"
#include "pavel/vdb/redistance.h"
#include "pavel/vdb/thicken.h"
#include "pavel/vdb/voxelize.h"

namespace pavel {
namespace {

Coord nearestVoxel(const Vec3& p) {
    return {int(std::lround(p[0])), int(std::lround(p[1])), int(std::lround(p[2]))};
}

/// Joins a capsule from a to b; index space.
void addCapsule(openvdb::FloatTree& tree, const Vec3& a, const Vec3& b, double radius) {
    Bounds box;
    box.add(a), box.add(b);
    const Vec3 reach(radius + kBand, radius + kBand, radius + kBand);
    const Coord lo = nearestVoxel(box.min - reach), hi = nearestVoxel(box.max + reach);
    const Vec3 ab = b - a;
    const double l2 = std::max(dot(ab, ab), 1e-30);
    openvdb::tree::ValueAccessor<openvdb::FloatTree> values(tree);
    for (int x = lo[0]; x <= hi[0]; ++x)
        for (int y = lo[1]; y <= hi[1]; ++y)
            for (int z = lo[2]; z <= hi[2]; ++z) {
                const Coord c(x, y, z);
                const Vec3 p = centreOf(c);
                const double t = std::clamp(dot(p - a, ab) / l2, 0.0, 1.0);
                const float d = float(std::clamp(length(p - a - t * ab) - radius, -double(kBand), double(kBand)));
                if (d < values.getValue(c)) values.setValue(c, d);
            }
}

struct Piece {
    std::vector<int> triangles;
    double volume = 0;
};

/// Connected pieces of a closed mesh, the largest first.
std::vector<Piece> piecesOf(const TriangleMesh& mesh) {
    UnionFind sets(mesh.points.size());
    for (const Triangle& t : mesh.triangles) sets.join(t[0], t[1]), sets.join(t[0], t[2]);
    std::map<int, Piece> byRoot;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        Piece& p = byRoot[sets.find(mesh.triangles[t][0])];
        p.triangles.push_back(int(t));
        p.volume += dot(mesh.corner(t, 0), cross(mesh.corner(t, 1), mesh.corner(t, 2))) / 6;
    }
    std::vector<Piece> pieces;
    for (auto& [root, p] : byRoot) pieces.push_back(std::move(p));
    std::stable_sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.volume > b.volume; });
    return pieces;
}

TriangleMesh submesh(const TriangleMesh& mesh, const std::vector<int>& triangles) {
    TriangleMesh out;
    out.points = mesh.points;
    for (int t : triangles) out.triangles.push_back(mesh.triangles[size_t(t)]);
    removeUnusedVertices(out);
    return out;
}

/// The nearest two points of two pieces, by a coarse search that suffices to join them.
std::pair<Vec3, Vec3> nearestPoints(const TriangleMesh& mesh, const Piece& a, const Piece& b) {
    constexpr size_t kMost = 3000;
    std::pair<Vec3, Vec3> best;
    double least = 1e300;
    const size_t stepA = a.triangles.size() / kMost + 1, stepB = b.triangles.size() / kMost + 1;
    for (size_t i = 0; i < a.triangles.size(); i += stepA)
        for (size_t j = 0; j < b.triangles.size(); j += stepB) {
            const Vec3 p = mesh.corner(size_t(a.triangles[i]), 0), q = mesh.corner(size_t(b.triangles[j]), 0);
            if (const double d = dot(p - q, p - q); d < least) least = d, best = {p, q};
        }
    return best;
}

}  // namespace

struct ShellBuilder::Grids {
    std::shared_ptr<const PackedGrids> packed;
    std::vector<WorkTree::Ptr> elements;
    openvdb::FloatTree::Ptr base;
};

ShellBuilder::~ShellBuilder() = default;

ShellBuilder::ShellBuilder(const Packing& packing, const TriangleMesh& base, const std::vector<PlacedElement>& placed,
                           const ShellOptions& options, double gap)
    : options_(options), h_(packing.voxelSize), gap_(gap) {
    openvdb::initialize();
    grids_ = std::make_unique<Grids>();
    grids_->packed = packing.grids;
    grids_->base = narrowBand(base, h_, float(options.clearance / h_ + kBand))->treePtr();
    const std::vector<WorkTree::Ptr> trees = treesOf(packing.grids->elements);
    for (const PlacedElement& p : placed) {
        const WorkTree::Ptr& tree = trees[size_t(p.id) - 1];
        if (!tree) continue;  // swallowed
        grids_->elements.push_back(tree);
        graph_.id.push_back(p.id);
        graph_.normal.push_back(p.worldFromElement.z);
    }
    const size_t n = graph_.id.size();
    if (n == 0) throw InputError("shell: no element is left to print");
    graph_.position.resize(n), graph_.bounds.resize(n), graph_.volume.resize(n);
    graph_.neighbours.resize(n), graph_.backNormals.resize(n);
    tbb::parallel_for(size_t(0), n, [&](size_t i) { measureElement(i); });
    const std::vector<CoordBBox> boxes = leafBoxes(grids_->elements);
    const ElementIndex index(boxes);
    std::vector<std::vector<std::pair<int, Bond>>> found(n);
    tbb::parallel_for(size_t(0), n, [&](size_t i) {
        for (int j : index.meeting(boxes[i]))
            if (size_t(j) > i)
                if (const Bond b = bondOf(i, size_t(j)); b.area > 0) found[i].emplace_back(j, b);
    });
    for (size_t i = 0; i < n; ++i)
        for (const auto& [j, bond] : found[i]) {
            bonds_[{int(i), j}] = bond;
            graph_.neighbours[i].push_back(j);
            graph_.neighbours[size_t(j)].push_back(int(i));
        }
    for (auto& list : graph_.neighbours) std::sort(list.begin(), list.end());
}

/// Place, extent and volume outside the clearance, and the base's normals under the element.
void ShellBuilder::measureElement(size_t i) {
    const WorkTree& tree = *grids_->elements[i];
    const BaseReader base(*grids_->base);
    const float clearance = float(options_.clearance / h_);
    Bounds box;
    Vec3 sum(0, 0, 0);
    size_t inside = 0, seen = 0;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
        for (int v = 0; v < 512; ++v) {
            const float phi = leaf->buffer().data()[v];
            if (phi > 1) continue;
            const Coord c = leaf->offsetToGlobalCoord(openvdb::Index(v));
            const float below = base.getValue(c);
            if (phi < 0 && below > clearance) {
                box.add(centreOf(c));
                sum += centreOf(c);
                ++inside;
            }
            if (std::abs(below - clearance) < 1 && ++seen % 7 == 0) {
                const Vec3 g(base.getValue(c.offsetBy(1, 0, 0)) - base.getValue(c.offsetBy(-1, 0, 0)),
                             base.getValue(c.offsetBy(0, 1, 0)) - base.getValue(c.offsetBy(0, -1, 0)),
                             base.getValue(c.offsetBy(0, 0, 1)) - base.getValue(c.offsetBy(0, 0, -1)));
                if (length(g) > 0.5) graph_.backNormals[i].push_back(normalized(g));
            }
        }
    if (!inside)
        throw InputError("shell.clearance: it takes element " + std::to_string(graph_.id[i]) +
                         " whole; make it smaller");
    graph_.position[i] = h_ * sum / double(inside);
    // The surface lies up to a voxel beyond the outermost centre.
    graph_.bounds[i].add(h_ * (box.min - Vec3(1, 1, 1)));
    graph_.bounds[i].add(h_ * (box.max + Vec3(1, 1, 1)));
    graph_.volume[i] = measureInside(tree).volume * h_ * h_ * h_;
}

/// The face in which two elements touch (or nearly, with a gap between them), outside the clearance.
ShellBuilder::Bond ShellBuilder::bondOf(size_t i, size_t j) const {
    const WorkTree &a = *grids_->elements[i], &b = *grids_->elements[j];
    const BaseReader base(*grids_->base);
    const float apart = std::min(float(gap_ / h_) + 0.6f, 4.f), clearance = float(options_.clearance / h_);
    Bond bond;
    Vec3 centre(0, 0, 0), axis(0, 0, 0);
    double count = 0;
    for (auto leaf = a.cbeginLeaf(); leaf; ++leaf) {
        const WorkLeaf* other = b.probeConstLeaf(leaf->origin());
        if (!other) continue;
        for (int v = 0; v < 512; ++v) {
            const float pa = leaf->buffer().data()[v], pb = other->buffer().data()[v];
            // A slab of two voxels around the face.
            if (pa + pb > apart || std::abs(pa - pb) > 2) continue;
            const Coord c = leaf->offsetToGlobalCoord(openvdb::Index(v));
            if (base.getValue(c) < clearance) continue;
            ++count;
            centre += centreOf(c);
            for (int k = 0; k < 3; ++k) {
                Coord up = c, down = c;
                ++up[k], --down[k];
                axis[k] += (a.getValue(up) - a.getValue(down)) - (b.getValue(up) - b.getValue(down));
            }
        }
    }
    bond.area = count / 2;
    if (count > 0) bond.centre = centre / count, bond.axis = normalized(axis);
    return bond;
}

ShellPart ShellBuilder::build(const std::vector<int>& members) const {
    ShellPart part;
    std::vector<const CompactLevelSet*> sets;
    for (int i : members) {
        part.ids.push_back(graph_.id[size_t(i)]);
        sets.push_back(&grids_->packed->elements[size_t(graph_.id[size_t(i)]) - 1]);
    }
    part.release = releaseOf(graph_, members);
    const bool touching = gap_ == 0;
    const double least = options_.minThickness / h_, radius = std::max(0.5 * least, 1.0);
    const openvdb::FloatTree::Ptr all = unionOf(sets, touching);
    for (size_t k = 0; k < members.size(); ++k)
        for (int j : graph_.neighbours[size_t(members[k])]) {
            if (j < members[k] || !std::binary_search(members.begin(), members.end(), j)) continue;
            const Bond& bond = bonds_.at({members[k], j});
            if (touching && bond.area > kPi / 4 * least * least) continue;
            const double reach = std::max(radius, 0.5 * gap_ / h_ + 1);
            addCapsule(*all, bond.centre - reach * bond.axis, bond.centre + reach * bond.axis, radius);
            ++part.bonds;
        }
    const float clearance = float(options_.clearance / h_);
    openvdb::FloatTree::Ptr solid = redistanced(*outside(*all, *grids_->base, clearance));
    if (const openvdb::FloatTree::Ptr thick = thickened(*solid, 0.5 * least, part.thickened))
        solid = redistanced(*outside(*thick, *grids_->base, clearance));
    // One piece: what is apart is joined to the rest, closed pockets are filled, crumbs are left away.
    for (int round = 0;; ++round) {
        const TriangleMesh mesh = levelSetMesh(*openvdb::FloatGrid::create(solid), h_);
        const std::vector<Piece> pieces = piecesOf(mesh);
        if (pieces.empty()) break;
        openvdb::FloatTree::Ptr joined;
        part.lostVolume = 0;
        for (size_t k = 1; k < pieces.size(); ++k) {
            if (pieces[k].volume <= 0) continue;
            const bool crumb = pieces[k].volume < std::pow(std::max(options_.minThickness, 2 * h_), 3);
            if (round == 3 || crumb) {
                part.lostVolume += pieces[k].volume;
                continue;
            }
            if (!joined) joined = std::make_shared<openvdb::FloatTree>(*solid);
            const auto [p, q] = nearestPoints(mesh, pieces[0], pieces[k]);
            const Vec3 along = radius * normalized(q - p);
            addCapsule(*joined, p / h_ - along, q / h_ + along, radius);
            ++part.bonds;
        }
        if (!joined) {
            part.mesh = submesh(mesh, pieces[0].triangles);
            part.volume = pieces[0].volume;
            break;
        }
        openvdb::tools::signedFloodFillWithValues(*joined, kBand, -kBand);
        solid = redistanced(*outside(*joined, *grids_->base, clearance));
    }
    return part;
}

}  // namespace pavel
