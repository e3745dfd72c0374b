#include "pavel/vdb/mesh_band.h"

#include <openvdb/tools/Composite.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>

#include "pavel/core/mesh_check.h"
#include "pavel/vdb/measure.h"
#include "pavel/vdb/mesh_facets.h"

namespace pavel {
namespace {

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

/// Lists the blocks of a box, in blocks, that may hold voxels within the band that the facet is nearest to: halves the
/// box.
void list(const Facet& f, int number, double band, const Coord& lo, const Coord& hi, std::vector<Meeting>& out) {
    Vec3 centre, half;
    for (int k = 0; k < 3; ++k) centre[k] = 4 * (lo[k] + hi[k]) + 3.5, half[k] = 4 * (hi[k] - lo[k]) + 3.5;
    if (!f.mayMeet(centre, half, band)) return;
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
                const double reach = f.reach(k, band);
                lo[k] = int(std::floor((std::min({f.a[k], f.b[k], f.c[k]}) - reach) / 8));
                hi[k] = int(std::floor((std::max({f.a[k], f.b[k], f.c[k]}) + reach) / 8));
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

/// Rows of a block, at one x: from the first voxel of `from` to the last one of `to`.
struct Rows {
    int x, from, to;
};

/// Calls f(facet, rows, above, within, bound) for the rows in which a facet may be nearest, an x at a time; the arrays
/// hold all voxels of that x. above: the facet's plane. within: the nearest edge's, positive over the facet's inside.
/// bound: no more than the squared distance to the facet, and equal to it over its inside. kInside: leaves out what has
/// nothing over the facet's inside.
template <bool kInside, class F>
[[gnu::always_inline]] inline void forRowsNear(const std::vector<Facet>& facets, const Meeting* first,
                                               const Meeting* last, const Coord& origin, float band, F f) {
    constexpr double kRounding = 1e-3;  // `within` is rounded
    float above[64], within[64], bound[64];
    float flat[4][64];  // of each plane, at the block's first x
    for (const Meeting* m = first; m != last; ++m) {
        const Facet& facet = facets[size_t(m->facet)];
        const FacetPlanes p(facet, centreOf(origin));
        int from[2], to[2];
        for (int k = 0; k < 2; ++k) {
            const double reach =
                (kInside ? double(band) * std::abs(facet.normal[k]) : facet.reach(k, double(band))) + kRounding;
            const double lo = std::min({facet.a[k], facet.b[k], facet.c[k]}) - reach,
                         hi = std::max({facet.a[k], facet.b[k], facet.c[k]}) + reach;
            from[k] = std::max(0, int(std::ceil(lo)) - origin[k]), to[k] = std::min(7, int(std::floor(hi)) - origin[k]);
        }
        if (from[0] > to[0] || from[1] > to[1]) continue;
        float least[4], most[4];
        for (int k = 0; k < 4; ++k) {
            const float start = p.at[k], y = p.y[k], z = p.z[k];
            for (int row = from[1]; row <= to[1]; ++row) {
                PAVEL_ROLLED
                for (int n = 0; n < 8; ++n) flat[k][8 * row + n] = start + float(row) * y + float(n) * z;
            }
            const float yLo = float(from[1]) * y, yHi = float(to[1]) * y;
            least[k] = start + std::min(yLo, yHi) + std::min(7 * z, 0.f);
            most[k] = start + std::max(yLo, yHi) + std::max(7 * z, 0.f);
        }
        const float aside = kInside ? 0 : -float(facet.aside * double(band) + kRounding);
        for (int x = from[0]; x <= to[0]; ++x) {
            const float up = float(x) * p.x[0], upAb = float(x) * p.x[1], upBc = float(x) * p.x[2],
                        upCa = float(x) * p.x[3];
            if (least[0] + up > band || most[0] + up < -band || most[1] + upAb < aside || most[2] + upBc < aside ||
                most[3] + upCa < aside)
                continue;
            for (int row = 8 * from[1]; row <= 8 * to[1]; row += 8) {
                PAVEL_ROLLED
                for (int v = row; v < row + 8; ++v) {
                    const float over = flat[0][v] + up, inAb = flat[1][v] + upAb, inBc = flat[2][v] + upBc,
                                inCa = flat[3][v] + upCa, inAbBc = inAb < inBc ? inAb : inBc,
                                in = inCa < inAbBc ? inCa : inAbBc, out = in < 0 ? in : 0;
                    above[v] = over;
                    within[v] = in;
                    bound[v] = over * over + out * out;
                }
            }
            f(facet, Rows{x, from[1], to[1]}, above, within, bound);
        }
    }
}

/// Of the voxels over the insides of facets: nearly all.
PAVEL_WIDE void fromInsides(const std::vector<Facet>& facets, const Meeting* first, const Meeting* last, float band,
                            BlockDistances& block) {
    const auto take = [&](const Facet&, const Rows& rows, const float* over, const float* within, const float* bound)
        __attribute__((always_inline)) {
        float *distance2 = block.distance2 + rows.x * 64, *above = block.above + rows.x * 64;
        for (int row = 8 * rows.from; row <= 8 * rows.to; row += 8) {
            PAVEL_ROLLED
            for (int v = row; v < row + 8; ++v) {
                const bool nearer = (within[v] > 0) & (bound[v] < distance2[v]);
                distance2[v] = nearer ? bound[v] : distance2[v];
                above[v] = nearer ? over[v] : above[v];
            }
        }
    };
    forRowsNear<true>(facets, first, last, block.origin, band, take);
}

/// Of those that are nearer to an edge or a corner: costly, and rare once all insides have been asked.
PAVEL_WIDE void fromRims(const std::vector<Facet>& facets, const Meeting* first, const Meeting* last, float band,
                         BlockDistances& block) {
    const auto take = [&](const Facet& f, const Rows& rows, const float*, const float* within, const float* bound)
        __attribute__((always_inline)) {
        float* distance2 = block.distance2 + rows.x * 64;
        int asked[64], any[8] = {};
        for (int row = 8 * rows.from; row <= 8 * rows.to; row += 8) {
            PAVEL_ROLLED
            for (int n = 0; n < 8; ++n) {
                const int v = row + n;
                asked[v] = int((within[v] <= 0) & (bound[v] < distance2[v]));
                any[n] |= asked[v];
            }
        }
        int all = 0;
        for (int n = 0; n < 8; ++n) all |= any[n];
        if (!all) return;
        for (int v = 8 * rows.from; v < 8 * rows.to + 8; ++v) {
            if (!asked[v]) continue;
            const Vec3* normal = nullptr;
            const Vec3 d = fromNearest(f, centreOf(block.origin.offsetBy(rows.x, v >> 3, v & 7)), normal);
            const float d2 = float(dot(d, d));
            if (d2 >= distance2[v]) continue;
            distance2[v] = d2;
            block.above[rows.x * 64 + v] = dot(d, *normal) < 0 ? -1 : 1;
        }
    };
    forRowsNear<false>(facets, first, last, block.origin, band, take);
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
    if (meshVolume(mesh) <= 0) return nullptr;
    const std::vector<Facet> facets = makeFacets(mesh);
    if (facets.empty()) return nullptr;
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
