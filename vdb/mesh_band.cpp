#include "pavel/vdb/mesh_band.h"

#include <openvdb/tools/Composite.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <atomic>

#include "pavel/core/mesh_check.h"
#include "pavel/vdb/measure.h"

namespace pavel {
namespace {

/// A triangle with what a distance to it asks for.
struct Facet {
    Vec3 a, b, c;
    Vec3 normal;             ///< unit
    std::array<Vec3, 3> in;  ///< unit, in the plane, away from the edges ab, bc, ca into the triangle
    std::array<Vec3, 3> edge, vertex;

    /// May a point of the ball be nearer than the ball's radius?
    bool mayMeet(const Vec3& centre, double radius) const {
        return std::abs(dot(centre - a, normal)) <= radius && dot(centre - a, in[0]) >= -radius &&
               dot(centre - b, in[1]) >= -radius && dot(centre - c, in[2]) >= -radius;
    }
};

/// False where an edge has not two triangles that agree about its sides, or a triangle has no area.
bool makeFacets(const TriangleMesh& mesh, std::vector<Facet>& facets) {
    const auto neighbours = triangleNeighbours(mesh);
    const std::vector<Vec3> atVertex = vertexNormals(mesh);
    const size_t n = mesh.triangles.size();
    facets.resize(n);
    std::atomic<bool> good{n > 0};
    tbb::parallel_for(size_t(0), n, [&](size_t t) {
        const Triangle& corners = mesh.triangles[t];
        Facet& f = facets[t];
        const Vec3 p[3] = {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
        f.a = p[0], f.b = p[1], f.c = p[2];
        const Vec3 across = cross(f.b - f.a, f.c - f.a);
        const double twice = length(across);
        if (!(twice > 1e-12)) good = false;
        f.normal = normalized(across);
        for (size_t k = 0; k < 3; ++k) {
            f.in[k] = normalized(cross(f.normal, p[(k + 1) % 3] - p[k]));
            f.vertex[k] = atVertex[size_t(corners[k])];
            const int m = neighbours[t][k];
            if (m < 0) {
                good = false;
                continue;
            }
            const Triangle& other = mesh.triangles[size_t(m)];
            bool agrees = false;
            for (size_t j = 0; j < 3; ++j)
                agrees |= other[j] == corners[(k + 1) % 3] && other[(j + 1) % 3] == corners[k];
            if (!agrees) good = false;
            f.edge[k] = f.normal + triangleNormal(mesh, size_t(m));
        }
    });
    return good;
}

/// From the nearest point of the facet to p, and the normal that tells p's side: of the face, edge or corner that it is
/// on.
Vec3 fromNearest(const Facet& f, const Vec3& p, const Vec3*& normal) {
    Vec3 weights;
    const Vec3 nearest = closestPointOnTriangle(p, f.a, f.b, f.c, &weights);
    const bool onBc = weights[0] == 0, onCa = weights[1] == 0, onAb = weights[2] == 0;
    normal = onCa && onAb   ? &f.vertex[0]
             : onAb && onBc ? &f.vertex[1]
             : onBc && onCa ? &f.vertex[2]
             : onAb         ? &f.edge[0]
             : onBc         ? &f.edge[1]
             : onCa         ? &f.edge[2]
                            : &f.normal;
    return p - nearest;
}

/// A facet in a block. Blocks are numbered so that they sort by x, y, z.
struct Meeting {
    uint64_t block;
    int facet;
    bool operator<(const Meeting& o) const { return block != o.block ? block < o.block : facet < o.facet; }
};
constexpr int kBias = 1 << 20;
uint64_t numberOf(const Coord& block) {
    return uint64_t(block[0] + kBias) << 42 | uint64_t(block[1] + kBias) << 21 | uint64_t(block[2] + kBias);
}
Coord originOf(uint64_t number) {
    const auto part = [&](int shift) { return 8 * (int(number >> shift & (2 * kBias - 1)) - kBias); };
    return {part(42), part(21), part(0)};
}

/// Lists the blocks of a box, in blocks, that hold voxels nearer to the facet than the band: halves the box.
void list(const Facet& f, int number, double band, const Coord& lo, const Coord& hi, std::vector<Meeting>& out) {
    Vec3 centre, half;
    for (int k = 0; k < 3; ++k) centre[k] = 4 * (lo[k] + hi[k]) + 3.5, half[k] = 4 * (hi[k] - lo[k]) + 3.5;
    if (!f.mayMeet(centre, band + length(half))) return;
    const Coord size = hi - lo;
    const int axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
    if (size[axis] == 0) {
        out.push_back({numberOf(lo), number});
        return;
    }
    Coord middle = hi, next = lo;
    middle[axis] = lo[axis] + size[axis] / 2;
    next[axis] = middle[axis] + 1;
    list(f, number, band, lo, middle, out);
    list(f, number, band, next, hi, out);
}

std::vector<Meeting> meetings(const std::vector<Facet>& facets, double band) {
    constexpr size_t kChunk = 1024;
    std::vector<std::vector<Meeting>> parts((facets.size() + kChunk - 1) / kChunk);
    tbb::parallel_for(size_t(0), parts.size(), [&](size_t part) {
        for (size_t t = part * kChunk; t < std::min(facets.size(), (part + 1) * kChunk); ++t) {
            const Facet& f = facets[t];
            Coord lo, hi;
            for (int k = 0; k < 3; ++k) {
                lo[k] = int(std::floor((std::min({f.a[k], f.b[k], f.c[k]}) - band) / 8));
                hi[k] = int(std::floor((std::max({f.a[k], f.b[k], f.c[k]}) + band) / 8));
            }
            list(f, int(t), band, lo, hi, parts[part]);
        }
    });
    std::vector<Meeting> all;
    for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
    tbb::parallel_sort(all.begin(), all.end());
    return all;
}

/// A facet's plane and the planes through its edges ab, bc, ca, in a block: values at its first voxel, and slopes.
struct FacetPlanes {
    float at[4], x[4], y[4], z[4];
    FacetPlanes(const Facet& f, const Vec3& first) {
        const Vec3* normals[4] = {&f.normal, &f.in[0], &f.in[1], &f.in[2]};
        const Vec3* through[4] = {&f.a, &f.a, &f.b, &f.c};
        for (int k = 0; k < 4; ++k) {
            const Vec3& n = *normals[k];
            at[k] = float(dot(first - *through[k], n)), x[k] = float(n[0]), y[k] = float(n[1]), z[k] = float(n[2]);
        }
    }
};

/// Squared distances in a block, and on which side their voxels lie.
struct BlockDistances {
    Coord origin;
    float distance2[512];
    float above[512];  ///< negative inside
};

/// Calls f(facet, x, above, within, bound) for each slab of 64 voxels that a facet may come near to. above: the facet's
/// plane. within: the nearest edge's, positive over the facet's inside. bound: no more than the squared distance to the
/// facet, and equal to it over its inside. kInside: leaves out slabs with nothing over the facet's inside.
template <bool kInside, class F>
[[gnu::always_inline]] inline void forSlabsNear(const std::vector<Facet>& facets, const Meeting* first,
                                                const Meeting* last, const Coord& origin, float band, F f) {
    float above[64], within[64], bound[64];
    float flat[4][64];  // of each plane, in the block's first slab
    for (const Meeting* m = first; m != last; ++m) {
        const Facet& facet = facets[size_t(m->facet)];
        const FacetPlanes p(facet, centreOf(origin));
        // A little more than the prism: `within` is rounded.
        const double reach = double(band) * (kInside ? std::abs(facet.normal[0]) : 1) + 1e-3,
                     lo = std::min({facet.a[0], facet.b[0], facet.c[0]}) - reach,
                     hi = std::max({facet.a[0], facet.b[0], facet.c[0]}) + reach;
        const int from = std::max(0, int(std::ceil(lo)) - origin[0]), to = std::min(7, int(std::floor(hi)) - origin[0]);
        float least[4], most[4];
        for (int k = 0; k < 4; ++k) {
            const float start = p.at[k], y = p.y[k], z = p.z[k];
            for (int row = 0; row < 8; ++row) {
                PAVEL_ROLLED
                for (int n = 0; n < 8; ++n) flat[k][8 * row + n] = start + float(row) * y + float(n) * z;
            }
            least[k] = start + std::min(7 * y, 0.f) + std::min(7 * z, 0.f);
            most[k] = start + std::max(7 * y, 0.f) + std::max(7 * z, 0.f);
        }
        for (int x = from; x <= to; ++x) {
            const float up = float(x) * p.x[0], upAb = float(x) * p.x[1], upBc = float(x) * p.x[2],
                        upCa = float(x) * p.x[3];
            const float aside = kInside ? 0 : -band;
            if (least[0] + up > band || most[0] + up < -band || most[1] + upAb < aside || most[2] + upBc < aside ||
                most[3] + upCa < aside)
                continue;
            PAVEL_ROLLED
            for (int v = 0; v < 64; ++v) {
                const float over = flat[0][v] + up, inAb = flat[1][v] + upAb, inBc = flat[2][v] + upBc,
                            inCa = flat[3][v] + upCa, inAbBc = inAb < inBc ? inAb : inBc,
                            in = inCa < inAbBc ? inCa : inAbBc, out = in < 0 ? in : 0;
                above[v] = over;
                within[v] = in;
                bound[v] = over * over + out * out;
            }
            f(facet, x, above, within, bound);
        }
    }
}

/// Of the voxels over the insides of facets: nearly all.
PAVEL_WIDE void fromInsides(const std::vector<Facet>& facets, const Meeting* first, const Meeting* last, float band,
                            BlockDistances& block) {
    const auto take = [&](const Facet&, int x, const float* over, const float* within, const float* bound)
        __attribute__((always_inline)) {
        float *distance2 = block.distance2 + x * 64, *above = block.above + x * 64;
        PAVEL_ROLLED
        for (int v = 0; v < 64; ++v) {
            const bool nearer = (within[v] > 0) & (bound[v] < distance2[v]);
            distance2[v] = nearer ? bound[v] : distance2[v];
            above[v] = nearer ? over[v] : above[v];
        }
    };
    forSlabsNear<true>(facets, first, last, block.origin, band, take);
}

/// Of those that are nearer to an edge or a corner: costly, and rare once all insides have been asked.
PAVEL_WIDE void fromRims(const std::vector<Facet>& facets, const Meeting* first, const Meeting* last, float band,
                         BlockDistances& block) {
    const auto take = [&](const Facet& f, int x, const float*, const float* within, const float* bound)
        __attribute__((always_inline)) {
        float* distance2 = block.distance2 + x * 64;
        int asked[64], any = 0;
        PAVEL_ROLLED
        for (int v = 0; v < 64; ++v) {
            asked[v] = int((within[v] <= 0) & (bound[v] < distance2[v]));
            any |= asked[v];
        }
        for (int v = 0; any && v < 64; ++v) {
            if (!asked[v]) continue;
            const Vec3* normal = nullptr;
            const Vec3 d = fromNearest(f, centreOf(block.origin.offsetBy(x, v >> 3, v & 7)), normal);
            const float d2 = float(dot(d, d));
            if (d2 >= distance2[v]) continue;
            distance2[v] = d2;
            block.above[x * 64 + v] = dot(d, *normal) < 0 ? -1 : 1;
        }
    };
    forSlabsNear<false>(facets, first, last, block.origin, band, take);
}

/// Distances from their squares; negative below.
PAVEL_WIDE void signedDistances(const BlockDistances& block, float band, float* out) {
    constexpr float kOn = 1e-5f;  // rounding shall not tell the side of voxels that lie in a facet's plane
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float d = std::sqrt(block.distance2[v]), kept = d > 1e-6f ? d : 1e-6f;  // zero would be no side at all
        const float within = block.above[v] < -kOn ? -kept : kept;
        out[v] = block.distance2[v] < band * band ? within : band;
    }
}

/// One block's distances; null where none is within the band.
WorkLeaf* makeLeaf(const std::vector<Facet>& facets, const Meeting* first, const Meeting* last, float band) {
    const float most = band * band;
    BlockDistances block;
    block.origin = originOf(first->block);
    std::fill(block.distance2, block.distance2 + 512, most);
    std::fill(block.above, block.above + 512, 1);
    fromInsides(facets, first, last, band, block);
    fromRims(facets, first, last, band, block);
    const auto isFar = [&](float d2) { return d2 >= most; };
    if (std::all_of(block.distance2, block.distance2 + 512, isFar)) return nullptr;
    auto leaf = std::make_unique<WorkLeaf>(block.origin, band, false);
    signedDistances(block, band, leaf->buffer().data());
    for (openvdb::Index v = 0; v < 512; ++v)
        if (!isFar(block.distance2[v])) leaf->setValueOn(v);
    return leaf.release();
}

/// The most by which face neighbours differ, one of them in the block.
PAVEL_WIDE float steepest(const HaloBlock& f) {
    float most[8] = {};
    for (int row = 0; row < 64; ++row) {
        const float* at = &f[size_t(((row >> 3) + 1) * 100 + ((row & 7) + 1) * 10 + 1)];
        for (const int step : {-100, 100, -10, 10, -1, 1}) {
            PAVEL_ROLLED
            for (int z = 0; z < 8; ++z) {
                const float by = std::abs(at[z] - at[z + step]);
                most[z] = by > most[z] ? by : most[z];
            }
        }
    }
    return *std::max_element(most, most + 8);
}

/// A signed distance changes by no more than the way: where it does, its sides contradict each other.
bool isDistance(const openvdb::FloatTree& tree) {
    constexpr float kMost = 1.05f;
    constexpr size_t kChunk = 256;
    std::vector<const WorkLeaf*> leaves;
    tree.getNodes(leaves);
    std::atomic<bool> good{true};
    tbb::parallel_for(size_t(0), (leaves.size() + kChunk - 1) / kChunk, [&](size_t part) {
        const BaseReader reader(tree);
        HaloBlock halo;
        for (size_t i = part * kChunk; i < std::min(leaves.size(), (part + 1) * kChunk) && good; ++i) {
            loadHalo(reader, *leaves[i], halo);
            if (steepest(halo) > kMost) good = false;
        }
    });
    return good;
}

/// Of one connected solid.
openvdb::FloatTree::Ptr solidBand(const TriangleMesh& mesh, float halfWidth) {
    std::vector<Facet> facets;
    if (meshVolume(mesh) <= 0 || !makeFacets(mesh, facets)) return nullptr;
    const std::vector<Meeting> all = meetings(facets, double(halfWidth));
    std::vector<size_t> starts;
    for (size_t i = 0; i < all.size(); ++i)
        if (i == 0 || all[i].block != all[i - 1].block) starts.push_back(i);
    starts.push_back(all.size());
    std::vector<WorkLeaf*> leaves(starts.size() - 1);
    tbb::parallel_for(size_t(0), leaves.size(), [&](size_t b) {
        leaves[b] = makeLeaf(facets, all.data() + starts[b], all.data() + starts[b + 1], halfWidth);
    });
    auto tree = std::make_shared<openvdb::FloatTree>(halfWidth);
    for (auto* leaf : leaves)
        if (leaf) tree->addLeaf(leaf);
    openvdb::tools::signedFloodFill(*tree);
    return isDistance(*tree) ? tree : nullptr;
}

}  // namespace

openvdb::FloatTree::Ptr meshBand(const TriangleMesh& mesh, float halfWidth) {
    constexpr size_t kMostPieces = 32;
    const std::vector<MeshPart> pieces = connectedParts(mesh);
    if (pieces.size() > kMostPieces) return nullptr;
    openvdb::FloatTree::Ptr all;
    for (const MeshPart& piece : pieces) {
        const openvdb::FloatTree::Ptr band = solidBand(piece.mesh, halfWidth);
        if (!band) return nullptr;
        if (all)
            openvdb::tools::csgUnion(*all, *band);
        else
            all = band;
    }
    return all;
}

}  // namespace pavel
